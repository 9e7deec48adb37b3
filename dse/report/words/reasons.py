"""Reasons as sentences: plain text, for the terminal, for Markdown and for HTML alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from dse.analysis.diagnosis.remarks import Outside, outside_sizes, outside_words
from dse.analysis.views import View
from dse.answers.designs import FurtherDesign, FurtherDesigns, Point
from dse.answers.ranking.changes import Change
from dse.answers.ranking.optimality_gap import is_proved
from dse.answers.ranking.reasons import Dominant, Improvement, PointDeltas, Reasoner, Reasons, Spared
from dse.answers.ranking.variants import NEAR
from dse.answers.result import Result
from dse.answers.tables.display import counted, readable
from dse.report.amounts import deltas_words, difference_words, listed, margin_words, rate_words
from dse.report.words.clocks import boundary_words
from dse.report.words.contention import contended_words, cores_origin, own_core_words, placed_words
from dse.report.words.messages import identifier_words
from dse.space.architecture.activation import exclusions
from dse.space.model.space import Space
from dse.space.question.open_cores import cores_beside
from dse.support.units import format_duration, is_unbounded
from dse.support.units.text import count_words, format_count

REDUCED = (
    "Latencies are reduced reaction times: a flow starts at its first component, without that component's own period."
)
CHAINED = (
    "The row of a thread that another one releases is how much longer the flow takes with it. It may be less than the "
    "response time: a job that delays several threads in a row on a core counts once, and a job that is released early "
    "by its jitter has more time."
)
PPM = 10**6
MOST_VARIANTS = 6
"""Maximum number of near-identical designs that are told one by one."""
SAME = "With the same objectives"
"""The label of what another offset saves for nothing."""
FEW_CHANGES = 2
"""The greatest number of changes that are named, and of those that follow from them, where there is little room."""
NEARNESS = f"no objective more than {readable(NEAR * PPM, 'ppm')} of its range away"
GAPS = (
    "The sum of periods over-estimates when sender and receiver are harmonic and synchronised without stated offsets.",
    "A measured maximum is a sample maximum, not a bound.",
)


@dataclass(frozen=True)
class Sentence:
    """A statement about an alternative, under a short label.

    `brief` is `text` with fewer changes; empty where that would not be shorter.
    """

    label: str
    text: str
    brief: str = ""
    """The statement with the first few changes only, where that is shorter."""


def sentences(result: Result, reasons: Reasons) -> list[Sentence]:
    """The sentences about an alternative, most important first.

    Labelled sentences: best objectives, baseline, neighbours, variants, limits, largest contributions, improvements.
    """
    currency = result.space.currency
    lines = [Sentence("Among all designs", _best_words(result, reasons))]
    said = _baseline_comparison_words(reasons, currency)
    if said:
        brief = _baseline_comparison_words(reasons, currency, FEW_CHANGES)
        lines.append(Sentence("Against the baseline", said, brief))
    above, near = reasons.above, reasons.neighbour
    if above is not None:
        same = near is not None and near.with_ == above.with_
        label = f"Against #{above.with_}, ranked above" + (" and its neighbour on the front" if same else "")
        lines.append(_compared(label, above, currency))
    if reasons.variants:
        lines.append(Sentence("Near-identical", _variants_words(reasons.variants, currency)))
    if near is not None and (above is None or near.with_ != above.with_):
        lines.append(_compared(f"Against #{near.with_}, its neighbour on the front", near, currency))
    if reasons.margins:
        tightest = [margin for margin in reasons.margins if not margin.slack] or reasons.margins[:1]
        said = " ".join(margin_words(margin, currency) for margin in tightest)
        lines.append(Sentence(f"Tightest requirement{'s' if len(tightest) > 1 else ''}", said))
    for dominant in reasons.dominants:
        lines.append(Sentence(f"Largest part of the {dominant.of} of {dominant.flow}", _dominant_words(dominant)))
    lines += [Sentence(SAME, _spared_words(item)) for item in reasons.spared]
    lines += [Sentence("On one clock", said) for said in boundary_words(reasons.analysis.boundaries)]
    if placed := placed_words(result.space, reasons.point.design):
        lines.append(Sentence(f"Cores{cores_origin(result.space)}", ". ".join(placed) + "."))
    if numbered := identifier_words(result.space, reasons.point.design):
        lines.append(Sentence("Chosen identifiers", f"{', '.join(numbered)}."))
    if result.leaves_out_contention:
        own = own_core_words(result.space) if cores_beside(result.space) else ""
        said = contended_words(result.contended.get(str(reasons.point.id)), currency, own=own)
        lines.append(Sentence("With response times", said))
    for improvement in reasons.improvements:
        lines.append(Sentence(f"To better {improvement.objective}", _improvement_words(improvement, result)))
    return lines


def _spared_words(spared: Spared) -> str:
    """The time that another offset saves, where it worsens no objective and no limit."""
    before, after = (format_duration(offset) if offset else "0 ms" for offset in spared.offsets_ns)
    saved = [f"{format_duration(time)} of latency of {flow}" for flow, time in spared.saves_ns.items()]
    return f"{spared.reader}.offset {after} instead of {before} saves {listed(saved)}."


def _best_words(result: Result, reasons: Reasons) -> str:
    """In which objectives the point has the best value of the front."""
    point = reasons.point
    best = []
    for info in result.objectives:
        values = [other.objectives[info.name] for other in result.front]
        if point.objectives[info.name] == (min(values) if info.sense == "minimise" else max(values)):
            sharing = values.count(point.objectives[info.name]) - 1
            word = "least" if info.sense == "minimise" else "most"
            best.append(
                f"{word} {info.name}"
                + (f" (shared with {sharing} other{'s' if sharing > 1 else ''})" if sharing else "")
            )
    front = "of the front" if result.status == "complete" else "found so far"
    if best:
        return f"{_capital(listed(best))} {front}."
    return "Balanced: best in no single objective."


def figures_words(result: Result, values: Mapping[str, int]) -> str:
    """The objectives of a design: ``jitter of main 11 ms, price 300 EUR``.

    In the order of the question, each in the unit that engineers read.
    """
    return ", ".join(
        f"{info.name} {counted(values[info.name], info.unit, result.space.currency)}" for info in result.objectives
    )


def baseline_words(reasoner: Reasoner) -> str:
    """Today's design: its figures, and the requirements that it breaks; or why there is none to compare with.

    One sentence. The baseline is judged by every requirement of the question.
    """
    result, baseline = reasoner.result, reasoner.baseline
    if baseline is None and result.baseline is None:
        return "The problem states no complete baseline to compare with."
    if baseline is None:
        return "The baseline is not a valid design of this problem: there is nothing to compare with."
    analysis, objectives = baseline
    broken = [verdict.requirement.shown for verdict in analysis.verdicts if not verdict.holds]
    said = f"violates {'; '.join(broken)}" if broken else "meets every requirement"
    return f"Baseline: {figures_words(result, objectives)}; it {said}."


def _compared(label: str, comparison: PointDeltas, currency: str) -> Sentence:
    return Sentence(
        label, _comparison_words(comparison, currency), _comparison_words(comparison, currency, FEW_CHANGES)
    )


def _comparison_words(comparison: PointDeltas, currency: str, most: int | None = None) -> str:
    """The changes (at most `most` of them), the gains and the losses."""
    return f"{changes_words(comparison.changes, most)}. {deltas_words(comparison.deltas, currency)}."


def _baseline_comparison_words(reasons: Reasons, currency: str, most: int | None = None) -> str:
    """The changes against the baseline, counted where the question counts them, with gains and losses."""
    if reasons.changed is None:
        return _comparison_words(reasons.baseline, currency, most) if reasons.baseline is not None else ""
    counted = {change.name for change in reasons.changed}
    others = [change for change in reasons.baseline.changes if change.name not in counted] if reasons.baseline else []
    said = [counted_words(reasons.changed, most) + _tail(others, most)]
    if reasons.baseline is not None:
        said.append(deltas_words(reasons.baseline.deltas, currency))
    return " ".join(f"{text}." for text in said)


def counted_words(changes: Sequence[Change], most: int | None = None) -> str:
    """``2 changes: nav.period from 10 ms to 20 ms; …``; with their costs where these are not 1 each.

    `most` is the number of changes to name, None for all.
    """
    if not changes:
        return "No change is counted"
    number = "1 change" if len(changes) == 1 else f"{len(changes)} changes"
    if all(change.cost == 1 for change in changes):
        return f"{number}: {'; '.join(_first(list(map(_change, changes)), most))}"
    costs = sum(change.cost or 0 for change in changes)
    listed = "; ".join(_first([f"{_change(change)} ({change.cost})" for change in changes], most))
    return f"{number} at a cost of {costs}: {listed}"


def _first(items: list[str], most: int | None) -> list[str]:
    """The first items, and how many more there are; one more is said rather than counted.

    >>> _first(["a", "b", "c"], 2), _first(["a", "b", "c", "d"], 2)
    (['a', 'b', 'c'], ['a', 'b', 'and 2 more changes'])
    """
    more = len(items) - most if most is not None else 0
    return [*items[:most], f"and {more} more changes"] if more > 1 else items


def _tail(changes: Sequence[Change], most: int | None = None) -> str:
    """The further changes."""
    return f" (with it: {', '.join(_first(list(map(_following, changes)), most))})" if changes else ""


def changes_words(changes: Sequence[Change], most: int | None = None) -> str:
    """``Changes computer from RT101 to Spectra; nav.period, now 20 ms (with it: ser1 is left empty)``.

    Decisions that follow from others are in brackets; `most` is the number of changes to name, None for all.
    """
    if not changes:
        return "Nothing changes"
    chosen = [_change(change) for change in changes if not change.follows]
    follow = [change for change in changes if change.follows]
    if not chosen:
        return f"Changes: {', '.join(_first(list(map(_following, follow)), most))}"
    return f"Changes {'; '.join(_first(chosen, most))}{_tail(follow, most)}"


def _variants_words(variants: Sequence[PointDeltas], currency: str) -> str:
    """``#2 with can0 can_500k (jitter of main 0.144 ms less, price 5 EUR more); #3 with …``; of many the first ones."""
    said = []
    for item in variants[:MOST_VARIANTS]:
        chosen = [change for change in item.changes if not change.follows] or item.changes
        changed = ", ".join(f"{short_name(change.name)} {change.after or 'unused'}" for change in chosen)
        moved = [f"{delta.name} {difference_words(delta, currency)}" for delta in item.deltas if delta.gain]
        said.append(f"#{item.with_} with {changed} ({', '.join(moved)})")
    more = len(variants) - MOST_VARIANTS
    return "; ".join(said) + (f"; and {more} more." if more > 0 else ".")


def hidden_words(result: Result, shown: Sequence[Point]) -> list[str]:
    """The sentence on points that a list of the front leaves out, with the reason.

    Sentences: variants by the point that they resemble, then the number of lower-ranked points.
    """
    there = {point.id for point in shown}
    groups: dict[int, list[int]] = {}
    for variant, leader in result.variants.items():
        if variant not in there and leader in there:
            groups.setdefault(leader, []).append(variant)
    said = []
    if groups:
        listed = "; ".join(
            f"{', '.join(f'#{number}' for number in numbers)} (like #{leader})" for leader, numbers in groups.items()
        )
        said.append(f"Near-identical to one above (one decision at a time, {NEARNESS}): {listed}.")
    count = len(result.front) - len(there) - sum(map(len, groups.values()))
    if count:
        said.append(f"Not shown here: {count} more of {len(result.front)}, ranked lower (--top all shows them).")
    elif groups:
        said.append("--top all shows them, too.")
    return said


def short_name(name: str) -> str:
    """A decision's name; the type of a slot goes by the slot's name.

    ``computer.type`` becomes ``computer``, every other name stays.
    """
    return name.removesuffix(".type")


def _change(change: Change) -> str:
    name = short_name(change.name)
    if change.before is None:
        return f"{name}, now {change.after}"
    return f"{name} from {change.before} to {change.after}"


def _following(change: Change) -> str:
    name = short_name(change.name)
    if change.after is None:
        return f"no {name}"
    if change.before is None:
        return _change(change)
    return f"{name} is left empty" if change.after == "none" else f"{name} is used"


EMPTY_SLOT = "holds: the slot is empty"
"""The verdict on a requirement that limits a processor or bus which the design leaves empty."""
OTHER_TYPE = "does not apply"
"""The verdict on an implied limit of a bus whose chosen type has none."""


def _dominant_words(dominant: Dominant) -> str:
    """``ekf_fusion.main_loop, sampling: 20 ms of 42.042 ms (47.6 %)``; several when they tie."""
    rows = listed([f"{row.contributor} ({row.max_method})" for row in dominant.rows])
    if is_unbounded(dominant.total_ns):
        return f"{rows}, which {'has' if len(dominant.rows) == 1 else 'have'} no bound."
    share = readable(Fraction(dominant.part_ns, dominant.total_ns) * 10**6, "ppm", digits=1)
    each = " each" if len(dominant.rows) > 1 else ""
    return f"{rows}, {counted(dominant.part_ns, 'ns')}{each} of {counted(dominant.total_ns, 'ns')} ({share})."


def _improvement_words(item: Improvement, result: Result) -> str:
    """Which point is next better in an objective, what it costs, and what has to change."""
    if item.point is None:
        best = result.status == "complete"
        return (
            "No feasible design is better: proved." if best else "Nothing better was found before the search stopped."
        )
    currency = result.space.currency
    gained = next(delta for delta in item.deltas if delta.name == item.objective)
    losses = [delta for delta in item.deltas if delta.gain < 0]
    costs = [f"{delta.name} {difference_words(delta, currency)}" for delta in losses]
    text = f"#{item.point} has {difference_words(gained, currency)}, for {listed(costs)}"
    if len(losses) == 1 and not any(map(is_unbounded, (losses[0].gain, gained.gain))):
        text += f" ({rate_words(losses[0], gained, currency)})"
    also = [
        f"{delta.name} {difference_words(delta, currency)}"
        for delta in item.deltas
        if delta.gain > 0 and delta != gained
    ]
    text += f", and with {listed(also)}" if also else ""
    return f"{text}. {changes_words(item.changes)}."


def others_words(others: FurtherDesigns) -> str:
    """The number of designs with a point's objectives or similar ones, and whether there are more.

    Says whether it is proved that there are no more.
    """
    count = len(others.designs)
    what = "with exactly the same objectives"
    if others.within:
        what = f"with each objective at most {readable(others.within * 10**6, 'ppm')} worse"
    if not count:
        return f"No other design {what}" + (
            ": proved." if others.more is False else " was found before the search stopped."
        )
    said = f"{count} other design{'s' if count > 1 else ''} {what}, chosen to differ"
    tail = {
        True: "there are more",
        False: "there are no more",
        None: "the search stopped before it could tell whether there are more",
    }
    return f"{said}; {tail[others.more]}."


def dominated_words(sibling: FurtherDesign, result: Result) -> str:
    """`` (dominated by #3 and #4)``, `` (the objectives of #5)``; nothing for a tie with its own point.

    In brackets behind the further design; also said where the search stopped before dominance was decided.
    """
    if sibling.dominated_by:
        return f" (dominated by {listed([f'#{number}' for number in sibling.dominated_by])})"
    equal = [point.id for point in result.front if point.objectives == sibling.objectives]
    if not equal:
        return " (not dominated by what was found before the search stopped)"
    return "" if sibling.id.startswith(f"{equal[0]}.") else f" (the objectives of #{equal[0]})"


def proof_words(result: Result) -> str:
    """The sentence on what was proved about the front.

    One sentence: complete, infeasible, or what is left open of a stopped search.
    """
    count = len(result.front)
    points = f"{count} non-dominated design{'s' if count != 1 else ''}"
    if result.status == "complete":
        grid = result.space.offset_grid_ns
        on_the_grid = f", offsets on a grid of {format_duration(grid)}" if grid else ""
        return f"Pareto front, proved complete: {points}{on_the_grid}."
    if result.status == "infeasible":
        return "Infeasible, proved: no design meets every requirement and rule."
    regions = len(result.unexplored)
    if any(not is_proved(result, point) for point in result.front):
        return (
            "Stopped before the first point was proved: the design shown meets every requirement and rule, and better "
            "ones may be missing."
        )
    return (
        f"Incomplete front, stopped early: {points} so far; "
        f"{format_count(regions)} region{'s' if regions != 1 else ''} of the objective space may hold more."
    )


def rounding_words(result: Result) -> str:
    """The sentence on rounded objectives; "" where all are exact.

    One sentence with the counting unit of each rounded objective.
    """
    rounded = [f"{item.name} (to {item.unit})" for item in result.objectives if item.name in result.rounded]
    return f"Rounded up, because no unit makes all values whole numbers: {', '.join(rounded)}." if rounded else ""


def exclusion_words(space: Space) -> str:
    """The sentence on combinations of options that are no designs though the file does not forbid them; "" if none.

    Sentences; such combinations are removed when the space is built (docs/semantics.md).
    """
    return " ".join(f"{_capital(text)}." for text in exclusions(space))


def extrapolated_words(result: Result) -> str:
    """The sentence on designs with message sizes for which no transmission time is stated; "" where there are none.

    Sentences with ids of points and the sizes in question.
    """
    places: dict[Outside, None] = {}
    ids = []
    for point in result.front:
        outside = tuple(outside_sizes(result.space, View(point.design)))
        places |= dict.fromkeys(outside)
        ids += [f"#{point.id}"] if outside else []
    where = _designs(ids) if len(ids) < len(result.front) else "every design"
    return " ".join(f"In {where} {text}." for text in outside_words(places))


def _designs(ids: Sequence[str]) -> str:
    more = [f"{len(ids) - MOST_VARIANTS} more"] if len(ids) > MOST_VARIANTS else []
    return listed([*ids[:MOST_VARIANTS], *more])


def unused_words(result: Result) -> str:
    """The sentence on designs in which a fixed decision has no effect; "" where there are none.

    One sentence for each such decision, with the ids of the designs.
    """
    said = []
    for item in result.unused:
        idle = [f"#{number}" for number in item["points"]]
        where = _designs(idle) if len(idle) < len(result.front) else "every design here"
        choice = f"{item['decision']} = {item['option']}"
        said.append(f"{choice} was fixed, but changes nothing in {where}, where it is not used.")
    return " ".join(said)


def tie_words(result: Result) -> str:
    """The sentence on points that share a rank.

    One sentence with the ids that share each rank; empty where no rank is shared.
    """
    groups: dict[int, list[int]] = {}
    for point in result.front:
        groups.setdefault(point.rank, []).append(point.id)
    tied = [
        f"{', '.join(f'#{number}' for number in ids)} at rank {rank}" for rank, ids in groups.items() if len(ids) > 1
    ]
    return f"Ties: {'; '.join(tied)}." if tied else ""


def rank_text(result: Result, rank: int) -> str:
    """The rank, with ``=`` where several points share it.

    Text such as ``2`` or ``1=``.
    """
    return f"{rank}=" if sum(point.rank == rank for point in result.front) > 1 else str(rank)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def effort_words(result: Result) -> str:
    """The effort of the search, and the number of designs in the space.

    Solver calls, wall time in seconds and the size of the space, as a sentence.
    """
    search = result.search
    spent = f"{count_words(search.solver_calls, 'solver call')}, {search.wall_s:.2f} s, at most"
    if not search.solver_calls and result.status == "incomplete":
        spent = "The time was over before the first solver call, as making the model comes first. At most"
    return f"{spent} {count_words(search.space_size, 'design')}"
