"""Limits as an explanation shows them."""

from __future__ import annotations

from fractions import Fraction
from math import ceil

from dse.analysis.limits import build_limit
from dse.analysis.measures import PPM, build_measure
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import View
from dse.search.feasibility.oracle import Member
from dse.space.model.criteria import Requirement
from dse.space.model.space import Space
from dse.support.units import Quantity, convert, format_duration, format_number


def own_limit(space: Space, member: Member) -> tuple[str, Fraction | None]:
    """The unit and the limit of a requirement as an explanation shows them; nothing for other members.

    The limit is exact: ppm for a share of a core, else in the base unit of the metric; a deadline is shown as lateness
    against 0 ns. Rules and fixed decisions give an empty unit and None.
    """
    if not isinstance(member, Requirement):
        return "", None
    if member.metric.key == "deadline":
        return "ns", Fraction(0)
    limit = member.limit.value * factor(space, member)
    return "ppm" if member.is_share else build_measure(space, member.metric).unit, limit


def factor(space: Space, member: Requirement) -> Fraction:
    """The number of shown units in one coherent unit of the limit.

    1 000 000 for shares (ppm), 10⁹ for deadlines (ns), else the base units of the metric in one unit of the limit as
    written.
    """
    if member.is_share:
        return Fraction(PPM)
    if member.metric.key == "deadline":
        return Fraction(NS_PER_S)
    one = Quantity(Fraction(1), member.limit.dimension, member.limit.unit)
    any_design = View(())  # such a bound is the same in every design
    return build_limit(space, Requirement("", member.metric, "<=", one)).bound(any_design)


def rewritten(member: Requirement, limit: Fraction, *, as_stated: bool = False) -> str:
    """The requirement as it may be written so that the others leave a design; "" for an implied one.

    With `as_stated` it is the statement that the requirement is a part of.
    """
    if member.implied:
        return ""
    if member.metric.key == "deadline":
        return f"{member.text} + {format_duration(ceil(limit * NS_PER_S))}"
    operator = {"<": "<=", ">": ">="}.get(member.operator, member.operator)
    quantity = Quantity(limit, member.limit.dimension, member.limit.unit)
    written = member.limit.dimension is not None and member.limit.unit != ""
    number = convert(quantity, member.limit.unit) if written else limit
    name = member.stated.partition(member.operator)[0].strip() if as_stated else member.metric.name
    return f"{name} {operator} {format_number(number)} {member.limit.unit}".rstrip()
