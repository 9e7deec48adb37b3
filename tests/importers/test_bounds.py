"""What a file asks for is bounded, by size and by time: a few lines never take all memory, or end with exit code 70."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run
from dse.importers.allowance import allowed
from dse.importers.ros2.launch.parameters import is_like, is_named
from dse.importers.ros2.yaml_places import UniqueNames

NODE = "Node(package='p', executable='e', name='n')"
FUNCTION = "def f(context, *more):\n    return []\n"


def put(folder: Path, text: str, name: str = "x.launch.py") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def python(*lines: str) -> str:
    """A launch file in Python; the body begins in line 4."""
    return f"{FUNCTION}def generate_launch_description():\n" + "".join(f"    {line}\n" for line in lines)


def doubled(line: str) -> tuple[str, ...]:
    return (line,) * 40


GROWING = {
    "a text": (("x = 'a'", *doubled("x = x + x")), "a text of more than 100,000 characters"),
    "a path": (("x = 'a'", *doubled("x = x / x")), "a text of more than 100,000 characters"),
    "a list": (("x = [1]", *doubled("x = x + x")), "steps, values and entries"),
    "a list of itself": (("x = [1]", *doubled("x.extend(x)")), "steps, values and entries"),
    "a list that is gone through": (("x = [1]", "y = [x.append(1) for i in x]"), "steps, values and entries"),
    "a loop": (("x = [1]", "for i in x:", "    x.append(1)"), "steps, values and entries"),
    "lists of one node": (
        (f"x = {NODE}", *doubled("x = [x, x]"), "return LaunchDescription(x)"),
        "steps, values and entries",
    ),
    "lists that are compared": (
        ("x = [1]", "y = [1]", *(("x = [x, x]", "y = [y, y]") * 40)[:80], "z = x == y"),
        "steps, values and entries",
    ),
    "a condition": ((f"x = {NODE}", *doubled("x = [x, x]"), "Node(condition=x)"), "steps, values and entries"),
    "groups": (
        (f"x = {NODE}", *doubled("x = GroupAction([x, x])"), "return LaunchDescription([x])"),
        "steps, values and entries",
    ),
    "a list in itself": (
        ("x = []", "x.append(x)", "Node(package=x)"),
        ":6: too large to be read: it is nested too deeply",
    ),
    "a dictionary in itself": (
        ("x = {}", "x['a'] = x", "Node(parameters=[x])"),
        ":6: too large to be read: it is nested",
    ),
    "a group in itself": (
        (f"x = GroupAction([{NODE}])", "x.append(x)", "return LaunchDescription([x])"),
        "more than 80 levels of groups and files",
    ),
    "many groups": (
        (
            f"x = {NODE}",
            "for i in " + "[1] + " * 200 + "[1]:",
            "    x = GroupAction([x])",
            "return LaunchDescription([x])",
        ),
        "more than 80 levels of groups and files",
    ),
    "a deep expression": (("x = " + "+".join("a" * 900),), ":4: too large to be read: it is nested too deeply"),
    "a number": ((f"x = str(0x{'f' * 5000})",), ":4: too large to be read: a number of too many digits"),
    "a sum": (("x = 1", *(("x = x + x",) * 20_000)), "a number of too many digits"),
}


@pytest.mark.parametrize("case", GROWING)
def test_what_grows_without_end_is_refused_at_its_line(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dse.importers.ros2.launch.reading.allowed", lambda: allowed(50_000))
    lines, words = GROWING[case]
    assert run(["import", put(tmp_path, python(*lines)), "-o", str(tmp_path / "y")]) == 3
    said = capsys.readouterr().err
    assert words in said and re.match(rf"{tmp_path}/x\.launch\.py:[0-9]+", said)
    assert not (tmp_path / "y").exists()


READ = {
    "arguments of an unknown call": ("OpaqueFunction(function=f, args=g())", "gives in Python"),
    "keywords of an unknown call": ("OpaqueFunction(function=f, kwargs=g())", "gives in Python"),
    "methods of other types": ("'a'.append(1), (1).append(1), (1).extend(1), {}.append(1), (1).items()", ""),
    "a path with NUL": (r"IncludeLaunchDescription('/a\x00b')", "there is no file"),
    "half a character": (r"IncludeLaunchDescription('/a\ud800b')", "there is no file /a?b"),
    "a cycle of links": ("IncludeLaunchDescription('loop/a')", "there is no file"),
    "a long path": (f"IncludeLaunchDescription('{'a' * 5000}')", "there is no file"),
    "parameters": (r"Node(name='m', executable='e', parameters=['/a\x00', '/\ud800', 'loop/a'])", "no parameter file"),
}


@pytest.mark.parametrize("case", READ)
def test_what_leads_nowhere_is_told_and_the_rest_is_read(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")
    line, words = READ[case]
    found = dse.import_file(put(tmp_path, python(f"return LaunchDescription([{NODE}, {line}])")))
    assert next(iter(yaml.safe_load(found.text)["threads"])) == "n"
    assert words in "\n".join(map(str, found.remarks))


@pytest.mark.parametrize(
    "value",
    [
        "$(var " * 3000 + "a" + ")" * 3000,
        f"$(eval '{'-' * 50_000}1')",
        f"$(eval '0x{'f' * 5000} + 1')",
        "$(eval '1/0')",
    ],
)
def test_texts_that_are_too_deep_or_too_large_are_not_static(value: str, tmp_path: Path) -> None:
    text = f'<launch><let name="x" value="{value}"/><node exec="e" name="n"/><node exec="e" name="$(var x)"/></launch>'
    found = dse.import_file(put(tmp_path, text, "x.launch.xml"))
    assert list(yaml.safe_load(found.text)["threads"]) == ["n", "e"]
    assert "x.launch.xml:1: warning: not static, left out: its name (node $(var x)): " in str(found.remarks[0])


def test_files_that_include_each_other_many_times_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in range(12):
        inner = f'<include file="$(dirname)/{number + 1}.launch.xml"/>' * 10
        put(tmp_path, f"<launch>{inner if number < 11 else '<log/>'}</launch>", f"{number}.launch.xml")
    assert run(["import", str(tmp_path / "0.launch.xml")]) == 3
    assert "more than 5,000 times a file is included" in capsys.readouterr().err


def test_nodes_are_counted_and_a_name_that_many_have_costs_no_search(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    node = '<node pkg="p" exec="e" name="n"/>\n'
    assert run(["import", put(tmp_path, f"<launch>\n{node * 20_000}</launch>", "x.launch.xml")]) == 3
    assert "x.launch.xml:10002: more than 10,000 nodes are started" in capsys.readouterr().err
    names = UniqueNames()
    assert [names.new("n") for _ in range(20_000)][::9999] == ["n", "n_10000", "n_19999"]
    assert [names.new(name) for name in ("m_2", "m", "m", "m")] == ["m_2", "m", "m_3", "m_4"]


@pytest.mark.parametrize(
    ("node", "pattern", "is_its"),
    [
        ("/a" * 40, "/**" * 12 + "/x", False),
        ("/a" * 40, "/**/a" * 20 + "/x", False),
        ("/a" * 40, "/**/a" * 20, True),
        ("/" + "a" * 60, "/" + "*a" * 20 + "b", False),
        ("/" + "a" * 60, "/" + "*a" * 20, True),
        ("/a/b", "/**", True),
        ("/a/b", "/**/a/**/b/**", True),
        ("/a/b", "/*", False),
        ("/a/b", "/a/b/*", False),
        ("/", "/**", False),
        ("", "/**", True),
    ],
)
def test_names_with_stars_are_compared_without_backtracking(node: str, pattern: str, is_its: bool) -> None:
    assert is_named(node, pattern) == is_its


def test_a_name_is_like_a_pattern_as_by_the_regular_expression() -> None:
    texts = ["", "a", "b", "ab", "ba", "aab", "abab", "abba", "bbb"]
    patterns = ["", "a", "*", "**", "a*", "*a", "a*b", "*a*", "a**b", "*b*b"]
    for least, regular in ((0, ".*"), (1, ".+")):
        for pattern in patterns:
            expression = re.escape(pattern).replace(r"\*", regular)
            for text in texts:
                assert is_like(text, pattern, least) == (re.fullmatch(expression, text) is not None)


LARGE = {
    "x.launch.py": python(
        "x = [1, 2, 3]", "y = [[[i, j, k, m] for i in x for j in x] for k in x]", *(["z = 1"] * 2000)
    ),
    "x.launch.xml": "<launch>" + '<node exec="e" name="n"/>' * 2000 + "</launch>",
    "x.launch.yaml": "launch:\n" + "- node: {exec: e, name: n}\n" * 2000,
    "x.yaml": "/a:\n  ros__parameters:\n" + "".join(f"    p{number}: {{rate: 1}}\n" for number in range(2000)),
    "x.aadl": "package p public\n" + "".join(f"system s{number} end s{number};\n" for number in range(1000)) + "end p;",
    "x.callbacks.yaml": "named_paths: []\nnodes:\n" + "- {node_name: a}\n" * 2000,
}


@pytest.mark.parametrize("name", LARGE)
def test_importers_keep_the_limit_of_time(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["import", put(tmp_path, LARGE[name], name), "--time-limit", "0.001s"]) == 5
    assert "the time limit came" in capsys.readouterr().err


MODELS = {
    "arrays": (
        (
            "thread t end t; process q end q; process implementation q.i subcomponents a: thread t[200000][200000]; "
            "end q.i; system s end s; system implementation s.i subcomponents q: process q.i; end s.i;"
        ),
        "x.aadl:1:186: more than 200000 components",
    ),
    "parentheses": (f"system s properties x => {'(' * 50_000}1{')' * 50_000}; end s;", "nested too deeply"),
    "feature groups": (
        "feature group g0 features p: out data port; end g0; "
        + "".join(f"feature group g{n} features a: feature group g{n - 1}; b: feature group g{n - 1}; end g{n};"
                  for n in range(1, 39))
        + "system a features x: feature group g38; end a; system b features x: feature group inverse of g38; end b;"
        " system s end s; system implementation s.i subcomponents a: system a; b: system b;"
        " connections c: feature group a.x -> b.x; end s.i;",
        "too large to be read: more than",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MODELS)
def test_models_that_grow_without_end_are_refused(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dse.importers.aadl.reading.PIECES", 3_000_000)
    text, words = MODELS[case]
    assert run(["import", put(tmp_path, f"package p public {text} end p;", "x.aadl")]) == 3
    assert words in capsys.readouterr().err


def test_a_yaml_file_of_another_tool_has_a_bounded_number_of_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dse.importers.ros2.yaml_places.MOST_VALUES", 5)
    text = "/a:\n  ros__parameters: {rate: 1, b: [1,\n  2]}\n"
    assert run(["import", put(tmp_path, text, "x.yaml")]) == 3
    assert "x.yaml:2:34: more than 5 values" in capsys.readouterr().err


def test_scalars_of_yaml_may_have_aliases_and_nothing_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "/a:\n  ros__parameters: {other: &x 10, rate: *x, none: ~, empty: }\n"
    found = yaml.safe_load(dse.import_file(put(tmp_path, text, "x.yaml")).text)
    assert found["threads"]["a.timer"]["period"] == "100 ms"
    for value in ("&x {b: *x}", "[&y [1], *y]"):
        assert run(["import", put(tmp_path, f"/a:\n  ros__parameters: {{rate: {value}}}\n", "x.yaml")]) == 3
        assert re.search(r"x\.yaml:2:[0-9]+: aliases are not expected here", capsys.readouterr().err)


@pytest.mark.skipif(os.name == "nt", reason="names of files are bytes elsewhere")
def test_a_file_whose_name_is_no_text_gives_a_file_that_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    name = os.fsdecode(b"a\xff.launch.xml")
    try:
        Path(name).write_text('<launch><node exec="e" name="n"><param name="rate" value="5"/></node></launch>', "utf-8")
    except OSError:
        pytest.skip("this file system has no such names")
    assert run(["import", name, "-o", "y.yaml"]) == 0
    assert yaml.safe_load(Path("y.yaml").read_text(encoding="utf-8"))["name"] == "a?.launch"
    assert run(["check", "y.yaml"]) == 0
    Path("y.yaml").rename(os.fsdecode(b"y\xff.yaml"))
    assert run(["solve", os.fsdecode(b"y\xff.yaml"), "--minimise", "price", "-q", "--json", "r.json"]) == 0
    assert '"y?.yaml"' in Path("r.json").read_text(encoding="utf-8")
