"""The drawing of an architecture: everything is there, inside the paper, apart, and open decisions are marked."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

import dse
from dse.answers.drawing.layout import Graph, layered, ranks
from dse.answers.drawing.parts import DrawnParts
from dse.answers.drawing.picture import Drafter
from dse.cli.main import run
from dse.examples.random import random_problem
from dse.examples.shipped import example_folder, example_path
from tests.answers.hostile import hostile_result

SVG = "{http://www.w3.org/2000/svg}"
EXAMPLES = sorted(path.stem for path in example_folder().glob("*.yaml"))
PICTURE = Path(__file__).parents[2] / "reports" / "pictures" / "inmark-architecture.svg"


def drawn(problem: dse.Problem) -> ElementTree.Element:
    """The drawing as XML, which it therefore is."""
    return ElementTree.fromstring(dse.export(problem, form="svg"))


def texts(drawing: ElementTree.Element) -> list[str]:
    return ["".join(item.itertext()) for item in drawing.iter(f"{SVG}text")]


def boxes(drawing: ElementTree.Element) -> list[tuple[float, float, float, float]]:
    """Left, upper, right and lower edge of the box of each component."""
    found = []
    for group in drawing.iter(f"{SVG}g"):
        place = re.fullmatch(r"translate\(([\d.-]+) ([\d.-]+)\)", group.get("transform", ""))
        if place is not None:
            x, y, rect = float(place[1]), float(place[2]), group.find(f"{SVG}rect")
            assert rect is not None
            found.append((x, y, x + float(rect.get("width", 0)), y + float(rect.get("height", 0))))
    return found


def looks(drawing: ElementTree.Element, name: str) -> set[str]:
    """The classes of the lines that stand for a connection."""
    for group in drawing.iter(f"{SVG}g"):
        title = group.find(f"{SVG}title")
        if title is not None and f"{name}: " in (title.text or ""):
            return set(group.get("class", "").split())
    raise AssertionError(f"no line of {name}")


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_component_is_inside_the_paper_and_apart(name: str) -> None:
    space = dse.load(example_path(name)).space
    drawing = drawn(dse.load(example_path(name)))
    _, _, width, height = map(float, drawing.get("viewBox", "").split())
    found = boxes(drawing)
    assert len(found) == len(space.components)
    for left, top, right, bottom in found:
        assert left >= 0 and right <= width and top >= 0 and bottom <= height
    for number, (left, top, right, bottom) in enumerate(found):
        for other in found[number + 1 :]:
            assert right <= other[0] + 0.2 or other[2] <= left + 0.2 or bottom <= other[1] or other[3] <= top


@pytest.mark.parametrize(("family", "seed"), [("many-buses", 1), ("two-computers", 2), ("event-driven", 3)])
def test_random_problems_are_drawn(family: str, seed: int) -> None:
    problem = dse.loads(random_problem(20, seed, 2, family))
    drawing = drawn(problem)
    assert len(boxes(drawing)) == len(problem.space.components)
    shown = " ".join(texts(drawing))
    assert all(slot.name in shown for slot in problem.space.processors)


def test_the_robot_is_drawn_from_source_to_sink() -> None:
    drawing = drawn(dse.load(example_path("inmark")))
    shown = texts(drawing)
    assert "computer RT101 or Spectra" in shown
    assert "canbus0 can_125k or can_250k or can_500k or can_1m" in shown
    assert "periodic 10 … 100 ms, aperiodic" in shown  # gnss_provider
    assert "ser0 rs232" in shown
    assert {"flow", "option"} <= looks(drawing, "position")  # over ser1 or eth0
    assert "flow" in looks(drawing, "estimate") and "option" not in looks(drawing, "estimate")
    assert "local" in looks(drawing, "filtered_pose")  # shared data
    assert "flow" not in looks(drawing, "odometry")
    ends = DrawnParts(dse.load(example_path("inmark")).space).flow_ends
    names = [item.name for item in dse.load(example_path("inmark")).space.components]
    assert {names[number]: what for number, what in ends.items()} == {"gnss": "source", "io_interface": "sink"}


def test_only_what_is_open_is_marked() -> None:
    asked = dse.load(example_path("inmark")).ask(
        fix=["computer = Spectra", "gnss_provider.dispatch_protocol = aperiodic"]
    )
    drawing = drawn(asked)
    assert "computer Spectra" in texts(drawing)
    marked = [item.text for item in drawing.iter(f"{SVG}text") if "decision" in item.get("class", "")]
    assert marked == ["periodic 4 … 20 ms", "periodic 5 … 50 ms, aperiodic", "periodic 5 … 50 ms, aperiodic"]


def test_what_is_open_of_an_executor_is_marked_at_its_threads() -> None:
    """A thread of the executor `mission_node` has no decision of its own; the core of that is one."""
    drawing = drawn(dse.load(example_folder() / "report" / "request_reply.yaml"))
    shown = {
        (group.findtext(f"{SVG}title") or ""): texts(group)
        for group in drawing.iter(f"{SVG}g")
        if group.get("transform") is not None
    }
    assert shown["mission"][-1] == "open: core" and shown["get_plan"][-1] == "open: executor, core"
    assert shown["operator"] == ["operator", "periodic 10 s"]


def test_a_design_is_drawn_with_what_was_chosen() -> None:
    result = dse.solve(example_path("inmark"), max_jitter="20 ms")
    first = next(point for point in result.front if point.decisions["computer.type"] == "Spectra")
    drawing = ElementTree.fromstring(dse.export(result, first.id, "svg"))
    shown = texts(drawing)
    assert "computer Spectra" in shown
    assert f"canbus0 {first.decisions['canbus0.type']}" in shown
    unused = {"ser1": "eth0", "eth0": "ser1"}[first.decisions["position.bus"]]
    assert f"{unused} not used" in shown
    assert shown.count("device") == 3  # the IMU and both motors, whose rate nobody states
    assert any("unused" in group.get("class", "") for group in drawing.iter(f"{SVG}g"))


def test_designs_differ_in_few_lines() -> None:
    result = dse.solve(example_path("inmark"))
    drafter = Drafter(result.space)
    one, other = (list(drafter.lines(point.design)) for point in result.front[:2])
    assert len(one) == len(other)
    assert 0 < sum(here != there for here, there in zip(one, other, strict=True)) < len(one) / 4


def test_names_are_text() -> None:
    result = hostile_result()
    drawing = ElementTree.fromstring(dse.export(result, result.front[0].id, "svg"))
    titles = {item.text for item in drawing.iter(f"{SVG}title")}
    assert {item.name for item in result.space.components} <= titles


def test_the_picture_in_the_readme_is_of_the_problem_as_it_is() -> None:
    """`dse export problems/inmark.yaml --format svg -o reports/pictures/inmark-architecture.svg` writes it again."""
    if not PICTURE.is_file():
        pytest.skip("the sample report is in a checkout only")
    assert PICTURE.read_text(encoding="utf-8") == dse.export(dse.load(example_path("inmark")), form="svg")


def test_the_command_draws_problems_and_designs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, out = str(tmp_path / "r.json"), tmp_path / "a.svg"
    assert run(["export", str(example_path("starter")), "--format", "svg", "-o", str(out)]) == 0
    assert out.read_text(encoding="utf-8").startswith("<svg")
    assert run(["solve", str(example_path("starter")), "--json", result, "-q"]) == 0
    assert run(["export", f"{result}#1", "--format", "svg"]) == 0
    assert run(["export", str(example_path("starter")), "--format", "dot"]) == 2


@pytest.mark.parametrize("form", ["problem", "dot", "aadl"])
def test_other_forms_are_of_designs(form: str) -> None:
    with pytest.raises(dse.UsageError, match="name an alternative"):
        dse.export(dse.load(example_path("starter")), form=form)  # type: ignore[arg-type]


def test_layout_keeps_nodes_apart() -> None:
    edges = [(0, 1), (0, 2), (1, 3), (2, 3), (3, 0), (0, 3), (4, 4)]
    layers = ranks(5, edges)
    assert layers == [0, 1, 1, 2, 0]
    graph = Graph(layers, edges, 3)
    found = layered(graph)
    assert found == layered(graph)
    places = sorted(zip(layers, found.centres, strict=True))
    for (layer, centre), (below, further) in pairwise(places):
        assert layer != below or further - centre >= 1 - 1e-9
    for (source, target), route in zip(edges, found.routes, strict=True):
        assert route[0] == (found.centres[source], layers[source])
        assert route[-1] == (found.centres[target], layers[target])


def test_heavy_edges_are_straight() -> None:
    """A chain among neighbours that pull it aside."""
    edges = [(0, 1), (1, 2), (2, 3), (0, 4), (1, 5), (5, 6)]
    found = layered(Graph(ranks(7, edges), edges, 4, heavy=[0, 1, 2]))
    chain = [found.centres[node] for node in range(4)]
    assert max(chain) - min(chain) < 0.05
