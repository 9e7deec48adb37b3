"""Settings for all tests: none depends on how fast the machine is. `effort.py` says how much the random ones try."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("dse", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("dse")

os.environ.pop("COLUMNS", None)  # what runs tests in parallel sets it; commands go by it

ROOT = Path(__file__).parents[1]
QUICK = (
    *("dse", "tests/spec", "tests/space", "tests/analysis", "tests/support"),
    *("tests/search/test_regions.py", "tests/search/test_front.py", "tests/answers/test_ranking.py"),
    *("tests/answers/test_words.py", "tests/questions/test_errors.py", "tests/verification/test_verify.py"),
)
"""What the marker ``quick`` selects: a look at every layer in less than a minute, before the whole suite."""
TAKES_SECONDS = (
    *("test_random", "test_words_exchanged", "test_vectorised", "test_what_pyyaml_writes", "test_the_search_is_exact"),
    *("test_extremes", "extremes", "test_figures_of_a_flow", "test_overwriting", "test_no_design_meets"),
    *("[inmark", "[autoware", "move_base", "[ekf_node", "[buses", "[large_rule", "dse.report.widget.widget"),
    *("test_fine_times", "test_schemas_are_told_apart", "test_every_semantic_message_has", "test_every_combination_of"),
    *("[perception", "test_no_design_is_better", "write_report", "test_lines_left_out"),
    *("test_exactly_the_non_dominated_points", "test_valid_documents", "test_second_model_has_exactly"),
)
"""What of it does not belong to it, by a part of its name."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what belongs to a quick run."""
    folders = [ROOT / name for name in QUICK]

    @cache
    def is_near(path: Path) -> bool:
        return any(path.is_relative_to(folder) for folder in folders)

    for item in items:
        if is_near(item.path) and not any(part in item.nodeid for part in TAKES_SECONDS):
            item.add_marker("quick")
