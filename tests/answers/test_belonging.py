"""Which problem a result belongs to: what it means decides, not its text; where it is gone, what the result carries."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.cli.main import run
from dse.examples.shipped import example_files
from dse.questions.result_problem import belonging
from dse.spec.loading.load import load_spec, parse_spec
from dse.spec.loading.writing import block_text
from dse.support.errors import ProblemError, UsageError
from tests.helpers.effort import LONG

MAIN = """\
dse: 1
name: Ferry
include: parts/types.yaml
source: a drawing
processors: {cpu: {type: [slow, fast]}}
devices: {source: {period: 10 ms}}
threads:
  first: {processor: cpu, period: [10 ms, 20 ms], compute_execution_time: {slow: 3 ms .. 4 ms, fast: 1 ms}}
  second: {processor: cpu, period: [10 ms, 20 ms], compute_execution_time: 1 ms .. 2 ms}
connections:
  wire: {from: source, to: first, data_size: 8 B}
  pipe: {from: first, to: second}
flows: {main: {path: [source, first, second]}}
requirements: [utilisation of cpu <= 70 %]
objectives: [minimise jitter of main, minimise price]
uncertainty:
  connections.wire.data_size: {samples: sizes.csv, column: size, unit: B}
"""
TYPES = "processor_types:\n  slow: {price: 100 EUR}\n  fast: {price: 250 EUR}\n"
SIZES = "size,when\n7,1\n9,2\n"

Edit = Callable[[Path], object]


def written(folder: Path) -> Path:
    (folder / "parts").mkdir(parents=True)
    (folder / "parts" / "types.yaml").write_text(TYPES, encoding="utf-8")
    (folder / "sizes.csv").write_text(SIZES, encoding="utf-8")
    (folder / "ferry.yaml").write_text(MAIN, encoding="utf-8")
    return folder / "ferry.yaml"


def changed(name: str, old: str, new: str) -> Edit:
    def edit(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        (folder / name).write_text(text.replace(old, new), encoding="utf-8")

    return edit


def merged(folder: Path) -> None:
    (folder / "ferry.yaml").write_text(MAIN.replace("include: parts/types.yaml\n", "") + TYPES, encoding="utf-8")


def moved(folder: Path) -> None:
    (folder / "parts").rename(folder / "pieces")
    changed("ferry.yaml", "parts/types.yaml", "pieces/types.yaml")(folder)


def turned(folder: Path) -> None:
    head, *sections = re.split(r"^(?=\w)", MAIN, flags=re.M)[1:]
    (folder / "ferry.yaml").write_text(head + "".join(reversed(sections)), encoding="utf-8")


def renamed(folder: Path) -> None:
    (folder / "sizes.csv").rename(folder / "bytes.csv")
    changed("ferry.yaml", "sizes.csv", "bytes.csv")(folder)


def rewritten(folder: Path) -> None:
    text = yaml.safe_dump(yaml.safe_load(MAIN), sort_keys=False, default_flow_style=False, width=40)
    (folder / "ferry.yaml").write_text("\ufeff# by a machine\n" + text, encoding="utf-8")


SAME: dict[str, Edit] = {
    "a comment": changed("ferry.yaml", "dse: 1\n", "# today\n\ndse: 1\n"),
    "a comment in an include": changed("parts/types.yaml", "100 EUR}", "100 EUR}  # dear"),
    "a blank line": changed("ferry.yaml", "threads:\n", "\nthreads:\n\n"),
    "quotes": changed("ferry.yaml", "20 ms]", "'20 ms']"),
    "line ends": changed("ferry.yaml", "\n", "\r\n"),
    "an alias": changed("ferry.yaml", "data_size: 8 B", "data_size: &size 8 B"),
    "where it comes from": changed("ferry.yaml", "a drawing", "another drawing"),
    "fields of a component in another order": changed(
        "ferry.yaml", "{from: first, to: second}", "{to: second, from: first}"
    ),
    "sections in another order": turned,
    "in blocks": rewritten,
    "no include": merged,
    "an include in another place": moved,
    "samples under another name": renamed,
    "another column of the samples": changed("sizes.csv", "size,when\n7,1\n9,2", "size\n7\n9"),
}
OTHER: dict[str, tuple[Edit, str]] = {
    "a value": (changed("ferry.yaml", "data_size: 8 B", "data_size: 9 B"), 'connections.wire.data_size was "8 B"'),
    "a value of an include": (changed("parts/types.yaml", "250", "260"), "processor_types.fast.price"),
    "a sample": (changed("sizes.csv", "9,2", "10,2"), "uncertainty.connections.wire.data_size.samples"),
    "the order of options": (changed("ferry.yaml", "[slow, fast]", "[fast, slow]"), "processors.cpu.type"),
    "the order of names": (
        changed(
            "ferry.yaml", "  wire: {from: source, to: first, data_size: 8 B}\n  pipe: {from: first, to: second}\n",
            "  pipe: {from: first, to: second}\n  wire: {from: source, to: first, data_size: 8 B}\n",
        ),
        "connections has its names in another order",
    ),
    "the order of names of an include": (
        lambda folder: (folder / "parts" / "types.yaml").write_text(
            "processor_types:\n  fast: {price: 250 EUR}\n  slow: {price: 100 EUR}\n", encoding="utf-8"
        ) and None,
        "processor_types has its names in another order",
    ),
    "a requirement": (changed("ferry.yaml", "70 %", "71 %"), "requirements was"),
    "a rule": (changed("ferry.yaml", "objectives:", "rules: [first.period == 10 ms]\nobjectives:"), "rules is new"),
    "a name": (changed("ferry.yaml", "Ferry", "Boat"), 'name was "Ferry", is "Boat"'),
}  # fmt: skip


@pytest.fixture
def solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the problem and its result ``r.json``."""
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(["solve", "ferry.yaml", "-q", "--json", "r.json"]) == 0
    return tmp_path


def results_of(folder: Path) -> dict[str, Any]:
    """What commands make of the result, without what tells of the run."""
    data: dict[str, Any] = dse.reopen(folder / "r.json").to_dict()
    return {key: data[key] for key in ("front", "objectives", "metric_units", "ranking", "refuted")}


@pytest.mark.parametrize("name", SAME)
def test_the_same_meaning_is_the_same_problem(name: str, solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = results_of(solved)
    SAME[name](solved)
    assert run(["verify", "r.json"]) == 0
    assert "has changed since, in comments, layout or paths only" in capsys.readouterr().out
    assert results_of(solved) == before
    if LONG or name in ("a comment in an include", "in blocks"):  # these commands read a result as `dse.reopen` does
        assert run(["report", "r.json", "-o", "rep"]) == 0
        assert run(["compare", "r.json", "r.json"]) == 0
    again = dse.resume("r.json").to_dict()
    assert again["front"] == before["front"]
    assert again["problem"]["identity"] == json.loads(Path("r.json").read_text())["problem"]["identity"]


@pytest.mark.parametrize("name", OTHER)
def test_another_meaning_is_refused_and_told(name: str, solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    edit, words = OTHER[name]
    edit(solved)
    assert run(["verify", "r.json"]) == 4
    out = " ".join(capsys.readouterr().out.split())
    assert "problem.identity: ferry.yaml is not the problem that was solved" in out and words in out
    for command in (["report", "r.json", "-o", "rep"], ["export", "r.json", "--alternative", "1"],
                    ["compare", "r.json", "r.json"], ["solve", "--resume", "r.json"]):  # fmt: skip
        assert run(command) == 2
        error = " ".join(capsys.readouterr().err.split())
        assert "ferry.yaml has changed since the result was written" in error and words in error
    assert not (solved / "rep" / "ferry.html").exists()


def test_what_is_gone_is_carried_and_a_forgery_would_pass(
    solved: Path, capsys: pytest.CaptureFixture[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    before = results_of(solved)
    far = tmp_path_factory.mktemp("far")
    (solved / "r.json").rename(far / "r.json")
    for path in ("ferry.yaml", "sizes.csv", "parts/types.yaml"):
        (solved / path).unlink()
    there = str(far / "r.json")
    assert run(["verify", there, "--json", "v.json"]) == 5
    said = " ".join(capsys.readouterr().out.split())
    assert "against the problem that the result itself carries" in said and "a forgery of both would pass" in said
    assert json.loads(Path("v.json").read_text())["status"] == "unfinished"
    assert results_of(far) == before
    for command in (["report", there, "-o", "rep"], ["solve", "--resume", there]):
        assert run(command) == 0
        assert "working with the problem that the result itself carries" in capsys.readouterr().err
    assert "this is what the result carries" in (solved / "rep" / "ferry.html").read_text(encoding="utf-8")
    for sides in ([there, there], [f"{there}#1", f"{there}#2"], [f"{there}#1", "baseline"]):
        capsys.readouterr()
        assert run(["compare", *sides]) in (0, 2)  # it has no baseline
        said = capsys.readouterr().err
        assert ("working with the problem that the result itself carries" in said) == ("baseline" not in sides)
    for form in ("pinning", "dot", "graphml", "svg"):
        assert run(["export", there, "--alternative", "1", "--format", form, "-o", f"out.{form}"]) == 0
    assert run(["export", there, "--alternative", "1", "-o", "one.yaml"]) == 0
    exported = dse.analyse(dse.load("one.yaml"))
    figures = {item["name"]: before["front"][0]["objectives"][item["name"]] for item in before["objectives"]}
    point = dse.reopen(there).front[0]
    assert exported.is_feasible and dict(point.objectives) == figures
    assert "include" not in Path("one.yaml").read_text() and "7 B" in Path("one.yaml").read_text()
    with pytest.raises(ProblemError):
        dse.load("ferry.yaml")


def edited(change: Callable[[dict[str, Any]], None]) -> None:
    data = json.loads(Path("r.json").read_text())
    change(data)
    Path("r.json").write_text(json.dumps(data))


FORGED: dict[str, Callable[[dict[str, Any]], None]] = {
    "the carried text": lambda data: data["files"].update(
        {"ferry.yaml": data["files"]["ferry.yaml"].replace("8 B", "9 B")}
    ),
    "a carried include": lambda data: data["files"].update({"parts/types.yaml": TYPES.replace("250", "251")}),
    "a comment in the carried text": lambda data: data["files"].update({"ferry.yaml": MAIN + "# more\n"}),
    "the hash": lambda data: data["problem"].update(sha256="0" * 64),
    "the hash of an include": lambda data: data["problem"]["includes"][0].update(sha256="0" * 64),
    "an include left out": lambda data: data["problem"].update(includes=[]),
    "the identity": lambda data: data["problem"].update(identity="0" * 64),
    "what is carried is no problem": lambda data: data["files"].update({"ferry.yaml": "dse: 1\nnonsense: 3\n"}),
    "what is carried is no text": lambda data: data.update(files={"ferry.yaml": 3}),
    "a lone surrogate": lambda data: data["files"].update({"ferry.yaml": "dse: 1\nname: \ud800\n"}),
    "carried files that are no mapping": lambda data: data.update(files=["ferry.yaml"]),
}


@pytest.mark.parametrize("name", FORGED)
def test_what_a_result_says_of_its_problem_is_checked(
    name: str, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edited(FORGED[name])
    assert run(["verify", "r.json"]) in (2, 4)
    for path in ("ferry.yaml", "sizes.csv", "parts/types.yaml"):
        (solved / path).unlink()
    capsys.readouterr()
    assert run(["verify", "r.json"]) in (2, 4, 5)  # never 0
    assert run(["report", "r.json", "-o", "rep"]) in (0, 2)
    assert "bug" not in capsys.readouterr().err


def test_a_result_that_carries_no_problem_is_not_whole(solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def shortened(data: dict[str, Any]) -> None:
        del data["files"], data["problem"]["identity"]

    edited(shortened)
    for _ in ("its problem file is there", "it is not"):
        assert (run(["verify", "r.json"]), run(["report", "r.json"])) == (4, 2)
        told = capsys.readouterr()
        assert "problem.identity: is missing\n  files: is missing" in told.out
        assert "is not a whole result: problem.identity: is missing (and 1 more mistakes)" in told.err
        (solved / "ferry.yaml").unlink(missing_ok=True)


def test_a_problem_of_the_same_name_in_the_way(solved: Path) -> None:
    """The result lies beside its own problem; where the commands are given there is another one of that name."""
    inner = solved / "inner"
    written(inner)
    (solved / "r.json").rename(inner / "r.json")
    OTHER["a value"][0](solved)
    for command in (["verify"], ["report", "-o", "rep"], ["compare", "inner/r.json"]):
        assert run([command[0], "inner/r.json", *command[1:]]) == 0
    SAME["a comment"](inner)
    for command in (["verify"], ["report", "-o", "rep"], ["compare", "inner/r.json"]):
        assert run([command[0], "inner/r.json", *command[1:]]) == 0


def test_conflicts_are_confirmed_wherever_their_lines_are_now(solved: Path) -> None:
    assert run(["solve", "ferry.yaml", "-q", "--json", "r.json", "--max-price", "90EUR"]) == 4
    inner = solved / "inner"
    inner.mkdir()
    (solved / "r.json").rename(inner / "r.json")
    assert run(["verify", "inner/r.json"]) == 0
    SAME["a comment"](solved)
    assert run(["verify", "inner/r.json"]) == 0


def test_a_problem_from_text_is_carried_too(tmp_path: Path) -> None:
    text = MAIN.replace("include: parts/types.yaml\n", "").replace("{samples: sizes.csv, column: size, unit: B}",
                                                                   "{samples: [7 B, 9 B]}") + TYPES  # fmt: skip
    path = tmp_path / "r.json"
    path.write_text(dse.solve(dse.loads(text)).to_json(), encoding="utf-8")
    again = dse.reopen(path)
    assert again.problem.is_carried and len(again.front) > 1
    assert dse.export(again, 1).startswith("# Ferry")
    written(tmp_path / "files")
    assert load_spec(tmp_path / "files" / "ferry.yaml").identity == parse_spec(text).identity


def test_a_broken_problem_file_is_told_not_passed_over(solved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (solved / "ferry.yaml").write_text("dse: 1\nname: [", encoding="utf-8")
    assert run(["verify", "r.json"]) == run(["report", "r.json"]) == 3
    assert "ferry.yaml:3:1: not YAML" in capsys.readouterr().err


def test_a_result_that_names_no_file() -> None:
    for block in ({}, {"problem": 3}, {"problem": {"file": 3}}, {"problem": {"file": "a\0b"}}):
        with pytest.raises(UsageError, match=r"r\.json: is not a whole result"):
            belonging(block, "r.json")


@pytest.mark.parametrize("path", example_files(), ids=lambda path: path.stem)
def test_a_document_as_text_says_the_same(path: Path) -> None:
    """Shipped problems: merged, written in blocks, read again; and read from their texts."""
    loaded = load_spec(path)
    again = parse_spec(block_text(loaded.document))
    assert again.document == loaded.document and again.spec.model_dump(exclude={"include"}) == loaded.spec.model_dump(
        exclude={"include"}
    )
    carried = load_spec(path, loaded.texts)
    assert (carried.spec, carried.sha256, carried.includes, carried.identity, carried.is_carried) == (
        loaded.spec,
        loaded.sha256,
        loaded.includes,
        loaded.identity,
        True,
    )


@pytest.mark.parametrize("gone", ["sizes.csv", "parts/types.yaml"])
@pytest.mark.parametrize("edit", ["as it was", "a comment"])
def test_what_the_file_names_is_gone_and_carried(
    gone: str, edit: str, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The problem file is there, a file that it names is not: this was a wrong problem file (3)."""
    (solved / gone).unlink()
    if edit in SAME:
        SAME[edit](solved)
    assert run(["verify", "r.json"]) == 5
    said = " ".join(capsys.readouterr().out.split())
    assert f"{gone}, which ferry.yaml names, is not there" in said and "a forgery of both would pass" in said
    for command in (["report", "r.json", "-o", "rep"], ["export", "r.json", "--alternative", "1", "-o", "one.yaml"]):
        assert run(command) == 0
        assert "ferry.yaml names files that are not there" in capsys.readouterr().err
    changed("ferry.yaml", "8 B", "9 B")(solved)
    assert run(["verify", "r.json"]) == 4
    assert run(["report", "r.json"]) == 2
    assert "9 B" in capsys.readouterr().err
    changed("ferry.yaml", "9 B", "9 furlongs")(solved)
    assert run(["verify", "r.json"]) == 3


def test_cores_and_their_use_are_checked_by_whoever_reads_a_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "--example", "inmark"]) == 0
    assert run(["solve", "inmark.yaml", "--max-jitter", "20ms", "-q", "--json", "r.json"]) == 0
    data = json.loads(Path("r.json").read_text())
    thread, core = next(iter(data["front"][0]["cores"].items()))
    used = data["front"][0]["core_use"]["computer"]["used"]
    for item, key, value in (
        (data["front"][0]["cores"], thread, core + 1),
        (data["front"][0]["core_use"]["computer"], "used", [*used[1:], used[0]]),
    ):
        kept = item[key]
        item[key] = value
        Path("forged.json").write_text(json.dumps(data), encoding="utf-8")
        item[key] = kept
        assert run(["verify", "forged.json"]) == 4
        for command in (["report", "forged.json"], ["compare", "forged.json", "r.json"]):
            capsys.readouterr()
            assert run(command) == 2
            assert "alternative 1 has other cores than the result says" in capsys.readouterr().err
