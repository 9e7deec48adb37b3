"""The settings of a question: one table for the file, the command line, results and what is made of them."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import dse
from dse.cli.main import cli
from dse.cli.options import Words
from dse.questions.problem import changed, loads, restated
from dse.questions.question import QuestionChanges, changes_of
from dse.space.model.space import Space
from dse.space.question.settings import OSATE_SETTINGS, SETTINGS, settings_of
from dse.spec.schema.json_schema import json_schema
from dse.support.errors import ProblemError, UsageError

PROBLEM = """
dse: 1
name: settings
processor_types: {cpu: {price: 5 EUR}}
processors: {p: {type: cpu}}
threads:
  a: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 1 ms .. 3 ms}
  b: {processor: p, period: 20 ms, compute_execution_time: 2 ms .. 4 ms, deadline: 5 ms}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
requirements: [utilisation of p <= 100 %]
objectives: [minimise latency of f, minimise price]
"""
EVERY = [(name, value) for name, values in SETTINGS.items() for value in values]
DEADLINES = ["response time of a <= its deadline", "response time of b <= its deadline"]


def test_each_setting_has_one_name_everywhere() -> None:
    assert set(SETTINGS) <= {item.name for item in fields(Space)}
    assert set(SETTINGS) <= {item.name for item in fields(QuestionChanges)}
    described = json_schema()
    for name, values in SETTINGS.items():
        stated = described["properties"][name]
        while "enum" not in stated:
            stated = described["$defs"][stated["$ref"].rpartition("/")[2]] if "$ref" in stated else stated["anyOf"][0]
        assert tuple(stated["enum"]) == values


@pytest.mark.parametrize(("name", "value"), EVERY)
def test_a_result_states_what_it_was_asked_and_every_command_takes_it(name: str, value: str, tmp_path: Path) -> None:
    """By option, by keyword and in the file it is one question: verified, resumed, exported and compared as such."""
    file, stated = tmp_path / "p.yaml", tmp_path / "stated.yaml"
    file.write_text(PROBLEM.lstrip(), encoding="utf-8")
    stated.write_text(f"{PROBLEM.lstrip()}{name}: {value}\n", encoding="utf-8")
    option = f"--{name.replace('_', '-')}"
    out = tmp_path / "r.json"
    done = CliRunner().invoke(cli, ["solve", str(file), option, value, "--json", str(out), "-q"])
    assert done.exit_code in (0, 4), done.output
    data = json.loads(out.read_text())
    solved = dse.solve(file, **{name: value})  # type: ignore[arg-type]
    in_the_file = dse.solve(stated).to_dict()
    assert data["problem"]["effective"][name] == value
    for other in (solved.to_dict(), in_the_file):
        assert {**other["problem"]["effective"]} == data["problem"]["effective"]
        assert other["front"] == data["front"]
    assert dse.verify(out).status == "verified"
    if data["front"]:
        text = dse.export(solved, 1, folder=tmp_path)
        assert settings_of(loads(text).space) == settings_of(dse.load(stated).space)
    for command in (["check"], ["analyse", "--design", "a.period = 20 ms"], ["explain"]):
        found = CliRunner().invoke(cli, [*command, str(file), option, value, "--json", "-"])
        written = json.loads(found.stdout)
        asked = written["problem"]["effective"] if command == ["explain"] else written
        assert asked[name] == value


@pytest.mark.parametrize(("name", "value"), EVERY)
@pytest.mark.parametrize("mark", ["-", "_", " "])
def test_every_spelling_is_taken_in_files_options_and_keywords(name: str, value: str, mark: str) -> None:
    """``response-time`` is ``response_time``, wherever it is written."""
    word = value.replace("_", mark) if "osate" not in value else value
    assert getattr(loads(f"{PROBLEM.lstrip()}{name}: {word}\n").loaded.spec, name) == value
    assert changes_of({name: word}).settings[name] == value
    if mark != " ":
        assert Words([value.replace("_", "-")]).convert(word, None, None).replace("-", "_") == value.replace("-", "_")


def test_words_of_threads_are_taken_with_hyphens() -> None:
    said = PROBLEM.replace("period: 20 ms,", "period: 20 ms, core: first-fit, priority: deadline monotonic,")
    thread = loads(said).loaded.spec.threads["b"]
    assert (thread.core, thread.priority) == (("first_fit",), ("deadline_monotonic",))


def test_a_result_of_an_older_meaning_is_refused_by_name() -> None:
    problem = loads(PROBLEM)
    effective = dict(dse.solve(problem).problem.effective)
    for name in SETTINGS:
        older = {key: value for key, value in effective.items() if key != name}
        if name in OSATE_SETTINGS:  # the profile `dse` does not look at it
            assert restated(problem, older).space == restated(problem, effective).space
            older["profile"] = "osate-2.19"
        with pytest.raises(UsageError, match=f"does not state '{name}'.*solve the problem again"):
            restated(problem, older)
        with pytest.raises(UsageError, match="it is one of"):
            restated(problem, {**effective, name: "otherwise"})


def test_unknown_values_are_usage_errors() -> None:
    with pytest.raises(UsageError, match="processing: expected execution_time, response_time; got 'busy'"):
        changed(loads(PROBLEM), QuestionChanges(processing="busy"))
    with pytest.raises(ProblemError, match="expected one of stated, all, none"):
        loads(PROBLEM + "deadlines: some\n")


def texts(problem: dse.Problem) -> list[str]:
    return [item.text for item in problem.space.requirements if "deadline" in item.text]


@pytest.mark.parametrize(
    ("said", "means", "required"),
    [
        ("", "stated", DEADLINES[1:]),
        ("deadlines: stated\n", "stated", DEADLINES[1:]),
        ("profile: osate-2.19\ndeadlines: stated\n", "stated", DEADLINES[1:]),
        ("deadlines: all\n", "all", DEADLINES),
        ("deadlines: none\n", "none", []),
        ("profile: osate-2.2\n", "none", []),
        ("profile: osate-2.19\ndeadlines: all\n", "all", DEADLINES),
    ],
)
def test_which_deadlines_count(said: str, means: str, required: list[str]) -> None:
    problem = loads(PROBLEM + said)
    assert (problem.space.deadlines, texts(problem)) == (means, required)


def test_deadlines_follow_the_profile_unless_they_are_said() -> None:
    unsaid, said = loads(PROBLEM), loads(PROBLEM + "deadlines: all\n")
    assert changed(unsaid, QuestionChanges(profile="osate-2.2")).space.deadlines == "none"
    assert changed(said, QuestionChanges(profile="osate-2.2")).space.deadlines == "all"
    assert changed(unsaid, QuestionChanges(profile="osate-2.2", deadlines="stated")).space.deadlines == "stated"
    assert texts(changed(unsaid, QuestionChanges(deadlines="all"))) == texts(said) == DEADLINES
    assert texts(changed(said, QuestionChanges(deadlines="none"))) == []


def test_stated_deadlines_are_those_of_the_threads_that_have_one() -> None:
    """Under `stated` a thread without a deadline is never late; under `all` it ends by its period."""
    from dse.analysis.limits import build_limit
    from dse.analysis.scheduling.responses import UNBOUNDED_NS
    from dse.analysis.views import View
    from dse.space.question.settings import deadline_requirements

    bounds: dict[str, list[Any]] = {}
    for word in ("stated", "all"):
        space = replace(loads(PROBLEM).space, deadlines=word)
        limits = [build_limit(space, item) for item in deadline_requirements(space, lambda _: "")]
        bounds[word] = [limit.bound(View((0,) * len(space.decisions))) for limit in limits]
    assert bounds == {"stated": [5_000_000], "all": [10_000_000, 5_000_000]}
    mixed = PROBLEM.replace(
        "deadline: 5 ms}", "type: [quick, slow]}\nthread_types: {quick: {deadline: 5 ms}, slow: {}}"
    )
    space = loads(mixed).space
    [limit] = [build_limit(space, item) for item in deadline_requirements(space, lambda _: "")]
    kind = space.decision_index("b.type")
    assert kind is not None
    views = [View(tuple(option * (at == kind) for at in range(len(space.decisions)))) for option in (0, 1)]
    assert [limit.bound(view) for view in views] == [5_000_000, UNBOUNDED_NS]


MEET = """
dse: 1
name: d
processor_types: {c: {cores: 1}}
processors: {p: {type: c}}
threads:
  a: {processor: p, period: [5 ms, 10 ms], compute_execution_time: 1 ms}
  b: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
  z: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
connections: {x: {from: a, to: z, port: data}, y: {from: b, to: z, port: data}}
flows: {f: {path: [a, z]}, g: {path: [b, z]}}
"""
REFUSED = [
    "objectives: [minimise disparity of z]",
    "requirements: [disparity of z <= 20 ms]",
    "metrics: {m: disparity of z * 2}\nobjectives: [minimise m]",
]


@pytest.mark.parametrize("profile", ["osate-2.2", "osate-2.19"])
@pytest.mark.parametrize("text", REFUSED)
def test_what_a_profile_refuses_is_refused_in_the_same_words_where_an_option_asks_for_it(
    text: str, profile: str
) -> None:
    with pytest.raises(ProblemError) as found:
        loads(f"{MEET}{text}\nprofile: {profile}\n")
    problem = loads(f"{MEET}{text}\n")
    with pytest.raises(UsageError) as asked:
        problem.ask(profile=profile)
    assert [str(item) for item in found.value.diagnostics] == str(asked.value).splitlines()[1:]
    problem.ask(profile="dse", processing="response_time", deadlines="all")


def test_objectives_that_others_replace_may_be_of_what_the_profile_does_not_know() -> None:
    problem = loads(f"{MEET}{REFUSED[0]}\n").ask(profile="osate-2.19", minimise="latency of f")
    result = dse.solve(problem)
    assert not dse.verify(result).findings
