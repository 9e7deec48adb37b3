"""The committed sample report fits the problem that it is of."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import dse
from dse.examples.shipped import example_path
from dse.report.content.front.document import Document
from dse.report.output import report_files

FOLDER = Path(__file__).parents[2] / "reports"

pytestmark = pytest.mark.skipif(
    not (FOLDER / "inmark.json").is_file(), reason="the sample report is in a checkout only"
)


def test_the_sample_is_of_the_problem_as_it_is_and_answers_the_question_of_the_readme() -> None:
    asked = "dse solve problems/inmark.yaml --max-jitter 20ms"
    for text in (FOLDER / "README.md", FOLDER.parent / "README.md"):
        assert asked in text.read_text(encoding="utf-8")
    sample = dse.reopen(FOLDER / "inmark.json", example_path("inmark"))  # a changed file or figure is refused
    fresh = dse.solve(example_path("inmark"), max_jitter="20ms")
    shown = (FOLDER.parent / "README.md").read_text(encoding="utf-8")
    assert f"complete, proved: {len(sample.front)} designs" in shown
    assert [point.objectives for point in sample.front] == [point.objectives for point in fresh.front]
    assert sample.status == "complete"
    assert sample.others


@pytest.mark.parametrize("name", ["inmark.md", "inmark.csv"])
def test_the_sample_says_what_is_said_today(name: str) -> None:
    def lasting(text: str) -> list[str]:
        return [line for line in text.splitlines() if not line.startswith(("- **Versions**", "- **Problem file**"))]

    assert lasting((FOLDER / name).read_text(encoding="utf-8")) == lasting(fresh()[name])


@cache
def fresh() -> dict[str, str]:
    """The files of the sample as they are written today."""
    return dict(report_files(Document(dse.reopen(FOLDER / "inmark.json", example_path("inmark")))))


@pytest.mark.parametrize("name", ["inmark.md", "inmark.csv", "inmark.json"])
def test_no_file_names_a_machine(name: str) -> None:
    text = (FOLDER / name).read_text(encoding="utf-8")
    assert not re.search(r"(?<![\w.])/(home|tmp|work|root|usr)/", text)


def test_every_picture_is_there() -> None:
    named = set(re.findall(r"\((pictures/[^)]+)\)", (FOLDER / "README.md").read_text(encoding="utf-8")))
    assert named <= {"pictures"} | {f"pictures/{path.name}" for path in (FOLDER / "pictures").iterdir()}
    assert len(list((FOLDER / "pictures").glob("inmark-*.svg"))) == 8
