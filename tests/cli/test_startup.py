"""What a command imports before it works; the seconds that this takes are measured by the benchmarks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

INMARK = str(Path(__file__).parents[2] / "problems" / "inmark.yaml")
SOLVER = ("ortools", "pandas", "numpy")
RESULTS = ("dse.results.forms", "dse.results.solve")
ROOMS = ("dse.simulation", "dse.verification", "dse.study", "dse.fitting", "dse.importers.aadl", "dse.report.document")
NEVER = {
    "--help": (*SOLVER, "networkx", "pydantic", "yaml", "rich", "dse.spec", "dse.space", "dse.analysis"),
    "check": (*SOLVER, "networkx", "jinja2", "dse.encode", "dse.pareto", *RESULTS, "dse.generator", *ROOMS),
    "new": (*SOLVER, "networkx", "rich", "dse.space", "dse.generator"),
    "solve": ("networkx", "scipy", "matplotlib", "dse.generator", "dse.study", "dse.verification"),
    "analyse": (*SOLVER, "networkx", "dse.encode", "dse.pareto"),
}
ARGUMENTS = {
    "--help": ["--help"],
    "check": ["check", INMARK],
    "new": ["new", "--list"],
    "solve": ["solve", INMARK, "--max-jitter", "20ms"],
    "analyse": ["analyse", INMARK],
}
PROGRAM = """
import sys
from dse.cli.main import run
code = run(sys.argv[1:])
print("\\nimported", code, *sys.modules, file=sys.stderr)
"""


@pytest.mark.parametrize("command", ARGUMENTS)
def test_a_command_imports_nothing_that_it_does_not_need(command: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *ARGUMENTS[command]], capture_output=True, text=True, check=True
    )
    code, *imported = done.stderr.rsplit("\nimported ", 1)[1].split()
    assert code == "0"
    assert not {name for name in imported for needless in NEVER[command] if f"{name}.".startswith(f"{needless}.")}
