"""Mutated files never break the program."""

from __future__ import annotations

import json
import random
import shlex
from pathlib import Path
from typing import Any

import pytest

from dse.cli.main import run
from tests.fuzz.harness import Fuzzer
from tests.fuzz.mutations import parsed, spliced, written
from tests.helpers.effort import FIRST, count

CASES = count(400)
SEED = 1 + FIRST
PUMP = Path(__file__).parent / "pump.yaml"


@pytest.mark.timeout(60 + CASES)
def test_mutated_files_get_a_message_and_an_exit_code_of_the_table(tmp_path: Path) -> None:
    fuzzer = Fuzzer(tmp_path, SEED)
    faults = [(number, outcome.fault, outcome.case) for number in range(CASES) if (outcome := _outcome(fuzzer, number))]
    assert not faults


def _outcome(fuzzer: Fuzzer, number: int) -> Any:
    outcome = fuzzer.run(fuzzer.case(number))
    return outcome if outcome.fault else None


def test_the_same_number_is_the_same_case(tmp_path: Path) -> None:
    first, second = Fuzzer(tmp_path / "a", 3), Fuzzer(tmp_path / "b", 3)
    for number in range(50):
        one, other = first.case(number), second.case(number)
        assert (one.name, one.arguments, one.data[:40]) == (other.name, other.arguments, other.data[:40])


def test_coverage_keeps_what_reaches_new_lines(tmp_path: Path) -> None:
    fuzzer = Fuzzer(tmp_path, 1, coverage=True)
    before = len(fuzzer.problems) + len(fuzzer.results)
    reached = [fuzzer.run(fuzzer.case(number)).new_lines for number in range(20)]
    assert sum(reached) == len(fuzzer.coverage.seen if fuzzer.coverage else ()) > 1000
    assert len(fuzzer.problems) + len(fuzzer.results) > before


def test_what_aliases_expand_without_end_is_written_with_its_aliases() -> None:
    bomb = "\n".join(["a0: &a0 [x]", *(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 40))])
    assert len(spliced("{}", random.Random(1), [bomb])) < 100_000
    assert written(parsed("a: &a [b, *a]"), random.Random(1), is_json=True)


# --- what fuzzing found ------------------------------------------------------------------------------------------


def test_a_list_of_very_many_unknown_names_is_told_in_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ", ".join(f"p{number}" for number in range(20_000))
    file = tmp_path / "many.yaml"
    text = PUMP.read_text(encoding="utf-8")
    file.write_text(text.replace("processor: computer", f"processor: [{names}]"), encoding="utf-8")
    assert run(["check", str(file)]) == 3
    lines = capsys.readouterr().err.splitlines()
    assert lines[-2:] == ["... and 39750 more", "dse: 40000 mistakes in the problem; nothing was solved or written"]


def test_the_first_mistakes_are_shown_and_the_rest_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In the order of the file, whichever kind they are of."""
    threads = [f"  t{number}: {{processor: p, period: {number}}}" for number in range(300)]
    lines = ["dse: 1", "name: x", "processors: {p: {type: c}}", "processor_types: {c: {}}", "threads:", *threads]
    file = tmp_path / "many.yaml"
    file.write_text("\n".join(lines), encoding="utf-8")
    assert run(["check", str(file)]) == 3
    said = capsys.readouterr().err.splitlines()
    assert said[0].endswith('threads.t0.period: expected a period such as "10 ms", got 0')
    assert said[249].endswith('threads.t249.period: expected a period such as "10 ms", got 249')
    assert said[250:] == ["... and 50 more", "dse: 300 mistakes in the problem; nothing was solved or written"]


def test_a_number_of_many_digits_in_a_result_is_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "result.json"
    file.write_text('{"format": "dse-result/1", "front": [' + "9" * 5000 + "]}", encoding="utf-8")
    for command in ("verify", "report", "export"):
        assert run([command, str(file), *(["--alternative", "1"] if command == "export" else [])]) == 2
        assert "cannot be read as a result" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", ["figure", "refuted", "unexplored"])
def test_a_search_is_not_resumed_from_what_cannot_be(
    wrong: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "result.json"
    assert run(["solve", str(PUMP), "-q", "--json", str(file)]) == 0
    data = json.loads(file.read_text(encoding="utf-8"))
    if wrong == "figure":
        data["front"][0]["objectives"]["price"] += 100
    else:
        data[wrong] = [dict.fromkeys(data["front"][0]["objectives"], 7)]
    file.write_text(json.dumps(data), encoding="utf-8")
    assert run(["solve", "--resume", str(file), str(PUMP)]) == 2
    assert "the search to go on with has a" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("problem.effective.profile", "dse-2"),
        ("problem.effective.worst_case", ["deadline"]),
        ("search.space_size", []),
        ("status", "done"),
        ("refuted", [{"price": "1"}]),
    ],
)
def test_a_result_with_a_part_of_another_kind_is_a_message(
    place: str, value: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "result.json"
    assert run(["solve", str(PUMP), "-q", "--json", str(file)]) == 0
    data = json.loads(file.read_text(encoding="utf-8"))
    *holders, key = place.split(".")
    held = data
    for name in holders:
        held = held[name]
    held[key] = value
    file.write_text(json.dumps(data), encoding="utf-8")
    commands = (["report", "-o", str(tmp_path)], ["solve", "--resume"], ["export", "--alternative", "1"], ["compare"])
    for command in commands:
        given = [*command, str(file), *([str(file)] if command == ["compare"] else [])]
        assert run(given) == 2
        assert "result" in capsys.readouterr().err
    assert run(["verify", str(file)]) == 4


def test_a_fraction_of_nothing_in_a_result_is_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    near, clash = tmp_path / "near.json", tmp_path / "clash.json"
    assert run(["solve", str(PUMP), "-q", "--json", str(near), "--within", "5%"]) == 0
    assert run(["solve", str(PUMP), "-q", "--json", str(clash), "--max-jitter", "5ms"]) == 4
    for file, change in ((near, ("others", 0, "within")), (clash, ("conflicts", 0, "members", 0, "closest"))):
        data = json.loads(file.read_text(encoding="utf-8"))
        held = data
        for key in change[:-1]:
            held = held[key]
        held[change[-1]] = "1/0"
        file.write_text(json.dumps(data), encoding="utf-8")
        assert run(["report", str(file), "-o", str(tmp_path)]) == 2
        assert "is not a whole result" in capsys.readouterr().err
        assert run(["verify", str(file)]) == 4


def test_work_beyond_all_numbers_is_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "huge.yaml"
    text = (PUMP.parent / "timing.yaml").read_text(encoding="utf-8")
    file.write_text(text.replace("10 us .. 20 us", "1e18 ms"), encoding="utf-8")
    assert run(["solve", str(file), "--minimise", "utilisation of computer", "-q"]) == 3
    assert "too large to search exactly" in capsys.readouterr().err


def test_alternative_prices_of_a_processor_type_have_margins(tmp_path: Path) -> None:
    file = tmp_path / "prices.yaml"
    text = PUMP.read_text(encoding="utf-8").replace("price: 60 EUR", "price: [60 EUR, 10.50 EUR]")
    file.write_text(text, encoding="utf-8")
    design = ["computer.type = small", "can0.type = can_250k", "computer.price = 10.50 EUR"]
    design += ["filter.dispatch_protocol = periodic", "filter.period = 10 ms", "control.period = 10 ms"]
    given = [part for choice in design for part in ("--design", choice)]
    assert run(["sensitivity", str(file), *given, "--no-front"]) == 0


EVERYTHING = Path(__file__).parent / "everything.yaml"
DESIGN = ("--design", "r.json#1")


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a problem that has a little of everything (times finer than 1 ns, units, fractions), solved."""
    folder = tmp_path_factory.mktemp("everything")
    (folder / "e.yaml").write_bytes(EVERYTHING.read_bytes())
    assert run(["solve", str(folder / "e.yaml"), "-q", "--json", str(folder / "r.json")]) == 0
    return folder


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("check e.yaml --deadlines all", 0),
        ("solve e.yaml --report -o out", 0),
        ("solve e.yaml --robust --report -o out", 0),
        ("solve e.yaml --further 2 --within 5% --csv out.csv", 0),
        ("explain e.yaml --require 'mass <= 80 g' --all --csv out.csv", 4),
        ("analyse e.yaml DESIGN --response-times --json out.json", 0),
        ("simulate e.yaml DESIGN --duration 50ms --runs 2 --json out.json", 0),
        ("sensitivity e.yaml DESIGN --samples 20 --report -o out", 0),
        ("sweep e.yaml --vary 'mass=100 g..0.3 kg step 100 g' --no-store --workers 1 --report -o out", 0),
        ("verify r.json", 0),
        ("report r.json -o out --figures svg", 0),
        ("compare r.json r.json", 0),
        ("export r.json --alternative 1 --format problem -o x.yaml", 0),
    ],
)
def test_every_command_takes_a_problem_with_everything(
    line: str, code: int, everything: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(everything)
    assert run(shlex.split(line.replace("DESIGN", " ".join(DESIGN)))) == code
