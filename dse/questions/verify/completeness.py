"""What a result claims about all designs, proved a second time: that regions are empty, and that nothing is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from dse.analysis.evaluate import Evaluator
from dse.answers.result import decisions_of
from dse.questions.verify.points import Bench
from dse.space.model.space import Design
from dse.support.errors import UsageError
from dse.support.units.text import count_words, first_of
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany
from dse.verification.geometry import Bound, inside, uncovered
from dse.verification.prover import Method, Prover, make_prover, outer_bound
from dse.verification.solver_calls import Reply

MOST_NAMED = 6
"""Maximum number of points that a remark names."""
MOST_TOGETHER = 32
"""Maximum number of regions or points that are proved together."""
Item = TypeVar("Item")


def check_claims(bench: Bench, method: Method, deadline: float | None) -> None:
    """Points, refuted and unexplored regions together leave nothing out; refuted regions hold no design.

    Each refuted region is proved empty by the second proof, each place outside of points and regions must be covered.
    What cannot be proved in time is noted in ``bench.left_open``, a contradiction as a finding.
    """
    data = bench.data
    refuted = [bench.minimised(region, f"refuted[{at}]") for at, region in enumerate(data["refuted"])]
    open_ = [bench.minimised(region, f"unexplored[{at}]") for at, region in enumerate(data["unexplored"])]
    if any(item.place.startswith(("refuted", "unexplored", "objectives", "problem")) for item in bench.findings):
        return
    for at, region in enumerate(refuted):
        for vector in bench.vectors:
            if inside(vector, region):
                bench.find(f"refuted[{at}]", f"is said to be empty, but holds the point with {bench.words(vector)}")
    if data["status"] != "incomplete" or len(bench.vectors) > 1:
        # a search that is stopped before its first point shows the best design that it has come across, as no more
        for at, region in enumerate(open_):
            if any(inside(vector, region) for vector in bench.vectors):
                bench.find(f"unexplored[{at}]", "holds a point of the front")
    try:
        prover = _Refining(bench, method, deadline)
        _check_proofs(bench, prover, refuted, open_)
    except (TooLarge, TooMany, _UnprovableError) as error:
        bench.left_open.append(f"completeness could not be proved again: {error}")


def _check_proofs(bench: Bench, prover: _Refining, refuted: Sequence[Bound], open_: Sequence[Bound]) -> None:
    refuted, open_ = _extended(prover, refuted, open_)
    _check_cover(bench, prover, (refuted, open_), prover.outer)
    _check_emptiness(bench, prover, refuted)
    if bench.data["status"] == "incomplete":
        _check_unexplored(bench, prover, open_)
    _check_first_designs(bench, prover)
    bench.checked.append(f"{len(refuted)} refuted regions hold no design: {prover.words}")


def _extended(
    prover: _Refining, refuted: Sequence[Bound], open_: Sequence[Bound]
) -> tuple[Sequence[Bound], Sequence[Bound]]:
    """The regions, without an end where they end outermost along an objective that holds open response times.

    How long these get at most is nothing that the second model can tell: it proves the wider regions instead.
    """
    for axis in prover.unlimited:
        most = max((region[axis] for region in (*refuted, *open_)), default=0)
        if any(vector[axis] >= most for vector in prover.bench.vectors):
            continue  # they end at a point, so that none is outermost

        def widened(region: Bound, axis: int = axis, most: int = most) -> Bound:
            ends = (
                max(most, prover.outer[axis]) if at == axis and end == most else end for at, end in enumerate(region)
            )
            return tuple(ends)

        refuted, open_ = [widened(region) for region in refuted], [widened(region) for region in open_]
    return refuted, open_


class _UnprovableError(Exception):
    """Of some design nothing can be said over all stated values."""


class _Refining:
    """A prover of the question as it is asked; of a robust one it learns from designs that are found and not robust."""

    def __init__(self, bench: Bench, method: Method, deadline: float | None) -> None:
        self.bench, self.method, self.deadline = bench, method, deadline
        self.outer = self._begin()

    def _begin(self) -> Bound:
        witness = self.bench.witness
        evaluator = Evaluator(self.bench.space) if witness is None else witness.evaluator()
        self.prover, tables = make_prover(evaluator, self.method, self.deadline)
        self.unlimited = [axis for axis, (total, _) in enumerate(tables.objectives) if total.is_open]
        return outer_bound(tables)

    @property
    def words(self) -> str:
        """The method of the proof in words, for the report."""
        return self.prover.words

    @property
    def left_aside(self) -> str:
        """The decisions that are not compared where designs have one objective vector, in words."""
        return self.prover.left_aside

    def in_region(
        self,
        below: Sequence[int | None],
        from_on: Sequence[int | None] | None = None,
        given: tuple[int, int] | None = None,
    ) -> Reply:
        """A design of a region that the witness of a robust question confirms, or a proof of none."""
        return self._true(lambda: self.prover.in_region(below, from_on, given))

    def earlier_design(self, vector: Sequence[int], design: Design) -> Reply:
        """A confirmed design with these objectives that comes earlier in the order of the file, or a proof of none."""
        return self._true(lambda: self.prover.earlier_design(vector, design))

    def unproved_regions(self, regions: Sequence[Sequence[int]]) -> list[int]:
        """The positions of regions that a quick proof about all of them does not show to be empty."""
        return self.prover.unproved_regions(regions)

    def unproved_claims(self, claims: Sequence[tuple[Sequence[int], Design]]) -> list[int]:
        """The positions of claims for which a quick proof about all does not show that no design is earlier."""
        return self.prover.unproved_claims(claims)

    def another_design(self, below: Sequence[int], known: Sequence[Design], among: Sequence[int]) -> Reply:
        """A confirmed design below `below` that differs from each known one in `among`, or a proof of none."""
        return self._true(lambda: self.prover.another_design(below, known, among))

    def _true(self, ask: Callable[[], Reply]) -> Reply:
        witness = self.bench.witness
        while True:
            reply = ask()
            if reply.answer != "design" or witness is None:
                return reply
            try:
                if not witness.learn(reply.design):
                    return reply
            except UsageError as error:
                raise _UnprovableError(str(error)) from error
            self._begin()


def _holds(bench: Bench, place: str, reply: Reply, what: str) -> bool:
    """Note what a reply means where there should be no design; True when there is none."""
    if reply.answer == "design":
        bench.find(place, f"{what}: {_design(bench, reply)}")
    return reply.answer == "none"


def _design(bench: Bench, reply: Reply) -> str:
    evaluation = Evaluator(bench.space).evaluate(tuple(max(option, 0) for option in reply.design))
    texts = ", ".join(f"{name} {option}" for name, option in decisions_of(bench.space, reply.design).items())
    return f"{texts or 'the only design'}, with {bench.figures(evaluation.objectives)}"


def _check_cover(bench: Bench, prover: Prover, regions: tuple[Sequence[Bound], Sequence[Bound]], outer: Bound) -> None:
    """Integer geometry: every vector is as bad as some point, or in a region."""
    listed = [*regions[0], *regions[1]]
    left = uncovered(bench.vectors, listed, outer)
    if left is not None:
        tighter = tuple(_edge(prover, listed, axis, bound, len(outer)) for axis, bound in enumerate(outer))
        left = uncovered(bench.vectors, listed, tighter) if tighter != outer else left
    if left is None:
        bench.checked.append("points and regions cover the objective space (integer geometry)")
        return
    where = bench.words(left).replace(" -", " -")
    missing = prover.in_region(left)
    known = f"; it holds {_design(bench, missing)}" if missing.answer == "design" else ""
    place = "unexplored" if bench.data["status"] == "incomplete" else "refuted"
    bench.find(place, f"nothing is said of the region beyond {where}: no point is as good, no region covers it{known}")


def _edge(prover: Prover, listed: Sequence[Bound], axis: int, bound: int, count: int) -> int:
    """The outermost bound that the regions state for an objective, where no design reaches it; else `bound`."""
    stated = max((region[axis] for region in listed), default=bound)
    if stated >= bound:
        return bound
    reply = prover.in_region((None,) * count, tuple(stated if at == axis else None for at in range(count)))
    return stated if reply.answer == "none" else bound


def _check_emptiness(bench: Bench, prover: Prover, refuted: Sequence[Bound]) -> None:
    order = sorted(range(len(refuted)), key=lambda at: refuted[at])
    said = f"{{}} of {len(refuted)} refuted regions were proved again to hold no design"

    def ask(at: int) -> None:
        place, reply = f"refuted[{order[at]}]", prover.in_region(refuted[order[at]])
        _holds(bench, place, reply, "is said to be empty, but holds a design")

    _prove(bench, [refuted[at] for at in order], (prover.unproved_regions, ask), said)


def _prove(
    bench: Bench,
    items: Sequence[Item],
    means: tuple[Callable[[Sequence[Item]], list[int]], Callable[[int], None]],
    said: str,
) -> None:
    """Prove items, neighbours together where that is quick.

    The first of the `means` returns the positions that it leaves unproved, the second proves the item at a position
    by itself. Where the time is up, `said` tells how many were proved until then.
    """
    together, alone = means
    for first in range(0, len(items), MOST_TOGETHER):
        group = items[first : first + MOST_TOGETHER]
        with bench.in_time(said.format(first)):
            left = together(group)
        for number, at in enumerate(left):
            with bench.in_time(said.format(first + len(group) - len(left) + number)):
                alone(first + at)


def _check_unexplored(bench: Bench, prover: Prover, open_: Sequence[Bound]) -> None:
    """A stopped search claims that no design dominates its points, and how good what is left may be.

    Of a point in an unexplored region, the best design that it had found, it does not claim that.
    """
    for vector in bench.vectors:
        if any(inside(vector, region) for region in open_):
            continue
        for axis, value in enumerate(vector):
            below = tuple(value if at == axis else other + 1 for at, other in enumerate(vector))
            if not _holds(
                bench, "front", prover.in_region(below), f"the point with {bench.words(vector)} is dominated"
            ):
                break
    potential = bench.data.get("potential", {})
    if potential:
        best = bench.minimised(potential, "potential")
        for region in open_:
            for axis, value in enumerate(best):
                below = tuple(min(value, bound) if at == axis else bound for at, bound in enumerate(region))
                place = f'potential["{bench.names[axis]}"]'
                _holds(bench, place, prover.in_region(below), "an unexplored region holds a better design")


def _check_first_designs(bench: Bench, prover: Prover) -> None:
    """Of the designs with the same objectives a point shows the first, unless it says that it may not be."""
    points = [bench.data["front"][position] for position in bench.positions]
    silent = [point["id"] for point in points if point.get("is_first") is False]
    places = [at for at, point in enumerate(points) if point.get("is_first") is not False]
    claims = [(bench.vectors[at], bench.designs[at]) for at in places]
    said = f"{{}} of {len(places)} points were proved again to have the first of their designs"

    def ask(at: int) -> None:
        place, reply = f"front[{bench.positions[places[at]]}].decisions", prover.earlier_design(*claims[at])
        _holds(bench, place, reply, "is not the first design with these objectives; that is")

    _prove(bench, claims, (prover.unproved_claims, ask), said)
    if count := len(bench.vectors) - len(silent):
        shown = "shows the first of the designs with its" if count == 1 else "show the first of the designs with their"
        aside = f", {prover.left_aside} left aside" if prover.left_aside else ""
        bench.checked.append(f"{count_words(count, 'point')} {shown} objectives{aside}")
    if silent:
        named = first_of([f"#{number}" for number in silent], MOST_NAMED)
        bench.remarks.append(
            f"not claimed (`is_first: false`), and not looked at: that the design shown is the first of those with the "
            f"objectives of {named}"
        )
