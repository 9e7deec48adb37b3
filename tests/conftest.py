"""Settings for all tests: none depends on how fast the machine is. `effort.py` says how much the random ones try."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.helpers.effort import count

settings.register_profile("dse", deadline=None, max_examples=count(300), suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("dse")

os.environ.pop("COLUMNS", None)  # what runs tests in parallel sets it; commands go by it
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # images of containers set it: each program that a test starts would
sys.dont_write_bytecode = False  # compile all of its modules again, and each worker all files of tests

ROOT = Path(__file__).parents[1]
QUICK = {
    "every room": ("dse/", "tests/test_structure.py"),
    "support": ("tests/support/test_reading.py",),
    "importers": ("tests/importers/test_can.py", "tests/importers/test_merging.py"),
    "spec": ("tests/spec/test_load.py",),
    "space": ("tests/space/test_catalogues.py",),
    "analysis": ("tests/analysis/test_limits.py", "tests/analysis/test_rates.py", "tests/scheduling/test_published.py"),
    "simulation": ("tests/clocks/test_simulation.py",),
    "encode": ("tests/encode/test_model.py::test_fixed_decisions", "tests/encode/test_model.py::test_sums_beyond"),
    "answers": ("tests/answers/test_ranking.py", "tests/answers/test_words.py"),
    "examples": ("tests/examples/test_generator.py::test_same_arguments",),
    "search": ("tests/search/test_insist.py", "tests/search/test_sound_solver.py"),
    "verification": ("tests/verification/test_feasible.py",),
    "fitting": ("tests/fitting/test_lines.py",),
    "questions": ("tests/questions/test_errors.py", "tests/questions/sweep/test_store.py"),
    "report": ("tests/report/test_utilisation_scale.py",),
    "cli": ("tests/cli/test_exit_codes.py", "tests/cli/test_question.py"),
}
"""What the marker ``quick`` selects in each folder of `dse`: the beginnings of names of tests.

The first line has all examples in docstrings, which run each function of Python once. A test belongs here if it takes
less than a second and says something of its folder that nothing else here does; all take less than a minute of one
processor. `tests/test_structure.py` holds that no folder is missing.
"""
FILES = tuple(ROOT / name.partition("::")[0] for names in QUICK.values() for name in names)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """A quick run does not import the other files of tests, which takes half as long as its tests."""
    if config.option.markexpr != "quick":
        return None
    is_near = any(path.is_relative_to(collection_path) or collection_path.is_relative_to(path) for path in FILES)
    return None if is_near else True


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what belongs to a quick run."""
    names = tuple(name for found in QUICK.values() for name in found)
    for item in items:
        if item.nodeid.startswith(names):
            item.add_marker("quick")


def pytest_collection_finish() -> None:
    """Look for garbage less often, and not among all tests that wait: that is a tenth of the time."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
