"""The forms of sensitivity studies: ``dse-sensitivity/1``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dse.answers.forms.base import Decisions, Figure, Form, Number, Of, Unit, field
from dse.answers.forms.studies import BUS_WAITING, StudiedProblem


class Break(Form):
    """Where a requirement breaks in one direction."""

    last: Figure = field("The last value that holds.")
    first: Figure | None = field("The first whole one that breaks; null where every value beyond `last` does.")
    requirement: str = field("The requirement that breaks.")
    thread: str | None = field("The thread by which it breaks, where that is told.")


class Margin(Form):
    """How far one input may move, alone."""

    path: str = field("The input, as a path of the problem file.")
    unit: Unit = field("What its figures count.")
    nominal: Figure = field("Its value in the problem.")
    below: Break | None = field("What breaks when it decreases; null where nothing does.")
    above: Break | None = field("What breaks when it increases; null where nothing does.")
    searched: list[Figure] = field("How far down and up it was looked for.", min_length=2, max_length=2)


class Scaling(Form):
    """All execution times multiplied by one factor."""

    factor: Figure | None = field("The greatest with which all requirements hold; null where none breaks any.")
    requirement: str | None = field("The requirement that breaks beyond it.")
    thread: str | None = field("The thread by which it breaks, where that is told.")
    exact: Annotated[bool, Of("is_exact")] = field("Whether the factor is the exact border; else it is found to 1e-9.")
    by_requirement: dict[str, Figure | None] = field("The factor of each requirement alone.")
    utilisations_ppm: Annotated[dict[str, Figure], Of("utilisations")] = field(
        "The utilisation of each processor at the factor."
    )
    searched_to: Annotated[Figure, Of("most")] = field("The greatest factor that was looked at.")


class Bar(Form):
    """A bar of a tornado chart: one metric at both ends of one input."""

    metric: str = field("The metric.")
    unit: Unit = field("What its figures count.")
    path: str = field("The input.")
    input_unit: Unit = field("What its figures count.")
    inputs: list[Figure] = field("The low and the high value of the input.", min_length=2, max_length=2)
    values: list[Figure | None] = field("The metric at these; null where it is unbounded.", min_length=2, max_length=2)
    nominal: Figure | None = field("The metric at the stated value; null where it is unbounded.")
    swing: Figure | None = field("The length of the bar; null where an end is unbounded.")


class Chance(Form):
    """How likely a design meets its requirements when the uncertain inputs vary."""

    decisions: Decisions = field("The design.")
    all_met: Number = field("The share of the samples in which every requirement holds.")
    standard_error: Number = field("Its standard error.")
    by_requirement: dict[str, Number] = field("The share in which each requirement holds.")


class Indices(Form):
    """What of a metric's variation each uncertain input explains."""

    output: str = field("The metric.")
    unit: Unit = field("What its figures count.")
    first: dict[str, Number] = field("The first-order Sobol index of each input.")
    total: dict[str, Number] = field("The total Sobol index of each input.")
    effect: dict[str, Number] = field("The mean absolute change when the input goes from one end to the other.")
    spread: dict[str, Number] = field("The standard deviation of that change.")
    over: dict[str, Annotated[list[Number], Field(min_length=2, max_length=2)]] = field("Both ends of each input.")


class Uncertain(Form):
    """What stated uncertainties do."""

    inputs: dict[str, str] = field("The uncertain inputs, each with what is stated, in words.")
    samples: int = field("The number of samples.")
    seed: int = field("The seed.")
    design: Annotated[Chance, Of("design_chance")] = field("The chance of the studied design.")
    alternatives: Annotated[list[Chance], Of("chances")] = field("The chances of the designs of the front.")
    indices: list[Indices] = field("What explains the variation of each metric.")
    unbounded: list[str] = field(
        "Metrics without indices: a response time in them has no bound for some of the stated values.", default=[]
    )


class SensitivityForm(Form):
    """The outcome of `dse sensitivity`: how one design's verdicts and metrics move with its inputs."""

    format: Literal["dse-sensitivity/1"] = field("The name of this format.")
    problem: StudiedProblem = field("Which problem was studied.")
    decisions: Decisions = field("The studied design.")
    broken: list[str] = field("The requirements that it breaks as it is; margins look at the others.")
    margins: list[Margin] = field("How far each input may move, alone.")
    execution_times: Annotated[Scaling | None, Of("scaling")] = field(
        "All execution times together; null where time was too short."
    )
    swing: str = field("Over what the bars go.")
    tornado: Annotated[list[Bar], Of("bars")] = field("How far each input moves each metric.")
    uncertainty: Annotated[Uncertain | None, Of("uncertain")] = field(
        "What stated uncertainties do; null where none are stated."
    )
    left_out: list[str] = field("What the time limit left no time for.", default=[])
    bus_waiting: Literal["not counted"] | None = field(BUS_WAITING, earlier=None)
    files: dict[str, str] = field(
        "The text of the problem file, of what it includes and of its samples, by name.", earlier=None
    )
