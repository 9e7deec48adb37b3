"""Which design is recommended, in words that tell designs apart: what it is, what it costs, which limit is nearest."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from dse.analysis.terms import PPM
from dse.answers.designs import Point, numbered_texts
from dse.answers.ranking.changes import Delta, deltas
from dse.answers.ranking.kinds import Kind, Kinds, shortest_names
from dse.answers.ranking.reasons import Margin
from dse.answers.result import Result
from dse.answers.tables.display import counted, readable
from dse.report.amounts import amount_words, difference_words, listed, safe_text
from dse.space.model.space import EMPTY
from dse.support.units import is_unbounded
from dse.support.units.text import first_of

if TYPE_CHECKING:
    from dse.questions.beyond_limit import Beyond
    from dse.questions.question import HasDecisions

CLOSE = Fraction(1, 100)
"""Scores that are no further apart than this share of the larger one are a tie."""
MOST_SHARING = 3
MOST_LIMITS = 2
"""The number of limits that are told of a design, the nearest first."""
MOST_MINOR = 2
"""The greatest number of minor decisions that are told."""


def shown_decisions(result: Result, point: HasDecisions) -> Mapping[str, str]:
    """The decisions of a design as readers see them: ``any (0xff)`` for an identifier that a rule gives.

    Names of decisions to texts; ``any`` alone for a design that is no point of the front, and while a search runs.
    """
    if isinstance(point, Point) and not result.under_way:
        return numbered_texts(result.space, point.decisions, point.design)
    return point.decisions


class Names:
    """Short names of the decisions of a result, and options in the words that tell designs apart.

    The type of a slot stands for itself where no other slot may have it.
    """

    def __init__(self, result: Result, kinds: Kinds) -> None:
        self.result = result
        known = [decision.name for decision in result.space.decisions]
        self.short: Mapping[str, str] = shortest_names(known, known)
        self.types = [f"{slot.name}.type" for slot in result.space.processors]
        self.naming = kinds.naming
        self.told = [*kinds.naming, *kinds.minor[:MOST_MINOR]]
        types = (item.options for item in result.space.decisions if item.name.endswith(".type"))
        self._slots_of = Counter(option for options in types for option in options)

    def option(self, name: str, option: str | None) -> str:
        """``Spectra``, ``can_125k``, ``main_loop.period 5 ms``; a slot without a type is left empty.

        Short where that is clear: the type alone if only one slot offers it, else with the name of the slot or
        decision.
        """
        if option is None:
            return f"no {self.short[name]}"
        if name.endswith(".type"):
            if option == EMPTY:
                return f"no {self.short[name]}"
            return option if self._slots_of[option] == 1 else f"{self.short[name]} {option}"
        return f"{self.short[name]} {option}"

    def chosen(self, point: HasDecisions) -> Mapping[str, str]:
        """The decisions of a design as sentences name them (`shown_decisions`)."""
        return shown_decisions(self.result, point)

    def kind(self, point: Point) -> str:
        """The decisions that tell the kind of a design from others; "" where all are of one kind.

        Options joined by commas, such as ``Spectra, can_125k``.
        """
        chosen = self.chosen(point)
        return ", ".join(self.option(name, chosen.get(name)) for name in self.naming)

    def design(self, point: HasDecisions) -> str:
        """The short name of a design: its computers where they are open, and the decisions that differ on the front.

        Options joined by commas, each once; at most `MOST_SHARING` computers.
        """
        types = [name for name in self.types if name in point.decisions][:MOST_SHARING]
        names = [*types, *(name for name in self.told if name not in types)]
        chosen = self.chosen(point)
        options = [self.option(name, chosen[name]) for name in names if name in chosen]
        return ", ".join(dict.fromkeys(options))


def beyond_words(result: Result, item: Beyond) -> tuple[str, str]:
    """The saving of the nearest design beyond a limit, and its excess.

    Two texts: ``price 735 EUR lower than in any design of the front`` and ``jitter 1.708 ms above the limit of 18 ms``;
    the excess is rounded up.
    """
    currency = result.space.currency
    saved = next(info for info in result.objectives if info.name == item.saved)
    least = min(point.objectives[item.saved] for point in result.front)
    lower = amount_words(least - item.objectives[item.saved], saved.unit, currency)
    excess = safe_text(item.value - item.limit, item.unit, currency, is_least=True)
    bound = counted(item.limit, item.unit, currency)
    return (
        f"{item.saved} {lower} lower than in any design of the front",
        f"{item.limited} {excess} above the limit of {bound}",
    )


def near_scores(kinds: Sequence[Kind]) -> list[Kind]:
    """The kinds whose best designs score within `CLOSE` of the first; that one alone where none does.

    In the order of rank, the first one included; more than one means a tie.
    """
    first = kinds[0].points[0]
    return [kind for kind in kinds if _is_near(first, kind.points[0])]


def _is_near(first: Point, other: Point) -> bool:
    one, two = (_number(point.score) for point in (first, other))
    if one is None or two is None:
        return first.rank == other.rank
    return abs(one - two) <= CLOSE * max(abs(one), abs(two))


def _number(score: str) -> Fraction | None:
    return Fraction(score) if re.fullmatch(r"\d+(\.\d+)?", score) else None


def recommended_words(result: Result, kind: Kind, names: Names, label: str) -> str:
    """The first design, what it is, and which designs of its kind score as well.

    One line that begins with `label`, such as "Recommended"; another ranking than the default is named.
    """
    point = kind.point
    also = [other for other in kind.points if other.id != point.id and _is_near(result.front[0], other)]
    said = f"{label}  #{point.id} {names.design(point)}".rstrip()
    if also:
        shown = [_also(names, point, other) for other in also[:MOST_SHARING]]
        shown += [f"{len(also) - MOST_SHARING} more"] if len(also) > MOST_SHARING else []
        said += f"; {listed(shown)} score{'s' if len(also) == 1 else ''} within 1 %"
    if result.ranking != "ideal":
        said += f" (first by {result.ranking_words})"
    return f"{said}."


def _also(names: Names, point: Point, other: Point) -> str:
    chosen = names.chosen(other)
    differs = [
        names.option(name, chosen.get(name))
        for name in names.told
        if other.decisions.get(name) != point.decisions.get(name)
    ]
    return f"#{other.id}" + (f" ({', '.join(differs)})" if differs else "")


def tie_words(result: Result, tied: Sequence[Kind], names: Names) -> Iterator[str]:
    """The reason why no design is recommended, and the differences of the first two.

    Two lines: the ids and scores that tie, and the differences of the first two in each objective.
    """
    one, other = tied[0].point, tied[1].point
    who = listed([f"#{kind.point.id}" for kind in tied])
    scores = listed(list(dict.fromkeys(kind.points[0].score for kind in tied))) if one.score else ""
    yield f"No recommendation: {who} tie within 1 %" + (f" (scores {scores})." if scores else ".")
    differences = [_signed(delta, result.space.currency) for delta in _between(result, other, one) if delta.gain]
    yield f"  #{one.id} ({names.design(one)}) against #{other.id} ({names.design(other)}): {', '.join(differences)}."


def _between(result: Result, before: Point, after: Point) -> list[Delta]:
    """The objectives in two points, under their short names."""
    changes = deltas(result.objectives, before.objectives, after.objectives)
    short = short_metrics(delta.name for delta in changes)
    return [replace(delta, name=short[delta.name]) for delta in changes]


def short_metrics(names: Iterable[str]) -> Mapping[str, str]:
    """The first word of each metric, where it is unique among the metrics; else the whole name.

    >>> short_metrics(["jitter of a", "price", "latency of a", "latency of b"])
    {'jitter of a': 'jitter', 'price': 'price', 'latency of a': 'latency of a', 'latency of b': 'latency of b'}
    """
    every = list(names)
    words = [name.partition(" of ")[0] for name in every]
    return {name: word if words.count(word) == 1 else name for name, word in zip(every, words, strict=True)}


def _signed(delta: Delta, currency: str) -> str:
    """``price +40 EUR``."""
    if is_unbounded(delta.after) or is_unbounded(delta.before):
        return f"{delta.name} {difference_words(delta, currency)}"
    change = delta.after - delta.before
    return f"{delta.name} {'+' if change > 0 else '-'}{_points(counted(abs(change), delta.unit, currency))}"


def _points(text: str) -> str:
    """A difference between shares is one of percentage points."""
    return f"{text.removesuffix('%')}points" if text.endswith("%") else text


def cost_words(result: Result, point: Point) -> str:
    """The objectives in which a design is best, and for each other one the cost of the best value.

    Phrases joined by commas, one for each objective, for the line below the recommendation.
    """
    sentences = []
    short = short_metrics(info.name for info in result.objectives)
    for info in result.objectives:
        what = f"{'lowest' if info.sense == 'minimise' else 'highest'} {short[info.name]}"
        values = [other.objectives[info.name] for other in result.front]
        best = min(values) if info.sense == "minimise" else max(values)
        if point.objectives[info.name] == best:
            sharing = [other.id for other in result.front if other.objectives[info.name] == best and other is not point]
            shown = first_of([f"#{number}" for number in sharing], MOST_SHARING)
            sentences.append(what + (f" (as {shown})" if sharing else ""))
            continue
        other = next(item for item in result.front if item.objectives[info.name] == best)
        moved = _between(result, point, other)
        gained = next(delta for delta in moved if delta.name == short[info.name])
        losses = [_signed(delta, result.space.currency) for delta in moved if delta.gain < 0]
        costs = f": {', '.join(losses)}" if losses else ""
        is_known = not is_unbounded(gained.before) and not is_unbounded(gained.after)
        amount = _signed(gained, result.space.currency).removeprefix(f"{gained.name} ")
        sentences.append(f"{what} (#{other.id}) {amount if is_known else 'bounded'}{costs}")
    return "; ".join(sentences)


def nearest_words(margins: Sequence[Margin], currency: str) -> str:
    """The limits with the least slack as a share: ``core 2 of computer 50.890 of 70 % (27.3 % slack)``.

    At most `MOST_LIMITS` limits; unbounded ones are left out, because warnings name them.
    """
    return ", ".join(_margin_words(item, currency) for item in margins[:MOST_LIMITS] if not is_unbounded(item.slack))


def _margin_words(item: Margin, currency: str) -> str:
    name, _, figures, slack = margin_parts(item, currency)
    return f"{name} {figures} ({slack})"


def margin_parts(item: Margin, currency: str) -> tuple[str, float, str, str]:
    """The name of the limited figure, the used share of the limit, value and limit, and the slack as a share.

    ``("core 2 of computer", 0.727, "50.89 of 70 %", "27.3 % slack")``.
    """
    unit, factor = item.unit, Fraction(1)
    if item.capacity and unit != "ppm":  # a load: its limit is a share of the bandwidth
        unit, factor = "ppm", item.capacity / PPM
    value, limit = (readable(figure / factor, unit, currency) for figure in (item.value, item.limit))
    name = item.requirement.metric.name
    if item.thread:
        name = f"{item.thread} of {name.removeprefix('utilisation of ')}"
    same = limit.rpartition(" ")[2]
    value = value.removesuffix(f" {same}")
    slack = f"{readable(item.share * PPM, 'ppm', digits=1)} slack" if item.slack else "no slack"
    relation = "of" if item.requirement.is_upper else "with at least"
    used = 1 - item.share if item.requirement.is_upper else item.limit / (item.value or item.limit or 1)
    return name, 2.0 if is_unbounded(item.value) else float(used), f"{value} {relation} {limit}", slack


def minor_words(result: Result, kinds: Kinds, names: Names) -> Iterator[str]:
    """The effect of each minor decision within a kind, against the design that represents the kind.

    One line for each of at most `MOST_MINOR` decisions, with the range of the change in each objective.
    """
    for name in kinds.minor[:MOST_MINOR]:
        others = {key for key in kinds.minor if key != name}
        moved: dict[str, list[Delta]] = {}
        options: dict[str, None] = {}
        for kind in kinds.kinds:
            for point in kind.points:
                here, there = point.decisions, kind.point.decisions
                if here.get(name) != there.get(name) and all(here.get(key) == there.get(key) for key in others):
                    options[names.option(name, here.get(name))] = None
                    for delta in _between(result, kind.point, point):
                        moved.setdefault(delta.name, []).append(delta)
        effects = [text for deltas in moved.values() if (text := _range_words(deltas, result.space.currency))]
        if options and effects:
            order = {names.option(item.name, option): at for item in result.space.decisions if item.name == name
                     for at, option in enumerate(item.options)}  # fmt: skip
            shown = sorted(options, key=lambda text: order.get(text, -1))
            label = ", ".join(shown) if name.endswith(".type") else ", ".join(
                text if at == 0 else text.removeprefix(f"{names.short[name]} ") for at, text in enumerate(shown)
            )  # fmt: skip
            yield f"Within each kind: {label}: {', '.join(effects)}."


def _range_words(deltas: Sequence[Delta], currency: str) -> str:
    """``price 5 to 40 EUR more``; "" where nothing moves."""
    changes = [item.after - item.before for item in deltas if not is_unbounded(item.after)]
    changes = [change for change in changes if change]
    if not changes:
        return ""
    first = deltas[0]
    low, high = min(changes), max(changes)
    if low < 0 < high:
        return f"{first.name} {_amount(low, first, currency)} to {_amount(high, first, currency)}"
    ends = sorted({abs(low), abs(high)})
    texts = [counted(value, first.unit, currency) for value in ends]
    unit = texts[-1].rpartition(" ")[2]
    shown = " to ".join([*(text.removesuffix(f" {unit}") for text in texts[:-1]), texts[-1]])
    return f"{first.name} {_points(shown)} {'more' if high > 0 else 'less'}"


def _amount(value: int, delta: Delta, currency: str) -> str:
    text = _points(counted(abs(value), delta.unit, currency))
    return f"{text} {'more' if value > 0 else 'less'}"
