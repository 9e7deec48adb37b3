"""What a command imports before it works; the seconds that this takes are measured by the benchmarks."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

INMARK = str(Path(__file__).parents[2] / "problems" / "inmark.yaml")
SOLVER = ("ortools", "pandas", "numpy")
SELDOM = ("importlib.metadata", "email")
RESULTS = ("dse.answers.forms",)
ROOMS = (
    "dse.simulation",
    "dse.verification",
    "dse.questions.sweep",
    "dse.questions.sensitivity",
    "dse.questions.robust",
    "dse.fitting",
    "dse.importers.aadl",
    "dse.report.content.front.document",
)
NEVER = {
    "--help": (*SOLVER, "networkx", "pydantic", "yaml", "rich", "dse.spec", "dse.space", "dse.analysis"),
    "check": (
        *SOLVER,
        *SELDOM,
        "networkx",
        "jinja2",
        "dse.encode",
        "dse.search",
        *RESULTS,
        "dse.examples.random",
        *ROOMS,
    ),
    "new": (*SOLVER, "networkx", "rich", "dse.space", "dse.examples.random"),
    "solve": (
        "pandas",
        "networkx",
        "scipy",
        "matplotlib",
        "jinja2",
        "dse.examples.random",
        "dse.fitting",
        "dse.report.output",
        "dse.questions.sweep",
        "dse.questions.explain",
        "dse.questions.stopped_search",
        "dse.verification",
    ),
    "solve quietly": ("importlib.metadata", "dse.answers.explanation", "dse.report", "dse.search.feasibility"),
    "analyse": (*SOLVER, "networkx", "dse.encode", "dse.search"),
}
ARGUMENTS = {
    "--help": ["--help"],
    "check": ["check", INMARK, "--processing", "execution-time"],
    "new": ["new", "--list"],
    "solve": ["solve", INMARK, "--max-jitter", "20ms"],
    "solve quietly": ["solve", INMARK, "--max-jitter", "20ms", "-q"],
    "analyse": ["analyse", INMARK],
}
PROGRAM = """
import atexit, sys
from dse.cli.entry import main
atexit.register(lambda: print("\\nimported", *sys.modules, file=sys.stderr))
main()
"""


@cache
def imported(program: str, command: str) -> list[str]:
    """The modules that a command has imported when it ends."""
    done = subprocess.run(
        [sys.executable, "-c", program, *ARGUMENTS[command]], capture_output=True, text=True, check=True
    )
    return done.stderr.rsplit("\nimported ", 1)[1].split()


@pytest.mark.parametrize("command", ARGUMENTS)
def test_a_command_imports_nothing_that_it_does_not_need(command: str) -> None:
    found = imported(PROGRAM, command)
    assert not {name for name in found for needless in NEVER[command] if f"{name}.".startswith(f"{needless}.")}


def test_what_waits_is_there_when_somebody_asks_for_it() -> None:
    program = """
from dse.cli.postponed import postpone
postpone()
import sys
from ortools.sat.python import cp_model
assert "pandas" not in sys.modules
model = cp_model.CpModel()
import numpy
assert cp_model.pd.Index([1, 2]).size == 2
import pandas
made = model.new_bool_var_series("b", pandas.Index(["x", "y"]))
assert type(made) is pandas.Series and len(made) == 2
from pydantic.plugin import _loader
assert "importlib.metadata" not in sys.modules
assert list(_loader.entry_points(group="pytest11"))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_what_waits_is_a_quarter_of_the_modules_of_a_solve() -> None:
    """Modules do not depend on the machine: with pandas a short solve takes 1.8 s of a processor in place of 1.6 s."""
    at_once = f"import dse.cli.postponed\ndse.cli.postponed.postpone = lambda: None\n{PROGRAM}"
    with_waiting, without = (len(imported(program, "solve")) for program in (PROGRAM, at_once))
    assert without > 1.3 * with_waiting


def test_a_part_of_a_problem_file_is_made_ready_when_a_file_has_it() -> None:
    program = """
from dse.spec.loading.load import parse_spec
from dse.spec.schema.model import Clock, Thread
parse_spec("{dse: 1, name: x, threads: {a: {period: 1 ms}}}")
assert Thread.__pydantic_complete__ and not Clock.__pydantic_complete__
assert parse_spec("{dse: 1, name: x, clocks: {a: {}}}").spec.clocks["a"] == Clock()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_ctrl_c_ends_the_program_quietly_before_it_can_answer_and_is_left_alone_in_a_library() -> None:
    program = """
import signal, sys, types
signal.signal(signal.SIGINT, signal.default_int_handler)  # where the tests run in the background it is ignored
import dse
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
import dse.cli.main
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
del sys.modules["dse.cli.main"]
import dse.cli.entry
signal.raise_signal(signal.SIGINT)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (-2, "", "")
