"""The command line: commands are imported when they are called, so that ``dse --help`` answers at once."""

from __future__ import annotations

import io
import os
import sys
import traceback
from importlib import import_module

import click

from dse.cli.common import discard_output
from dse.cli.interrupts import Interrupts
from dse.cli.printing import in_a_line, say, tell
from dse.support.errors import (
    EXIT_BUG,
    EXIT_INCOMPLETE,
    EXIT_MEANINGS,
    EXIT_USAGE,
    DseError,
    ProblemError,
    Wording,
    nearest,
)
from dse.support.files.guard import guarding
from dse.support.version import __version__

COMMANDS = {
    "solve": "The proven Pareto front of a problem, ranked.",
    "analyse": "One design: latency contributors, CPU and bus tables, verdicts.",
    "simulate": "A design played out in time, against its analysed bounds; response times.",
    "sweep": "The front as a function of a limit or an input: exact break-points, grids.",
    "sensitivity": "Margins of a design, which inputs matter, and how sure one can be.",
    "report": "A result as a report: HTML, Markdown, CSV, JSON, figures.",
    "compare": "Two results, two designs, a design and the baseline, or measurements, side by side.",
    "export": "A chosen design as a problem file, ROS 2 parameters, Graphviz, GraphML or AADL.",
    "check": "Validate a problem file and describe its space.",
    "explain": "Why a problem is infeasible, and the smallest relaxations that make it feasible.",
    "verify": "Re-check a result without trusting the solver that made it.",
    "sizes": "How large ROS messages are: by the report's rule, and serialised.",
    "fit": "Measurements as the figures of a problem file: transmission and execution times.",
    "import": "Models, CAN databases, ROS 2 configurations or traces as a problem file.",
    "new": "Write a problem file to start from.",
    "schema": "Print the JSON Schema of problem files, and of what commands write.",
}
MODULES = {"import": "files.importing"} | {
    name: f"files.{name}" for name in ("export", "fit", "new", "schema", "sizes")
}
"""Where commands are that are not beside the others under their own name."""
MOST_MISTAKES = 250
"""The greatest number of mistakes that is shown."""
EXIT_CODES = f"Exit codes: {'; '.join(f'{code} {meaning}' for code, meaning in EXIT_MEANINGS.items())}."


class LazyGroup(click.Group):
    """A group whose commands are known by name and help, and imported when called.

    Starting takes a fraction of a second, because the solver and the report are not imported for ``--help``.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order of a day's work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command itself; imports it.

        None for an unknown name.
        """
        if cmd_name not in COMMANDS:
            return None
        module = MODULES.get(cmd_name, cmd_name)
        command = getattr(import_module(f"dse.cli.commands.{module}"), "command")  # noqa: B009 (typed as Any on purpose)
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is called; a misspelt one gets a suggestion, as options do."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            near = nearest(args[0], COMMANDS) if args[0] not in COMMANDS else ""
            if near:
                raise click.UsageError(f"{error.message.rstrip('.')}. (Did you mean '{near}'?)", ctx) from None
            raise

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _version(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value:
        say(f"dse {__version__}")
        ctx.exit()


@click.command(cls=LazyGroup, epilog=EXIT_CODES, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=_version, help="Show the version.")
def cli() -> None:
    """Exact design-space exploration for robot and embedded architectures.

    An architecture with open decisions goes in, as a YAML file; every Pareto-optimal architecture that meets its limits
    comes out, with a proof that none is missing. Start with: dse new my.yaml; dse solve my.yaml
    """


def run(arguments: list[str]) -> int:
    """Run one command; every error becomes a message and an exit code.

    Exit codes: 0 answered, 2 wrong use, 3 invalid problem, 4 no, 5 incomplete, 70 a fault of ours. Messages speak of
    options.
    """
    before, Wording.options = Wording.options, True
    try:
        return _run(arguments)
    finally:
        Wording.options = before


def _run(arguments: list[str]) -> int:
    try:
        with guarding():
            code = int(cli.main(arguments, prog_name="dse", standalone_mode=False) or 0)
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            discard_output()
        return code
    except click.ClickException as error:
        shown = io.StringIO()
        error.show(shown)
        tell(shown.getvalue().removesuffix("\n"))
        return EXIT_USAGE
    except (click.Abort, KeyboardInterrupt):
        return _say("interrupted", EXIT_INCOMPLETE)
    except ProblemError as error:
        count = len(error.diagnostics)
        for item in error.diagnostics[:MOST_MISTAKES]:
            tell(in_a_line(str(item)))
        if count > MOST_MISTAKES:
            tell(f"... and {count - MOST_MISTAKES} more")
        return _say(
            f"{count} mistake{'s' if count != 1 else ''} in the problem; nothing was solved or written", error.exit_code
        )
    except DseError as error:
        return _say(str(error), error.exit_code)
    except (BrokenPipeError, SystemExit):  # click leaves by itself where the reader of its help has gone
        discard_output()
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return _say(f"{place}{error.strerror or error}", EXIT_USAGE)
    except Exception as error:  # noqa: BLE001 (the outermost handler: whatever is left is a bug of ours)
        return _bug(error)


def _bug(error: Exception) -> int:
    """Whatever is left, unless it comes of Ctrl-C."""
    if Interrupts.came:
        return _say("interrupted", EXIT_INCOMPLETE)
    if os.environ.get("DSE_TRACEBACK"):
        tell(traceback.format_exc())
    return _say(
        f"a bug in dse: {type(error).__name__}: {error}\nplease report it with the problem file; "
        f"DSE_TRACEBACK=1 shows where",
        EXIT_BUG,
    )


def _say(message: str, code: int) -> int:
    tell(f"dse: {message}")
    return code
