"""What each design of a front keeps when response times count, where the front itself leaves them out."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.diagnosis.front_verdicts import (
    ContentionReferee,
    Judged,
    Miss,
    core_origins,
    is_left_out,
    placements_of,
    with_contention,
)
from dse.analysis.terms import PPM
from dse.space.model.space import Design, Space


@dataclass(frozen=True)
class Broken:
    """A requirement that a design misses: `value` (None: unbounded) against `limit`, in `unit`.

    `unbounded` names the threads in it whose response time has no bound.
    """

    requirement: str
    value: Fraction | None
    limit: Fraction
    unit: str
    unbounded: tuple[str, ...] = ()

    @classmethod
    def of(cls, miss: Miss) -> Broken:
        """What the referee found, without the number that stands for no bound."""
        verdict = miss.verdict
        value = None if miss.unbounded else verdict.value
        return cls(verdict.requirement.shown, value, verdict.limit, verdict.unit, miss.unbounded)


@dataclass(frozen=True)
class Contended:
    """What a design breaks when response times count; it keeps every requirement where that is nothing."""

    broken: tuple[Broken, ...]

    @property
    def status(self) -> str:
        """``kept`` or ``broken``."""
        return "broken" if self.broken else "kept"


NOT_JUDGED = {"status": "not checked", "broken": []}
"""What the JSON of a result says of a design that was not looked at."""


def judge(referee: ContentionReferee, design: Design) -> Contended:
    """What one valid design keeps.

    Raises
    ------
    OutOfTime
        when a limit of time (`dse.support.timelimit.until`) is up.
    """
    return contended(referee.judge(design))


def contended(found: Judged) -> Contended:
    """What the referee said of a design."""
    return Contended(tuple(Broken.of(miss) for miss in found.misses))


def basis_dict(space: Space) -> dict[str, Any] | None:
    """What the fronts of a study leave out and are judged by, for JSON; None where they leave out nothing.

    Whether response times are left out, and who chooses the cores.
    """
    if with_contention(space) is None:
        return None
    return {"left_out": is_left_out(space), "cores": sorted(core_origins(space))}


def core_use(space: Space, design: Design) -> dict[str, tuple[str, list[Fraction]]]:
    """Whether open threads of each processor with several cores have a partition, and what each core carries (ppm).

    The first is ``stated`` where every core is stated or decided; else ``found``, ``none`` (proved), ``undecided``.
    """
    return {
        space.processors[number].name: (
            item.status if item.is_open else "stated",
            [load * PPM for load in item.loads],
        )
        for number, item in placements_of(space, design).items()
        if item.cores
    }
