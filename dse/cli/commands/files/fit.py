"""``dse fit``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from dse.cli.common import ExistingPath, all_option, check_writable, console, in_time, json_option, screen_lines
from dse.cli.grouping import GroupedCommand
from dse.cli.pages import answer, page_path, report_option, write_page_figures
from dse.cli.printing import say

REST = "-o FILE writes the catalogue, with every remark, for problem files to include; --all prints it."


def _pairs(ctx: click.Context, param: click.Parameter, values: Sequence[str]) -> dict[str, str]:
    """``NAME=VALUE``, several times."""
    pairs: dict[str, str] = {}
    for value in values:
        name, separator, rest = (part.strip() for part in value.partition("="))
        if not separator or not name or not rest:
            raise click.BadParameter(f"{value!r}: expected NAME=VALUE", ctx, param)
        pairs[name] = rest
    return pairs


@click.command("fit", cls=GroupedCommand)
@click.argument("files", nargs=-1, required=True, type=ExistingPath(dir_okay=False))
@click.option(
    "--method",
    type=click.Choice(["ols", "envelope", "quantile"]),
    default="ols",
    show_default=True,
    help="Least squares, lines that enclose every sample, or quantile lines.",
)
@click.option("--quantiles", show_default="1 % .. 99 %", metavar="LOW..HIGH", help="Quantiles, with --method quantile.")
@click.option(
    "--round-trip/--one-way",
    default=None,
    help="Times are round trips, which count half, or one way; default: by the name of the column.",
)
@click.option("--sizes", metavar="LOW..HIGH", help="Use messages of these sizes only, e.g. '0 B .. 3 KB'.")
@click.option("--without", multiple=True, metavar="LOW..HIGH", help="Leave messages of these sizes out.")
@click.option("--name", default="", metavar="NAME", help="Name of the bus type, where no column names the transport.")
@click.option(
    "--platform", "platforms", multiple=True, callback=_pairs, metavar="NAME=TYPE", help="Processor type of a platform."
)
@click.option("--column", "columns", multiple=True, callback=_pairs, metavar="ROLE=NAME", help="Column of a role.")
@click.option(
    "--unit", "units", multiple=True, callback=_pairs, metavar="ROLE=UNIT", help="Unit of a column with plain numbers."
)
@click.option(
    "--extremes",
    type=click.IntRange(10, 10**12),
    metavar="N",
    help="Also extrapolate to the value that one sample in N exceeds, by extreme value theory.",
)
@click.option("-o", "--output", metavar="PATH", help="Write the catalogue, a file that problem files include.")
@click.option("--figures", "figures", metavar="DIR", help="Write the plots into this folder, as SVG.")
@all_option
@report_option
@json_option
@in_time
def command(
    files: tuple[str, ...],
    method: str,
    quantiles: str | None,
    round_trip: bool | None,
    sizes: str | None,
    without: tuple[str, ...],
    name: str,
    platforms: dict[str, str],
    columns: dict[str, str],
    units: dict[str, str],
    extremes: int | None,
    output: str | None,
    figures: str | None,
    every: bool,
    report: str | None,
    json_path: str | None,
) -> int:
    """Measurements (CSV) as transmission times of bus types, or execution times of thread types.

    A row is one sample (delay_us), or the figures of many (min_us, max_us, mean_us, stddev_us); size_bytes makes them
    transmission times, thread or component execution times; platform and transport tell several apart.

    Roles of columns: size, sample, min, max, mean, median, deviation, count, platform, transport, thread, component.
    """
    if output == "-" and json_path == "-":
        raise click.UsageError("only one of -o and --json can go to standard output")
    further = [_samples_path(output)] if output not in (None, "-") else []
    check_writable(output, json_path, page_path(report), *further)
    from dse.fitting.fitted import samples_table
    from dse.questions.verbs.fit import fit

    fitted = fit(
        *files,
        method=method,
        quantiles=quantiles,
        round_trip=round_trip,
        sizes=sizes,
        without=without,
        name=name,
        extremes=extremes,
        columns=columns,
        units=units,
        platforms=platforms,
    )
    to_file = output is not None and output != "-"
    has_samples = any(len(item.summary.samples_ns) for item in fitted.executions)
    samples = _samples_path(output) if to_file and has_samples else None
    text = fitted.to_yaml(samples.name if samples is not None else None)
    from dse.report.content.fit import fit_page
    from dse.report.output import page_text
    from dse.report.page import Section, texts
    from dse.report.terminal import page_height

    page = fit_page(fitted)
    beside = None if samples is None else str(samples)
    report_text = report, lambda: page_text(page, report or "")
    tables = (beside, lambda: samples_table(fitted)), (output, lambda: text), (json_path, fitted.to_json), report_text
    screen = console()
    is_below = output is None and (every or page_height(screen, page) + text.count("\n") < screen_lines(screen))
    rest = Section("rest", "", () if is_below or output is not None else tuple(texts(REST)))
    answer(replace(page, sections=(*page.sections, rest)), *tables, every=every)
    if is_below and json_path != "-":
        say(f"\n{text}".removesuffix("\n"))
    write_page_figures(figures, page, Path(files[0]).stem)
    return 0


def _samples_path(output: str | None) -> Path:
    """Where the samples of execution times go, beside the catalogue."""
    assert output is not None
    return Path(output).with_suffix(".samples.csv")
