"""`dse.export`: a chosen design for other tools, and back as a problem file that gives the same figures."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from dse.analysis.evaluate import Evaluator
from dse.analysis.messages.stages import counted_buses
from dse.analysis.views import View
from dse.answers.analysis import analyse_design
from dse.answers.designs import FurtherDesign, Point
from dse.answers.drawing.picture import Drafter
from dse.answers.exports.aadl.extension import ChosenModel, Side
from dse.answers.exports.aadl.model import WholeModel
from dse.answers.exports.cie import cie_configuration
from dse.answers.exports.dbc import can_database
from dse.answers.exports.formats import graphml, graphviz, pinning_table, ros2_parameters
from dse.answers.exports.problem_file import fixed_problem, without
from dse.answers.result import Result
from dse.importers.aadl.document.implementations import Subsystem, replacement, subsystems, with_implementations
from dse.importers.aadl.document.problem import ProblemWriter
from dse.importers.aadl.instance.model import InstanceModel as AadlModel
from dse.importers.aadl.instance.model import read_model
from dse.importers.registry import YAML, is_model
from dse.questions.complete_design import complete_design
from dse.questions.problem import Model, Problem, load, load_carried, model_of
from dse.space.model.metric_kinds import counts_changes
from dse.space.model.space import Design, Space
from dse.space.question.settings import settings_of
from dse.spec.loading.writing import block_text
from dse.spec.schema.model import Imported, Ros2
from dse.support import arguments
from dse.support.errors import ProblemError, UsageError
from dse.support.units import Exact

Format = Literal["problem", "ros2", "cie", "pinning", "dbc", "dot", "graphml", "aadl", "svg"]
TRIALS = 5


@arguments.checked(
    result=arguments.DRAWN, form=arguments.Word(get_args(Format)), folder=arguments.path, response_times=arguments.flag
)
def export(
    result: Result | Problem,
    alternative: int | str | None = None,
    form: Format = "problem",
    folder: str | Path = ".",
    *,
    response_times: bool = False,
) -> str:
    """One design of a result as text, or the drawing of a problem.

    Parameters
    ----------
    result
        from `dse.solve` or `dse.questions.reopen.reopen`; or a problem, of which only ``svg`` can be written.
    alternative
        the id of a point (``3``), or of another design (``3.1``); None for the drawing of a problem.
    form
        ``problem``: the problem file with its decisions fixed; ``ros2``: the parameters that nodes declare; ``cie``: a
        configuration of the callback-isolated executor, with priorities and cores; ``pinning``: cores and
        priority levels of threads as CSV; ``dbc``: the messages of a CAN bus with their identifiers; ``dot``;
        ``graphml``; ``aadl``: a model, or an implementation that extends the one that the problem is of; ``svg``: a
        drawing of the architecture, of a problem with its open decisions marked.
    folder
        where a problem file will stand: it decides how included files and those of samples are named.
    response_times
        whether an AADL model gets the computed response times of its threads as SEI::Response_Time, which OSATE's
        latencies then count instead of execution times.

    Raises
    ------
    UsageError
        when there is no such design or form, or response times are asked for in another form than AADL.

    Examples
    --------
    >>> import dse
    >>> chosen = dse.loads(dse.export(dse.solve("pump.yaml"), 1))
    >>> chosen.space.baseline is not None
    True
    >>> dse.export(dse.load("pump.yaml"), form="svg").splitlines()[-1]
    '</svg>'
    """
    if response_times and form != "aadl":
        raise UsageError("response times are written to AADL models only")
    if form == "svg" and alternative is None:
        return Drafter(result.space, for_designs=False).standalone(None)
    if not isinstance(result, Result) or alternative is None:
        raise UsageError(f"{form} is of a design: name an alternative of a result")
    chosen = find_design(result, alternative)
    title = f"{result.problem.name}: alternative {chosen.id} of dse solve, problem SHA-256 {result.problem.sha256}"
    if form == "ros2":
        return ros2_parameters(result.space, chosen.design, title, _names(result))
    if form == "cie":
        return cie_configuration(result.space, chosen.design, title, _names(result))
    if form == "pinning":
        return pinning_table(result.space, chosen.design, title)
    if form == "dbc":
        return can_database(result.space, chosen.design, title)
    if form == "dot":
        return graphviz(result.space, chosen.design)
    if form == "svg":
        return Drafter(result.space).standalone(chosen.design)
    if form == "graphml":
        return graphml(result.space, chosen.design)
    if form == "aadl":
        return _aadl_text(result, chosen.design, title, response_times=response_times)
    return _problem(result, chosen.design, title, Path(folder))


def _names(result: Result) -> Ros2 | None:
    """How ROS 2 calls what the problem names."""
    return load_carried(result.problem.file, result.problem.texts).loaded.spec.ros2


def find_design(result: Result, alternative: int | str) -> Point | FurtherDesign:
    """The point or other design with that id.

    Raises
    ------
    UsageError
        when there is none.
    """
    candidates: list[Point | FurtherDesign] = [
        *result.front,
        *(item for others in result.others for item in others.designs),
    ]
    for item in candidates:
        if str(item.id) == str(alternative):
            return item
    ids = ", ".join(str(item.id) for item in candidates[:40])
    raise UsageError(f"there is no alternative {alternative}; ids: {ids or 'none'}")


def _problem(result: Result, design: Design, title: str, folder: Path) -> str:
    """The fixed problem file, after a copy has been read back, with the result's texts, and has given the figures."""
    source = Path(result.problem.file)
    original = _original(result, folder)
    texts = [fixed_problem(original, result, design, title, where, source) for where in (folder, source.parent)]
    path = source.parent / "exported.yaml"
    for _ in range(TRIALS):
        try:
            _check_same(result, design, load_carried(path, {**result.problem.texts, path.name: texts[1]}).space)
        except ProblemError as error:
            cleaned = [without(text, error) for text in texts]
            if None in cleaned:
                raise AssertionError(f"the exported problem does not load: {error}") from error
            texts = [text for text in cleaned if text is not None]
        else:
            return texts[0]
    raise AssertionError("the exported problem does not load")


def _original(result: Result, folder: Path) -> str:
    """The problem file as it was read; with its includes merged in where these cannot be used from `folder`.

    Names of samples are relative to the main file: those of an included one would not be found from another.
    """
    problem = result.problem
    source = Path(problem.file)
    text = problem.texts[source.name]
    merges = re.search(r"^of:", text, re.M) is not None or (problem.is_carried and len(problem.texts) > 1)
    if not merges and folder.resolve() != source.parent.resolve() and len(problem.texts) > 1:
        loaded = load_carried(problem.file, problem.texts).loaded
        merges = any(
            isinstance(stated.samples, str)
            and loaded.source_of(("uncertainty", key, "samples")) is not loaded.sources[0]
            for key, stated in loaded.spec.uncertainty.items()
        )
    if merges:
        return block_text(load_carried(problem.file, problem.texts).loaded.document)
    return text.removeprefix("\ufeff")


def _check_same(result: Result, design: Design, space: Space) -> None:
    """The exported problem must have the design as its baseline, with the very figures; from there nothing changes.

    Without the waiting for buses where less is open of these, so that more of it counts.
    """
    there, known = complete_design(space, space.baseline), result.space
    if counted_buses(space) != counted_buses(known):
        space, known = replace(space, bus_queuing="not_counted"), replace(known, bus_queuing="not_counted")
    mine, theirs = figures(known, design), figures(space, there)
    told = {name: value for name, value in theirs.items() if name in mine}  # more have figures where less is open
    differing = {name: (value, mine[name]) for name, value in told.items() if mine[name] != value}
    assert not differing, f"the exported problem has other figures: {differing}"


def figures(space: Space, design: Design) -> dict[str, Fraction]:
    """Every metric of a design except `changes`, exact, by name.

    Names of metrics to exact values in base units. An export is read back; it is written only if its figures are equal.
    """
    view = View(design)
    metrics = Evaluator(space).metrics
    return {item.metric.name: item.value(view) for item in metrics if not counts_changes(space, item.metric)}


# Designs as AADL, each read back before it is handed out: it must give the very figures.


TRIALS_OF_EXPORTING_AADL = 10
MOST_TOLD = 3
INSTEAD = "--format problem writes it as a problem file"
Responses: TypeAlias = Mapping[str, tuple[Exact, Exact]]


def _aadl_text(result: Result, design: Design, title: str, *, response_times: bool = False) -> str:
    """A design as AADL, with the response times of its threads where they are asked for.

    Raises
    ------
    UsageError
        for what AADL cannot say, naming it.
    """
    loaded = load_carried(result.problem.file, result.problem.texts).loaded
    served = [item for item in result.space.processors if item.serves is not None]
    pieces = [item.pieces for item in result.space.components if item.pieces is not None]
    if pieces or served:
        what = f"{pieces[0].thread} has segments" if pieces else f"{served[0].name} serves one job at a time"
        raise UsageError(f"AADL cannot say all of this design: {what} ({INSTEAD})")
    responses = _responses(result, design) if response_times else {}
    if loaded.spec.imported is not None and not _is_imported_copy(result):
        return _chosen(result, design, title, loaded.spec.imported, responses)
    document = loaded.document
    left_out: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "exported.aadl"
        for _ in range(TRIALS_OF_EXPORTING_AADL):
            text = WholeModel(document, result.space, design, title).text(left_out)
            path.write_text(text, encoding="utf-8")
            try:
                _check_same(result, design, load(path).space)
            except AssertionError as error:
                raise UsageError(f"AADL cannot say all of this design: {error} ({INSTEAD})") from error
            except ProblemError as error:
                dropped = [_of_nothing(document, left_out, item.path) for item in error.diagnostics]
                if None in dropped:
                    said = "; ".join(f"{item.path}: {item.message}" for item in error.diagnostics[:MOST_TOLD])
                    raise UsageError(f"AADL cannot say all of this design: {said} ({INSTEAD})") from error
                left_out += [text for text in dropped if text is not None]
            else:
                return (
                    WholeModel(document, result.space, design, title, responses).text(left_out) if responses else text
                )
    raise UsageError(f"AADL cannot say all of this design ({INSTEAD})")


def _chosen(result: Result, design: Design, title: str, imported: Imported, responses: Responses) -> str:
    """An implementation that extends the model; it is read back together with the files of that."""
    path = _model_file(result)
    options = model_of(path, imported).options
    model = read_model(path, options)
    taken = _implementations(model, result.space, design)
    if taken:
        names = {item.name: item.classifiers[0] for item in taken}
        model = with_implementations(model, taken, names, path, options)
    writer = ProblemWriter(model, path, options)
    writer.document()
    base = _base(path, imported, taken)
    before, chosen = Side(base, complete_design(base, {})), Side(result.space, design)
    known = {item.name for item in base.connections}
    added = next((item.name for item in result.space.connections if item.name not in known), None)
    if added is not None:
        raise UsageError(f"AADL cannot say all of this design: the model has no connection {added} ({INSTEAD})")
    components = {item.title: item for item in model.root.below()}
    refined = {
        components[item.component.title]: replacement(model.library, item.component, item.classifiers[0])
        for item in taken
    }
    name = f"{imported.root.rpartition('::')[2].partition('.')[0]}_chosen"
    text, wanted = (
        ChosenModel(model, writer, before, chosen, title, name, refined).text(refined_by)
        for refined_by in ({}, responses)
    )
    with tempfile.TemporaryDirectory() as place:
        for number, file in enumerate(model.library.files):
            (Path(place) / f"{number}.aadl").write_bytes(file.read_bytes())
        target = Path(place) / "chosen.aadl"
        target.write_text(text, encoding="utf-8")
        settings = settings_of(result.space)
        there = load(Model(target, mode=imported.mode)).ask(**settings).space
        mine, theirs = figures(result.space, design), figures(there, complete_design(there, {}))
    kinds = ("latency", "min latency", "jitter", "load", "utilisation")
    differing = [
        key for key, value in theirs.items() if key.partition(" of ")[0] in kinds and mine.get(key, value) != value
    ]
    if differing:
        raise UsageError(f"AADL cannot say all of this design: in the model it would have another {differing[0]}")
    return wanted


def _is_imported_copy(result: Result) -> bool:
    """Whether it is a problem file as `dse import` writes it: a problem by itself, not one of the model."""
    name = Path(result.problem.file).name
    stated = re.search(r"^imported:", result.problem.texts.get(name, ""), re.MULTILINE)
    return name.lower().endswith(YAML) and stated is not None


def _implementations(model: AadlModel, space: Space, design: Design) -> list[Subsystem]:
    """The subsystems of the root whose implementation was chosen, each with that alone."""
    choices: dict[str, dict[str, list[str]]] = {"threads": {}, "devices": {}}
    sections = {item.name: item.section for item in space.components}
    for item, option in zip(space.decisions, design, strict=False):
        if item.field == "type" and item.component in sections and option >= 0:
            choices[sections[item.component]][item.component] = [item.options[option]]
    return [item for item in subsystems(model, choices) if item.component.parent is model.root]


def _base(path: Path, imported: Imported, taken: Sequence[Subsystem]) -> Space:
    """The problem that a model states by itself, with these implementations of subsystems."""
    if not taken:
        return load(model_of(path, imported)).space
    document: dict[str, Any] = {"dse": 1, "name": "base", "of": str(path.resolve()), "root": imported.root}
    document |= {"mode": imported.mode} if imported.mode else {}
    document |= {"library": [str(Path(item).resolve()) for item in model_of(path, imported).library]}
    for item in taken:
        document.setdefault(item.key[0], {})[item.name] = {"type": item.classifiers[0]}
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "base.yaml"
        file.write_text(json.dumps(document), encoding="utf-8")
        return load(file).space


def _responses(result: Result, design: Design) -> Responses:
    """The best and worst response time of each thread, in ns; of those without a bound none."""
    analysis = analyse_design(Evaluator(result.space), design, response_times=True).responses
    return {
        item.name: (item.best_ns, item.response_ns)
        for responses in analysis.values()
        for item in responses
        if item.part == "thread" and item.response_ns is not None
    }


def _model_file(result: Result) -> Path:
    """The model that a result's problem came from, on the disk."""
    main = Path(result.problem.file)
    candidates = [main, *(main.parent / name for name, _ in result.problem.includes)]
    for path in candidates:
        if path.exists() and is_model(path):
            return path
    raise UsageError(f"{main}: the AADL model that it is of is not there; it is needed to extend it")


def _of_nothing(document: Mapping[str, Any], left_out: list[str], path: str) -> str | None:
    """The requirement or objective that makes no sense in this design any more, or the name of such a metric."""
    if path.startswith("metrics."):
        return path.removeprefix("metrics.")
    match = re.fullmatch(r"(requirements|objectives)\[(\d+)\]", path)
    if match is None:
        return None
    stated = [text for text in document[match[1]] if text not in left_out]
    return str(stated[int(match[2])])
