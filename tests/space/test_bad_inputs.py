"""Semantic mistakes: one defect per file and nothing that merely follows from it; several at once; mutations."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import dse.space
from dse.questions.problem import load, loads
from dse.space import properties
from dse.space.build import build_space
from dse.space.model.space import Space
from dse.space.properties import Ledger
from dse.space.question.metrics import QuestionError
from dse.space.question.reading import MOST_FAILURES
from dse.spec.loading.load import load_spec, parse_spec
from dse.spec.loading.partial_reading import MOST_PLACES
from dse.support.errors import ProblemError
from tests.helpers.diagnostics import (
    FOLDER,
    assert_every_input_has_its_messages,
    assert_places_exist,
    bad_inputs,
    expected_messages,
    messages,
)
from tests.helpers.effort import LONG

SEMANTIC = FOLDER / "semantic"
MIXED = FOLDER / "mixed"
VALID = (FOLDER / "valid.yaml").read_text(encoding="utf-8")
SEVERAL = {"flow_several_mistakes", "local_alone", "map_of_a_type", "several_mistakes"}


def build(path: Path) -> Space:
    return build_space(load_spec(path))


@pytest.mark.parametrize("path", bad_inputs(SEMANTIC), ids=lambda path: path.stem)
def test_message(path: Path) -> None:
    assert messages(path, build) == expected_messages(path)


@pytest.mark.parametrize("path", bad_inputs(SEMANTIC), ids=lambda path: path.stem)
def test_one_defect_gives_one_message(path: Path) -> None:
    count = len(expected_messages(path))
    assert count > 1 if path.stem in SEVERAL else count == 1


def test_every_bad_input_has_its_messages_and_the_base_is_valid() -> None:
    assert_every_input_has_its_messages(SEMANTIC)
    assert_every_input_has_its_messages(MIXED)
    build(FOLDER / "valid.yaml")


@pytest.mark.parametrize("path", bad_inputs(MIXED), ids=lambda path: path.stem)
def test_what_cannot_be_read_hides_no_misspelt_name(path: Path) -> None:
    """Units, keys and shapes are wrong, and names too: all is reported in one go."""
    assert messages(path, load) == expected_messages(path)


@pytest.mark.parametrize("path", bad_inputs(FOLDER), ids=lambda path: path.stem)
def test_nothing_is_reported_that_follows_from_what_cannot_be_read(path: Path) -> None:
    assert messages(path, load) == expected_messages(path)


CUT = {
    "threads: {beep: {processor: computer}}": False,  # `threads` is there twice: nobody knows which threads there are
    "tasks: {beep: {processor: computer}}": True,  # no name of a section, and not close to one
    "flow: {}": False,  # surely `flows`
    "devices: [gnss]": False,
}


@pytest.mark.parametrize("extra", CUT)
def test_names_are_looked_up_where_it_is_known_which_there_are(extra: str) -> None:
    text = VALID.replace("objectives: [minimise", "objectives: [minimise speed, minimise")
    section = extra.partition(":")[0]
    lines = [line for line in text.splitlines() if not (section == "devices" and line.startswith("devices:"))]
    with pytest.raises(ProblemError) as caught:
        loads("\n".join([*lines, extra]))
    found = [item.path for item in caught.value.diagnostics]
    assert ("objectives[0]" in found) is CUT[extra]


def test_several_mistakes_come_in_the_order_of_the_lines() -> None:
    with pytest.raises(ProblemError) as caught:
        build(SEMANTIC / "several_mistakes.yaml")
    places = [(item.line, item.column) for item in caught.value.diagnostics]
    assert places == sorted(places) and len(set(places)) == 10


def test_after_very_many_mistakes_less_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither questions nor closest names take long, however many are wrong; the first ones keep their hint."""
    monkeypatch.setattr(properties, "MOST_COMPARED", 100)
    wrong = "".join(f"  c{number}: {{from: gns, to: nav, data_size: 1 B}}\n" for number in range(100))
    with pytest.raises(ProblemError) as caught:
        loads(VALID.replace("connections:\n", f"connections:\n{wrong}"))
    hints = [item.hint for item in caught.value.diagnostics]
    assert hints[0] == 'did you mean "gnss"?' and hints[-1] == ""
    rules = ", ".join(["nav.perod == 10 ms"] * (MOST_FAILURES + 5))
    with pytest.raises(ProblemError) as caught:
        loads(re.sub(r"rules: \[.*\]", f"rules: [{rules}]", VALID))
    assert len(caught.value.diagnostics) == MOST_FAILURES + 1
    assert [item.path for item in caught.value.diagnostics if "cannot be read" in item.message] == ["rules[199]"]
    units = "\n".join(f"  spare{number}: {{period: 1 msec}}" for number in range(MOST_PLACES + 1))
    with pytest.raises(ProblemError) as caught:
        loads(VALID.replace("threads:\n", f"threads:\n{units}\n").replace("[minimise", "[minimise speed, minimise"))
    assert not any(item.path.startswith("objectives") for item in caught.value.diagnostics)


# --- every message has a file -------------------------------------------------------------------------------------


def _call_sites() -> Iterator[tuple[str, int, int]]:
    """File name, first and last line of each place in `dse.space` that reports a mistake."""
    for path in sorted(Path(dse.space.__path__[0]).glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in ("error", "unknown", "QuestionError") and node.args:
                yield path.name, node.lineno, node.end_lineno or node.lineno


NOT_FOR_FILES = {  # messages that only another reader of questions can cause
    "no figures per processor type here",  # every field that may be a map is read with its meaning
    "nothing is called",  # in a rule the parser finds unknown names first
    "questions cannot be read",  # see test_after_very_many_mistakes_less_is_looked_at
}


def test_every_semantic_message_has_a_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: set[tuple[str, int]] = set()

    def watch(kind: type, name: str) -> None:
        original = getattr(kind, name)

        def noted(*args: Any, **kwargs: Any) -> Any:
            frame: FrameType | None = sys._getframe(1)
            while frame is not None and "dse/space" in frame.f_code.co_filename:
                seen.add((Path(frame.f_code.co_filename).name, frame.f_lineno))
                frame = frame.f_back
            return original(*args, **kwargs)

        monkeypatch.setattr(kind, name, noted)

    watch(Ledger, "error")
    watch(QuestionError, "__init__")
    for path in bad_inputs(SEMANTIC):
        messages(path, build)
    silent = []
    for file, first, last in _call_sites():
        if not any(name == file and first <= line <= last for name, line in seen):
            source = (Path(dse.space.__path__[0]) / file).read_text(encoding="utf-8").splitlines()[first - 1 : last]
            if not any(text in " ".join(source) for text in NOT_FOR_FILES):
                silent.append(f"{file}:{first}: {source[0].strip()}")
    assert silent == []


# --- no mistake breaks the reader ---------------------------------------------------------------------------------

WORD = re.compile(r"[A-Za-z_][\w.]*|\d+")
WORDS = sorted({*WORD.findall(VALID), "none", "nobody", "aperiodic", "sporadic", "hybrid", "power", "0", "in", "not"})


@settings(max_examples=400 if LONG else 120, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 10**6), st.sampled_from(WORDS)), min_size=1, max_size=4))
def test_words_exchanged(changes: list[tuple[int, str]]) -> None:
    """A file with some words exchanged is valid, or refused with places that exist."""
    text = VALID
    for number, word in changes:
        found = list(WORD.finditer(text))
        place = found[number % len(found)]
        text = text[: place.start()] + word + text[place.end() :]
    refuse_or_accept(text)


@settings(max_examples=200 if LONG else 80, deadline=None)
@given(st.sets(st.integers(0, len(VALID.splitlines()) - 1), min_size=1, max_size=4))
def test_lines_left_out(lines: set[int]) -> None:
    refuse_or_accept("\n".join(line for number, line in enumerate(VALID.splitlines()) if number not in lines))


def refuse_or_accept(text: str) -> None:
    try:
        build_space(parse_spec(text, "problem.yaml"))
    except ProblemError as error:
        assert error.diagnostics
        assert_places_exist(error.diagnostics, text)
        assert all(item.file == "problem.yaml" and item.message for item in error.diagnostics)
        assert len(set(error.diagnostics)) == len(error.diagnostics)
