"""Launch files and parameter files of ROS 2 with something wrong, for the importer: hostile parts, tokens, bytes."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from .harness import Case, Outcome, run_case
from .mutations import changed_bytes, changed_lines, changed_number, monstrous, spliced

XML = """<launch>
  <arg name="side" default="front"/>
  <let name="image" value="/$(var side)/image"/>
  <group scoped="true">
    <push-ros-namespace namespace="$(var side)"/>
    <set_remap from="a" to="$(var image)"/>
    <node pkg="cam" exec="cam_node" name="cam" if="$(eval &quot;'$(var side)' == 'front'&quot;)">
      <param from="$(dirname)/robot.yaml"/>
      <param name="update_rate" value="50" unless="$(equals $(var side) rear)"/>
      <remap from="~/output/image" to="$(var image)"/>
    </node>
    <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
      <composable_node pkg="track" plugin="track::Track" name="track">
        <param name="scan"><param name="rate" value="10"/></param>
        <remap from="~/input/image" to="$(var image)"/>
      </composable_node>
    </node_container>
  </group>
  <include file="$(dirname)/inner.launch.xml"><arg name="name" value="$(env ROBOT dog)"/></include>
</launch>
"""
INNER = '<launch><arg name="name"/><node pkg="watch" exec="dog" name="$(var name)"/></launch>\n'
YAML = """launch:
- arg: {name: side, default: front}
- set_parameter: {name: rate, value: "5"}
- group:
  - push_ros_namespace: {namespace: $(var side)}
  - node:
      pkg: cam
      exec: cam_node
      name: cam
      param:
      - {from: $(dirname)/robot.yaml}
      - {name: update_rate, value: "50", if: "$(not false)"}
      remap:
      - {from: ~/output/image, to: /image}
- include: {file: $(dirname)/inner.launch.xml, arg: [{name: name, value: dog}]}
"""
PYTHON = """import os
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription, OpaqueFunction, TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration as Given, PathJoinSubstitution, PythonExpression, ThisLaunchFileDir
from launch_ros.actions import ComposableNodeContainer, Node, PushRosNamespace
from launch_ros.descriptions import ComposableNode


def cam(context, *more, name="cam"):
    parameters = [os.path.join(os.path.dirname(__file__), "robot.yaml"), {"scan": {"rate": 5, "all": [1, 2.5, "x"]}}]
    if Given("side").perform(context) == "front":
        parameters += [{"update_rate": 50}]
    return [Node(package="cam", executable="cam_node", name=name, parameters=parameters,
                 remappings=[("~/output/image", image())])]


def image():
    return ["/", Given("side"), "/image"]


def generate_launch_description():
    x = "a"
    nodes = [Node(package="p", executable="e", name=f"n{x}"), Node(package="p", executable="e")]
    names = [item.lower() for item in ["A", "B"]]
    for name, text in {"side": "front", "fast": "false"}.items():
        nodes.append(DeclareLaunchArgument(name, default_value=text))
    box = ComposableNodeContainer(
        package="rclcpp_components", executable="component_container", name="box", namespace="",
        composable_node_descriptions=[
            ComposableNode(package="track", plugin="track::Track", name=name,
                           parameters=[PathJoinSubstitution([ThisLaunchFileDir(), "robot.yaml"])],
                           remappings=[("~/input/image", image()), ("~/output/lane", "/lane")])
            for name in names])
    ld = LaunchDescription(nodes)
    ld.add_action(GroupAction([PushRosNamespace(Given("side")), OpaqueFunction(function=cam, args=[x]), box]))
    is_rear = PythonExpression(["'", Given("side"), "' == 'rear'"])
    ld.add_action(TimerAction(period=3.0, actions=[Node(package="w", executable="d", condition=IfCondition(is_rear))]))
    ld.add_action(IncludeLaunchDescription("inner.launch.xml", launch_arguments={"name": "dog"}.items()))
    return ld
"""
PARAMETERS = """/**:
  ros__parameters: {use_sim_time: false}
/*/cam:
  ros__parameters:
    update_rate: 20.0
    learning_rate: 0.1
front:
  track:
    ros__parameters:
      timer_period_ms: 25
      detector: {fps: 5, list: [1, 2]}
"""
TEXTS = {"case.launch.xml": XML, "case.launch.yaml": YAML, "case.launch.py": PYTHON, "case.yaml": PARAMETERS}
AROUND = {
    "inner.launch.xml": INNER,
    "robot.yaml": PARAMETERS,
    "a.launch.xml": '<launch><include file="$(dirname)/case.launch.py"/><include file="case.launch.xml"/></launch>',
    "b.launch.xml": '<launch><node exec="e" name="cam" namespace="front"><param from="case.yaml"/></node></launch>',
}
"""Files beside the mutated one, of which some include it."""
TOKENS = (
    *(
        "$(var side)",
        "$(var ",
        "$(eval '",
        "$(env A)",
        "$(find-pkg-share x)",
        "$(dirname)",
        "$(filename)",
        "$(python x)",
    ),
    *(
        "$(equals a b)",
        "$(if true a b)",
        "$(or ",
        ")",
        "(",
        "'",
        '"',
        "\\",
        "\0",
        "\u202e",
        "é",
        "/",
        "/**",
        "*",
        "~",
        "..",
    ),
    *(
        "None",
        "True",
        "1e999",
        "0x" + "f" * 5000,
        "9" * 5000,
        "[]",
        "{}",
        "()",
        "x",
        "[x]",
        "-1",
        "1j",
        "b''",
        r"'\ud800'",
    ),
    *(
        r"'\x00'",
        "**x",
        "*x",
        "lambda: 1",
        "yield",
        "await x",
        "self",
        "context",
        "Given",
        "Node",
        "GroupAction",
        "x.y",
    ),
    *("OpaqueFunction", "LaunchDescription", "IncludeLaunchDescription", "Command", ".append", ".extend", ".items()"),
    *("+", "/", "==", "not ", "and", "or", "if", "else", "for", "in", ":", ",", "=", "+=", "return", "def f(): ", "\n"),
    *("<group>", "</group>", "<node ", "<include ", "/>", "<!--", "<![CDATA[", "&#0;", "&#xD800;", "&amp;", "<?xml ?>"),
    *("ros__parameters", "&a ", "*a", "<<: ", "- ", ": ", "!!int ", "---\n", "name", "value", "from", "param", "rate"),
)
LINES = (
    "x = x + x", "x = [x, x]", "x = [x] * 9", "x.append(x)", "x.extend(x)", "x += x", "nodes += nodes", "x = {'a': x}",
    "x['a'] = x", "x = GroupAction([x, x])", "x = GroupAction(x)", "x = f'{x}{x}'", "x = x / x",
    "x = [y for y in nodes]",
    "x = [[y, z] for y in nodes for z in nodes]", "nodes.append(nodes)", "nodes = [nodes, nodes]", "x = str(nodes)",
    "nodes[0] = nodes", "x = cam(x)", "x = generate_launch_description()", "'a'.append(1)", "(1).lower()", "x = 0xff",
    "x = OpaqueFunction(function=cam, args=x)", "x = OpaqueFunction(function=cam, kwargs=x)", "x = os.environ[x]",
    "x = OpaqueFunction(function=x)", "x = nodes == nodes", "x = x == [x]", "x = not x", "x = -x", "x = x[0]",
    "x = Node(package=x, executable=x, name=x, namespace=x, parameters=x, remappings=x, condition=x)",
    "x = Node(parameters=[{'a': x}], remappings=[(x, x)])", "x = LaunchDescription(x)", "x = Given(x)",
    "x = Given(x, x)",
    "x = PathJoinSubstitution(x)", "x = PythonExpression(x)", "x = IncludeLaunchDescription(x, launch_arguments=x)",
    "x = IncludeLaunchDescription('case.launch.py')", "x = DeclareLaunchArgument(x, default_value=x)", "x = dict(x)",
    "x = ComposableNodeContainer(composable_node_descriptions=[x])", "x = Path(x)", "x = x.perform(x)", "x = tuple(x)",
    "x = x or x", "x = x and not x", "x = '%s' % x", "x = '{}'.format(x)", "x = x.replace('a', x)", "x = x.split(x)",
    "x = '/'.join(x)", "x = Path(x, x).parent", "x = Path(__file__).parents[3]", "x = f'{x:9.9f}{x!r}'", "x = x[:9]",
    "x = {y: x for y in x if y in x}", "x = list(range(x))", "x = dict(zip(x, x))", "x = list(enumerate(x))", "break",
    "x = x * x", "x = len(x) < 3 <= x", "x -= x", "x = x.get(x, x)", "x.update(x)", "while x: x = x + x", "continue",
    "x = int(x) / int(x)", "x = RegisterEventHandler(OnProcessExit(on_exit=x))", "x = x.startswith(x)", "x = any(x)",
    "ld = LaunchDescription(x)", "ld.add_action(x)", "ld.add_action(ld)", "nodes.append(x)", "nodes.append(x)",
)  # fmt: skip
"""What a function of a Python file may do to a value."""
Mutation = Callable[[str, random.Random, Sequence[str]], str]
_PARTS = re.compile(r"\w+|\s+|[^\w\s]+")


def changed_token(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """A token replaced, inserted, repeated, left out, or taken from elsewhere."""
    parts = _PARTS.findall(text) or [""]
    at, kind = rng.randrange(len(parts)), rng.randrange(5)
    if kind == 0:
        parts[at] = rng.choice(TOKENS)
    elif kind == 1:
        parts.insert(at, rng.choice(TOKENS))
    elif kind == 2:
        parts[at] = rng.choice(_PARTS.findall(rng.choice(others)))
    elif kind == 3:
        parts[at] *= rng.choice((2, 50, 5000))
    else:
        del parts[at]
    return "".join(parts)


def with_lines(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """Statements in a function of a Python file, once or many times; a part of another file many times."""
    size = rng.choice((1, 1, 3, 10, 40, 1000))
    if "def " not in text:
        lines = text.splitlines(keepends=True) or ["\n"]
        at = rng.randrange(len(lines))
        return "".join([*lines[:at], lines[at] * size, *lines[at:]])
    places = [found.end() for found in re.finditer(r"\n    (?=\w)", text)]
    if not places:
        return changed_token(text, rng, others)
    at = rng.choice(places)
    block = rng.sample(LINES, rng.choice((1, 1, 2, 4)))
    if rng.random() < 0.2:
        loop = rng.choice(("for y in nodes:", "for y in x:", "for y in range(9):", "if x:", "try:"))
        block = [loop, *(f"    {line}" for line in block)]
    more = "".join(f"{line}\n    " for line in block) * size
    return text[:at] + more + text[at:]


def nested(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """Something within itself many times."""
    size = rng.choice((10, 59, 100, 400, 3000, 20_000))
    opening, closing = rng.choice(
        (
            ("$(var ", ")"), ("$(eval ", ")"), ("(", ")"), ("[", "]"), ("not ", ""), ("-", ""), ("GroupAction([", "])"),
            ("<group>", "</group>"), ("a + ", ""), ("f(", ")"), ("{'a': ", "}"), ("x.", ""), ("lambda: ", ""),
            ("/**", ""),
            ("1 if x else ", ""), ("f'{", "}'"), ("*", ""), ("a/", ""), ("[x for x in ", "]"),
        )
    )  # fmt: skip
    inner = opening * size + rng.choice(("a", "1", "", "'a'", "x")) + closing * rng.choice((size, size, size - 1))
    places = list(re.finditer(r'(?<=")[^"\n]*(?=")|(?<== )[^\n]+|(?<=: )[^\n]+', text))
    if not places:
        return text + inner
    place = rng.choice(places)
    return text[: place.start()] + inner + text[place.end() :]


_KINDS: tuple[tuple[int, Mutation], ...] = (
    (6, changed_token), (5, with_lines), (3, nested), (3, changed_lines), (2, changed_number), (1, spliced),
    (1, monstrous),
)  # fmt: skip


def mutated(text: str, rng: random.Random) -> bytes:
    """A text with one to six mutations."""
    others = tuple(TEXTS.values())
    is_plausible = rng.random() < 0.5
    for _ in range(rng.choice((1, 1, 2, 2, 3, 6))):
        kind: Mutation = rng.choices([item for _, item in _KINDS], [weight for weight, _ in _KINDS])[0]
        text = (rng.choice((with_lines, with_lines, changed_number)) if is_plausible else kind)(text, rng, others)
    data = text[:2_000_000].encode("utf-8", "surrogatepass")
    return changed_bytes(data, rng) if rng.random() < 0.1 else data


class LaunchFuzzer:
    """Draws launch files and parameter files from a seed and imports them in a folder of its own."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.seed = folder, seed
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in {**TEXTS, **AROUND}.items():
            (folder / name).write_text(text, encoding="utf-8")

    def case(self, number: int) -> Case:
        """The case with this number."""
        rng = random.Random(f"launch/{self.seed}/{number}")
        name = rng.choice((*TEXTS, "case.launch.py", "case.launch.py"))
        data = mutated(TEXTS[name], rng)
        file = "FILE"
        if rng.random() < 0.2:
            file = "b.launch.xml" if name == "case.yaml" else "a.launch.xml"
        more = rng.choice(((), (), ("--timers", "update_* [Hz]"), ("--arguments", "side:=rear"), ("--cores", "2")))
        if file == "FILE" and name == "case.yaml":
            more = more if more[:1] != ("--arguments",) else ()
        also = ("robot.yaml",) if not more and rng.random() < 0.1 else ()
        return Case(name, data, ("import", file, *also, *more, "-o", "found.yaml"), name)

    def run(self, case: Case) -> Outcome:
        """Import it; the sound file is there again afterwards."""
        outcome = run_case(case, self.folder)
        (self.folder / case.name).write_text(TEXTS[case.name], encoding="utf-8")
        return outcome
