"""What a search of the front found and proved, and what of it holds for a narrower question."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from dse.search.regions import Bound, RefutedRegions, SearchRegions, inside, strictly_inside
from dse.space.model.space import Design
from dse.support.errors import UsageError

ANYTHING = 2**62
"""The bound of a region in an objective of which nothing is known; far beyond exact arithmetic."""


@dataclass(frozen=True)
class ObjectiveScale:
    """The unit of each objective in a search: steps above an offset; `everywhere` bounds all objectives, in steps.

    The solver counts whole steps from 0; results have counting units.
    """

    everywhere: Bound
    offsets: Bound
    steps: Bound

    def counted(self, bound: Bound) -> Bound:
        """Steps to counted (minimised) objectives.

        `offset + step · value` for each objective, in counting units, minimised.
        """
        parts = zip(self.offsets, self.steps, bound, strict=True)
        return tuple(offset + step * value for offset, step, value in parts)

    def in_steps(self, bound: Bound) -> Bound:
        """Counted (minimised) objectives to steps.

        Raises
        ------
        UsageError
            when the objectives cannot have such values.
        """
        parts = [
            divmod(value - offset, step) for offset, step, value in zip(self.offsets, self.steps, bound, strict=True)
        ]
        if any(rest for _, rest in parts):
            raise UsageError(f"the search to go on with has a region {bound}: the objectives cannot have these values")
        return tuple(steps for steps, _ in parts)

    def held(self, bounds: Iterable[Bound]) -> list[Bound]:
        """The regions of a wider question, in counted objectives, as regions of this one in steps, none inside another.

        A bound is rounded up to the next value that there is here: the region holds the same designs as before. One
        that is below all values leaves nothing of its region.

        >>> ObjectiveScale((3, 6), (10, 0), (5, 1)).held([(12, 99), (10, 4), (15, 3)])
        [(1, 6)]
        """
        within: list[Bound] = []
        for bound in bounds:
            parts = zip(self.offsets, self.steps, self.everywhere, bound, strict=True)
            region = tuple(min(most, -((offset - value) // step)) for offset, step, most, value in parts)
            if all(value > 0 for value in region) and not any(inside(region, other) for other in within):
                within = [other for other in within if not inside(other, region)] + [region]
        return within


@dataclass(frozen=True)
class FrontSearch:
    """The points that a search found, and the regions that it proved empty.

    `points` maps objective vectors (counted, as `Measure.integer` gives them) to designs. `unexplored` are the regions
    still open and `refuted` those proved empty: exclusive upper bounds in the same units, minimised objectives
    (maximised ones negated). `floors` has for each open region the least value that each objective may still have
    there. `not_first` are the points whose design is not proved to be the first, in the order of the file, of those
    that have them. `interrupted`: it was Ctrl-C that ended the search. `frame` is how the search counted.
    """

    points: Mapping[tuple[int, ...], Design]
    unexplored: tuple[Bound, ...]
    refuted: tuple[Bound, ...]
    calls: int
    elapsed_s: float
    floors: tuple[Bound, ...] = ()
    not_first: frozenset[tuple[int, ...]] = frozenset()
    interrupted: bool = False
    frame: ObjectiveScale | None = None

    @property
    def is_complete(self) -> bool:
        """Whether every region was refuted or is dominated.

        The front is then proved.
        """
        return not self.unexplored


def narrowed(search: FrontSearch, senses: Sequence[str], keeps: Callable[[Design], bool]) -> FrontSearch:
    """The state of a search for a narrower question, whose designs are those that `keeps` accepts.

    What was refuted stays refuted. What only points dominated that are none any more is open again.
    """
    points = {vector: design for vector, design in search.points.items() if keeps(design)}
    frame = search.frame
    if len(points) == len(search.points):
        return search
    if frame is None:  # nothing was searched: what the others dominated is anywhere
        floors = (tuple(map(min, zip(*search.floors, strict=True))),) if search.floors else ()
        return replace(search, points=points, unexplored=(tuple(ANYTHING for _ in senses),), floors=floors)
    held = SearchRegions(frame.everywhere)
    held.refuted = RefutedRegions(frame.in_steps(region) for region in search.refuted)
    if held.refuted.cover(frame.everywhere):
        held.open = []
    for vector in sorted(points):
        signed = tuple(-value if sense == "maximise" else value for value, sense in zip(vector, senses, strict=True))
        if not any(strictly_inside(signed, region) for region in search.unexplored):  # else found, but not proved
            held.cut(frame.in_steps(signed))
    regions = sorted(held.open)
    return replace(
        search,
        points=points,
        unexplored=tuple(frame.counted(region) for region in regions),
        refuted=tuple(sorted(frame.counted(region) for region in held.refuted)),
        floors=tuple(frame.counted(held.refuted.floor(region)) for region in regions),
        not_first=search.not_first & points.keys(),
    )
