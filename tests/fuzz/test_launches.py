"""Mutated launch files and parameter files never break the importer, nor take all time or all memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.fuzz.launches import TEXTS, LaunchFuzzer
from tests.helpers.effort import FIRST, count

CASES = count(300)
SEED = 1 + FIRST


@pytest.mark.timeout(60 + CASES)
def test_mutated_launch_files_get_a_message_and_an_exit_code_of_the_table(tmp_path: Path) -> None:
    fuzzer = LaunchFuzzer(tmp_path, SEED)
    faults = [(number, outcome.fault, outcome.case) for number in range(CASES) if (outcome := _outcome(fuzzer, number))]
    assert not faults


def _outcome(fuzzer: LaunchFuzzer, number: int) -> Any:
    outcome = fuzzer.run(fuzzer.case(number))
    return outcome if outcome.fault else None


def test_the_sound_files_are_problems_and_many_mutated_ones_are_read(tmp_path: Path) -> None:
    fuzzer = LaunchFuzzer(tmp_path, SEED)
    outcomes = [fuzzer.run(fuzzer.case(number)) for number in range(20)]
    assert {outcome.code for outcome in outcomes} >= {0, 3}
    for name, text in TEXTS.items():
        assert (tmp_path / name).read_text(encoding="utf-8") == text
