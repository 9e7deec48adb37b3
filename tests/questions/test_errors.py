"""What a user gets wrong: each message names the closest valid form; exit codes."""

from __future__ import annotations

from pathlib import Path

import pytest

from dse.cli.main import run
from dse.questions.problem import load
from dse.questions.sweep.inputs_of_file import Inputs, merged_data
from dse.questions.sweep.sweep import read_axes, sweep
from dse.support.errors import ProblemError, UsageError
from tests.questions.studies import example, written

WRONG = [
    ("threads.nav_controller.perod=1ms,2ms", 'did you mean "threads.nav_controller.period"?'),
    (
        "threads.nav_controller.compute_execution_time=1ms",
        "it comes from the type: thread_types.auto_steering.on_timer",
    ),
    ("processor_types.RT101.prise=1 EUR", 'did you mean "processor_types.RT101.price"?'),
    ("price=100 EUR..50 EUR", "the range is empty"),
    ("bus_types.can_125k.bandwidth=2kbit/s..1kbit/s step 1 bit/s", "the range is empty"),
    ("bus_types.can_125k.bandwidth=1kbit/s..2kbit/s step 0 bit/s", "a step must be above 0"),
    ("bus_types.can_125k.bandwidth=1kbit/s..2kbit/s step -1 bit/s", "a step must be above 0"),
    ("bus_types.can_125k.bandwidth=1kbit/s..2kbit/s step 1 ms", "not of the kind"),
    ("bus_types.can_125k.bandwidth=5ms", "expected a bandwidth such as"),
    ("bus_types.can_125k.bandwidth=1kbit/s..2kbit/s", "give a step"),
    ("bus_types.can_125k.bandwidth=*1 ms", "a factor is a plain number"),
    ("bus_types.can_125k.bandwidth=*-1", "must not be negative"),
    ("processor_types.RT101.cores=*0.3", "no whole number"),
    ("jitter of gnss_to_spraier=1ms..2ms", 'did you mean "gnss_to_sprayer"?'),
    ("jitter of gnss_to_sprayer=1W..2W", "is no unit of jitter"),
    ("jitter of gnss_to_sprayer=1..2", "expected a limit with its unit"),
    ("gitter of gnss_to_sprayer=1ms..2ms", 'did you mean "jitter"?'),
    ("price=", "no values"),
    ("price", "expected PATH=VALUES"),
    ("price=1 EUR,,2 EUR", "an empty value"),
    ("price=1 EUR,1 EUR", "given twice"),
    ("processor_types.RT101.price=1 EUR..900 EUR step 0.000001 EUR", "at most 100000"),
    ("thread_types.auto_steering.on_timer.compute_execution_time=5ms", "say which"),
    ("requirements[0]=1ms", "a limit is varied by its metric"),
    ("processor_types.RT101.price<=1 EUR", "an input has a value"),
]


@pytest.mark.parametrize(("text", "words"), WRONG)
def test_wrong_axes_are_explained(text: str, words: str) -> None:
    problem = example("inmark")
    with pytest.raises(UsageError) as caught:
        read_axes(problem, Inputs(merged_data(problem)), [text])
    assert words in str(caught.value)
    assert caught.value.exit_code == 2


def test_one_interval_and_nothing_twice() -> None:
    problem = example("starter")
    inputs = Inputs(merged_data(problem))
    with pytest.raises(UsageError, match="varied twice"):
        read_axes(problem, inputs, ["price=1 EUR,2 EUR", "price=3 EUR"])
    with pytest.raises(UsageError, match="one limit can vary over a whole interval"):
        read_axes(problem, inputs, ["price=1 EUR..2 EUR", "jitter of sensor_to_actuator=1ms..2ms"])


def test_a_value_that_makes_no_valid_problem_is_told_beside_the_others() -> None:
    problem = example("starter")
    path = next(path for path in Inputs(merged_data(problem)).groups if path.endswith(".max"))
    result = sweep(problem, f"{path}=0 ms,900 ms")
    assert result.runs[0].status == "invalid" and result.exit_code == 3
    assert "the minimum is above the maximum" in str(result.runs[0].outcome)


def test_exit_codes_of_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file = str(written(tmp_path, "starter"))
    assert run(["sweep", file, "--vary", "threads.controler.period=1ms"]) == 2
    assert "did you mean" in capsys.readouterr().err
    assert run(["sweep", file, "--vary", "price=50EUR..300EUR", "--no-store", "--workers", "1"]) == 0
    assert "Front    complete, proved" in capsys.readouterr().out
    assert run(["sweep", file, "--vary", "price=1EUR..2EUR", "--no-store", "--workers", "1"]) == 4
    assert run(["sweep", file, "--vary", "price=1EUR,2EUR", "--store", str(tmp_path / "no" / "s")]) == 2
    assert not list(tmp_path.glob("*.sqlite"))


UNCERTAIN = [
    ("threads.nobody.period: {range: 1 ms .. 2 ms}", "no quantity of the problem has this path"),
    ("bus_types.can_250k.bandwidth: {range: 2 ms .. 3 ms}", "expected a bandwidth"),
    ("bus_types.can_250k.bandwidth: {range: 300 .. 200 kbit/s}", "the range is empty"),
    ("bus_types.can_250k.bandwidth: {}", "nothing says how uncertain it is"),
    ("bus_types.can_250k.bandwidth: {distribution: normal, mean: 250 kbit/s}", "needs `mean` and `deviation`"),
    ("bus_types.can_250k.bandwidth: {distribution: triangular, range: 200 .. 300 kbit/s}", "needs a `mode`"),
    ("bus_types.can_250k.bandwidth: {range: 200 .. 300 kbit/s, mode: 250 kbit/s}", "has no meaning"),
    ("bus_types.can_250k.bandwidth: {range: 200 .. 300 kbit/s, factor: 0.9 .. 1.1}", "not both"),
    ("bus_types.can_250k.bandwidth: {samples: nothing.csv}", "cannot be read"),
    ("bus_types.can_250k.transmission_time: {range: 1 us .. 2 us}", "say which"),
    ("bus_types.can_250k.bandwidth: {factor: 1 ms .. 2 ms}", "a factor is a plain number"),
]


@pytest.mark.parametrize(("entry", "words"), UNCERTAIN)
def test_wrong_uncertainties_are_diagnostics(
    tmp_path: Path, entry: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whoever reads the file is told, whether or not anything uncertain matters to the command."""
    path = written(tmp_path, "starter", f"\nuncertainty:\n  {entry}\n")
    with pytest.raises(ProblemError) as caught:
        load(path)
    assert words in str(caught.value)
    assert caught.value.diagnostics[0].line > 10
    for command in ("check", "solve"):
        assert run([command, str(path)]) == 3
        assert words in capsys.readouterr().err


def test_wrong_uncertainties_stand_beside_other_mistakes(tmp_path: Path) -> None:
    path = written(tmp_path, "starter", "\nuncertainty:\n  threads.nobody.period: {range: 1 ms .. 2 ms}\n")
    path.write_text(path.read_text().replace("objectives:", "objectives:\n  - minimise jiter"))
    with pytest.raises(ProblemError) as caught:
        load(path)
    said = [item.message for item in caught.value.diagnostics]
    assert any("unknown metric" in text for text in said) and "no quantity of the problem has this path" in said
