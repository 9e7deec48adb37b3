"""``dse export``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dse.cli.common import ExistingPath, check_writable, in_time, load_told, tell_carried, write_text
from dse.cli.grouping import GroupedCommand
from dse.cli.printing import tell
from dse.support.errors import UsageError, about

if TYPE_CHECKING:
    from dse.questions.verbs.export import Format

FORMATS: tuple[Format, ...] = ("problem", "ros2", "cie", "pinning", "dbc", "dot", "graphml", "aadl", "svg")


LINES_WITHOUT_ROWS = 3
MOST_LOOKED_AT = 4000
FILE = ExistingPath(dir_okay=False, allow_dash=True)


class AlternativeId(click.ParamType[tuple[str, str]]):
    """A result file and the id of an alternative in it: ``RESULT.json#ID``, or the file alone."""

    name = "result"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        """The path, and the id ("" where there is none)."""
        file, mark, number = str(value).rpartition("#")
        if not mark or Path(str(value)).exists():
            file, number = str(value), ""
        return str(FILE.convert(file, param, ctx)), number


@click.command("export", cls=GroupedCommand)
@click.argument("result", metavar="RESULT#ID", type=AlternativeId())
@click.option("--alternative", metavar="ID", help="The id, where RESULT alone is given: the same as RESULT#ID.")
@click.option(
    "--format", "form", type=click.Choice(FORMATS), default="problem", show_default=True, help="What to write."
)
@click.option("-o", "--output", default="-", metavar="PATH", help="The file to write; standard output if left out.")
@click.option(
    "--problem",
    type=ExistingPath(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="The problem file, if it has moved.",
)
@click.option("--response-times", is_flag=True, help="AADL: the computed response times as SEI::Response_Time.")
@in_time
def command(
    result: tuple[str, str],
    alternative: str | None,
    form: Format,
    output: str,
    problem: str | None,
    response_times: bool,
) -> int:
    """A chosen design: the problem file with its decisions fixed, for ROS 2, as Graphviz, GraphML, AADL or a drawing.

    It is named as everywhere: r.json#3 is an alternative of a result, r.json#3.1 another design of it. A problem file
    or model alone can be drawn (svg), with its open decisions marked.

    For ROS 2 there are the parameters that nodes declare (ros2); cores and priorities go into a file of their own that
    is written beside it (.pinning.csv), or for the callback-isolated executor (cie).

    The problem file keeps its comments, has the design as its baseline, and is read back before it is handed out:
    `dse analyse` gives the same figures for it, or lower ones where its cores and priorities, which it states, make
    bounds of chains less (docs/semantics.md, section 4.9). As AADL it is an implementation that extends the model that
    the problem is of, with what was decided; of a problem file it is a whole model, with what AADL has no word for in a
    property set. `pinning` is a table (CSV) of cores and priority levels, on which response times hold. `dbc` has the
    messages of a CAN bus with their identifiers, stated or chosen, lengths, senders and cycle times. Neither the result
    nor its problem file is overwritten.
    """
    file, number = result
    if number and alternative not in (None, number):
        raise click.UsageError(f"{file}#{number} and --alternative {alternative}: name one alternative")
    chosen = number or alternative
    if not chosen and form != "svg":
        raise click.UsageError(f"name an alternative: {file}#ID")
    check_writable(output, replaces_problems=True)
    from dse.questions.reopen import reopen
    from dse.questions.verbs.export import export

    if not chosen:
        write_text(output, export(load_told(file), form=form))
        return 0
    opened = reopen(file, problem)
    tell_carried(opened.problem.file, is_carried=opened.problem.is_carried)
    folder = Path() if output == "-" else Path(output).parent
    with about(file):
        text = export(opened, chosen, form, folder, response_times=response_times)
    write_text(output, text)
    if form == "aadl" and output != "-":
        _write_property_set(Path(output), text)
    if form == "ros2" and output != "-":
        _write_pinning(Path(output).with_suffix(".pinning.csv"), export(opened, chosen, "pinning", folder))
    return 0


def _write_pinning(path: Path, text: str) -> None:
    """The cores and priorities of a design, which are no parameters of nodes, in a file of their own."""
    from dse.answers.exports.formats import PINNED

    if len(text.splitlines()) <= LINES_WITHOUT_ROWS:
        return
    if path.exists() and PINNED not in path.read_text(encoding="utf-8", errors="replace")[:MOST_LOOKED_AT]:
        raise UsageError(f"{path}: is there already, and is no table of cores and priorities")
    check_writable(str(path), replaces_problems=True)
    write_text(str(path), text)
    tell(f"wrote {path}, cores and priorities of the threads")


def _write_property_set(output: Path, text: str) -> None:
    """OSATE wants one package or property set in a file: the one that the model uses stands beside it."""
    from dse.importers.aadl.property_set import OURS, TEXT

    path = output.parent / f"{OURS}.aadl"
    if f", {OURS};" not in text or path == output or (path.is_file() and path.read_text(encoding="utf-8") == TEXT):
        return
    if path.exists():
        raise UsageError(f"{path}: is there already, and is not the property set that {output} uses")
    check_writable(str(path), replaces_problems=True)
    write_text(str(path), TEXT)
    tell(f"wrote {path}, the property set that it uses")
