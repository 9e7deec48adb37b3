"""Verdicts on each design of a front with response times, where the front itself leaves them out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Annotated, Any, Literal

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
from dse.support.json_fields import Data, Json, Unit


@dataclass(frozen=True)
class Broken:
    """A requirement that a design misses when response times count.

    Values and limits are exact, in base units of the metric.
    """

    requirement: Annotated[str, "The requirement in the words of the problem."]
    value: Annotated[Fraction | None, "What the design has, in `unit`; null where it is unbounded."]
    limit: Annotated[Fraction, "The limit, in `unit`."]
    unit: Annotated[Unit, "What the two figures count."]
    unbounded: Annotated[tuple[str, ...], "The threads in it whose response time has no bound."] = ()

    @classmethod
    def of(cls, miss: Miss) -> Broken:
        """The verdict of the referee, without the number that stands for no bound.

        `value` is None where a response time in the metric has no bound; `unbounded` names the threads.
        """
        verdict = miss.verdict
        value = None if miss.unbounded else verdict.value
        return cls(verdict.requirement.shown, value, verdict.limit, verdict.unit, miss.unbounded)


@dataclass(frozen=True)
class Contended:
    """The requirements that a design violates when threads wait for the CPU.

    For results whose search counted execution times alone. `broken` is what the design violates on its own cores
    (stated, decided, else those of first-fit), empty where it meets every requirement there. `decisions` are other
    cores and best orders with which it meets every requirement. `is_open` says that the time limit came before it was
    known whether there are any.
    """

    JSON_NAME = "Contention"
    WRITTEN = ("status", "broken", "decisions")

    broken: Annotated[tuple[Broken, ...], "What it misses then on its own cores: stated, decided, else by first-fit."]
    decisions: Annotated[
        Mapping[str, str],
        "Other cores (and best orders) with which it keeps every requirement, by decision.",
        Json(default={}),
    ] = field(default_factory=dict)
    is_open: bool = False

    @property
    def status(self) -> Literal["kept", "broken", "unknown"]:
        """The verdict on the design with waiting counted: whether it keeps every requirement.

        ``kept``: on its own cores, or with the `decisions`; ``broken``: on no cores that may be chosen, which is
        proved (of `dse analyse`, and of the fronts of a sweep: on its own cores); ``unknown``: the time limit came
        before.
        """
        if self.decisions or not self.broken:
            return "kept"
        return "unknown" if self.is_open else "broken"


NOT_JUDGED = {"status": "unknown", "broken": []}
"""The JSON verdict on a design that was not examined."""


def judge(referee: ContentionReferee, design: Design) -> Contended:
    """Judge one valid design with contention counted, on its own cores.

    Raises
    ------
    OutOfTime
        when a limit of time (`dse.support.timelimit.until`) is up.
    """
    return contended(referee.judge(design))


def contended(judged: Judged) -> Contended:
    """The verdicts of the referee on a design with waiting counted.

    One `Broken` for each requirement that the design misses with waiting counted; none means that it keeps all.
    """
    return Contended(tuple(Broken.of(miss) for miss in judged.misses))


class ContentionBasis(Data):
    """The effects that the fronts of a study leave out, and the basis on which their designs are judged."""

    left_out: Annotated[bool, "Whether response times are left out of the latencies."]
    cores: Annotated[
        list[Literal["stated", "decided", "first-fit"]], "Who chooses the cores that threads are judged on."
    ]


def basis_dict(space: Space) -> dict[str, Any] | None:
    """The `ContentionBasis` of a study's fronts as JSON; None where the fronts leave out nothing.

    Whether response times are left out, and who chooses the cores.
    """
    if with_contention(space) is None:
        return None
    return {"left_out": is_left_out(space), "cores": sorted(core_origins(space))}


@dataclass(frozen=True)
class CoreUse:
    """How the cores of a processor are used."""

    partition: Annotated[
        Literal["stated", "found", "none", "undecided"],
        "`stated` where every core is stated or decided; of threads without one whether some way to put them on cores "
        "keeps what is required of each core: found, none (proved absent), or undecided.",
    ]
    used: Annotated[list[Fraction], "What each core carries, in ppm of it, core 1 first."]


def core_use(space: Space, design: Design) -> dict[str, CoreUse]:
    """The use of the cores of each processor with several cores, by the name of the processor.

    Processors with one core are left out. Loads are exact, in ppm of one core, by the stated, decided or first-fit
    assignment of threads.
    """
    return {
        space.processors[number].name: CoreUse(
            item.status if item.is_open else "stated",
            [load * PPM for load in item.loads],
        )
        for number, item in placements_of(space, design).items()
        if item.cores
    }
