"""What is exported: a problem file that keeps its comments and gives the same figures, and texts for other tools."""

from __future__ import annotations

import io
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx
import pytest
import yaml

import dse
from dse.answers.exports.formats import graphml, graphviz, ros2_parameters
from dse.answers.exports.yaml_editing import YamlDocument, yaml_text
from dse.answers.reading import read_result
from dse.answers.result import Result
from dse.cli.main import run
from dse.examples.shipped import example_folder
from dse.questions.reopen import reopen
from dse.questions.verbs.export import export, find_design
from dse.spec.schema.model import Ros2
from dse.support.errors import UsageError
from tests.answers.hostile import NAMES, PROBLEM, hostile_result
from tests.helpers.effort import LONG

CORES = """\
dse: 1
name: cores
deadlines: all
processor_types: {board: {cores: 2}}
processors: {main: {type: board}}
threads:
  block:
    processor: main
    period: 10 ms  # a comment
    compute_execution_time: 6 ms
  flow: {processor: main, period: 10 ms, compute_execution_time: 6 ms}
  any: {processor: main, core: any, period: 40 ms, compute_execution_time: 1 ms}
  listed: {processor: main, core: [1, 2], period: 40 ms, compute_execution_time: 1 ms}
  shared: &it {processor: main, period: 80 ms, compute_execution_time: 1 ms}
  same: *it
objectives: [minimise utilisation of main]
"""


def solved(path: Path, **asked: Any) -> Result:
    return dse.solve(path, **asked)


def comments(text: str) -> list[str]:
    return re.findall(r"#.*", text)


def assert_same_figures(result: Result, number: int, path: Path) -> None:
    """Analysing the file gives the point's metrics; the file leaves nothing open that could give others."""
    path.write_text(export(result, number, folder=path.parent), encoding="utf-8")
    analysis = dse.analyse(dse.load(path))
    point = next(item for item in result.front if item.id == number)
    for name, value in point.metrics.items():  # stated cores have figures of their own besides
        assert (analysis.metrics[name], analysis.metric_units[name]) == (value, result.metric_units[name]), name
    assert analysis.is_feasible
    assert dse.check(dse.load(path)).size == 1


@pytest.mark.parametrize("name", ["inmark", "starter", "move_base", "autoware_reference"])
def test_the_exported_problem_gives_the_same_figures(name: str, tmp_path: Path) -> None:
    result = dse.solve(example_folder() / f"{name}.yaml", time_limit_s=20)
    ends = 2 if LONG else 1
    for point in (*result.front[:ends], *result.front[-ends:]):
        assert_same_figures(result, point.id, tmp_path / f"{point.id}.yaml")


def test_every_comment_is_kept(tmp_path: Path) -> None:
    source = example_folder() / "inmark.yaml"
    text = export(dse.solve(source), 1, folder=tmp_path)
    flat = " ".join(comments(text))
    missing = [comment for comment in comments(source.read_text(encoding="utf-8")) if comment.strip("# ") not in flat]
    assert missing == []
    assert "computer: {type: RT101}" in text
    assert "period: 20 ms          # odometry comes every 20 ms: no slower than that" in text


def test_beside_the_original_nothing_moves(tmp_path: Path) -> None:
    shutil.copytree(example_folder(), tmp_path / "problems")
    path = tmp_path / "problems" / "inmark.yaml"
    text = export(dse.solve(path), 1, folder=path.parent)
    assert "  - catalogues/platforms.yaml\n" in text


def test_the_question_of_the_command_line_goes_along(tmp_path: Path) -> None:
    source = example_folder() / "inmark.yaml"
    result = dse.solve(source, max_jitter="20ms", profile="osate-2.2", minimise=["power", "jitter of gnss_to_sprayer"])
    path = tmp_path / "chosen.yaml"
    path.write_text(export(result, 1, folder=tmp_path), encoding="utf-8")
    space = dse.load(path).space
    assert space.profile == "osate-2.2"
    assert "jitter of software_chain <= 20 ms" in {item.text for item in space.requirements}
    assert [item.metric.name for item in space.objectives] == ["power", "jitter of gnss_to_sprayer"]
    assert_same_figures(result, 1, path)


SHARED = """
# catalogue figures are decisions too
dse: 1
name: Elsewhere
processor_types: {cpu_a: {price: [10 EUR, 12 EUR], power: 1 W}}   # two offers
thread_types: {filter: {compute_execution_time: [1 ms, 2 ms], period: &periods [10 ms, 20 ms]}}
processors: {cpu: {type: cpu_a}, spare: {type: cpu_a, optional: true}}
devices: {source: {period: 10 ms}}
threads:
  one: {type: filter, processor: [cpu, spare], dispatch_protocol: periodic}   # block or flow
  two:
    type: filter
    processor: cpu
    dispatch_protocol: periodic
    # the end of two
  three: {processor: cpu, period: *periods, compute_execution_time: {cpu_a: [1 ms, 3 ms]}}
connections: {wire: {from: source, to: one}}
flows: {main: {path: [source, one]}}
rules: [one.period == 20 ms]
requirements:
  - utilisation of cpu <= 90 %   # stays
objectives: [minimise jitter of main, minimise price, maximise utilisation of cpu]
"""


def test_decisions_inherited_from_types_or_shared_by_aliases(tmp_path: Path) -> None:
    source = tmp_path / "source.yaml"
    source.write_text(SHARED, encoding="utf-8")
    result = dse.solve(source)
    assert result.status == "complete"
    for point in result.front:
        text = export(result, point.id, folder=tmp_path)
        (tmp_path / "out.yaml").write_text(text, encoding="utf-8")
        analysis = dse.analyse(tmp_path / "out.yaml")
        expected = dse.analyse(source, point.decisions)
        assert analysis.metrics == expected.metrics
        assert [c for c in comments(SHARED) if c not in text] == []


@pytest.mark.parametrize(
    ("text", "position", "expected"),
    [
        ("a: [x, y]  # c\n", 1, "a: y  # c\n"),
        ("a:\n  - x  # first\n  - y  # second\nb: 1\n", 0, "a:\n    x  # first\n  # second\nb: 1\n"),
        ("a:\n- x\n- y\nb: 1\n", 1, "a:\n  y\nb: 1\n"),
        ("a: [x,  # one\n    'y z']  # two\n", 1, "a:  # one\n    'y z'  # two\n"),
        ("{a: [x, y], b: 1}\n", 1, "{a: y, b: 1}\n"),
    ],
)
def test_a_list_becomes_one_of_its_items(text: str, position: int, expected: str) -> None:
    draft = YamlDocument(text)
    draft.choose(draft.find(["a"]), position)
    found = draft.result()
    chosen = yaml.safe_load(text)["a"][position]
    assert yaml.safe_load(found) == {**yaml.safe_load(text), "a": chosen}
    assert [comment for comment in comments(text) if comment not in found] == []
    assert " ".join(found.split()) == " ".join(expected.split())


@pytest.mark.parametrize(
    "text", ["10 ms", "no", "a: b", "#x", "- y", "ü", "1e3", "", " x", "'q'", '"q"', "a\u2028b", "🤖", "~"]
)
def test_scalars_read_back(text: str) -> None:
    value = yaml_text(text)
    assert yaml.safe_load(f"[{value}]") == [text]
    assert yaml.safe_load(f"k: {value}") == {"k": text}


def test_hostile_names_survive_every_format(tmp_path: Path) -> None:
    source = tmp_path / "hostile.yaml"
    source.write_text(PROBLEM, encoding="utf-8")
    result = dse.solve(source)
    for point in result.front:
        assert_same_figures(result, point.id, tmp_path / "fixed.yaml")
        text = (tmp_path / "fixed.yaml").read_text(encoding="utf-8")
        assert [
            comment for comment in ("# a comment to keep", "# as the plant allows", "# fast") if comment not in text
        ] == []
        graph = networkx.read_graphml(io.BytesIO(graphml(result.space, point.design).encode()))
        assert {NAMES["worker"], NAMES["cpu"], NAMES["sensor"], NAMES["wire bus"]} == set(graph.nodes)
        names = Ros2(parameters={f"{NAMES['worker']}.rate": "hz"})
        [(name, fields)] = yaml.safe_load(ros2_parameters(result.space, point.design, "a\nb: c", names)).items()
        assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name)
        assert fields["ros__parameters"]["hz"] > 0
        dot = graphviz(result.space, point.design)
        outside = re.sub(r'"(?:[^"\\]|\\.)*"', '""', dot)
        assert "<" not in outside
        assert re.fullmatch(r'digraph "" \{\n(?:  [^"<]*(?:"")?[^"<]*;\n)+\}\n', outside.replace("; node", ", node"))


TYPES = """
dse: 1
name: types
device_types:
  cheap: {period: 50 ms, price: 10 EUR, compute_execution_time: [1 ms .. 2 ms, 1 ms .. 3 ms]}
  good: {period: 10 ms, price: 90 EUR}
thread_types: {fusion: {compute_execution_time: 1 ms}}
devices: {gnss: {type: [cheap, good]}, imu: {type: good}}
threads: {nav: {type: fusion, queue_size: [1, 2], dispatch_protocol: aperiodic}}
connections: {a: {from: gnss, to: nav, data_size: 8 B, rate: [5 Hz, 10 Hz]}, b: {from: imu, to: nav}}
flows: {main: {path: [gnss, nav]}}
objectives: [minimise latency of main, minimise price]
"""


def test_the_graph_has_everything_that_was_decided() -> None:
    result = dse.solve(dse.loads(TYPES))
    assert {point.decisions["gnss.type"] for point in result.front} >= {"cheap"}
    for point in result.front:
        graph = networkx.read_graphml(io.BytesIO(graphml(result.space, point.design).encode()), force_multigraph=True)
        assert graph.nodes["gnss"]["type"] == point.decisions["gnss.type"]
        assert (graph.nodes["imu"]["type"], graph.nodes["nav"]["type"]) == ("good", "fusion")
        assert graph.nodes["nav"]["queue_size"] == point.decisions["nav.queue_size"]
        (edge,) = [facts for source, _, facts in graph.edges(data=True) if source == "gnss"]
        assert edge["rate"] == point.decisions["a.rate"]
        found = graph.nodes["gnss"].get("compute_execution_time")
        assert found == point.decisions.get("gnss.compute_execution_time")
        assert f"gnss\\n{point.decisions['gnss.type']}" in graphviz(result.space, point.design)


def test_the_parameters_are_those_that_nodes_declare(tmp_path: Path) -> None:
    stated = {
        "ekf_fusion.main_loop.period": "loop.period",
        "gnss_provider.rate": "hz",
        "sprayer.rate": "rate [int Hz]",
    }
    problem = (example_folder() / "inmark.yaml").read_text(encoding="utf-8")
    file = tmp_path / "inmark.yaml"
    file.write_text(
        f"{problem}\nros2: {{nodes: {{gnss_provider: /gnss}}, parameters: {json.dumps(stated)}}}\n", "utf-8"
    )
    shutil.copytree(example_folder() / "catalogues", tmp_path / "catalogues")
    result = dse.solve(file)
    point = next(item for item in result.front if item.decisions["ekf_fusion.main_loop.period"] == "4 ms")
    text = export(result, point.id, "ros2")
    assert yaml.safe_load(text) == {
        "ekf_fusion": {"ros__parameters": {"loop.period": 0.004}},
        "/gnss": {"ros__parameters": {"hz": 20.0}},
        "sprayer": {"ros__parameters": {"rate": 250}},
    }
    assert "# Without a stated parameter, so that their nodes keep what they have: " in text
    assert "no parameter of a node is stated for it" not in text
    (tmp_path / "r.json").write_text(result.to_json(), encoding="utf-8")
    out = tmp_path / "out.yaml"
    for _ in range(2):
        assert run(["export", f"{tmp_path}/r.json#{point.id}", "--format", "ros2", "-o", str(out)]) == 0
    assert (tmp_path / "out.pinning.csv").read_text(encoding="utf-8") == export(result, point.id, "pinning")
    (tmp_path / "out.pinning.csv").write_text("mine", encoding="utf-8")
    assert run(["export", f"{tmp_path}/r.json#{point.id}", "--format", "ros2", "-o", str(out)]) == 2
    assert (tmp_path / "out.pinning.csv").read_text(encoding="utf-8") == "mine"


def test_a_chosen_period_that_no_parameter_has_is_told() -> None:
    """A node with parameters of its own keeps its period where none of them is the period."""
    result = dse.solve(example_folder() / "report" / "component_parameters.yaml")
    for point in result.front:
        text = export(result, point.id, "ros2")
        period = point.decisions["gnss_localisation.period"]
        assert f"no parameter of a node is stated for it: gnss_localisation.period {period}\n" in text
        assert "period" not in yaml.safe_load(text)["/gnss_localisation"]["ros__parameters"]


def test_parameters_that_no_node_declares_are_not_written() -> None:
    result = dse.solve(example_folder() / "starter.yaml")
    with pytest.raises(UsageError, match="the problem states no parameters of nodes: state what the nodes declare"):
        export(result, 1, "ros2")


def test_an_unknown_alternative_is_refused() -> None:
    with pytest.raises(UsageError, match="there is no alternative 77; ids: 1, 2"):
        find_design(hostile_result(), 77)


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, out = str(tmp_path / "result.json"), str(tmp_path / "out.yaml")
    question = [
        "solve",
        str(example_folder() / "inmark.yaml"),
        "-q",
        "--json",
        result,
        "--alternatives",
        "1",
        "--top",
        "3",
    ]
    assert run([*question, "--within", "15%"]) == 0
    others = [item["id"] for group in read_result(result)["others"] for item in group["designs"]]
    assert others
    for number in ("2", others[0]):
        assert run(["export", result, "--alternative", number, "-o", out]) == 0
        assert run(["analyse", out]) == 0
        capsys.readouterr()
    for form in ("pinning", "dot", "graphml", "svg"):
        assert run(["export", result, "--alternative", "1", "--format", form]) == 0
        assert capsys.readouterr().out
    assert run(["compare", f"{result}#1", f"{result}#{others[0]}"]) == 0
    assert "decision" in capsys.readouterr().out
    assert run(["compare", "baseline", "baseline"]) == 2
    assert run(["compare", result, f"{result}#1"]) == 2


def test_what_an_export_is_made_from_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    problem, result, link = tmp_path / "own.yaml", tmp_path / "own.json", tmp_path / "link.yaml"
    shutil.copy(example_folder() / "starter.yaml", problem)
    link.symlink_to(problem)
    assert run(["solve", str(problem), "--json", str(result)]) == 0
    before = problem.read_bytes(), result.read_bytes()
    for output, what in (
        (problem, "the problem file"),
        (link, "the problem file"),
        (result, "the result"),
    ):
        assert run(["export", str(result), "--alternative", "1", "-o", str(output)]) == 2
        assert f"{output}: is {what}" in capsys.readouterr().err
    assert (problem.read_bytes(), result.read_bytes()) == before
    for _ in range(2):  # other files are written over
        assert run(["export", str(result), "--alternative", "1", "-o", str(tmp_path / "other.yaml")]) == 0


def test_reopening_gives_the_result_back(tmp_path: Path) -> None:
    result = dse.solve(example_folder() / "inmark.yaml", max_jitter="20ms", fix="canbus0.type = can_250k")
    path = tmp_path / "result.json"
    path.write_text(result.to_json(), encoding="utf-8")
    again = reopen(path)
    assert again.to_dict() == result.to_dict()
    assert again == replace(result, space=again.space)


def test_a_wrong_figure_is_noticed(tmp_path: Path) -> None:
    result = dse.solve(example_folder() / "starter.yaml")
    path = tmp_path / "result.json"
    price = result.front[0].objectives["price"]
    path.write_text(result.to_json().replace(f'"price": {price}', f'"price": {price + 1}'), encoding="utf-8")
    with pytest.raises(UsageError, match="has other figures"):
        reopen(path)


def test_reopening_hostile_names(tmp_path: Path) -> None:
    source = tmp_path / "hostile.yaml"
    source.write_text(PROBLEM, encoding="utf-8")
    name = NAMES["flow"]
    result = dse.solve(source, max_jitter="1 s", require=f"jitter of {name!r} <= 2 s" if "'" not in name else ())
    path = tmp_path / "result.json"
    path.write_text(result.to_json(), encoding="utf-8")
    assert reopen(path).to_dict() == result.to_dict()


@pytest.mark.parametrize(
    "command", [["report", "-o", "out"], ["export", "--alternative", "1"], ["compare", "whole.json"]]
)
@pytest.mark.parametrize("change", ["rank", "point", "score"])
def test_ranks_and_ids_are_judged_again(
    change: str,
    command: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["solve", str(example_folder() / "starter.yaml"), "-q", "--json", "whole.json"]) == 0
    data = json.loads(Path("whole.json").read_text(encoding="utf-8"))
    if change == "point":
        del data["front"][1]
    else:
        data["front"][1][change] = {"rank": data["front"][0]["rank"], "score": "0.001"}[change]
    Path("changed.json").write_text(json.dumps(data), encoding="utf-8")
    assert run([command[0], "changed.json", *command[1:]]) == 2
    said = capsys.readouterr().err
    assert said.startswith("dse: changed.json: front[") and "`dse verify` says all that is wrong" in said
    assert run([command[0], "whole.json", *command[1:]]) == 0


def test_chosen_cores_stand_at_their_threads(tmp_path: Path) -> None:
    """As ``core: 2``, in block and in flow style, in the place of ``any``; as a rule only where an alias is shared."""
    source = tmp_path / "cores.yaml"
    source.write_text(CORES, encoding="utf-8")
    result = solved(source)
    point = result.front[0]
    text = export(result, point.id, folder=tmp_path)
    stated = {name: fields.get("core") for name, fields in yaml.safe_load(text)["threads"].items()}
    chosen = {name.removesuffix(".core"): int(core) for name, core in point.decisions.items() if name.endswith(".core")}
    assert len(chosen) == 6 and stated == {**chosen, "shared": None, "same": None}
    analysis = dse.analyse(dse.loads(text))
    assert analysis.is_feasible and analysis.decisions["same.core"] == point.decisions["same.core"]


@pytest.mark.parametrize("place", ["main", "catalogue"])
def test_files_of_samples_are_found_from_where_the_file_is_written(tmp_path: Path, place: str) -> None:
    base = "dse: 1\nname: s\nthreads: {a: {processor: p, period: [1 s, 2 s], compute_execution_time: 1 ms}}\n"
    base += "processor_types: {b: {cores: 1}}\nprocessors: {p: {type: b}}\nobjectives: [minimise utilisation of p]\n"
    uncertainty = "uncertainty: {threads.a.compute_execution_time: {samples: s.csv, unit: ms}}\n"
    (tmp_path / "s.csv").write_text("a\n1\n2\n", encoding="utf-8")
    (tmp_path / "c.yaml").write_text(uncertainty, encoding="utf-8")
    (tmp_path / "p.yaml").write_text(base + (uncertainty if place == "main" else "include: c.yaml\n"), encoding="utf-8")
    result = solved(tmp_path / "p.yaml")
    for folder in (tmp_path, tmp_path / "deep" / "er"):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "o.yaml").write_text(export(result, 1, folder=folder), encoding="utf-8")
        assert dse.load(folder / "o.yaml").loaded.stated[0].numbers


UNUSED = """
dse: 1
name: unused
profile: osate-2.19
processor_types: {board: {}}
processors: {main: {type: board}}
devices: {d: {period: 4 ms}}
thread_types:
  timed: {dispatch_protocol: periodic, period: [20 ms, 40 ms], compute_execution_time: 6 ms}
  woken: {dispatch_protocol: aperiodic, period: 10 ms, compute_execution_time: 2 ms}
threads: {t: {type: [timed, woken], processor: main}}
connections: {c: {from: d, to: t}}
flows: {f: {path: [d, t]}}
objectives: [minimise latency of f]
baseline: {t: {type: timed, period: 20 ms}}
cost_of_change: {t: {type: 2, period: 3}}
"""


@pytest.mark.parametrize("profile", ["dse", "osate-2.19"])
def test_what_a_design_does_not_use_neither_counts_nor_costs(profile: str) -> None:
    """The period goes with the other type, and with it what changing it costs; before, the export did not load."""
    result = dse.solve(dse.loads(UNUSED.replace("osate-2.19", profile)))
    assert result.front[0].decisions["t.type"] == "woken"
    text = export(result, 1)
    again = dse.loads(text)
    assert dse.analyse(again).metrics["latency of f"] == result.front[0].metrics["latency of f"]
