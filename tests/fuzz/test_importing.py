"""Mutated files of other formats never break the program."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.harness import Case
from tests.fuzz.importing import ImportFuzzer
from tests.helpers.effort import FIRST, count

CASES = count(300)
SEED = 1 + FIRST


@pytest.fixture(scope="module")
def fuzzer(tmp_path_factory: pytest.TempPathFactory) -> ImportFuzzer:
    return ImportFuzzer(tmp_path_factory.mktemp("imports"), SEED)


def test_every_file_that_is_mutated_is_right_by_itself(fuzzer: ImportFuzzer) -> None:
    """But for packages of AADL without a system, which others need."""
    for item in fuzzer.files:
        outcome = fuzzer.run(Case(item.name, item.data, item.arguments, item.name))
        assert outcome.code == 0 or "there is no system implementation to analyse" in outcome.output, outcome


@pytest.mark.timeout(60 + CASES)
def test_mutated_files_get_a_message_and_an_exit_code_of_the_table(fuzzer: ImportFuzzer) -> None:
    outcomes = [fuzzer.run(fuzzer.case(number)) for number in range(CASES)]
    assert not [(number, outcome.fault, outcome.case) for number, outcome in enumerate(outcomes) if outcome.fault]


def test_the_same_number_is_the_same_case(fuzzer: ImportFuzzer, tmp_path: Path) -> None:
    other = ImportFuzzer(tmp_path, SEED)
    for number in range(50):
        one, two = fuzzer.case(number), other.case(number)
        assert (one.name, one.arguments) == (two.name, two.arguments)
