"""The first lines of an answer: what was asked, what changes the decision, what was found, and what is counted."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property

from dse.analysis.terms import PPM
from dse.answers.analysis import Analysis
from dse.answers.contention_verdicts import Broken, Contended
from dse.answers.ranking.kinds import Kinds
from dse.answers.ranking.optimality_gap import is_proved
from dse.answers.result import Result
from dse.answers.tables.display import readable
from dse.report.page import Tone
from dse.report.words.basis import counting_words
from dse.report.words.contention import core_words, own_core_words, uncounted_words
from dse.space.model.criteria import Requirement
from dse.space.model.metric_kinds import KINDS
from dse.space.model.space import Space
from dse.space.question.open_cores import cores_beside
from dse.space.question.settings import ORIGIN
from dse.support.units import format_duration, is_unbounded
from dse.support.units.text import count_words, format_count

LINE = 80
"""Letters of the first line."""
DEADLINE = "<= its deadline"
"""The end of the text of a requirement that is a deadline."""
SHORT_NAME = 32
"""Letters of a name that is cut so that a limit has room."""


def title_words(result: Result) -> str:
    """The problem's name and the limits that were asked for, in a line of a terminal.

    At most `LINE` characters. A name that leaves no room for a limit is cut in its middle.
    """
    name = result.problem.name
    limits = limits_words(result, LINE - len(name) - 2)
    if limits[:1].isdecimal() and len(name) > SHORT_NAME:  # none is named, only their number
        shown = limits_words(result, LINE - SHORT_NAME - 2)
        if not shown[:1].isdecimal():
            half = SHORT_NAME // 2
            name, limits = f"{name[: half - 2].rstrip()} ... {name[half - SHORT_NAME + 3 :].lstrip()}", shown
    return f"{name}: {limits}" if limits else name


def limits_words(result: Result, room: int) -> str:
    """The limits that were asked for, as far as there is room: the caller's, else those of the file; else how many.

    At most `room` characters; empty where nothing is limited.
    """
    stated = [item for item in result.space.requirements if not item.implied]
    asked = [item for item in stated if item.origin == ORIGIN] or stated
    of_all = _limits_of_every_flow(result.space, asked)
    said = (of_all.get(item.text) or _limit_words(item) for item in asked if not item.text.endswith(DEADLINE))
    limits = list(dict.fromkeys(said))
    limits += ["every deadline met"] if any(item.text.endswith(DEADLINE) for item in asked) else []
    if result.space.overload == "allowed":
        limits.insert(0, "overload allowed")
    for count in range(len(limits), -1, -1):
        more = len(limits) - count
        noun = f"{'more ' if count else ''}limit{'s' if more > 1 else ''}"
        rest = [f"{more} {noun}"] if more else []
        words = ", ".join([*limits[:count], *rest])
        if len(words) <= room:
            break
    return words if limits else ""


def _limits_of_every_flow(space: Space, asked: Sequence[Requirement]) -> dict[str, str]:
    """The phrase for requirements that limit each of several flows alike, by their texts: results state them singly."""
    groups: dict[tuple[str, str], dict[int, str]] = {}
    for item in asked:
        kind = KINDS.get(item.metric.kind)
        if item.metric.index is not None and kind is not None and kind.of == "flow":
            rest = item.text.removeprefix(f"{item.metric.kind} of {space.flows[item.metric.index].name}")
            groups.setdefault((item.metric.kind, rest), {})[item.metric.index] = item.text
    whole = {key: texts for key, texts in groups.items() if 1 < len(texts) == len(space.flows)}
    return {text: f"{kind} of every flow{rest}" for (kind, rest), texts in whole.items() for text in texts.values()}


def _limit_words(item: Requirement) -> str:
    """A requirement; one that is stated for all flows, processors or buses with a word that says so.

    >>> _limit_words(Requirement("jitter of f <= 5 ms", None, "<=", None, stated="jitter <= 5 ms"))
    'jitter of every flow <= 5 ms'
    """
    for word in sorted(KINDS, key=len, reverse=True):
        if item.stated.startswith(f"{word} ") and KINDS[word].of:
            return item.stated.replace(word, f"{word} of every {KINDS[word].of}", 1)
    return item.stated or item.text


def found_words(result: Result, kinds: Kinds) -> tuple[str, str, Tone]:
    """The status as a word, what it means, and the tone in which it is said.

    For example ``("Front", "complete, proved: 15 designs", "good")``.
    """
    count = count_words(len(result.front), "design")
    if 1 < len(kinds.kinds) < len(result.front):
        count += f" of {len(kinds.kinds)} kinds"
    if result.status == "infeasible":
        return "INFEASIBLE", "proved: no design meets every requirement and rule.", "wrong"
    if result.status == "complete":
        grid = result.space.offset_grid_ns
        on_the_grid = f", offsets on a grid of {format_duration(grid)}" if grid else ""
        return "Front", f"complete, proved: {count}{on_the_grid}", "good"
    if not result.front:
        return "INCOMPLETE", f"stopped {_stopped(result)} before a design was found.", "doubtful"
    if any(not is_proved(result, point) for point in result.front):
        stopped = "stopped by Ctrl-C: " if result.interrupted else ""
        said = f"{stopped}the first design found: it meets every limit; better ones may be missing."
        return "INCOMPLETE", said, "doubtful"
    regions = count_words(len(result.unexplored), "region")
    return "INCOMPLETE", f"stopped {_stopped(result)}: {count}; {regions} of the objective space open.", "doubtful"


def _stopped(result: Result) -> str:
    return "by Ctrl-C" if result.interrupted else "by the time limit"


def counted_words(result: Result) -> tuple[str, str]:
    """The sentence on what latencies count, and a remark on the profile; both "" where no latency is asked for.

    Two sentences, the second one about profiles that count no response times.
    """
    said = counting_words(result.space, result.problem.effective)
    return said, uncounted_words(result.space) if said else ""


class WaitingNotes:
    """The verdicts on the designs of a front with waiting for the CPU, where the search left waiting out.

    Verdicts of designs come from the result; nothing is analysed again. `known` are those that are no "unknown".
    """

    def __init__(self, result: Result) -> None:
        self.result = result
        left = result.leaves_out_contention and any(not item.implied for item in result.space.requirements)
        verdicts = {point.id: result.contended.get(str(point.id)) for point in (result.front if left else ())}
        self.known: dict[int, Contended] = {
            number: item for number, item in verdicts.items() if item is not None and item.status != "unknown"
        }
        self.kept = [number for number, item in self.known.items() if item.status == "kept"]
        self.is_asked = left
        self.chooses = bool(cores_beside(result.space))

    def broken(self, number: int) -> tuple[Broken, ...]:
        """The requirements that a design misses with waiting, on its own cores, where no other cores hold.

        By the id of the design; empty where it holds, or nothing is known.
        """
        item = self.known.get(number)
        return item.broken if item is not None and item.status == "broken" else ()

    @cached_property
    def warning(self) -> str:
        """The warning that designs violate limits with waiting: all that are known, or the first; else "".

        How many hold, the best of them, the limit, and the least excess.
        """
        first = self.result.front[0].id if self.result.front else 0
        if not self.known or (self.kept and not self.broken(first)):
            return ""
        own = f"{own_core_words(self.result.space)}: " if self.chooses else ""
        cores = "" if self.chooses else f" Threads {core_words(self.result.space)}."
        if self.kept:
            broken = self.broken(first)
            more = f" and {count_words(len(broken) - 1, 'more limit')}" if len(broken) > 1 else ""
            said = f"#{first} violates {self._violated(broken[0])}{more}"
            if self.chooses:
                said = f"#{first} meets every limit on no cores ({own}{self._violated(broken[0])}{more})"
            return f"With waiting for the CPU, {said}; {self._count()}.{cores}"
        count, every = len(self.known), len(self.result.front)
        rest = "" if count == every else f"; {count_words(every - count, 'design')} unknown: the time was too short"
        if self.chooses:
            who = f"none of {format_count(count)} designs meets" if count > 1 else "the design does not meet"
            return f"With waiting for the CPU, {who} every limit on any cores ({own}{self._common()}){rest}."
        who = f"all {format_count(count)} designs violate" if count > 1 else "the only design violates"
        return f"With waiting for the CPU, {who} {self._common()}{rest}.{cores}"

    def _count(self) -> str:
        """``12 of 15 meet every limit, the best is #1``."""
        kept, every, known = len(self.kept), len(self.result.front), len(self.known)
        rest = f"; {every - known} unknown: the time was too short" if known < every else ""
        return f"{kept} of {every} meet{'s' if kept == 1 else ''} every limit, the best is #{self.kept[0]}{rest}"

    def _violated(self, item: Broken) -> str:
        """``jitter of f <= 20 ms (29.294 ms)``."""
        value = "unbounded" if item.value is None else readable(item.value, item.unit, self.result.space.currency)
        return f"{item.requirement} ({value})"

    def _common(self) -> str:
        """The limit that most of the designs violate, and its least value; else that it is one or another."""
        violations: dict[str, list[tuple[Fraction | None, int, Broken]]] = {}
        for number, item in self.known.items():
            for broken in item.broken:
                violations.setdefault(broken.requirement, []).append((broken.value, number, broken))
        text, rows = max(violations.items(), key=lambda pair: len(pair[1]))
        if len(rows) < len(self.known):
            return "one or more limits"
        bounded = [(value, number, broken) for value, number, broken in rows if value is not None]
        if not bounded:
            return f"{text}: unbounded"
        is_upper = bounded[0][0] >= bounded[0][2].limit  # it is violated
        value, number, broken = (min if is_upper else max)(bounded, key=lambda row: row[0])
        word = "" if len(self.known) == 1 else "least " if is_upper else "greatest "
        who = "" if len(self.known) == 1 else f" (#{number})"
        return f"{text}; {word}{readable(value, broken.unit, self.result.space.currency)}{who}"

    def note(self) -> str:
        """The sentence on designs that meet every limit with waiting, where no warning is shown.

        One sentence; empty where waiting is counted or a warning is shown.
        """
        if not self.result.leaves_out_contention or not self.result.front or self.warning:
            return ""
        if not self.is_asked:
            return "Nothing is required that waiting for the CPU could violate."
        if not self.known:
            return "With waiting for the CPU it is unknown which designs meet every limit: the time was too short."
        every = len(self.result.front)
        if len(self.kept) == every:
            who = "the design meets" if every == 1 else f"{'both' if every == 2 else f'all {every}'} meet"
            return f"With waiting for the CPU {who} every limit."
        cores = ", cores chosen for each," if self.chooses else ""
        return f"With waiting for the CPU{cores} {self._count()}."


def overload_words(analysis: Analysis) -> list[str]:
    """The warnings on processors, cores and buses that a design overloads.

    One sentence for each overloaded resource, with its load in %.
    """
    said = []
    for usage in analysis.processors:
        if not usage.capacity:
            continue
        loads = usage.core_loads
        fullest = max(loads, key=lambda core: loads[core], default=None)
        if usage.total > usage.capacity:
            said.append(f"{usage.name} is overloaded: {_share(usage.total)} of {_share(usage.capacity)}.")
        elif fullest is not None and loads[fullest] > PPM:
            said.append(f"core {fullest} of {usage.name} is overloaded: {_share(loads[fullest])} of 100 %.")
    for bus in analysis.buses:
        if bus.capacity and bus.total > bus.capacity:
            said.append(f"{bus.name} is overloaded: {_share(bus.total / bus.capacity * PPM)} of 100 %.")
        elif bus.busy_total is not None and bus.busy_total > PPM:
            said.append(f"{bus.name} is busy for {_share(bus.busy_total)} of 100 %.")
    return said


def unbounded_words(result: Result) -> list[str]:
    """The warning on objectives of the first design that have no bound.

    One sentence for each objective; empty where all are finite.
    """
    first = result.front[0].objectives
    names = [info.name for info in result.objectives if is_unbounded(first[info.name])]
    return [f"{name[:1].upper()}{name[1:]} is unbounded." for name in names]


def _share(value: Fraction) -> str:
    return readable(value, "ppm")
