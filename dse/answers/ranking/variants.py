"""How the designs of a front differ: which decisions vary, and which designs are near-identical.

A point is a *variant* of a better-ranked one when each objective is within a tenth of its range of that point's, and
it is reached from there by changing one decision at a time, through such points alone. What falls away or comes up
with another decision (a period with its dispatch protocol, an optional slot with what is bound to it) is no decision
of its own here. So one design with three bus rates takes one place in a list, while designs that are built otherwise
keep theirs, however close their figures are.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from dse.answers.ranking.ranking import finite, range_of
from dse.space.model.space import EMPTY
from dse.support.units import is_unbounded

NEAR = Fraction(1, 10)
"""Largest difference between a point and its variant, as a share of an objective's range."""
Number: TypeAlias = int | Fraction
Vector: TypeAlias = Sequence[Number]


def find_variants(
    vectors: Sequence[Vector], decisions: Sequence[Mapping[str, str]], ranges: Vector | None = None
) -> list[int | None]:
    """For each point, best ranked first, the position of the one that it is a variant of; None where it is none.

    Ranges are those of bounded values; points are no variants of each other where one is unbounded and one is not.

    Parameters
    ----------
    vectors
        objectives of each point, in any unit.
    decisions
        the active open decisions of each point, by name.
    ranges
        the range of each objective, in its unit; that over `vectors` when left out.

    Examples
    --------
    >>> rates = [{"type": "small", "bus": text} for text in ("125k", "250k")] + [{"type": "large", "bus": "1m"}]
    >>> find_variants([(100, 10), (95, 11), (0, 30)], rates)
    [None, 0, None]
    """
    leaders: list[int | None] = [None] * len(vectors)
    if not vectors or not vectors[0]:
        return leaders
    endless = [tuple(map(is_unbounded, vector)) for vector in vectors]
    bounded = range_of(vectors, ["minimise"] * len(vectors[0]))
    vectors = finite(vectors)
    spans = ranges if ranges is not None else [high - low for low, high in bounded]
    most = [span * NEAR.numerator for span in spans]
    reach = spans[0] * NEAR
    by_first = sorted(range(len(vectors)), key=lambda at: vectors[at][0])
    firsts = [vectors[at][0] for at in by_first]
    taken: set[int] = set()
    for leader, vector in enumerate(vectors):
        if leader in taken:
            continue
        inside = by_first[bisect_left(firsts, vector[0] - reach) : bisect_right(firsts, vector[0] + reach)]
        rest = [at for at in inside if at > leader and at not in taken and endless[at] == endless[leader]]
        near = [at for at in rest if _is_near(vectors[at], vector, most)]
        edge = [leader]
        while edge and near:
            here = edge.pop()
            joined = [at for at in near if is_one_choice(decisions[here], decisions[at])]
            near = [at for at in near if at not in joined]
            edge += joined
            taken.update(joined)
            for at in joined:
                leaders[at] = leader
    return leaders


def _is_near(one: Vector, other: Vector, most: Vector) -> bool:
    """Whether no difference is a larger share than `NEAR` of a range; `most` are the ranges times its numerator."""
    return all(-share <= (a - b) * NEAR.denominator <= share for a, b, share in zip(one, other, most, strict=True))


def is_one_choice(one: Mapping[str, str], other: Mapping[str, str]) -> bool:
    """Whether two designs differ in one decision, apart from what falls away or comes up with it.

    >>> is_one_choice({"nav.protocol": "periodic", "nav.period": "5 ms"}, {"nav.protocol": "aperiodic"})
    True
    """
    count = 0
    for name, option in one.items():
        against = other.get(name, option)
        if option != against and EMPTY not in (option, against):
            count += 1
            if count > 1:
                return False
    return True


def varying(designs: Sequence[Mapping[str, str]], names: Sequence[str] | None = None) -> list[str]:
    """The decisions (of `names`, else of all) in which designs differ; all of them where there is but one design.

    >>> varying([{"a": "1", "b": "2"}, {"a": "1", "b": "3"}]), varying([{"a": "1", "b": "2"}])
    (['b'], ['a', 'b'])
    """
    known = names if names is not None else list(dict.fromkeys(name for design in designs for name in design))
    differing = [name for name in known if len({design.get(name) for design in designs}) > 1]
    return differing or [name for name in known if any(name in design for design in designs)]
