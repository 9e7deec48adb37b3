"""Parameter files of ROS 2 and the parameters that they give a node, and which of them are periods of timers.

Which entries of a file concern a node, and that the later one counts, is as rcl does it (rcl_yaml_param_parser): keys
are node names, with or without namespaces in mappings around them; ``/**`` stands for any names, ``/*`` for one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from dse.importers.allowance import spend
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue
from dse.support.units import PARAMETER_RATES as RATES
from dse.support.units import PARAMETER_TIMES_NS as UNITS

WHAT = "a parameter file of ROS 2"
INSIDE = "ros__parameters"
_STATED = re.compile(r"((?P<node>/[\w/*]*):)?(?P<name>[A-Za-z_*][\w.*-]*)(\s*\[\s*(?P<unit>\w+)\s*\])?")
KNOWN: Mapping[str, str] = {
    **dict.fromkeys(
        (
            *("rate", "frequency", "update_rate", "update_frequency", "publish_rate", "publish_frequency"),
            *("publishing_rate", "publishing_frequency", "controller_frequency", "control_rate", "control_frequency"),
            *("loop_rate", "loop_frequency", "cycle_frequency", "planning_hz", "update_hz", "publish_hz", "timer_hz"),
            *("smoothing_frequency", "timer_frequency", "timer_rate", "polling_rate", "control_hz", "loop_hz"),
        ),
        "Hz",
    ),
    **dict.fromkeys(("timer_period", "update_period", "publish_period", "control_period", "ctrl_period"), "s"),
    **dict.fromkeys(("timer_period_ms", "update_period_ms", "publish_period_ms", "control_period_ms"), "ms"),
    **dict.fromkeys(("timer_period_s", "update_period_s", "publish_period_s", "timer_period_sec"), "s"),
}
"""Names of parameters that are taken for those of a timer where the user states none, by the last part of the name."""
LOOKS = re.compile(r"(?i)(rate|freq(uency)?|hz|fps|period(_?(s|sec|ms|us|ns))?)\Z")
"""What else may be one: it is told."""
LONGEST_NS = 10**15


@dataclass(frozen=True)
class NodeParameter:
    """A parameter with its text, the file and the line where it stands."""

    name: str
    text: str
    file: str
    line: int


@dataclass(frozen=True)
class Timer:
    """A parameter that states how often a timer comes: as a period or a rate in `unit`.

    `stated` tells that the user's mapping names it; else the name was recognised.
    """

    parameter: NodeParameter
    unit: str
    period_ns: int
    stated: bool

    @property
    def words(self) -> str:
        """The parameter as `ros2.parameters` of a problem file has it.

        Such as ``rate [int Hz]``.
        """
        whole = "int " if re.fullmatch(r"[0-9]+", self.parameter.text) else ""
        return f"{self.parameter.name} [{whole}{self.unit}]"

    @property
    def field(self) -> str:
        """Whether it is the ``rate`` or the ``period`` of a thread."""
        return "rate" if self.unit in RATES else "period"


@dataclass(frozen=True)
class TimerParameter:
    """The user's own mapping: parameters, of some nodes where `node` says which, and their unit."""

    node: str
    name: str
    unit: str


def stated_timers(text: str | None) -> list[TimerParameter] | str:
    """The parameters that `--timers` names, or a text that says what is wrong with it.

    >>> stated_timers("fps, /cam:grab.period_ms [ms]")
    [TimerParameter(node='', name='fps', unit='Hz'), TimerParameter(node='/cam', name='grab.period_ms', unit='ms')]
    >>> stated_timers("a [km]")
    "'a [km]': expected the name of a parameter, with its node before it (/cam:fps) and its unit after it (fps [Hz])"
    """
    timers = []
    for part in (text or "").split(","):
        if not part.strip():
            continue
        match = _STATED.fullmatch(part.strip())
        if match is None or (match["unit"] or "s") not in {**UNITS, **RATES}:
            words = "expected the name of a parameter, with its node before it (/cam:fps) and its unit after it"
            return f"{part.strip()!r}: {words} (fps [Hz])"
        unit = match["unit"] or KNOWN.get(match["name"]) or _unit_of(match["name"])
        timers.append(TimerParameter(match["node"] or "", match["name"], unit))
    return timers


def _unit_of(name: str) -> str:
    """The unit that the name of a parameter suggests: Hz unless it is a period."""
    ends = re.search(r"(?i)period(_?(s|sec|ms|us|ns))?\Z", name)
    if ends is None:
        return "Hz"
    unit = (ends[2] or "s").lower()
    return "s" if unit == "sec" else unit


class ParameterFile:
    """A parameter file: the entries of each node name, in their order.

    Node names may have the wildcards ``*`` and ``**``, as rcl reads them.
    """

    def __init__(self, path: Path) -> None:
        """Read it.

        Raises
        ------
        ProblemError
            when it is none.
        """
        file = LocatedFile(path, WHAT)
        self.path = path
        self.entries = list(self._entries(file.root, ""))
        self._with_stars = [number for number, (name, _) in enumerate(self.entries) if "*" in name]
        self._by_name: dict[str, list[int]] = {}
        for number, (name, _) in enumerate(self.entries):
            self._by_name.setdefault(name, []).append(number)
        if not self.entries:
            file.wrong(file.root, f"expected the names of nodes and `{INSIDE}` below them, as {WHAT} has them")
        for name, place in self.entries:
            if not isinstance(place.data, dict | None):
                file.wrong(place, f"the parameters of {name} are no mapping")
        file.check()

    def _entries(self, place: LocatedValue, prefix: str) -> Iterator[tuple[str, LocatedValue]]:
        for key, value in (place.data if isinstance(place.data, dict) else {}).items():
            if key == INSIDE:
                yield prefix, value
            elif isinstance(value.data, dict):
                yield from self._entries(value, f"{prefix}/{key.strip('/')}")

    @property
    def nodes(self) -> list[str]:
        """The full names that it has, without those with wildcards."""
        return list(dict.fromkeys(name for name, _ in self.entries if "*" not in name))

    def of(self, node: str) -> list[NodeParameter]:
        """The parameters of a node by its full name; a later one of the same name counts.

        In the order of the file; wildcard entries count as well.
        """
        parameters: dict[str, NodeParameter] = {}
        spend(1 + len(self._with_stars))
        with_stars = [number for number in self._with_stars if is_named(node, self.entries[number][0])]
        named = [] if "*" in node else self._by_name.get(node, [])
        for number in sorted([*with_stars, *named]):
            for parameter in self._flat(self.entries[number][1], ""):
                spend()
                parameters[parameter.name] = parameter
        return list(parameters.values())

    def _flat(self, place: LocatedValue, prefix: str) -> Iterator[NodeParameter]:
        for key, value in (place.data or {}).items():
            name = f"{prefix}{key}"
            if isinstance(value.data, dict):
                yield from self._flat(value, f"{name}.")
            elif isinstance(value.data, str):
                yield NodeParameter(name, value.text, str(self.path), value.line)


def is_named(node: str, pattern: str) -> bool:
    """Whether an entry of a parameter file concerns a node.

    >>> [is_named("/front/cam", text) for text in ("/**", "/front/cam", "/*/cam", "/cam", "/**/cam")]
    [True, True, True, False, True]
    """
    if "*" not in pattern:
        return node == pattern
    parts = node.split("/")
    reached = {0}
    for wanted in pattern.split("/"):
        if wanted == "**":
            first = min(reached)
            filled = next((number for number in range(first, len(parts)) if not parts[number]), len(parts))
            reached |= set(range(first, filled + 1))
        else:
            reached = {number + 1 for number in reached if number < len(parts) and is_like(parts[number], wanted, 1)}
        if not reached:
            return False
    return len(parts) in reached


def is_like(text: str, pattern: str, least: int = 0) -> bool:
    """Whether a text is a pattern with stars, each of which stands for any characters, at least so many.

    >>> [is_like(text, "ca*m*", 1) for text in ("camm", "caxmx", "cam")]
    [False, True, False]
    """
    first, *rest = pattern.split("*")
    if not rest:
        return text == pattern
    if not text.startswith(first):
        return False
    position = len(first)
    for part in rest[:-1]:
        position = text.find(part, position + least)
        if position < 0:
            return False
        position += len(part)
    return text.endswith(rest[-1]) and len(text) - len(rest[-1]) >= position + least


def timers_of(
    node: str, parameters: Sequence[NodeParameter], stated: Sequence[TimerParameter]
) -> tuple[list[Timer], list[str]]:
    """The parameters of a node that are those of timers, and remarks on the others.

    Parameters are recognised by their last name (`KNOWN`), unless `stated` has the user's own mapping.
    """
    timers, remarks = [], []
    for parameter in parameters:
        last = parameter.name.rpartition(".")[2]
        stated_unit = next((item.unit for item in stated if _is_meant(item, node, parameter.name)), None)
        unit = stated_unit if stated else KNOWN.get(last)
        if unit is None:
            if LOOKS.search(last) and _period_ns(parameter.text, "Hz") is not None:
                remarks.append(parameter.name)
            continue
        period_ns = _period_ns(parameter.text, unit)
        if period_ns is not None:
            timers.append(Timer(parameter, unit, period_ns, bool(stated)))
        elif stated_unit is not None:
            remarks.append(f"{parameter.name} ({parameter.text[:40]!r} is no {'rate' if unit in RATES else 'period'})")
    return timers, remarks


def _is_meant(item: TimerParameter, node: str, name: str) -> bool:
    return (not item.node or is_named(node, item.node)) and (item.name == name or is_like(name, item.name))


def _period_ns(text: str, unit: str) -> int | None:
    """The period that a figure states; None where it is none above 0."""
    if not re.fullmatch(r"[0-9]{1,12}(\.[0-9]{0,12})?([eE][+-]?[0-9]{1,2})?", text):
        return None
    value = Fraction(text)
    if value <= 0:
        return None
    period = Fraction(10**9) / (value * RATES[unit]) if unit in RATES else value * UNITS[unit]
    return round(period) if 1 <= round(period) <= LONGEST_NS else None
