"""Designs as AADL, each read back before it is handed out: it must give the very figures."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from dse.analysis.evaluate import Evaluator
from dse.api.completing import complete_design
from dse.api.export import check_same, figures
from dse.api.problem import Model, load, load_carried
from dse.errors import ProblemError, UsageError
from dse.importers.aadl.alternatives import Subsystem, replacement, subsystems, with_implementations
from dse.importers.aadl.model import Model as AadlModel
from dse.importers.aadl.model import read_model
from dse.importers.aadl.problem import Writer
from dse.importers.registry import YAML, is_model
from dse.results.aadl.chosen import ChosenModel, Side
from dse.results.aadl.whole import WholeModel
from dse.results.design_tables import analyse_design
from dse.results.solve import Result
from dse.space.settings import settings_of
from dse.space.types import Design, Space
from dse.spec.model import Imported
from dse.units import Exact

TRIALS = 10
MOST_TOLD = 3
INSTEAD = "--format problem writes it as a problem file"
Responses: TypeAlias = Mapping[str, tuple[Exact, Exact]]


def aadl_text(result: Result, design: Design, title: str, *, response_times: bool = False) -> str:
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
        for _ in range(TRIALS):
            text = WholeModel(document, result.space, design, title).text(left_out)
            path.write_text(text, encoding="utf-8")
            try:
                check_same(result, design, load(path).space)
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
    options = {key: text for key, text in (("root", imported.root), ("mode", imported.mode)) if text is not None}
    model = read_model(path, options)
    taken = _implementations(model, result.space, design)
    if taken:
        names = {item.name: item.classifiers[0] for item in taken}
        model = with_implementations(model, taken, names, path, options)
    writer = Writer(model, path, options)
    writer.document()
    base = _base(path, imported, taken)
    before, chosen = Side(base, complete_design(base, {})), Side(result.space, design)
    components = {item.title: item for item in model.root.below()}
    refined = {
        components[item.component.title]: replacement(model.library, item.component, item.classifiers[0])
        for item in taken
    }
    name = f"{imported.root.rpartition('::')[2].partition('.')[0]}_chosen"
    text, given = (
        ChosenModel(model, writer, before, chosen, title, name, refined).text(told) for told in ({}, responses)
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
    return given


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
        return load(Model(path, imported.root, imported.mode)).space
    document: dict[str, Any] = {"dse": 1, "name": "base", "of": str(path.resolve()), "root": imported.root}
    document |= {"mode": imported.mode} if imported.mode else {}
    for item in taken:
        document.setdefault(item.key[0], {})[item.name] = {"type": item.classifiers[0]}
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "base.yaml"
        file.write_text(json.dumps(document), encoding="utf-8")
        return load(file).space


def _responses(result: Result, design: Design) -> Responses:
    """The best and worst response time of each thread, in ns; of those without a bound none."""
    found = analyse_design(Evaluator(result.space), design, response_times=True).responses
    return {
        item.name: (item.best_ns, item.response_ns)
        for responses in found.values()
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
    found = re.fullmatch(r"(requirements|objectives)\[(\d+)\]", path)
    if found is None:
        return None
    stated = [text for text in document[found[1]] if text not in left_out]
    return str(stated[int(found[2])])
