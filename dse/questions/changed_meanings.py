"""Which figures of a file count otherwise than under an earlier meaning of files: remarks of `dse.check`.

Each is a change that CHANGELOG.md names under "Changed meaning", told where a file is touched by it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from dse.analysis.latency.rows import counts_responses
from dse.questions.problem import Problem
from dse.space.architecture.carriers import counted
from dse.space.architecture.clocks import AT_RELEASE
from dse.space.model.space import Component, Space, at_home
from dse.space.model.trees import PerProcessorType, leaves
from dse.space.question.open_cores import OWNERS, decided_cores
from dse.spec.quantities.quantities import figures_of
from dse.support.units import TRANSMISSION, UNITS, canonical_unit

MOST_NAMED = 6
"""Maximum number of names in one remark."""


def changed_meanings(problem: Problem) -> Iterator[str]:
    """What in the file an earlier version counted otherwise, and how it counts now."""
    space = problem.space
    yield from _equal_priorities(space)
    yield from _fine_times(problem)
    yield from _totals(space)
    yield from _defaults(space)
    yield from _open_cores(problem)
    yield from _deadlines(space)
    yield from _late_reads(space)
    yield from _wait_sets(space)
    yield from _callback_groups(space)
    yield from _segments(space)
    yield from _homes(space)
    yield from _late_segments(space)


def _named(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def _equal_priorities(space: Space) -> Iterator[str]:
    """Threads that may share a processor, and may have the same stated priority."""
    holders: dict[tuple[int, int], list[str]] = {}
    best = {item.component for item in space.open_priorities}
    for number, item in enumerate(space.components):
        if number in best:
            continue
        ranks = {rank for rank in leaves(item.priority) if isinstance(rank, int)}
        for slot in {slot for slot in leaves(item.processor) if slot is not None}:
            for rank in ranks:
                holders.setdefault((slot, rank), []).append(item.name)
    shared = {name: None for names in holders.values() if len(names) > 1 for name in names}
    if shared:
        yield (
            "threads of equal stated priority count in each other's response time on one core, in both directions "
            f"(the shorter period went first before): {_named([*shared])}"
        )


def _fine_times(problem: Problem) -> Iterator[str]:
    """Times of messages, and stated latencies of flows, that are no whole ns."""
    spec = problem.loaded.spec
    found = [
        figure.path for figure in figures_of(spec) if figure.kind is TRANSMISSION and figure.nominal.denominator != 1
    ]
    for name, flow in spec.flows.items():
        if flow.latency is not None and any(Fraction(end).denominator != 1 for end in flow.latency):
            found.append(f"flows.{name}.latency")
    if found:
        yield f"times that are no whole ns count exactly (rounded outwards to whole ns before): {_named(found)}"


def _totals(space: Space) -> Iterator[str]:
    """Declared totals whose unit is a multiple of a unit of the table: limits on them were off by the factor."""
    for name, unit in space.totals.items():
        scale, _ = UNITS.get(canonical_unit(unit), (Fraction(1), None))
        if scale != 1 and any(item.metric.key == name for item in space.requirements):
            yield f"limits on {name} count in its own unit, {unit} (off by a factor of {max(scale, 1 / scale)} before)"


def _defaults(space: Space) -> Iterator[str]:
    """Decisions that some type leaves to a default, which is no option of theirs."""
    for reference in space.references.values():
        index = space.decision_index(reference.name)
        if index is None or not space.decisions[index].is_open:
            continue
        absent = [text for value, text in reference.texts.items() if value not in space.decisions[index].values]
        if absent:
            yield (
                f"{reference.name} is no decision where the chosen type does not state it: it counts as "
                f"{_named(absent)}, which was an option before"
            )


def _open_cores(problem: Problem) -> Iterator[str]:
    """Threads whose core is a decision although the file does not mention it."""
    space, spec = problem.space, problem.loaded.spec
    names = [item.decision.component for item in decided_cores(space)]
    stated = {name: item.core for section in OWNERS for name, item in getattr(spec, section).items()}
    silent = [name for name in names if not stated[name]]
    if silent and space.has_open_groups:
        yield f"the core of each thread is a decision, as executors of some threads are: {_named(silent)}"
    elif silent:
        yield (
            "the core of each thread is a decision, as something that is asked depends on it "
            f"(`core: first_fit` puts them as before): {_named(silent)}"
        )


def _deadlines(space: Space) -> Iterator[str]:
    """Threads whose deadline is a requirement because they state it."""
    names = [
        space.components[item.metric.index or 0].name for item in space.requirements if item.metric.key == "deadline"
    ]
    if names and space.deadlines == "stated":
        yield (
            "every design meets the deadlines that are stated (each design only told of them before; "
            f"`deadlines: none` asks for none): {_named(names)}"
        )


def _late_reads(space: Space) -> Iterator[str]:
    """Timers on clocks whose jobs may begin late, and read then: minima were those of reading at the release."""
    timed = [item for item in space.components if item.offset_ns is not None and item.processor is not None]
    names = [
        item.name
        for item in timed
        if set(leaves(item.communication)) - AT_RELEASE and (counts_responses(space) or item.response_ns is not None)
    ]
    if names and space.profile == "dse":
        yield (
            "jobs of timers that share a clock may read when they begin, which lowers minimum latencies "
            f"(at their release before: `communication: at_dispatch`): {_named(names)}"
        )


def _wait_sets(space: Space) -> Iterator[str]:
    """Executors whose bounds became tighter."""
    names = [item.name for item in space.executors if "wait_set" in leaves(item.kind)]
    if names:
        yield f"response times in a wait set have a tighter bound than before: {_named(names)}"


def _callback_groups(space: Space) -> Iterator[str]:
    """Executors whose threads may wait for one that comes without a bound: other threads release it."""
    names = [
        item.name
        for item in space.executors
        if "callback_group" in leaves(item.kind)
        and len(item.members) > 1
        and any(_comes_late(space, space.components[number]) for number in item.members)
    ]
    if names:
        yield (
            "a callback without a bound delays the more urgent ones of its group by one job "
            f"(none of them had a bound before): {_named(names)}"
        )


def _segments(space: Space) -> Iterator[str]:
    """Threads with segments beside work that may wait for one of these, and go before the next."""
    names: dict[str, None] = {}
    for item in space.components:
        if item.pieces is not None and any(
            _may_wait_for(space, other, item) for other in space.components if other.stated_as != item.stated_as
        ):
            names[item.stated_as] = None
    if names:
        yield (
            "what waited for a segment of a thread goes before its next segment "
            f"(it was not counted before): {_named([*names])}"
        )


def _homes(space: Space) -> Iterator[str]:
    """Threads whose first or last segment runs elsewhere than they do, with messages whose way follows from where."""
    names: dict[str, None] = {}
    for wire in space.connections:
        ends = [end for end in (wire.source, wire.target) if end is not None]
        if len({space.components[end].stated_as for end in ends}) < len(ends):
            continue  # from piece to piece
        away = [end for end in ends if _is_away(space, end)]
        homes = [set(leaves(at_home(space.components, end).process)) - {None} for end in ends]
        is_local = len(homes) > 1 and bool(homes[0] & homes[1])
        figures = [tree for bus in counted(space.buses, wire) for tree in (bus.fixed_ns, bus.latency_ns)]
        if is_local or any(isinstance(leaf, PerProcessorType) for tree in figures for leaf in leaves(tree)):
            names |= {space.components[end].stated_as: None for end in away}
    if names:
        yield (
            "messages of a thread count where the thread runs, on its own processor and in its process "
            f"(before, where its first or last segment runs): {_named([*names])}"
        )


def _late_segments(space: Space) -> Iterator[str]:
    """Threads with segments that no limit keeps in time, whose first one may go before something else."""
    limited = {
        item.metric.index
        for item in space.requirements
        if item.metric.kind == "response time" and item.operator in ("<=", "<")
    }
    names: dict[str, None] = {}
    for number, item in enumerate(space.components):
        if item.pieces is None or number != item.pieces.members[0] or item.pieces.members[-1] in limited:
            continue
        if any(_may_meet(other, item) for other in space.components if other.stated_as != item.stated_as):
            names[item.stated_as] = None
    if names:
        yield (
            "what the first segment of a thread without a bound goes before has none either "
            f"(that segment counted as if it came in time before): {_named([*names])}"
        )


def _may_meet(one: Component, other: Component) -> bool:
    """Whether two threads, or pieces of threads, may run on one processor."""
    return bool({*leaves(one.processor)} & {*leaves(other.processor)} - {None})


def _is_away(space: Space, end: int) -> bool:
    """Whether the piece that sends or receives for a thread runs elsewhere than the thread does."""
    piece, home = space.components[end], at_home(space.components, end)
    return (piece.processor, piece.process) != (home.processor, home.process)


def _may_wait_for(space: Space, other: Component, piece: Component) -> bool:
    """Whether a piece may keep something waiting that goes before a later piece of its thread, where they meet."""
    served = {index for index in leaves(piece.executor) if index is not None} & set(leaves(other.executor))
    if served:
        kinds = {kind for index in served for kind in leaves(space.executors[index].kind)}
        return "callback_group" in kinds or other.pieces is None
    ranks = {rank for rank in leaves(piece.priority) if isinstance(rank, int)} & set(leaves(other.priority))
    return bool(ranks) and _may_meet(piece, other)


def _comes_late(space: Space, item: Component) -> bool:
    """Whether response times of other threads may delay what releases a thread."""
    protocols = set(leaves(item.protocol))
    by_inputs = protocols - {"periodic", None} or (None in protocols and None in leaves(item.period_ns))
    senders = [space.connections[wire].sender for wire in item.triggers]
    return bool(by_inputs) and any(space.components[one].processor is not None for one in senders if one is not None)
