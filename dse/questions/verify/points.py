"""What a result states of its points, recomputed by the analysis alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Protocol

from dse.analysis.evaluate import Evaluation, Evaluator
from dse.analysis.measures import cost_of_changes
from dse.analysis.views import View
from dse.answers.ranking.ranking import rank, same_score
from dse.answers.ranking.variants import find_variants
from dse.answers.result import decisions_of, ranked, unused_choices
from dse.answers.tables.display import NO_BOUND, exact, figures_of, without_stand_in
from dse.answers.verification import Finding
from dse.questions.complete_design import baseline_design
from dse.questions.problem import Problem
from dse.space.model.space import Design, Space
from dse.space.size import space_size
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, look_at_the_clock
from dse.support.units import Unbounded, is_unbounded
from dse.support.units.text import count_words
from dse.verification.prover import Method
from dse.verification.scheduling.sampling import own_value

BEYOND = 2**62
"""No objective reaches it."""
MOST_FINDINGS = 50
MOST_OF_A_KIND = 10
"""The greatest number of findings that are listed of one kind, such as the rank of a point."""


_NUMBER = re.compile(r"\[\d+\]")
_OF_ORDER = re.compile(r"(^|\.)(ranking\.words|front\[\d*\]\.(id|rank|score|variant_of))$")
"""Places of findings about the order of designs, which change neither a design nor what is proved."""


class Witness(Protocol):
    """Knows of designs whether every requirement holds for all values that are stated of uncertain inputs.

    Implemented by `RobustWitness`; a result that is not robust has no witness.
    """

    def evaluator(self) -> Evaluator:
        """The evaluator of designs that may be robust, as far as is known.

        Its limits include demands at corners. What it rejects is not robust.
        """
        ...

    def learn(self, design: Design) -> bool:
        """Whether a design is not robust, which `evaluator` knows from now on.

        False where the design is proved to be robust.
        """
        ...

    def broken(self, design: Design) -> list[str]:
        """The requirements that a design violates for some stated values of the inputs, in words.

        One sentence for each requirement; empty for a robust design.
        """
        ...

    def check(self, bench: Bench, method: Method, deadline: float | None) -> None:
        """Check the further statements of a robust result.

        Nominal front, lost designs and the price of robustness; findings are noted in `bench`.
        """
        ...


@dataclass
class Bench:
    """A result under examination: what it says, and what was found.

    `has_moved`: the lines of the problem file are not where they were, for comments or the layout have changed.

    `vectors` and `designs` are those of the points that could be recomputed, objectives to be minimised, `positions`
    their places in the front. `witness` is there where the question is robust.
    """

    data: Mapping[str, Any]
    problem: Problem
    findings: list[Finding] = field(default_factory=list)
    checked: list[str] = field(default_factory=list)
    left_open: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    asked: Problem | None = None
    witness: Witness | None = None
    designs: list[Design] = field(default_factory=list)
    vectors: list[tuple[int, ...]] = field(default_factory=list)
    positions: list[int] = field(default_factory=list)
    has_moved: bool = False
    kinds: Counter[str] = field(default_factory=Counter)

    def find(self, place: str, text: str) -> None:
        """Note that something is wrong.

        `place` is a path such as ``front[3].metrics``. Findings beyond `MOST_OF_A_KIND` at one kind of place are
        counted.
        """
        kind = _NUMBER.sub("[]", place)
        self.kinds[kind] += 1
        if self.kinds[kind] <= MOST_OF_A_KIND:
            self.findings.append(Finding(place, text))

    def listed(self) -> tuple[Finding, ...]:
        """The findings to list: those about designs and proofs first, how many more there are, then ids and ranks.

        At most `MOST_FINDINGS`.
        """
        more = [
            Finding(kind, f"{count - MOST_OF_A_KIND} more such findings")
            for kind, count in self.kinds.items()
            if count > MOST_OF_A_KIND
        ]
        found = [*self.findings, *more]
        return tuple(sorted(found, key=lambda item: bool(_OF_ORDER.search(item.place)))[:MOST_FINDINGS])

    @contextmanager
    def in_time(self, so_far: str) -> Iterator[None]:
        """Note how far a check has come, where its time is up.

        Raises
        ------
        OutOfTime
            then.
        """
        try:
            look_at_the_clock()
            yield
        except OutOfTime:
            self.left_open.append(f"{so_far}, the others were not")
            raise

    def compare(self, place: str, expected: Any, stated: Any) -> None:
        """Note every difference between what should be stated and what is.

        Mappings are compared key by key, lists entry by entry, other values by type and value; the place of each
        finding is the path to the difference.
        """
        if isinstance(expected, dict) and isinstance(stated, dict):
            for key in [*expected, *(key for key in stated if key not in expected)]:
                where = f"{place}.{key}" if str(key).isidentifier() else f'{place}["{key}"]'
                if key not in stated:
                    self.find(where, f"is missing; it is {_shown(expected[key])}")
                elif key not in expected:
                    self.find(where, f"is stated as {_shown(stated[key])}, but there is no such thing")
                else:
                    self.compare(where, expected[key], stated[key])
        elif isinstance(expected, list) and isinstance(stated, list) and len(expected) == len(stated):
            for at, (one, other) in enumerate(zip(expected, stated, strict=True)):
                self.compare(f"{place}[{at}]", one, other)
        elif type(expected) is not type(stated) or expected != stated:
            self.find(place, f"is stated as {_shown(stated)}; it is {_shown(expected)}")

    @property
    def under_way(self) -> bool:
        """Whether the result was written while its search went on: it has what that needs, and no more.

        Checkpoints of a search state neither metrics nor variants.
        """
        return self.data.get("under_way") is True

    @property
    def space(self) -> Space:
        """The space of the question as it was asked."""
        assert self.asked is not None
        return self.asked.space

    @property
    def names(self) -> list[str]:
        """The objectives."""
        return [item.metric.name for item in self.space.objectives]

    @property
    def signs(self) -> list[int]:
        """-1 for objectives to be maximised.

        1 or -1 for each objective, to turn a vector into one that is minimised in every entry.
        """
        return [1 if item.sense == "minimise" else -1 for item in self.space.objectives]

    def minimised(self, region: Mapping[str, Any], place: str) -> tuple[int, ...]:
        """Figures by objective as a vector to be minimised; anything but one integer for each is a finding, and 0.

        An unexplored region may leave out objectives: it has no bound in them.
        """
        if place.startswith("unexplored") and set(region) < set(self.names):
            region = {name: sign * BEYOND for name, sign in zip(self.names, self.signs, strict=True)} | dict(region)
        if set(region) != set(self.names) or not all(type(value) is int for value in region.values()):
            self.find(place, f"needs a whole number for each of {', '.join(self.names)}")
            return (0,) * len(self.names)
        return tuple(sign * region[name] for sign, name in zip(self.signs, self.names, strict=True))

    def vector_of(self, evaluation: Evaluation) -> tuple[int, ...]:
        """The objectives of a design as a vector to be minimised, with what stands for an unbounded one.

        Whole numbers in the counting units of the objectives, entries to be maximised with a negative sign.
        """
        pairs = zip(self.signs, evaluation.objectives, strict=True)
        return tuple(sign * int(value) for sign, value in pairs)

    def words(self, vector: Sequence[int]) -> str:
        """A vector in the objectives' own sense, in the units in which they are counted.

        For example ``price 29000, latency of chain 6934000``.
        """
        return self.figures(sign * value for sign, value in zip(self.signs, vector, strict=True))

    def figures(self, values: Iterable[int]) -> str:
        """Objectives with their names; what stands for an unbounded one is said to be that.

        `values` are in the objectives' own sense, in counting units.
        """
        said = []
        for info, objective, value in zip(self.data["objectives"], self.space.objectives, values, strict=True):
            shown = without_stand_in(self.space, objective.metric, info["unit"], value)
            said.append(f"{objective.metric.name} {NO_BOUND if is_unbounded(shown) else int(value)}")
        return ", ".join(said)


def check_statements(bench: Bench) -> None:
    """Objectives and units, the size of the space, and whether the status fits what is listed.

    Everything that can be compared without looking at a single point; differences are findings of `bench`.
    """
    data, space = bench.data, bench.space
    evaluator = Evaluator(space)
    objectives = [
        {"name": measure.metric.name, "sense": item.sense, "unit": measure.counting_unit}
        for measure, item in zip(evaluator.objectives, space.objectives, strict=True)
    ]
    bench.compare("objectives", objectives, data["objectives"])
    bench.compare("metric_units", dict(evaluator.counting_units), data["metric_units"])
    bench.compare("rounded", list(evaluator.rounded), data.get("rounded", []))
    bench.compare("search.space_size", space_size(space), data["search"]["space_size"])
    listed = {key: bool(data[key]) for key in ("front", "refuted", "unexplored")}
    fits = {
        "complete": listed["front"] and not listed["unexplored"],
        "infeasible": listed["refuted"] and not listed["front"] and not listed["unexplored"],
        "incomplete": listed["unexplored"],
    }
    if data["status"] not in fits:
        bench.find("status", f"{data['status']!r} is none of {', '.join(fits)}")
    elif not fits[data["status"]]:
        has = ", ".join(f"{'' if there else 'no '}{key}" for key, there in listed.items())
        bench.find("status", f"{data['status']} does not fit a result with {has}")


def check_front(bench: Bench) -> None:
    """Check each point by evaluating its decisions again; no point dominates another; ids and ranks are right.

    Every point is evaluated anew, its metrics are compared exactly, and pairs of points are tested for dominance.
    Designs and vectors are kept in `bench` for the second proof.
    """
    evaluator = Evaluator(bench.space)
    ids = []
    for position, point in enumerate(bench.data["front"]):
        with bench.in_time(f"{position} of {len(bench.data['front'])} points were recomputed"):
            evaluation = recomputed(bench, evaluator, point, f"front[{position}]", f"point {point['id']}")
        if evaluation is not None:
            ids.append(point["id"])
            bench.designs.append(evaluation.design)
            bench.vectors.append(bench.vector_of(evaluation))
            bench.positions.append(position)
    for at, one in enumerate(bench.vectors):
        look_at_the_clock()
        for later, other in enumerate(bench.vectors):
            if one == other and at < later:
                bench.find("front", f"points {ids[at]} and {ids[later]} have the same objectives")
            elif one != other and all(a <= b for a, b in zip(one, other, strict=True)):
                bench.find("front", f"point {ids[later]} is dominated by point {ids[at]}")
    points = count_words(len(ids), "point")
    bench.checked.append(f"{points}, recomputed from their decisions by the analysis alone; none dominates another")
    if len(ids) == len(bench.data["front"]) and not bench.findings:
        check_ranks(bench)


def recomputed(
    bench: Bench, evaluator: Evaluator, point: Mapping[str, Any], place: str, called: str
) -> Evaluation | None:
    """The evaluation of a listed design, or None where it is none or is not feasible; every difference is noted.

    `point` is the mapping of the result, `place` its path, `called` its name in findings. Structure, requirements,
    objectives and metrics are evaluated by the analysis.
    """
    design = _design(bench, point["decisions"], place)
    if design is None:
        return None
    evaluation = evaluator.evaluate(design)
    if evaluation.breaches:
        bench.find(f"{place}.decisions", f"{called} is no valid design: {'; '.join(evaluation.breaches)}")
        return None
    bench.compare(f"{place}.decisions", decisions_of(bench.space, evaluation.design), dict(point["decisions"]))
    for verdict in evaluation.verdicts:
        if not verdict.holds:
            alone = f", by {verdict.who} alone" if verdict.who else ""
            text = f"{called} violates {verdict.requirement.text!r}{alone}"
            bench.find(place, f"{text}: {exact(verdict.value)} {verdict.unit}, the limit is {exact(verdict.limit)}")
    if bench.witness is not None and evaluation.is_feasible:
        _hear(bench, bench.witness, evaluation.design, place, called)
    objectives = dict(zip(bench.names, evaluation.objectives, strict=True))
    bench.compare(f"{place}.objectives", figures_of(objectives), point["objectives"])
    if bench.under_way and not point["metrics"]:
        return evaluation if evaluation.is_feasible else None
    metrics = evaluator.metric_values(evaluation.design)
    bench.compare(f"{place}.metrics", figures_of(metrics), point["metrics"])
    _sample_again(bench, evaluator, evaluation.design, f"{place}.metrics")
    return evaluation if evaluation.is_feasible else None


def _sample_again(bench: Bench, evaluator: Evaluator, design: Design, place: str) -> None:
    """Compare what clocks and offsets do to flows with the second proof's formulas."""
    view = View(design)
    for measure in evaluator.metrics:
        if any(term.sampled is not None for term in measure.terms):
            own, value = own_value(measure, view), measure.value(view)
            if own != value:
                where = f'{place}["{measure.metric.name}"]'
                bench.find(where, f"is {value} {measure.unit} by the analysis, but {own} release by release")


def _hear(bench: Bench, witness: Witness, design: Design, place: str, called: str) -> None:
    """Note what a design of a robust front breaks for some stated values."""
    try:
        for text in witness.broken(design):
            bench.find(place, f"{called} {text}")
    except OutOfTime:
        raise
    except UsageError as error:
        bench.left_open.append(f"{place}: {error}")


def _design(bench: Bench, decisions: Mapping[str, Any], place: str) -> Design | None:
    """The design that the texts name; a decision that they leave out holds option 0, which must not matter."""
    known = {item.name: (index, item) for index, item in enumerate(bench.space.decisions) if item.is_open}
    design = [0] * len(bench.space.decisions)
    sound = True
    for name, text in decisions.items():
        where = f'{place}.decisions["{name}"]'
        if name not in known:
            bench.find(where, "there is no such open decision")
            sound = False
        elif text not in known[name][1].options:
            bench.find(where, f"has no option {text!r}")
            sound = False
        else:
            index, item = known[name]
            design[index] = item.options.index(text)
    return tuple(design) if sound else None


def check_ranks(bench: Bench) -> None:
    """Ids in the order of the default ranking, ranks by the stated method, from all `designs` and `vectors`.

    Ids, ranks, scores, variants and unused choices are computed anew and compared with what the result states.
    """
    data = bench.data
    vectors = [_own(bench, vector, point) for vector, point in zip(bench.vectors, data["front"], strict=True)]
    senses = [item.sense for item in bench.space.objectives]
    order = {
        vector: number for number, (_, vector, _) in enumerate(ranked([(v, ()) for v in vectors], senses), start=1)
    }
    for at, (vector, point) in enumerate(zip(vectors, data["front"], strict=True)):
        bench.compare(f"front[{at}].id", order[vector], point["id"])
    method = data["ranking"]["method"]
    base = baseline_design(bench.space)
    changed = None
    if base is not None:
        changed = [cost_of_changes(bench.space, View(design)) for design in bench.designs]
    ranking = rank(method, vectors, list(zip(bench.names, senses, strict=True)), changed)
    if data["ranking"]["words"] != ranking.words:
        bench.find("ranking.words", f"do not describe the method {method!r}")
    rows = zip(ranking.ranks, ranking.scores, data["front"], strict=True)
    for at, (number, score, point) in enumerate(rows):
        bench.compare(f"front[{at}].rank", number, point["rank"])
        if point["score"] != "" and not same_score(point["score"], score):
            bench.find(f"front[{at}].score", f"is stated as {point['score']!r}; it is {score!r}")
    choices = unused_choices(bench.space, ((point["id"], point["decisions"]) for point in data["front"]))
    bench.compare("unused", choices, data.get("unused", []))
    leaders = find_variants(vectors, [point["decisions"] for point in data["front"]])
    for at, (leader, point) in enumerate(zip(leaders, data["front"], strict=True) if not bench.under_way else ()):
        expected = None if leader is None else data["front"][leader]["id"]
        bench.compare(f"front[{at}].variant_of", expected, point.get("variant_of"))
    stated = [(point["rank"], point["id"]) for point in data["front"]]
    if stated != sorted(stated):
        bench.find("front", "is not in the order of rank")
    what = "ids and ranks" if bench.under_way else "ids, ranks and variants"
    bench.checked.append(f"{what} ({method})")


def _own(bench: Bench, vector: tuple[int, ...], point: Mapping[str, Any]) -> tuple[int | Fraction, ...]:
    """The objectives of a listed point in their own sense, what it lists as unbounded being that."""
    own = [sign * value for sign, value in zip(bench.signs, vector, strict=True)]
    stated = [point["objectives"][name] for name in bench.names]
    return tuple(Unbounded(value) if text is None else value for value, text in zip(own, stated, strict=True))


def _shown(value: Any) -> str:
    text = "null" if value is None else repr(value)
    return text if len(text) <= 200 else f"{text[:200]}…"
