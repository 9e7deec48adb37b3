"""``dse simulate``."""

from __future__ import annotations

from typing import Any

import click

from dse.cli.commands.analyse import named
from dse.cli.common import (
    all_option,
    check_writable,
    json_option,
    load_told,
    problem_argument,
    quiet_option,
    time_limit_option,
)
from dse.cli.grouping import GroupedCommand
from dse.cli.options import question_of, question_options
from dse.cli.pages import answer, page_path, report_option
from dse.support.timelimit import TimeLimit, until


@click.command("simulate", cls=GroupedCommand)
@problem_argument()
@click.option(
    "--design",
    multiple=True,
    metavar="'DECISION = OPTION'",
    help="The design: RESULT.json#ID (an alternative, with its question), or a decision other than the baseline's.",
)
@click.option(
    "--duration", metavar="DURATION", help="Simulated time of each run, e.g. 10s; default: as long as the periods need."
)
@click.option(
    "--offsets",
    type=click.Choice(["worst", "random", "zero"]),
    default="worst",
    show_default=True,
    help="Release offsets: search the worst ones of each flow, draw them, or release everything at once.",
)
@click.option(
    "--runs",
    type=click.IntRange(1, 10**6),
    default=40,
    show_default=True,
    help="Number of runs; of each flow where worst offsets are searched.",
)
@click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True, help="Seed of all random numbers."
)
@click.option(
    "--execution",
    type=click.Choice(["random", "max", "min"]),
    default="random",
    show_default=True,
    help="Execution and transmission times: random in their ranges, longest, or shortest.",
)
@click.option(
    "--drift",
    type=click.IntRange(0, 100_000),
    default=0,
    metavar="PPM",
    help="Largest drift of clocks, in parts per million.",
)
@click.option(
    "--contention/--no-contention", default=True, help="Threads wait for their core (default), or have a core each."
)
@click.option(
    "--bus-contention", is_flag=True, help="A physical bus carries one message at a time, in order of arrival."
)
@click.option(
    "--endless-queues", is_flag=True, help="Every queue holds whatever arrives, also where its size is stated."
)
@time_limit_option("with the runs that were made")
@question_options
@all_option
@report_option
@json_option
@quiet_option
def command(
    file: str,
    design: tuple[str, ...],
    duration: str | None,
    offsets: Any,
    runs: int,
    seed: int,
    execution: Any,
    drift: int,
    contention: bool,
    bus_contention: bool,
    endless_queues: bool,
    time_limit: TimeLimit,
    every: bool,
    report: str | None,
    json_path: str | None,
    quiet: bool,
    **options: Any,
) -> int:
    """Simulate a design in time, and compare every observation with its analysed bounds.

    Exit code 4 when an observation lies outside the bounds, whatever the reason.
    """
    check_writable(json_path, page_path(report))
    from dse.questions.verbs.simulate import simulate

    with until(time_limit):
        chosen = named(design, load_told(file).ask(**question_of(options)))
    simulation = simulate(
        chosen.problem,
        chosen.texts,
        duration=duration,
        offsets=offsets,
        runs=runs,
        seed=seed,
        execution=execution,
        drift_ppm=drift,
        contention=contention,
        bus_contention=bus_contention,
        endless_queues=endless_queues,
        time_limit_s=time_limit.rest_s,
    )
    from dse.report.content.simulate import simulation_page

    page, lead = simulation_page(simulation), f"{simulation.space.name}: {chosen.called}, simulated"
    answer(page, (json_path, simulation.to_json), report=report, every=every, quiet=quiet, lead=lead)
    return simulation.exit_code
