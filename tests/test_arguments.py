"""Every argument of every public verb is checked as the option of the command line is, in the words of dse."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from datetime import timedelta
from fractions import Fraction
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import dse
from dse.answers.verification import Verification
from dse.cli.main import COMMANDS
from dse.support.arguments import Whole, Word, duration, share, span
from dse.support.errors import DseError, UsageError

PUMP = (Path(__file__).parent / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
DESIGN = {"computer.type": "small", "can0.type": "can_500k", "filter.dispatch_protocol": "aperiodic",
          "control.period": "10 ms"}  # fmt: skip
VERBS = [name for name in dse.__all__ if inspect.isfunction(getattr(dse, name))]
BY_ITSELF = {"problem", "design", "question", "source", "options", "one", "other", "space", "studies"}
"""What a verb makes sense of itself: it is one of several things."""
SEVERAL = {"files", "names"}
"""Positional arguments, of which there may be any number."""
FOREIGN = (5, 1.5, object(), b"bytes", ["a", 3], {"a": object()}, float("nan"), timedelta(seconds=-1))


def checks_of(name: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = getattr(getattr(dse, name), "checks", {})
    return found


@pytest.fixture(scope="module")
def given() -> dict[str, Any]:
    """A value of each positional argument."""
    problem = dse.loads(PUMP)
    result = dse.solve(problem)
    return {"problem": problem, "result": result, "answer": result, "design": DESIGN, "vary": "price=1EUR..9EUR",
            "alternative": 1, "one": result, "other": result, "path": "r.json", "threads": 5, "name": "inmark",
            "text": PUMP, "method": "knee", "source": problem, "space": problem.space}  # fmt: skip


@pytest.mark.parametrize("name", VERBS)
def test_every_parameter_is_checked(name: str) -> None:
    parameters = [*inspect.signature(getattr(dse, name)).parameters]
    exempt = BY_ITSELF | ({"alternative"} if name == "export" else set())
    assert [item for item in parameters if item not in checks_of(name) and item not in exempt] == []


@pytest.mark.parametrize(
    ("verb", "keyword"), [(verb, keyword) for verb in VERBS for keyword in checks_of(verb) if verb != "loads"]
)
def test_what_is_wrong_is_refused_by_name(verb: str, keyword: str, given: dict[str, Any]) -> None:
    """An error of ours that begins with the keyword; no error of another library."""
    call = getattr(dse, verb)
    needed = [item.name for item in inspect.signature(call).parameters.values()
              if item.default is item.empty and item.kind is item.POSITIONAL_OR_KEYWORD]  # fmt: skip
    refused = 0
    for value in FOREIGN:
        arguments = {name: given[name] for name in needed if name in given} | {keyword: value}
        try:
            checks_of(verb)[keyword](keyword, value)
        except UsageError as error:
            refused += 1
            assert str(error).startswith(keyword)
            first = [given["problem"]] if "problem" in arguments else []
            with pytest.raises(UsageError):
                call(*first, value) if keyword in SEVERAL else call(**arguments)
    assert refused >= 3


@pytest.mark.parametrize("name", [name for name in VERBS if checks_of(name) and name != "import_file"])
def test_a_keyword_that_there_is_not_is_refused_with_the_nearest(name: str) -> None:
    keyword = [*checks_of(name)][-1]
    with pytest.raises(UsageError, match=rf"^{name}: unknown keyword '{keyword}x' \(did you mean \"{keyword}\"\?\)$"):
        getattr(dse, name)(**{f"{keyword}x": 1})


def options() -> list[tuple[str, str, click.ParamType[Any]]]:
    """Verbs and keywords with the type of the option that is theirs on the command line."""
    found: list[tuple[str, str, click.ParamType[Any]]] = []
    renamed = {"drift": "drift_ppm", "further": "count", "of": "of", "form": "form"}
    verbs = {"import": "import_file", "new": "random_problem"}
    for command in COMMANDS:
        tool = _command(command)
        verb = verbs.get(command, command)
        for item in tool.params:
            keyword = renamed.get(str(item.name), str(item.name))
            for owner in (verb, "with_further_designs" if command == "solve" else verb):
                if keyword in checks_of(owner) and isinstance(item.type, click.IntRange | click.Choice):
                    found.append((owner, keyword, item.type))
    return found


def _command(name: str) -> click.Command:
    from dse.cli.main import cli

    found = cli.get_command(click.Context(cli), name)
    assert found is not None
    return found


def test_ranges_and_words_are_those_of_the_command_line() -> None:
    compared = 0
    for verb, keyword, kind in options():
        check = checks_of(verb)[keyword]
        if isinstance(kind, click.IntRange) and isinstance(check, Whole):
            assert check.least == kind.min or verb == "random_problem", (verb, keyword)
            assert kind.max is None or check.most == kind.max, (verb, keyword)
            compared += 1
        elif isinstance(kind, click.Choice) and isinstance(check, Word):
            assert set(check.words) == set(kind.choices), (verb, keyword)
            compared += 1
    assert compared >= 14


def test_words_that_are_none_name_the_nearest(given: dict[str, Any]) -> None:
    problem, result = given["problem"], given["result"]
    wrong: dict[str, Callable[[], object]] = {
        'offsets: expected worst, random, zero; got \'wurst\' (did you mean "worst"?)':
            lambda: dse.simulate(problem, DESIGN, offsets="wurst"),  # type: ignore[arg-type]
        'execution: expected max, min, random; got \'maxx\' (did you mean "max"?)':
            lambda: dse.simulate(problem, DESIGN, execution="maxx"),  # type: ignore[arg-type]
        "method: expected auto, exhaustion, model; got 'foo'":
            lambda: dse.verify(result, method="foo"),  # type: ignore[arg-type]
        'profile: expected dse, osate-2.2, osate-2.19; got \'des\' (did you mean "dse"?)':
            lambda: dse.solve(problem, profile="des"),
        "workers: expected a whole number from 1 to 64; got 0": lambda: dse.solve(problem, workers=0),
        'time_limit_s: expected a positive time: seconds, a timedelta, or text such as "2 min"; got -1':
            lambda: dse.solve(problem, time_limit_s=-1),
        'solve: unknown keyword \'max_jiter\' (did you mean "max_jitter"?)':
            lambda: dse.solve(problem, max_jiter="5 ms"),  # type: ignore[call-arg]
        'unknown keyword \'max_jiter\' (did you mean "max_jitter"?)':
            lambda: problem.ask(max_jiter="5 ms"),
        'max_jitter: expected a text with a unit, such as "20 ms", or several; got 0':
            lambda: problem.ask(max_jitter=0),
        "require: expected a text, or several; got 0": lambda: problem.ask(require=0),
    }  # fmt: skip
    for said, call in wrong.items():
        with pytest.raises(DseError) as caught:
            call()
        assert str(caught.value) == said


def test_what_other_libraries_have_is_taken(given: dict[str, Any]) -> None:
    problem = given["problem"]
    plain = dse.simulate(problem, DESIGN, runs=2, seed=3, duration="1 s").to_dict()
    numpy = dse.simulate(
        problem, DESIGN, runs=np.int64(2), seed=np.uint8(3), duration=timedelta(seconds=1), contention=np.bool_(True),  # type: ignore[arg-type]
        time_limit_s=timedelta(minutes=5),
    )  # fmt: skip
    assert numpy.to_dict() == plain
    assert dse.solve(problem, workers=np.int64(1), time_limit_s="5 min").status == "complete"  # type: ignore[arg-type]


def test_times_and_shares() -> None:
    assert [span("t", value) for value in (None, 2, Fraction(1, 2), "90", "1.5 min", timedelta(seconds=3))] == [
        None, 2.0, 0.5, 90.0, 90.0, 3.0
    ]  # fmt: skip
    assert duration("d", timedelta(milliseconds=1)) == "1000 us"
    assert [share("s", value) for value in (0.1, Fraction(1, 3), "10 %")] == [
        Fraction(1, 10), Fraction(1, 3), Fraction(1, 10)
    ]  # fmt: skip


def test_a_verification_is_true_where_everything_was_confirmed(given: dict[str, Any]) -> None:
    data = given["result"].to_dict()
    assert bool(dse.verify(data, problem=given["problem"])) is True
    data["front"][0]["objectives"]["price"] += 1
    rejected = dse.verify(data, problem=given["problem"])
    assert (rejected.status, bool(rejected)) == ("rejected", False)
    assert not Verification("r.json", "p.yaml", "unfinished", (), (), ("something",))


def test_a_misspelt_name_is_no_name() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'slove' \(did you mean 'solve'\?\)"):
        _ = dse.slove  # type: ignore[attr-defined]  # which a type checker finds: an unused comment is an error
