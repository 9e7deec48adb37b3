"""What `dse` exports is documented by example, and is enough for each command's job."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.answers.comparison import DesignComparison
from dse.cli.main import COMMANDS, run

NAMES = [name for name in dse.__all__ if name != "__version__" and name not in dse._TYPES]
PUMP = Path(__file__).parent / "fuzz" / "pump.yaml"
DESIGN = {"computer.type": "small", "can0.type": "can_500k", "filter.dispatch_protocol": "aperiodic",
          "control.period": "10 ms"}  # fmt: skip
CHOSEN = [part for name, option in DESIGN.items() for part in ("--design", f"{name} = {option}")]
ASKED: dict[str, Any] = {"max_jitter": "20 ms", "require": "price <= 900 EUR", "fix": "can0.type = can_500k"}
OPTIONS = ["--max-jitter", "20 ms", "--require", "price <= 900 EUR", "--fix", "can0.type = can_500k"]
LAMP = "package p public system s end s; system implementation s.i end s.i; end p;"
VARY = "jitter of sensor_to_valve=1ms..40ms"


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_a_docstring_with_an_example(name: str) -> None:
    """In NumPy style; `pytest dse` runs the examples. A function tells of each of its parameters."""
    thing = getattr(dse, name)
    text = inspect.getdoc(thing) or ""
    assert re.search(r"^Examples\n-+\n(>>> .*\n)+", text + "\n", re.M), name
    if inspect.isfunction(thing):
        shown = text.partition("Parameters\n----------\n")[2]
        assert [item for item in inspect.signature(thing).parameters if item not in shown] == []


def solve() -> Any:
    return dse.with_further_designs(dse.solve("pump.yaml", **ASKED), 1, within="20%").to_dict()


def analyse() -> Any:
    return dse.analyse(dse.load("pump.yaml").ask(max_price="100 EUR"), DESIGN).to_dict()


def simulate() -> Any:
    return dse.simulate("pump.yaml", DESIGN, runs=2).to_dict()


def sweep() -> Any:
    return dse.sweep("pump.yaml", VARY, store=None).to_dict()


def sensitivity() -> Any:
    return dse.sensitivity("pump.yaml", [f"{name} = {option}" for name, option in DESIGN.items()]).to_dict()


def report() -> Any:
    dse.write_report(dse.ranked_by(dse.reopen("r.json"), "knee"), "mine")
    return json.loads(Path("mine/pump.json").read_text(encoding="utf-8"))


def compare() -> Any:
    result = dse.reopen("r.json")
    one, other = (dse.analyse("pump.yaml", point.decisions) for point in result.front[:2])
    return {**dse.compare(one, other).to_dict(), "names": ["r.json#1", "r.json#2"]}


def export() -> Any:
    return dse.export(dse.reopen("r.json"), 2)


def check() -> Any:
    return dse.check("pump.yaml", **ASKED).to_dict()


def explain() -> Any:
    return dse.explain("pump.yaml", max_jitter="5 ms").to_dict()


def verify() -> Any:
    return dse.verify("r.json").to_dict()


def sizes() -> Any:
    return dse.sizes("geometry_msgs/PoseArray", lengths={"poses": 32}).to_dict()


def fit() -> Any:
    return dse.fit("delays.csv", method="envelope", name="ipc").to_dict()


def import_() -> Any:
    return dse.import_file("lamp.aadl", root="p::s.i").text


def new() -> Any:
    return dse.random_problem(8, seed=3)


def schema() -> Any:
    return dse.schema("sweep")


JOBS: dict[str, tuple[list[str], Callable[[], Any]]] = {
    "solve": (["pump.yaml", *OPTIONS, "--further", "1", "--within", "20%", "-q", "--json", "out.json"], solve),
    "analyse": (["pump.yaml", "--max-price", "100 EUR", *CHOSEN, "--json", "out.json"], analyse),
    "simulate": (["pump.yaml", *CHOSEN, "--runs", "2", "--json", "out.json"], simulate),
    "sweep": (["pump.yaml", "--vary", VARY, "--no-store", "--json", "out.json"], sweep),
    "sensitivity": (["pump.yaml", *CHOSEN, "--json", "out.json"], sensitivity),
    "report": (["r.json", "--rank-by", "knee", "-o", "theirs"], report),
    "compare": (["r.json#1", "r.json#2", "--json", "out.json"], compare),
    "export": (["r.json", "--alternative", "2", "-o", "out.json"], export),
    "check": (["pump.yaml", *OPTIONS, "--json", "out.json"], check),
    "explain": (["pump.yaml", "--max-jitter", "5 ms", "--json", "out.json"], explain),
    "verify": (["r.json", "--json", "out.json"], verify),
    "sizes": (["geometry_msgs/PoseArray", "--length", "poses=32", "--json", "out.json"], sizes),
    "fit": (["delays.csv", "--method", "envelope", "--name", "ipc", "--json", "out.json"], fit),
    "import": (["lamp.aadl", "--root", "p::s.i", "-o", "out.json"], import_),
    "new": (["out.json", "--random", "--threads", "8", "--seed", "3"], new),
    "schema": (["--of", "sweep", "-o", "out.json"], schema),
}


def contents(folder: str) -> dict[str, bytes]:
    """By name; the drawings of one process count their clips."""
    return {path.name: re.sub(rb"clip\d+", b"clip", path.read_bytes()) for path in Path(folder).iterdir()}


def test_reports_and_figures_are_those_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also with a study, another alternative, and the plots by themselves: each needed what is not exported."""
    monkeypatch.chdir(tmp_path)
    Path("pump.yaml").write_text(PUMP.read_text(encoding="utf-8"), encoding="utf-8")
    Path("delays.csv").write_text("size_bytes,min_us,max_us\n0,10,20\n100,12,24\n300,20,29\n", encoding="utf-8")
    result, study = dse.solve("pump.yaml"), dse.sweep("pump.yaml", VARY, store=None)
    Path("r.json").write_text(result.to_json(), encoding="utf-8")
    Path("s.json").write_text(study.to_json(), encoding="utf-8")
    fit = dse.fit("delays.csv")
    theirs: dict[str, list[str]] = {
        "whole": ["report", "r.json", "--study", "s.json", "--alternative", "2", "--top", "1"],
        "plots": ["report", "r.json", "--alternative", "2", "--figures", "svg"],
        "study": ["report", "s.json", "--figures", "svg"],
    }
    for name, words in theirs.items():
        assert run([*words, "-o", f"theirs-{name}"]) == 0
    assert run(["fit", "delays.csv", "--figures", "theirs-fit"]) == 0
    reopened = dse.reopen("r.json")
    read = dse.read("s.json")
    assert isinstance(read, dse.SweepResult) and read == study and read.frame().equals(study.frame())
    dse.write_report(reopened, "whole", alternative=2, top=1, studies=[read])
    dse.write_figures(reopened, "plots", alternative=2)
    dse.write_figures(read, "study")
    dse.write_report(read, "page.html")
    assert run(["report", "s.json", "-o", "theirs-page"]) == 0
    assert Path("page.html").read_bytes() == Path("theirs-page/Pump-sweep.html").read_bytes()
    dse.write_figures(fit, "fit")
    for name in (*theirs, "fit"):
        assert contents(name) == contents(f"theirs-{name}")
    for wrong in (
        lambda: dse.write_figures(reopened, "x", ("pdf",)),
        lambda: dse.write_figures(reopened, "x", alternative=99),
        lambda: dse.write_figures(dse.check("pump.yaml"), "x"),
        lambda: dse.write_report(reopened, "x.md", top=3),
        lambda: dse.write_report(reopened, "x", alternative=99),
    ):
        with pytest.raises(dse.UsageError):
            wrong()
    assert not Path("x").exists()


def test_every_command_has_its_job_here() -> None:
    assert list(JOBS) == list(COMMANDS)


@pytest.mark.parametrize("name", JOBS)
def test_a_commands_job_is_done_with_what_dse_exports(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pump.yaml").write_text(PUMP.read_text(encoding="utf-8"), encoding="utf-8")
    Path("delays.csv").write_text("size_bytes,min_us,max_us\n0,10,20\n100,12,24\n300,20,29\n", encoding="utf-8")
    Path("lamp.aadl").write_text(LAMP, encoding="utf-8")
    Path("r.json").write_text(dse.solve("pump.yaml").to_json(), encoding="utf-8")
    options, job = JOBS[name]
    assert run([name, *options]) in (0, 4)
    written = Path("theirs/pump.json" if name == "report" else "out.json").read_text(encoding="utf-8")
    mine = job()
    theirs = written if isinstance(mine, str) else json.loads(written)
    if isinstance(theirs, dict):
        for data in (mine, theirs):
            for key in ("search", "wall_s"):
                data.pop(key, None)
        mine = json.loads(json.dumps(mine))
    elif name == "new":
        theirs = theirs.partition("\n")[2]  # which schema an editor is to use
    assert mine == theirs


def test_every_verb_takes_a_result_and_a_point_of_it() -> None:
    """They stand for the question that was asked, with all that was beyond the file, and for its decisions."""
    asked: dict[str, Any] = {**ASKED, "objectives": ["minimise price"], "overload": "allowed"}
    result = dse.solve(PUMP, **asked)
    assert dse.load(result).space == dse.load(PUMP).ask(**asked).space
    assert dse.solve(result).problem.question == result.problem.question
    point = result.front[0]
    assert dse.check(result).size == dse.check(PUMP, **asked).size
    assert dse.explain(result).status == "feasible"
    analysis = dse.analyse(result, point)
    assert "price <= 900 EUR" in {verdict.requirement.text for verdict in analysis.verdicts}
    assert dict(analysis.decisions) == point.decisions
    assert dse.simulate(result, point, runs=1).decisions == dse.simulate(result, analysis, runs=1).decisions
    assert dse.sensitivity(result, point, front=False).decisions == point.decisions
    assert dse.sweep(result, "price=60EUR..900EUR", store=None).problem["changes"]["fix"]
    text = PUMP.read_text(encoding="utf-8") + "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1}}"
    robust = dse.solve_robust(text)
    assert dse.solve(robust).frame().equals(robust.nominal.frame())
    assert dse.compare(robust, robust.nominal).frame().columns.tolist() == ["name", "one", "other"]


def test_what_no_verb_takes_is_told() -> None:
    result = dse.solve(PUMP)
    wrong: tuple[Callable[[], Any], ...] = (
        lambda: dse.solve(None),  # type: ignore[arg-type]
        lambda: dse.check(3),  # type: ignore[arg-type]
        lambda: dse.analyse(result, 1),  # type: ignore[arg-type]
        lambda: dse.compare(result.front[0], result),  # type: ignore[arg-type]
        lambda: dse.export(result, 1, "jsn"),  # type: ignore[arg-type]
    )
    for call in wrong:
        with pytest.raises(dse.UsageError, match=r"expected .*; got |is not one of "):
            call()


def test_every_answer_is_a_table_in_a_notebook() -> None:
    """In units that engineers read; an entry of a frame may be had in the unit that is wanted."""
    result = dse.solve(PUMP)
    point = result.front[0]
    analysis = dse.analyse(result, point)
    answers: list[Any] = [result, analysis, dse.check(PUMP), dse.explain(PUMP, max_jitter="5 ms")]
    answers += [dse.simulate(result, point, runs=1), dse.sensitivity(result, point, front=False)]
    answers += [dse.compare(result, result), dse.compare(analysis, analysis), dse.sweep(PUMP, VARY, store=None)]
    answers += [dse.verify(result), dse.sizes("geometry_msgs/PoseArray")]
    for answer in answers:
        assert "<table" in answer._repr_html_() and len(answer.frame()), answer
    latency = analysis.frame("ms")["latency of sensor_to_valve [ms]"][0]
    assert latency == result.frame("ms")["latency of sensor_to_valve [ms]"][0]
    rows = analysis.flow_frame("sensor_to_valve", "ms")
    assert rows["max [ms]"].sum() == pytest.approx(latency)
    assert "max [ms]" in dse.simulate(result, point, runs=1).frame("ms")
    with pytest.raises(dse.UsageError, match="no flow is called 'x'"):
        analysis.flow_frame("x")


def test_figures_of_every_table_come_in_the_unit_that_is_wanted(tmp_path: Path) -> None:
    """Also where each row has its own, which then stands beside them."""
    result = dse.solve(PUMP)
    point = result.front[0]
    margins = dse.sensitivity(result, point, front=False)
    exact, wanted = margins.frame("exact").set_index("path"), margins.frame(("ms", "%")).set_index("path")
    assert set(exact["unit"]) > {"ns"} and not {"ns", "ppm"} & set(wanted["unit"])
    times = exact[exact["unit"] == "ns"]
    assert (times["nominal"] / 1e6).to_dict() == wanted["nominal"][times.index].to_dict()
    said = dse.explain(PUMP, max_jitter="5 ms")
    assert (said.frame("us")["limit"].dropna() == said.frame("exact")["limit"].dropna() / 1000).all()
    told = dse.compare(dse.analyse(result, point), dse.analyse(result, result.front[1]))
    assert isinstance(told, DesignComparison)
    prices = told.frame("readable").set_index("name").loc["price"]
    assert (prices["one"], prices["unit"]) == (float(point.metrics["price"] / 100), "EUR")
    assert "ct" in set(replace(told, currencies=("EUR", "USD")).frame("readable")["unit"])
    assert list(dse.verify(result).frame()["kind"].unique()) == ["checked"]
    sizes = dse.sizes("geometry_msgs/PoseArray", lengths={"poses": 32}, distribution="ros1_noetic")
    assert sizes.frame("KB")["stated [KB]"].tolist() == [1.812] and "stated [B]" in sizes.frame("exact")
    times_us = tmp_path / "delays.csv"
    times_us.write_text("size_bytes,min_us,max_us\n0,10,20\n100,12,24\n300,20,29\n", encoding="utf-8")
    fit = dse.fit(times_us)
    assert fit.frame("us")["fixed most [us]"][0] == fit.frame("exact")["fixed most [ns]"][0] / 1000
    with pytest.raises(dse.UsageError, match="units 'furlong'"):
        margins.frame("furlong")


def test_a_front_is_a_sequence_of_designs_that_can_be_told_apart(tmp_path: Path) -> None:
    result = dse.solve(PUMP)
    assert len(result) == len(result.front) == 4 and list(result) == list(result.front)
    assert (result[0], result[-1], result[1:3]) == (result.front[0], result.front[-1], result.front[1:3])
    assert result.point(3).id == 3 and {point: point.id for point in result}[result.point(3)] == 3
    with pytest.raises(dse.UsageError, match="there is no design 9: ids run from 1 to 4"):
        result.point(9)
    assert result and not dse.solve(PUMP, max_jitter="5 ms")
    for write, name in ((result.to_json, "r.json"), (result.to_csv, "r.csv"), (dse.check(PUMP).to_json, "c.json")):
        assert write(tmp_path / name) == (tmp_path / name).read_text(encoding="utf-8")
    assert repr(dse.analyse(PUMP, result[0])) == "<Analysis of 'Pump': meets every requirement>"


def test_frames_are_readable_and_exact_on_request() -> None:
    result = dse.solve(PUMP)
    assert result.frame()["jitter of sensor_to_valve [ms]"].tolist() == [7.078, 13.444, 6.934, 13.588]
    exact = result.frame("exact")
    assert exact["jitter of sensor_to_valve [ns]"].tolist()[0] == 7_078_000 and exact["price [ct]"].dtype == "int64"
    assert result.frame(("us", "exact"))["jitter of sensor_to_valve [us]"][0] == 7078
    assert {"price [ct]"} <= set(result.frame(("us", "exact")))
    for unit in ("furlong", "USD", "kg"):
        with pytest.raises(dse.UsageError, match=f"units '{unit}'"):
            result.frame(unit)


def test_messages_speak_of_keywords_in_python_and_of_options_on_the_command_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(dse.UsageError, match=r"^max_jitter 20: expected a limit with its unit"):
        dse.solve(PUMP, max_jitter="20")
    assert run(["solve", str(PUMP), "--max-jitter", "20"]) == 2
    assert "--max-jitter 20: expected a limit with its unit" in capsys.readouterr().err
    for name, meant in (("analyze", "analyse"),):
        with pytest.raises(AttributeError, match=f"did you mean '{meant}'"):
            getattr(dse, name)
    with pytest.raises(dse.UsageError, match=r"unknown keyword 'minimize' .did you mean"):
        dse.solve(PUMP, minimize="price")  # type: ignore[call-arg]
    with pytest.raises(dse.UsageError, match='did you mean "max_utilisation"'):
        dse.solve(PUMP, max_utilization="5 %")  # type: ignore[call-arg]
    with pytest.raises(dse.UsageError, match=r"x\.pdf: a report is a page"):
        dse.write_report(dse.check(PUMP), "x.pdf")


def test_a_plot_is_shown_and_saved(tmp_path: Path) -> None:
    result = dse.solve(PUMP)
    assert result.plot()._repr_svg_().startswith("<svg") and result.plot("latency", 2).name == "latency"
    result.plot("parallel").save(tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_bytes().startswith(b"<svg")
    for wrong in (lambda: result.plot("pie"), lambda: result.plot().save("a.pdf"), lambda: result.plot("usage", 9)):
        with pytest.raises(dse.UsageError):
            wrong()
    assert dse.plot(dse.sweep(PUMP, VARY, store=None)).svg.startswith("<svg")
    with pytest.raises(dse.UsageError, match="nothing to draw"):
        dse.plot(dse.check(PUMP))
    pytest.importorskip("resvg_py")
    result.plot("parallel").save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_problem_is_built_without_a_file() -> None:
    model = dse.Problem.build("Two", processing="response_time")
    cpu = model.add_processor("cpu", type=[model.add_processor_type("small", price="5 EUR"), "large"])
    with pytest.raises(dse.UsageError, match="processors: 'cpu' is there already"):
        model.add_processor(cpu, type="small")
    model.add_thread("a", processor=cpu, period=timedelta(milliseconds=10), compute_execution_time="1 ms")
    with pytest.raises(dse.ProblemError, match="large"):
        model.problem()
    model.add_processor_type("large", price="9 EUR")
    model.minimise("price")
    problem = model.problem()
    assert problem.space.processing == "response_time" and repr(model) == "<Builder of 'Two': 5 entries>"
    assert [point.decisions for point in dse.solve(problem)] == [{"cpu.type": "small"}]


def test_what_verbs_take_and_return_is_exported() -> None:
    """Every class of dse in the signature of a public function, or of a method of a public answer."""
    words = {"Form", "Format", "Method", "Offsets", "Execution", "Status", "AnyRun", "MetricValue", "Literal"}
    stranger = set()
    for name in dse.__all__:
        thing = getattr(dse, name)
        if name in dse._TYPES or not callable(thing):
            continue
        parts = [thing] if inspect.isfunction(thing) else [
            getattr(item, "fget", item) for key, item in vars(thing).items()
            if not key.startswith("_") and (inspect.isfunction(item) or isinstance(item, property))
        ]  # fmt: skip
        for item in parts:
            part: Any = item
            for text in getattr(inspect.unwrap(part), "__annotations__", {}).values():
                bare = re.sub(r"Annotated\[(\w+).*", r"\1", str(text))
                stranger |= {word for word in re.findall(r"\b[A-Z]\w+\b", bare) if hasattr(_home(part), word)} & {
                    word for word in re.findall(r"\b[A-Z]\w+\b", bare)
                    if getattr(getattr(_home(part), word, None), "__module__", "").startswith("dse.")
                }  # fmt: skip
    assert stranger - words - set(dse.__all__) == set()


def _home(part: Any) -> Any:
    return inspect.getmodule(inspect.unwrap(part))


def test_types_are_known_of_all_that_is_exported() -> None:
    listed = inspect.getsource(dse).partition("if TYPE_CHECKING:")[2].partition("_HOMES")[0]
    assert set(re.findall(r" as (\w+)", listed)) == {*dse._HOMES, *dse._TYPES}


def test_decisions_and_limits_may_be_named_in_mappings() -> None:
    """As the decisions of a point are: fixed, they leave that point alone."""
    problem = dse.load(PUMP)
    point = dse.solve(problem, max_jitter="20 ms").front[0]
    found = dse.solve(problem, max_jitter={"sensor_to_valve": "20 ms"}, fix=point.decisions)
    assert [item.objectives for item in found.front] == [point.objectives]
    assert (
        problem.ask(fix=DESIGN).space.fixed == problem.ask(fix=[f"{key} = {DESIGN[key]}" for key in DESIGN]).space.fixed
    )
    for asked in ({"fix": {"control.period": 10}}, {"require": {"price": "900 EUR"}}, {"max_price": 900}):
        with pytest.raises(dse.UsageError, match=f"{next(iter(asked))}: expected "):
            problem.ask(**asked)


def test_every_answer_is_one_line_in_a_terminal() -> None:
    problem = dse.load(PUMP)
    result = dse.solve(problem)
    analysis = dse.analyse(problem, DESIGN)
    answers = [result, analysis, dse.check(problem), dse.explain(problem, max_jitter="5 ms"), dse.verify(result)]
    answers += [dse.simulate(problem, DESIGN, runs=1), dse.compare(result, result)]
    assert repr(analysis) == "<Analysis of 'Pump': meets every requirement>"
    assert [repr(answer) for answer in answers if "Pump" not in repr(answer)] == ["<Verification: verified>"]
    assert [repr(answer) for answer in answers if len(repr(answer)) > 100] == []
    assert repr(result.front[0]).startswith("<Point 1, rank 1: ") and len(repr(result.front[0])) < 200
