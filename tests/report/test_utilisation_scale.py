"""Utilisation is in per cent of one core wherever it stands: tables, requirements, analyses, sentences, JSON."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import dse
from dse.cli.main import cli

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
DESIGN = {
    "computer.type": "small",
    "can0.type": "can_500k",
    "filter.dispatch_protocol": "periodic",
    "filter.period": "5 ms",
    "control.period": "20 ms",
}
# small has 2 cores; filter uses 0.9 ms / 5 ms = 18 % of one, control 2 ms / 20 ms = 10 %: 28 % of 200 %.


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What `dse analyse --all` prints of that design, with a limit that the sum is nearest to."""
    chosen = [word for name, option in DESIGN.items() for word in ("--design", f"{name} = {option}")]
    limit = ["--processing", "execution-time", "--require", "utilisation of computer <= 20 %"]
    found = CliRunner().invoke(cli, ["analyse", str(PUMP), "--all", *limit, *chosen], env={"COLUMNS": "300"})
    return " ".join(found.output.split())


def test_a_requirement_has_the_figure_of_the_metric(shown: str) -> None:
    assert "utilisation of computer <= 20 % 28 % 40 % 12 % holds (20 % of each of 2 cores; core 1 has 18 %" in shown
    assert "utilisation of computer 28 % of 200 %" in shown
    assert "total of 200 % 28 %" in shown
    assert "14 %" not in shown, "the mean of the cores is no figure of the processor"


def test_each_figure_has_its_denominator(shown: str, tmp_path: Path) -> None:
    assert "computer (small) 28 % of 200 % (2 cores), 18 % of core 1, the fullest" in shown
    one_core = dse.loads(re.sub(r"small: \{cores: 2", "small: {cores: 1", PUMP.read_text(encoding="utf-8")))
    [page] = dse.write_report(dse.analyse(one_core, DESIGN), tmp_path / "pump.md")
    assert "computer (small) 28 % of its core" in page.read_text(encoding="utf-8")


def test_what_one_core_decides_says_whose_it_is() -> None:
    analysis = dse.analyse(PUMP, DESIGN, require="utilisation of computer <= 15 %", processing="execution_time")
    verdict = next(item for item in analysis.verdicts if item.requirement.text == "utilisation of computer <= 15 %")
    assert (verdict.who, verdict.value, verdict.limit) == ("filter", 180_000, 150_000)
    chosen = [word for name, option in DESIGN.items() for word in ("--design", f"{name} = {option}")]
    limit = ["--processing", "execution-time", "--require", "utilisation of computer <= 15 %"]
    found = CliRunner().invoke(cli, ["analyse", str(PUMP), *limit, *chosen], env={"COLUMNS": "300"})
    row = "utilisation of computer (filter) 18 % 15 % -20 % VIOLATED"
    assert row in " ".join(found.output.split())


def test_json_has_one_scale() -> None:
    data = dse.analyse(PUMP, DESIGN, require="utilisation of computer <= 20 %", processing="execution_time").to_dict()
    (stated,) = [item for item in data["requirements"] if item["requirement"] == "utilisation of computer <= 20 %"]
    assert stated["value"] == data["metrics"]["utilisation of computer"]["value"] == 280_000
    assert stated["limit"] == 400_000
    assert data["processors"]["computer"]["total"] == 280_000


def test_a_bound_says_what_its_limit_is_of_each_core() -> None:
    found = CliRunner().invoke(
        cli, ["check", str(PUMP), "--require", "utilisation of computer <= 1 %"], env={"COLUMNS": "300"}
    )
    assert re.search(r"the limit is [24] % \(1 % of each of [24] cores\)", found.output)
