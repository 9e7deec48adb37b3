"""Tables as sums of smaller ones: what two decisions add independently needs no literal for each pair of options.

A latency contribution is the sampling delay of a period plus the execution time on a processor type: the table over
both decisions is the sum of a table over each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from fractions import Fraction
from itertools import combinations
from math import lcm, prod

import numpy as np
import numpy.typing as npt

from dse.analysis.validity import has_conditional_home
from dse.analysis.views import Case, allowed_options
from dse.encode.tuning import AdditiveTables
from dse.space.model.space import Space

MOST_VALUE = 2**60


def additive_parts(space: Space, cases: Sequence[Case[Fraction]], tuning: AdditiveTables) -> list[list[Case[Fraction]]]:
    """Tables over disjoint sets of decisions whose sum is the given table; the table itself where there are none.

    Two decisions belong together when the difference that one makes depends on the other (their mixed second
    difference is not 0 everywhere). A table stays whole where in one of the smaller ones a design would have no case,
    or have to use a decision that it may leave out.
    """
    decisions = sorted({decision for case in cases for decision, _ in case.conditions})
    may_be_unused = {index for index in decisions if has_conditional_home(space.decisions[index], index)}
    options = {decision: list(allowed_options(space, decision)) for decision in decisions}
    values = _values(options, cases, tuning.most_cells) if tuning.is_on else None
    groups = _groups(decisions, values) if values is not None else []
    if len(groups) < 2:
        return [list(cases)]
    first = {(decision, listed[0]) for decision, listed in options.items()}
    parts = []
    for number, members in enumerate(groups):
        origin = cases[0].value if number else Fraction(0)  # it counts once, in the first part
        part = [
            Case(tuple(item for item in case.conditions if item[0] in members), case.value - origin)
            for case in cases
            if all(item[0] in members or item in first for item in case.conditions)
        ]
        if not _have_a_case(cases, part, may_be_unused & members, tuning.most_pairs):
            return [list(cases)]
        if any(case.value for case in part):
            parts.append(part)
    return parts


def _have_a_case(
    cases: Sequence[Case[Fraction]], part: Sequence[Case[Fraction]], may_be_unused: Set[int], most_pairs: int
) -> bool:
    """Whether each design, which has one of the `cases`, has one in a table over some of their decisions.

    What a case leaves out a design may leave undecided, where it `may_be_unused`: what fits the case must not ask it.
    """
    if all(may_be_unused <= {decision for decision, _ in case.conditions} for case in cases):
        return True
    if len(cases) * len(part) > most_pairs:
        return False
    cases_of = [(dict(one.conditions), [pair for pair in one.conditions if pair[0] in may_be_unused]) for one in part]
    for case in cases:
        taken = dict(case.conditions)
        for conditions, uncertain in cases_of:
            fits = all(taken.get(decision, option) == option for decision, option in conditions.items())
            if fits and not all(decision in taken for decision, _ in uncertain):
                return False
    return True


def _values(
    options: Mapping[int, Sequence[int]], cases: Sequence[Case[Fraction]], most_cells: int
) -> npt.NDArray[np.int64] | None:
    """The table as an array with an axis for each decision, in a common denominator.

    None where that is no use: one decision, too many cells or too large numbers, or a combination without a value.
    """
    shape = tuple(len(listed) for listed in options.values())
    if len(shape) < 2 or prod(shape) > most_cells:
        return None
    scale = lcm(*(case.value.denominator for case in cases))
    counts = [int(case.value * scale) for case in cases]
    if max(map(abs, counts)) >= MOST_VALUE:
        return None
    values = np.zeros(shape, dtype=np.int64)
    is_known = np.zeros(shape, dtype=bool)
    for case, count in zip(cases, counts, strict=True):
        taken = dict(case.conditions)
        cell = tuple(
            listed.index(taken[decision]) if decision in taken else slice(None) for decision, listed in options.items()
        )
        values[cell] = count
        is_known[cell] = True
    return values if is_known.all() else None


def _groups(decisions: Sequence[int], values: npt.NDArray[np.int64]) -> list[frozenset[int]]:
    """The decisions in groups between which there is no interaction."""
    groups = {decision: frozenset((decision,)) for decision in decisions}
    for (one, a), (other, b) in combinations(enumerate(decisions), 2):
        if groups[a] != groups[b] and np.diff(np.diff(values, axis=one), axis=other).any():
            joined = groups[a] | groups[b]
            groups.update(dict.fromkeys(joined, joined))
    return list(dict.fromkeys(groups.values()))
