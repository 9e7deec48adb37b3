"""No number stands for a response time without a bound in anything that is printed or written: it is said."""

from __future__ import annotations

import base64
import gzip
import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.answers.ranking.order import ranked_by
from dse.answers.ranking.variants import find_variants
from dse.cli.main import run
from dse.report.words.missing import missing_words
from dse.support.units import Unbounded, is_unbounded

FULL = """
dse: 1
name: unbounded
processing: response_time
processor_types: {small: {cores: 1, price: 60 EUR}, big: {cores: 2, price: 100 EUR}}
processors: {p: {type: [small, big]}}
devices:
  s: {period: 10 ms, compute_execution_time: 100 us .. 300 us}
threads:
  t1: {processor: p, period: 10 ms, compute_execution_time: 5 ms}
  t2: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 4 ms .. 5 ms, queue_size: 2}
connections: {a: {from: s, to: t2}}
flows: {f: {path: [s, t2]}}
metrics: {weighed: 2 * latency of f, less: price / 1 EUR * 1 ms - latency of f}
requirements: [price <= 200 EUR]
objectives: [minimise latency of f, minimise price]
baseline: {p: {type: small}}
uncertainty: {threads.t1.compute_execution_time: {factor: 0.9 .. 1.1}}
"""
"""A core that is full, and releases that jitter: what is late once stays late. A second core mends it."""
OVERLOADED = FULL.replace("compute_execution_time: 5 ms}", "compute_execution_time: 4 ms .. 6 ms}")
LEAST_NS = 10**10
"""Less than any part of what stands for an unbounded time, more than any other figure here."""
COMMANDS = {
    "solve": "solve full.yaml --csv out.csv --report -o reports --further 1 --json out.json",
    "analyse": "analyse full.yaml --json out.json",
    "one design": "analyse full.yaml --design p.type=small --require 'latency of f <= 1 s' --json out.json",
    "simulate": "simulate full.yaml --runs 2 --json out.json",
    "explain": "explain full.yaml --max-latency 3ms --json out.json --csv out.csv",
    "check": "check full.yaml --json out.json",
    "sweep": "sweep full.yaml --vary price=60EUR..300EUR --no-store --workers 1 --json out.json --csv out.csv --report",
    "grid": "sweep full.yaml --vary processor_types.small.price=50EUR,60EUR --no-store --workers 1 --json out.json "
    "--csv out.csv --report",
    "sensitivity": "sensitivity over.yaml --samples 50 --json out.json --csv out.csv --report",
    "robust": "solve over.yaml --robust --json out.json --csv out.csv --report",
    "compare": "compare solved.json#1 solved.json#2 --json out.json",
    "results": "compare solved.json solved.json --json out.json",
    "report": "report solved.json",
    "verify": "verify solved.json --json out.json",
    "export": "export solved.json --alternative 2 -o out.yaml",
    "insisting": "solve full.yaml --insist --json out.json --report out.html",
    "resume": "solve --resume solved.json --json out.json",
}


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The result of the full one, as a command has written it beside the file."""
    folder = tmp_path_factory.mktemp("solved")
    (folder / "full.yaml").write_text(FULL, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert run(["solve", "full.yaml", "-q", "--json", "solved.json"]) == 0
    return (folder / "solved.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", COMMANDS)
def test_no_command_says_a_number(
    name: str, solved: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    inputs = {"full.yaml": FULL, "over.yaml": OVERLOADED, "solved.json": solved}
    for file, text in inputs.items():
        Path(file).write_text(text, encoding="utf-8")
    assert run(shlex.split(COMMANDS[name])) in (0, 4), capsys.readouterr().err
    said = capsys.readouterr()
    assert not list(numbers_in(f"{said.out}\n{said.err}"))
    for path in (item for item in Path().rglob("*") if item.is_file() and str(item) not in inputs):
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"\b1-[0-9a-f]{16}\b", "", text)  # a digest of the code, which may be all digits
        if path.suffix == ".json":
            assert not list(figures_in(json.loads(text))), path
        elif path.suffix == ".csv":
            assert not re.findall(r"\d{11,}", text), path
        elif path.suffix == ".html":
            packed = [gzip.decompress(base64.b64decode(found)).decode() for found in re.findall("H4sI[\\w+/=]+", text)]
            page = re.sub("<(script|style).*?</(script|style)>", "", text, flags=re.DOTALL)
            data = [part for part in packed if part.startswith("{")]
            assert data or 'id="data"' not in text  # a page of a study has no script that reads data
            assert not [found for part in (page, *data) for found in numbers_in(part) if "." not in found], path
        else:
            assert not list(numbers_in(text)), path


def numbers_in(text: str) -> Iterator[str]:
    """Numbers of more than seven digits before the point, in groups of three or not, or with an exponent."""
    yield from re.findall(r"(?<![\w.#])[1-9]\d{0,2}(?: \d{3}){2,}(?!\d)|(?<![\w.#])\d{9,}(?!\w)|\d[.\d]*e\+\d+", text)


def figures_in(data: Any, place: str = "") -> Iterator[str]:
    """Numbers that only what stands for an unbounded time reaches, but for those that bound regions and searches."""
    if isinstance(data, dict):
        for key, value in data.items():
            if key not in ("refuted", "unexplored", "searched", "searched_to", "potential", "search", "files"):
                yield from figures_in(value, f"{place}.{key}")
    elif isinstance(data, list):
        for value in data:
            yield from figures_in(value, place)
    elif isinstance(data, int | float) and abs(data) >= LEAST_NS:
        yield f"{place}: {data}"


def test_what_is_written_instead() -> None:
    result = dse.solve(FULL)
    late = next(point for point in result.front if point.decisions["p.type"] == "small")
    data = next(item for item in result.to_dict()["front"] if item["id"] == late.id)
    for name in ("latency of f", "jitter of f", "weighed", "less"):
        assert data["metrics"][name] is None
        assert f"{name} [" in result.to_csv()
    assert data["objectives"] == {"latency of f": None, "price": 6000}
    assert data["metrics"]["min latency of f"] == 4_100_000
    assert result.to_csv().count("unbounded") == 4
    frame = result.frame("readable")
    assert frame.loc[frame["id"] == late.id, "latency of f [ms]"].item() == inf
    analysis = dse.analyse(FULL)
    assert analysis.to_dict()["flows"]["f"]["max_ns"] is None
    assert [row["max_ns"] for row in analysis.to_dict()["flows"]["f"]["rows"]][-1] is None


def test_a_stopped_search_says_it_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Only the late design was found, and no region of the others is proved to be empty."""
    result = dse.solve(FULL)
    late = [point for point in result.front if is_unbounded(point.objectives["latency of f"])]
    stopped = replace(
        result,
        status="incomplete",
        front=tuple(late),
        refuted=(),
        unexplored=({"latency of f": 10**15, "price": 9000},),
        potential={"latency of f": 10**14 + 5, "price": 4000},
    )
    said = "; ".join(missing_words(stopped))
    assert said.startswith("latency of f: no less than unbounded")
    assert not list(numbers_in(said))


def test_what_is_unbounded_stays_so() -> None:
    number = Unbounded(10)
    for found in (
        number + 1,
        1 - number,
        number * Fraction(1, 3),
        -number,
        abs(-number),
        sum([Fraction(1), number], Fraction(0)),
        number / 2,
    ):
        assert is_unbounded(found)
    assert not is_unbounded(0 * number) and 0 * number == 0
    assert number == 10 and hash(number) == hash(10) and max(number, 3) is number


SCALED = """
dse: 1
name: scaled
processing: response_time
overload: allowed
processor_types: {tiny: {price: 10 EUR}, small: {price: 20 EUR}, mid: {price: 40 EUR}, large: {price: 80 EUR}}
processors: {cpu: {type: [tiny, small, mid, large]}}
devices: {s: {period: 10 ms, compute_execution_time: 1 ms}}
threads:
  a: {processor: cpu, period: 10 ms, compute_execution_time: {tiny: 1 ms .. 9 ms, small: 6 ms, mid: 3 ms, large: 1 ms}}
  b: {processor: cpu, period: 20 ms, compute_execution_time: {tiny: 1 ms .. 9 ms, small: 6 ms, mid: 3 ms, large: 1 ms}}
connections: {c: {from: s, to: a}, d: {from: a, to: b}}
flows: {f: {path: [s, a, b]}}
objectives: [minimise latency of f, minimise price]
"""
"""Latencies 55, 40 and 34 ms for 20, 40 and 80 EUR, and none that is bounded for 10 EUR."""


def test_nothing_is_scaled_by_what_stands_for_unbounded(tmp_path: Path) -> None:
    """Ranges are 21 ms and 70 EUR: before, the bounded ones were 0.143, 0.429 and 1 from the best, by price alone."""
    result = dse.solve(SCALED)
    figures = [tuple(item["objectives"].values()) for item in result.to_dict()["front"]]
    assert figures == [(40_000_000, 4000), (34_000_000, 8000), (55_000_000, 2000), (None, 1000)]
    assert [point.score for point in result.front] == ["0.515", "1.000", "1.010", "2.000"]
    assert [point.id for point in result.front] == [1, 2, 3, 4]
    for method in ("ideal", "topsis", "knee", "weights:price=2"):
        ranked = ranked_by(result, method)
        assert not dse.verify(ranked, problem=dse.load(SCALED)).findings
        assert all(score != "0.000001" for score in (point.score for point in ranked.front))
    swept = dse.sweep(SCALED, "threads.a.period=10ms,12ms")
    assert swept.to_dict()["ranking"]["scale"][0]["worst"] == 55_000_000


def test_findings_name_no_number_for_what_is_unbounded() -> None:
    data = dse.solve(SCALED).to_dict()
    data["front"] = [item for item in data["front"] if item["objectives"]["latency of f"] is not None]
    found = [item.text for item in dse.verify(data, problem=dse.load(SCALED)).findings]
    assert any("with latency of f unbounded, price 1000" in text for text in found)
    assert not [text for text in found if list(numbers_in(text)) or re.search(r"\d{13}", text)]


def test_near_identical_is_told_by_bounded_ranges() -> None:
    far = Unbounded(10**14)
    designs = [{"a": str(number)} for number in range(4)]
    assert find_variants([(100, 1), (120, 1), (200, 1), (far, 1)], designs) == [None, None, None, None]
    assert find_variants([(100, 1), (105, 1), (far, 1), (far + 3, 1)], designs) == [None, None, None, 2]


def test_a_limit_that_the_stand_in_would_keep_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "scaled.yaml"
    path.write_text(SCALED, encoding="utf-8")
    for command in (["solve"], ["analyse", "--fix", "cpu.type=tiny"], ["explain"], ["check"]):
        assert run([command[0], str(path), *command[1:], "--max-latency", "200000 s"]) in (0, 3)
        assert "latency of f <= 200000 s: no limit" in "".join(capsys.readouterr())
    assert run(["sweep", str(path), "--no-store", "--vary", "latency=20ms..200000s"]) == 3
    assert "no limit" in " ".join(capsys.readouterr().out.split())
