"""The order of messages on a bus where some may have any identifier, by trying who may be last.

From the last place up: of the messages that are left those with any identifier may take it while there is a number for
them, and the one with the greatest stated number while there are numbers for the rest below it. Who ends by its
deadline with all others before it may have it; else who has the first turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

NEVER = Fraction(10**18)
WORDS = {"EMCY": 1, "TPDO1": 3, "RPDO1": 4, "TPDO2": 5, "RPDO2": 6, "TSDO": 11, "RSDO": 12, "HEARTBEAT": 14}


def number_of(text: str) -> int:
    """An identifier that is stated: a number, or four bits of a function before seven of a node.

    >>> number_of("0x10"), number_of("TPDO2 of node 9") == 0x289
    (16, True)
    """
    word, _, node = text.partition(" of node ")
    return (WORDS[word] << 7) + int(node) if node else int(text, 0)


def order_of(
    stated: Mapping[str, int | None],
    latest: Mapping[str, Fraction | None],
    periods: Mapping[str, Fraction | None],
    on_flow: Mapping[str, bool],
    most: int,
    ends: Callable[[str, Sequence[str], Sequence[str], int], Fraction | None],
    rule: str = "audsley",
) -> list[str]:
    """The names of `stated`, which are in the order of the file, the most urgent first.

    `ends` plays a message with those before it and those behind it, and with so many ns of something else.
    """
    names = list(stated)
    left, behind = list(names), list[str]()
    upper = most

    def turn(name: str) -> tuple[bool, bool, Fraction, int]:
        if on_flow[name] and rule != "deadline_monotonic":
            return True, stated[name] is None, Fraction(0), -names.index(name)
        wanted = latest[name] if latest[name] is not None else periods[name]
        is_stated = stated[name] is not None and rule != "deadline_monotonic"
        return False, is_stated, -NEVER if wanted is None else -wanted, -names.index(name)

    while left:
        numbers = {name: number for name in left if (number := stated[name]) is not None}
        free = [name for name in left if name not in numbers]
        bottom = max(numbers, key=lambda name: numbers[name]) if numbers else None
        edge = -1 if bottom is None else numbers[bottom]
        may = [name for name in free if upper > edge]
        if bottom is not None and (not may or len(free) <= edge - (len(numbers) - 1)):
            may.append(bottom)
        may.sort(key=turn)

        def is_in_time(name: str, more: int = 0) -> bool:
            limit = latest[name]
            end = None if limit is None else ends(name, [other for other in left if other != name], behind, more)
            return limit is None or (end is not None and end <= limit)

        def tolerated(name: str) -> int:
            """The greatest number of ns of something else with which it is in time, by powers of two downwards."""
            limit = latest[name]
            if limit is None:
                return 2**70
            most = 0
            for power in reversed(range(int(limit).bit_length())):
                most += 2**power if is_in_time(name, most + 2**power) else 0
            return most

        fitting = [name for name in may if is_in_time(name)]
        if rule == "deadline_monotonic":
            last = may[0]
        elif rule == "robust" and fitting:
            last = max(fitting, key=tolerated)
        else:
            last = fitting[0] if fitting else may[0]
        left.remove(last)
        behind.insert(0, last)
        upper = edge - 1 if last == bottom else upper - 1
    return behind
