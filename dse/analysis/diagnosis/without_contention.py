"""Requirements as if no thread waited for another: what a design would have to keep at the least.

Each response time counts as long as its job takes alone (the lower end of `Term.ends`). A design that keeps a limit
keeps it like this, too, so that what is impossible like this is impossible however threads wait.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from dse.analysis.limits import Limit, build_limit
from dse.analysis.terms import Measure, Term, extreme_term
from dse.space.model.criteria import Requirement
from dse.space.model.space import Space


def uncontended_limit(space: Space, requirement: Requirement, *, is_asked: bool = True) -> Limit:
    """The limit of a requirement as if no thread waited for another; `is_asked` as for `build_limit`.

    An upper limit in which response times count is one on the least that its figure may be; of lower and exact ones
    nothing is demanded.
    """
    limit = build_limit(space, requirement, is_asked=is_asked)
    terms = limit.measure.terms
    if not any(map(_waits, terms)):
        return limit
    if not requirement.is_upper:
        return _nothing(limit)
    return replace(limit, measure=replace(limit.measure, terms=tuple(map(_least, terms))), is_elsewhere=True)


def _waits(term: Term) -> bool:
    """Whether a response time is in a summand."""
    inner = term.extreme.sums if term.extreme is not None else ()
    return term.ends is not None or any(_waits(item) for terms in inner for item in terms)


def _least(term: Term) -> Term:
    """A summand that is never more than the given one; the same where no response time is in it."""
    if term.extreme is not None and _waits(term):
        return extreme_term(term.label, term.extreme.changed(_least))
    ends = term.ends
    return term if ends is None else Term(term.label, lambda view: ends(view)[0], component=term.component)


def _nothing(limit: Limit) -> Limit:
    """A limit that every design keeps."""
    kept = replace(limit.requirement, operator="<=")
    nothing = Measure(limit.measure.metric, limit.measure.unit, (), 1)
    return Limit(kept, nothing, lambda view: Fraction(0), is_elsewhere=True)
