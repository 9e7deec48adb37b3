"""A refactoring changes no answer: digests of the answers to 250 questions of every kind.

The questions are every shipped problem with and without response times, and some 220 drawn ones: families of the
generator, systems of threads (cores, executors, reservations, segments, chains of callbacks), timers on clocks, and
the questions of `tests.properties.test_every_question`, of which half are robust. An answer is the result as JSON, and
the analysis of its first design, without the version, the meaning of the figures, times and counts of calls.

A change that is meant to change answers says so, and writes the digests anew. To see what a change did, keep the
answers before and after it and compare the folders::

    python -m tests.test_fixed_results                   # writes tests/golden/fixed_results.txt
    python -m tests.test_fixed_results --keep FOLDER     # writes each answer to a file of the folder, no digest
"""

from __future__ import annotations

import json
import random
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.examples.random.families import FAMILIES
from dse.examples.random.problem import random_problem
from dse.questions.problem import Problem
from dse.questions.robust.robust import robust_asked
from dse.search.front import SearchLimits
from tests.clocks import test_late_reads, test_open_offsets, test_reads
from tests.helpers import chained_callbacks, thread_segments, thread_systems
from tests.helpers.effort import LONG, count
from tests.oracle.generator import to_yaml
from tests.properties import test_every_question

ROOT = Path(__file__).parents[1]
DIGESTS = Path(__file__).parent / "golden" / "fixed_results.txt"
LEFT_OUT = (
    *("version", "semantics", "search", "files", "sha256", "question", "identity", "file", "solver_calls"),
    *("conflicts", "give_up", "contention"),
)
"""Keys that a refactoring may change, or the load of the machine: versions, times, counts, what is explained, and the
verdicts on designs that time suffices for."""
USUAL = 150
"""Questions that a test run without more effort asks an effort-th part of; all are asked from ``DSE_EFFORT=9`` on."""
SLOW = ("two-computers 1 with response times", "segments 0", "shipped problems/inmark_clock.yaml")
"""Questions that take together as long as all others that a test run asks."""

Answer = Callable[[], Mapping[str, Any]]


def questions() -> Iterator[tuple[str, Answer]]:
    """Name and answer of every question; the answer is computed when it is called for."""
    yield from _shipped()
    for name, drawn in _drawn():
        yield name, partial(_of_text, drawn)
    yield from _of_every_kind()


def _shipped() -> Iterator[tuple[str, Answer]]:
    for path in sorted((ROOT / "problems").glob("**/*.yaml")):
        if "catalogues" in path.parts:
            continue
        changes: list[dict[str, Any]] = [{}, {"processing": "execution_time"}]
        if path.stem == "inmark":
            changes += [{"max_jitter": "20 ms"}, {"max_jitter": "20 ms", "processing": "execution_time"}]
        for change in changes:
            words = " ".join(f"{key}={value}" for key, value in change.items())
            yield f"shipped {path.relative_to(ROOT)} {words}".strip(), partial(_of_file, path, change)


def _drawn() -> Iterator[tuple[str, Callable[[], str]]]:
    """Problem files by name, each with a question of its own; a file is drawn when it is called for."""
    for family in FAMILIES:
        for seed in range(4):
            drawn = partial(random_problem, 6 + 2 * seed, seed, 2 + seed % 2, family)
            yield f"{family} {seed}", partial(_counting, drawn, "execution_time")
            yield f"{family} {seed} with response times", partial(_counting, drawn, "response_time")
    for kind in thread_systems.KINDS:
        for seed in range(5):
            yield f"threads {kind} {seed}", partial(_threads, kind, seed)
    for seed in range(10):
        yield f"segments {seed}", partial(_segments, seed)
        yield f"callbacks {seed}", partial(_written, chained_callbacks.draw, chained_callbacks.text_of, seed)
    for name, draw, write in (
        ("late reads", test_late_reads.drawn, json.dumps),
        ("open offsets", test_open_offsets.drawn, to_yaml),
        ("reads", test_reads.drawn, json.dumps),
    ):
        for seed in range(8):
            yield f"clocks {name} {seed}", partial(_written, draw, write, seed)


def _counting(drawn: Callable[[], str], processing: str) -> str:
    return f"{drawn()}processing: {processing}\n"


def _threads(kind: str, seed: int) -> str:
    return thread_systems.text_of(thread_systems.draw(seed, kind=kind))


def _segments(seed: int) -> str:
    return thread_segments.text_of(thread_segments.draw(seed))


def _written(draw: Callable[[random.Random], Any], write: Callable[[Any], str], seed: int) -> str:
    return write(draw(random.Random(seed)))


def _of_every_kind() -> Iterator[tuple[str, Answer]]:
    for osate, scheduled in ((False, False), (True, False), (False, True)):
        for seed in range(20):
            words = f"{' osate' * osate}{' scheduled' * scheduled}"
            yield f"question {seed}{words}", partial(_question, seed, osate=osate, scheduled=scheduled)


def _of_text(drawn: Callable[[], str]) -> Mapping[str, Any]:
    return answer_of(dse.loads(drawn()))


def _of_file(path: Path, change: Mapping[str, Any]) -> Mapping[str, Any]:
    return answer_of(dse.load(path).ask(**change))


def _question(seed: int, *, osate: bool, scheduled: bool) -> Mapping[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        asked = test_every_question.question(seed, Path(folder), osate=osate, scheduled=scheduled)
        if asked is None:
            return {}
        if asked.robust:
            return told(robust_asked(asked.problem, SearchLimits()))
        return answer_of(asked.problem)


def answer_of(problem: Problem) -> Mapping[str, Any]:
    """The front of a problem, and the analysis of its first design."""
    result = dse.solve(problem, workers=1)
    first = {"first": told(dse.analyse(result, design=result.front[0]))} if result.front else {}
    return {**told(result), **first}


def told(answer: Result | RobustResult | Any) -> dict[str, Any]:
    """An answer as JSON has it, without what a refactoring may change."""
    found = _without(answer.to_dict())
    assert isinstance(found, dict)
    return found


def _without(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _without(value) for key, value in data.items() if key not in LEFT_OUT}
    if isinstance(data, list | tuple):
        return [_without(item) for item in data]
    if isinstance(data, str):
        return re.sub(r"[^\s:']*/(?=[\w.]+\.(?:yaml|aadl)\b)", "", data)
    return f"{data:.12g}" if isinstance(data, float) else data


def text_of(answer: Answer) -> str:
    """An answer as indented JSON; the error where the question has none."""
    try:
        found = answer()
    except dse.DseError as error:
        found = {"error": re.sub(r"/\S*/", "", str(error))}
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"


def digest_of(answer: Answer) -> str:
    """Sixteen digits that tell answers apart."""
    return sha256(text_of(answer).encode()).hexdigest()[:16]


@cache
def expected() -> Mapping[str, str]:
    """The digests that are kept, by the name of the question."""
    lines = DIGESTS.read_text(encoding="utf-8").splitlines()
    return {name: digest for digest, _, name in (line.partition(" ") for line in lines)}


ASKED = list(questions())


def share() -> list[Any]:
    """Questions that a test run asks: evenly spread over all kinds."""
    step = max(1, len(ASKED) // count(USUAL))
    return [pytest.param(name, answer, id=name) for name, answer in ASKED[::step] if LONG or name not in SLOW]


@pytest.mark.parametrize(("name", "answer"), share())
def test_no_answer_changes(name: str, answer: Answer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert digest_of(answer) == expected()[name]


def test_every_question_has_a_digest() -> None:
    assert [name for name, _ in ASKED] == list(expected())


def main() -> None:
    """Write the digests anew, or the answers to the files of a folder."""
    if sys.argv[1:2] == ["--keep"]:
        folder = Path(sys.argv[2])
        folder.mkdir(parents=True, exist_ok=True)
        for name, answer in ASKED:
            (folder / f"{re.sub(r'[^a-z0-9=_]+', '-', name)}.json").write_text(text_of(answer), encoding="utf-8")
        return
    lines = [f"{digest_of(answer)} {name}\n" for name, answer in ASKED]
    DIGESTS.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
