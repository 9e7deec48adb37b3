"""``dse sizes``."""

from __future__ import annotations

from collections.abc import Sequence

import click

from dse.cli.common import ExistingPath, all_option, check_writable, in_time, json_option, quiet_option
from dse.cli.grouping import GroupedCommand
from dse.cli.pages import answer, page_path, report_option

LENGTH = "expected PATH=NUMBER, such as poses=32 or header.frame_id=8, with at most 12 digits"


def _lengths(ctx: click.Context, param: click.Parameter, values: Sequence[str]) -> dict[str, int]:
    """``PATH=N``, several times."""
    numbers: dict[str, int] = {}
    for value in values:
        path, _, number = (part.strip() for part in value.partition("="))
        if not path or not (number.isascii() and number.isdecimal()) or len(number) > 12:
            raise click.BadParameter(f"{value!r}: {LENGTH}", ctx, param)
        numbers[path] = int(number)
    return numbers


@click.command("sizes", cls=GroupedCommand)
@click.argument("names", nargs=-1, metavar="[TYPE]...")
@click.option(
    "--definitions",
    multiple=True,
    type=ExistingPath(),
    metavar="PATH",
    help="Message definitions (.msg, .srv, .action, .idl), or a folder or workspace with them.",
)
@click.option(
    "--bag",
    "bags",
    multiple=True,
    type=ExistingPath(),
    metavar="PATH",
    help="Measure the messages of this bag.",
)
@click.option(
    "--length",
    "lengths",
    multiple=True,
    callback=_lengths,
    metavar="PATH=N",
    help="Number of elements of an array or string.",
)
@click.option(
    "--distribution",
    default="ros2_humble",
    show_default=True,
    metavar="NAME",
    help="ROS distribution, which decides the known types and the serialisation (ros1_noetic: ROS 1, else CDR).",
)
@all_option
@report_option
@json_option
@quiet_option
@in_time
def command(
    names: tuple[str, ...],
    definitions: tuple[str, ...],
    bags: tuple[str, ...],
    lengths: dict[str, int],
    distribution: str,
    every: bool,
    report: str | None,
    json_path: str | None,
    quiet: bool,
) -> int:
    """Sizes of ROS messages: by the rule of the report, and serialised.

    TYPE is such as sensor_msgs/Imu; all types of the definitions (or of the distribution) where none is named.
    """
    check_writable(json_path, page_path(report))
    from dse.questions.verbs.sizes import sizes

    measured = sizes(*names, definitions=definitions, bags=bags, lengths=lengths, distribution=distribution)
    from dse.report.content.sizes import sizes_page

    answer(sizes_page(measured), (json_path, measured.to_json), report=report, every=every, quiet=quiet)
    return 0
