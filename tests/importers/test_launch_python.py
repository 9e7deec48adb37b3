"""What is followed of Python in launch files: drawn expressions have the values that Python gives them."""

from __future__ import annotations

import ast
import os
import random
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
import yaml

import dse
from dse.importers.allowance import allowed
from dse.importers.ros2.launch.actions import Unknown
from dse.importers.ros2.launch.python import _Reader
from tests.helpers.effort import cases

TEXTS = ("'robot_1'", "'a.yaml'", "'x,y'", "''", "' b '", "'/opt/share'", "'front/cam'", "side")
NUMBERS = ("0", "1", "3", "-2", "2.5", "10", "size")
NAMES: dict[str, Any] = {"side": "Left", "size": 4, "items": ["a", "b", "c"], "table": {"k": "v", "n": 2}}


class Drawn:
    """Expressions of Python by their type."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(f"python/{seed}")

    def text(self, depth: int) -> str:
        """A text."""
        if depth <= 0:
            return self.rng.choice(TEXTS)
        a, b, n, t = self.text(depth - 1), self.text(depth - 1), self.number(depth - 1), self.truth(depth - 1)
        rng = self.rng
        forms = (
            f"({a} + {b})", f"({a}).lower()", f"({a}).upper()", f"({a}).strip()", f"({a}).replace('a', {b})",
            f"({a} if {t} else {b})", f"({a} or {b})", f"({a} and {b})", "f'{side}-{size:04.1f}'", "f'{size}{side!r}'",
            "'{}/{0}'".replace("0", "") + f".format({a}, {b})", f"'%s:%d' % ({a}, {rng.randint(0, 9)})", f"str({n})",
            f"({a}).removeprefix('robot')", f"'/'.join([{a}, {b}])", f"({a})[:{rng.randint(0, 4)}]",
            f"({a}).partition('/')[2]", f"({a} + '_')[0]", f"items[{rng.randint(-3, 2)}]", f"table.get({a}, {b})",
            f"os.path.join('/w', {a})", f"{self.path(depth - 1)}.__str__()", f"({a}).title()",
            f"str({self.path(depth - 1)})",
        )  # fmt: skip
        return self.rng.choice(forms)

    def path(self, depth: int) -> str:
        """A path."""
        a = self.rng.choice(("'config'", "'a.b.yaml'", "'c/d'", "side"))
        if depth <= 0:
            return f"Path('/opt', {a})"
        inner = self.path(depth - 1)
        return self.rng.choice(
            (f"({inner} / {a})", f"{inner}.joinpath({a}, 'e')", f"{inner}.parent", f"Path({inner}, {a})",
             f"Path(str({inner}))", f"Path('/q').joinpath({inner})", f"Path('/w', {inner}.name)",
             f"Path({inner}.parent, {inner}.stem + {inner}.suffix)")
        )  # fmt: skip

    def number(self, depth: int) -> str:
        """A number."""
        if depth <= 0:
            return self.rng.choice(NUMBERS)
        a, b = self.number(depth - 1), self.number(depth - 1)
        return self.rng.choice(
            (f"({a} + {b})", f"({a} - {b})", f"({a} * {b})", f"({a} / 4)", f"len({self.text(depth - 1)})", f"int({a})",
             f"float({a})", f"({self.text(depth - 1)}).count('a')", f"len([x for x in items if x != {self.text(0)}])",
             f"list(range(5))[{self.rng.randint(-5, 4)}]", f"({a} // 2)")
        )  # fmt: skip

    def truth(self, depth: int) -> str:
        """A condition."""
        a, b = self.text(depth - 1), self.text(depth - 1)
        if depth <= 0:
            return self.rng.choice(("True", "False", "side == 'Left'"))
        one, two, n = self.truth(depth - 1), self.truth(depth - 1), self.number(depth - 1)
        return self.rng.choice(
            (f"({one} and {two})", f"({one} or {two})", f"(not {one})", f"({a}).startswith({b})", f"({a} in {b})",
             f"({a}).endswith(('a', 'l'))", f"({n} < 3)", f"(0 <= {n} <= 9)", f"({a} == {b})", f"({a} not in items)",
             f"any(x == {a} for x in items)", f"bool({a})", "('k' in table)", f"({a}).isdigit()",
             f"(table.get({a}) is None)")
        )  # fmt: skip


def value_of(text: str) -> Any:
    reader = _Reader(Path("x.launch.py"), ast.parse(""))
    with allowed():
        return reader.value(ast.parse(text, mode="eval").body, NAMES)


@pytest.mark.parametrize("seed", cases(60))
def test_drawn_expressions_have_the_value_that_python_gives_them(seed: int) -> None:
    drawn = Drawn(seed)
    for kind in (drawn.text, drawn.path, drawn.number, drawn.truth):
        for _ in range(20):
            text = kind(drawn.rng.randint(1, 3))
            expected = eval(text, {"os": os, "Path": PurePosixPath, **NAMES})
            found = value_of(text)
            assert not isinstance(found, Unknown), text
            expected = str(expected) if isinstance(expected, PurePosixPath) else expected
            assert found == expected and type(found) is type(expected), (text, found, expected)


OPEN = {
    "Path(get_package_share_directory('p'), 'config', 'a.yaml')": "$(find-pkg-share p)/config/a.yaml",
    "(Path('/a') / get_package_share_directory('p') / 'x').__str__()": "$(find-pkg-share p)/x",
    "str(Path(__file__).resolve().parent / 'a.yaml')": "$(dirname)/a.yaml",
    "Path(__file__).parents[1] / 'config'": "$(dirname)/../config",
    "os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), 'b')": "$(dirname)/../b",
    "Path(get_package_share_path('p')).joinpath('a', 'b.yaml').parent": "$(find-pkg-share p)/a",
    "f\"{get_package_share_directory('p')}/c\"": "$(find-pkg-share p)/c",
    "'{}/{}'.format(get_package_share_directory('p'), 'c')": "$(find-pkg-share p)/c",
    "'%s/c' % get_package_share_directory('p')": "$(find-pkg-share p)/c",
    "'/'.join([get_package_share_directory('p'), 'c'])": "$(find-pkg-share p)/c",
    "weird() and False": None,
    "True or weird()": True,
    "False and weird()": False,
    "LaunchConfiguration('a').perform(context).startswith('b')": None,
    "weird() or True": None,
    "os.path.dirname(LaunchConfiguration('a'))": None,
}


@pytest.mark.parametrize("text", OPEN)
def test_what_is_known_of_open_values(text: str) -> None:
    reader = _Reader(Path("x.launch.py"), ast.parse(""))
    with allowed():
        found = reader.value(ast.parse(text, mode="eval").body, {"__file__": "$(filename)"})
    expected = OPEN[text]
    if expected is None:
        assert isinstance(found, Unknown)
    else:
        assert found == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("weird() or True", True),
        ("weird() and False", False),
        ("not (weird() and 0)", True),
        ("weird() or False", None),
    ],
)
def test_conditions_hold_where_a_known_part_decides(text: str, expected: bool | None) -> None:
    reader = _Reader(Path("x.launch.py"), ast.parse(""))
    with allowed():
        found = reader.truth(ast.parse(text, mode="eval").body, {})
    assert found is (NotImplemented if expected is None else expected)


BRANCHES = """def generate_launch_description():
    nodes, rate = [], 10
    if thing():
        rate = 20
        nodes.append(Node(package='p', executable='in', name='in', parameters=[{'update_rate': rate}]))
        single = Node(package='p', executable='one', name='one')
    else:
        nodes.append(Node(package='p', executable='other', name='other'))
    nodes += [single, Node(package='p', executable='out', name='out', parameters=[{'update_rate': rate}])]
    if thing(2):
        return LaunchDescription([])
    nodes.append(GroupAction([Node(package='p', executable='g', name='g')], condition=IfCondition(thing(3))))
    return LaunchDescription(nodes)
"""


def test_a_branch_whose_condition_is_not_followed_keeps_its_nodes(tmp_path: Path) -> None:
    """What it sets is not known behind it, and one that returns is not taken."""
    path = tmp_path / "a.launch.py"
    path.write_text(BRANCHES, encoding="utf-8")
    found = dse.import_file(path)
    threads = yaml.safe_load(found.text)["threads"]
    assert {name: body.get("period") for name, body in threads.items()} == {
        "in.timer": "50 ms", "one": None, "out": None, "g": None,
    }  # fmt: skip
    told = "\n".join(str(item) for item in found.remarks)
    for words in (
        ":3: warning: a branch counts as taken: its condition is not followed: what thing() gives in Python",
        ":10: warning: not static, left out: what thing(2) gives in Python",
        ":12: warning: group counts as started: its condition is not followed: what thing(3) gives in Python",
    ):
        assert words in told, (words, told)


IDIOMS = """import os
from pathlib import Path
from weird import thing
def generate_launch_description():
    share = Path(get_package_share_directory('mypkg'))
    nodes = []
    for i, (name, rate) in enumerate(zip(['a', 'b', 'skipped', 'c'], [10.0, 20, 1, 40])):
        if name.startswith('skip'):
            continue
        if name == 'c':
            break
        nodes.append(Node(package='p', executable='e', name=f'{name}_{i:02d}', parameters=[{'update_rate': rate}]))
    nodes.append(Node(package='p', executable='odd', name=thing(), remappings=thing(), parameters=thing()))
    nodes.append(Node(package='p', executable='if', name='if', condition=IfCondition(thing(1))))
    nodes.append(Node(package='p', executable='kw', name='kw', **thing()))
    nodes.append(ComposableNodeContainer(package='q', executable='component_container', name='box',
                                         composable_node_descriptions=thing()))
    nodes.append(RegisterEventHandler(OnProcessExit(target_action=nodes[0], on_exit=[
        Node(package='p', executable='late', name='late', parameters=[share / 'config' / 'a.yaml'])])))
    while thing():
        nodes.append(Node(package='p', executable='w', name='w'))
    return LaunchDescription(nodes)
"""


CLOSURE = """def setup(context):
    rate = 20
    def spawned(name, **more):
        return Node(package='p', executable='e', name=name, parameters=[{'update_rate': rate + extra}], **more)
    return [AppendEnvironmentVariable('A', 'b'), *[spawned(name, namespace='x') for name in ('a', 'b')]]
extra = 5
if __name__ == '__main__':
    main()
def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=setup)])
"""


def test_functions_within_functions_see_the_names_around_them(tmp_path: Path) -> None:
    path = tmp_path / "a.launch.py"
    path.write_text(CLOSURE, encoding="utf-8")
    found = dse.import_file(path)
    threads = yaml.safe_load(found.text)["threads"]
    assert {name: body["period"] for name, body in threads.items()} == {"x.a.timer": "40 ms", "x.b.timer": "40 ms"}
    assert not any("Python" in str(item) for item in found.remarks)


def test_nodes_are_kept_with_what_is_known_and_the_line_is_named(tmp_path: Path) -> None:
    for name, text in {"launch/a.launch.py": IDIOMS, "package.xml": "<package><name>mypkg</name></package>",
                       "config/a.yaml": "late:\n  ros__parameters:\n    update_rate: 50.0\n"}.items():  # fmt: skip
        path = tmp_path / "mypkg" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    found = dse.import_file(tmp_path / "mypkg" / "launch" / "a.launch.py")
    threads = yaml.safe_load(found.text)["threads"]
    periods = {name: body.get("period") for name, body in threads.items()}
    timers = {"a_00.timer": "100 ms", "b_01.timer": "50 ms", "late.timer": "20 ms"}
    assert periods == {**timers, "odd": None, "if": None, "kw": None}
    told = "\n".join(str(item) for item in found.remarks)
    for words in (
        ":13: warning: not static, left out: its name (node thing()): what thing() gives in Python",
        ":13: warning: not static, left out: a remapping of /odd: what thing() gives in Python",
        ":13: warning: not static, left out: parameter thing() of /odd: what thing() gives in Python",
        ":14: warning: node if counts as started: its condition is not followed: what thing(1) gives in Python",
        ":15: warning: not static, left out: what thing() gives in Python",
        ":16: warning: not static, left out: composable_node thing(): what thing() gives in Python",
        ":20: warning: not static, left out: what thing() gives in Python",
    ):
        assert words in told, (words, told)
