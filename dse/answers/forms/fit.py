"""The form of what `dse fit` makes of measurements: ``dse-fit/1``."""

from __future__ import annotations

from typing import Annotated, Literal

from dse.answers.forms.base import Figure, Form, Number, Of, field


class FitRemark(Form):
    """Something to know before the figures are used."""

    kind: str = field("What it is about, such as `spread`, `saturated`, `negative part`, `sample maximum`.")
    text: str = field("In words.")
    limit_bytes: int | None = field("The size at or below which messages stay clear of it; null where there is none.")


class Measured(Form):
    """The samples of one size or thread, in a few figures (ns); of round trips, half of them."""

    size_bytes: int | None = field("The size of the messages; null for execution times.")
    min_ns: Figure = field("The least sample.")
    max_ns: Figure = field("The greatest sample.")
    mean_ns: Number | None = field("Their mean; null where the file does not say it.")
    median_ns: Number | None = field("Their median; null where the file does not say it.")
    deviation_ns: Number | None = field("Their standard deviation; null where the file does not say it.")
    count: int | None = field("How many there are; null where the file does not say it.")


class FittedTail(Form):
    """An extreme-value fit beside a sample maximum: an extrapolation, no bound."""

    size_bytes: int | None = field("The size of the messages; null for execution times.")
    model: str = field("`block maxima (GEV)` or `peaks over threshold (GPD)`.")
    shape: Number = field("The shape; above 0 the tail has no end.")
    location_ns: Number = field("The location, or the threshold.")
    scale_ns: Number = field("The scale.")
    level_ns: Number = field("What one sample in `one_in` exceeds, if the model holds.")
    one_in: int = field("One sample in so many.")
    values: int = field("How many block maxima or values beyond the threshold were fitted.")
    p_value: Number = field("Of a Kolmogorov-Smirnov test of the half that was left out of a fit for it.")
    lag_1: Number = field("The correlation of samples that follow each other; the models assume none.")


class FittedLine(Form):
    """A line through the minima or maxima of the sizes, as the method gives it, and how well it fits."""

    fixed_ns: Figure = field("The time of an empty message.")
    per_byte_ns: Figure = field("The time for each byte.")
    r_squared: Number | None = field("The share of the variance that the line explains; null where there is none.")
    rms_ns: Number = field("The root of the mean squared residual.")
    beyond: int = field("How many minima lie below, or maxima above, the line.")
    most_beyond_ns: Figure = field("By how much at most.")
    at_bytes: int | None = field("At which size that is; null where nothing lies beyond.")


class FittedTransport(Form):
    """A transport on a platform."""

    transport: str = field("Its name: of the bus type.")
    platform: str = field("The processor type; empty where the files do not say it.")
    fixed_ns: list[Figure] = field("Least and greatest fixed time, rounded outwards, as the catalogue has them.")
    per_byte_ns: list[Figure] = field("Least and greatest time per byte, likewise.")
    sizes_bytes: list[int] = field("From and to which size of messages they hold, as the catalogue has it.")
    low: FittedLine = field("The line of the least times.")
    high: FittedLine = field("The line of the greatest times.")
    sizes: Annotated[list[Measured], Of("summaries")] = field("What was fitted, by size.")
    left_out: list[int] = field("Sizes that were not used.")
    remarks: list[FitRemark] = field("What is to be said of it.")
    tails: list[FittedTail] = field("Extreme-value fits, where they were asked for.")


class FittedExecution(Form):
    """The execution times of a callback on a platform."""

    name: str = field("The thread type.")
    platform: str = field("The processor type; empty where the files do not say it.")
    measured: Annotated[Measured, Of("summary")] = field("Its samples in a few figures.")
    is_single_sample: Annotated[bool, Of("summary.is_single")] = field("Whether there is only one.")
    remarks: list[FitRemark] = field("What is to be said of it.")
    tails: list[FittedTail] = field("Extreme-value fits, where they were asked for.")


class FitForm(Form):
    """The outcome of `dse fit`: figures of a problem file from measurements."""

    format: Literal["dse-fit/1"] = field("The name of this format.")
    files: list[str] = field("The files of measurements, as they were given.")
    method: Literal["ols", "envelope", "quantile"] = field("How lines are drawn.")
    quantiles: list[Figure] | None = field("The shares below the lower and the upper line; null for other methods.")
    round_trip: Annotated[bool, Of("is_round_trip")] = field("Whether times were halved.")
    transports: list[FittedTransport] = field("Transmission times, by transport and platform.")
    executions: list[FittedExecution] = field("Execution times, by thread and platform.")
    unused_columns: Annotated[list[str], Of("unused")] = field("Columns that say nothing for this.")
    catalogue: str = field("The catalogue, as YAML.")
