"""A file that decides over an AADL model, to start from: what the model states, and what may be chosen instead.

The options are those that nobody has to think up: half and double of each stated period, how threads are dispatched,
and the classifiers of processors and buses that the model has. Its own values are the baseline.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from dse.importers.aadl.instance.model import InstanceModel, libraries, read_model
from dse.importers.registry import Imported, read_foreign
from dse.space.build import build_space
from dse.spec.loading.load import load_spec
from dse.spec.loading.writing import block_text
from dse.support.errors import Diagnostic, ProblemError
from dse.support.units import UnitError, format_duration, parse_period_ns

ASSUMED = "half and double of each stated period are assumptions of `dse new`: keep what the application allows"
PERIOD = "    period: ["
TRIALS = 20
SLOTS = {"processors": "processor", "buses": "bus"}
MOST_LATENCIES = 2
"""The most flows whose latency is an objective."""


def deciding_text(path: Path, options: Mapping[str, str], folder: Path) -> tuple[str, tuple[Diagnostic, ...]]:
    """The text of a file in a folder that decides over a model, and the remarks of the import.

    Parameters
    ----------
    path
        the model, an ``.aadl`` file or a folder of them.
    options
        those of the importer: ``root``, ``mode``, ``library``.
    folder
        where the file will stand: paths in it are seen from there.

    Raises
    ------
    ProblemError
        when the model is wrong.
    """
    imported = read_foreign(path, "aadl", options)
    model = read_model(path, options)
    choices = _choices(imported.document, model)
    head = _head(imported, options)
    choices = _accepted(
        {**head, "of": str(path.resolve())}, choices, [str(item.resolve()) for item in libraries(options)]
    )
    document = {**head, "of": _seen_from(folder, path)}
    if folders := [_seen_from(folder, item) for item in libraries(options)]:
        document["library"] = folders
    document |= {**choices, **_question(head, choices)}
    text = "".join(f"{line}\n" for line in _explained(block_text(document)))
    return _comments(imported) + text, imported.remarks


def _head(imported: Imported, options: Mapping[str, str]) -> dict[str, Any]:
    """The head of the document: the model and the question."""
    stated = imported.document["imported"]
    head: dict[str, Any] = {"dse": 1, "name": f"Decisions of {stated['root']}", "of": "", "root": stated["root"]}
    if options.get("mode"):
        head["mode"] = options["mode"]
    bound = [item for item in imported.document.get("threads", {}).values() if "processor" in item]
    deadlines = [item["deadline"] for item in bound if "deadline" in item]
    if deadlines and not any(text.startswith("0 ") for text in deadlines):
        head["deadlines"] = "stated"
    flows = list(imported.document.get("flows", {}))[:MOST_LATENCIES]
    head["objectives"] = [f'minimise latency of "{name}"' for name in flows]
    head["assumptions"] = [ASSUMED]
    return head


def _choices(document: Mapping[str, Any], model: InstanceModel) -> dict[str, dict[str, dict[str, list[str]]]]:
    """The options of fields, by section and name; the value of the model comes first."""
    choices: dict[str, dict[str, dict[str, list[str]]]] = {}
    entered = {item.get("to") for item in document.get("connections", {}).values()}
    for name, item in document.get("threads", {}).items():
        if "category" in item:
            continue
        fields: dict[str, list[str]] = {}
        if periods := _periods(item.get("period")):
            fields["period"] = periods
            stated = item.get("dispatch_protocol", "periodic")
            if name in entered:
                fields["dispatch_protocol"] = list(dict.fromkeys((stated, "periodic", "aperiodic")))
        if fields:
            choices.setdefault("threads", {})[name] = fields
    for section, category in SLOTS.items():
        for name, types in _types(document.get(section, {}), model, category):
            choices.setdefault(section, {})[name] = {"type": types}
    return choices


def _periods(stated: Any) -> list[str]:
    """A period, half and double of it, as far as they are whole nanoseconds."""
    if not isinstance(stated, str):
        return []
    try:
        period_ns = parse_period_ns(stated)
    except UnitError:
        return []
    wanted = (period_ns, *([period_ns // 2] if period_ns % 2 == 0 else []), 2 * period_ns)
    return [format_duration(value) for value in wanted]


def _types(slots: Mapping[str, Any], model: InstanceModel, category: str) -> Iterator[tuple[str, list[str]]]:
    """The slots of a category, each with its own classifier and the others that the packages of the model have."""
    everything = [item for package in model.library.main for item in package.classifiers.values()]
    named = [item for item in everything if item.category == category]
    stems = {item.name.partition(".")[0].lower() for item in named if item.is_implementation}
    offered = [
        f"{item.package}::{item.name}" for item in named if item.is_implementation or item.name.lower() not in stems
    ]
    for component in model.root.below():
        name = model.name(component)
        if component.category != category or component.flat is None or name not in slots:
            continue
        types = list(dict.fromkeys((component.flat.title, *offered)))
        if len(types) > 1:
            yield name, types


def _accepted(
    head: Mapping[str, Any], choices: dict[str, dict[str, dict[str, list[str]]]], folders: list[str]
) -> dict[str, dict[str, dict[str, list[str]]]]:
    """The choices without those that no problem can have, such as a dispatch by inputs in a cycle."""
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "trial.yaml"
        for _ in range(TRIALS):
            document = {**head, **({"library": folders} if folders else {}), **choices}
            file.write_text(block_text({**document, **_question(head, choices)}), encoding="utf-8")
            try:
                build_space(load_spec(file))
            except ProblemError as error:
                if not any(_dropped(choices, item.path) for item in error.diagnostics):
                    raise
            else:
                break
    return {section: entries for section, entries in choices.items() if entries}


def _dropped(choices: dict[str, dict[str, dict[str, list[str]]]], path: str) -> bool:
    """Take out what a mistake is about; whether there was anything of it."""
    for section, entries in choices.items():
        for name, fields in list(entries.items()):
            for key in list(fields):
                if path.startswith((f"{section}.{name}.{key}", f"baseline.{name}.{key}")):
                    del fields[key]
                    if not fields:
                        del entries[name]
                    return True
    return False


def _question(head: Mapping[str, Any], choices: Mapping[str, Mapping[str, Mapping[str, list[str]]]]) -> dict[str, Any]:
    """The baseline and the objectives; where nothing may be chosen there is no baseline, and no change to count."""
    baseline = dict(_baseline(choices))
    changes = ["minimise changes"] if baseline else []
    return {"objectives": [*changes, *head["objectives"]], **({"baseline": baseline} if baseline else {})}


def _baseline(choices: Mapping[str, Mapping[str, Mapping[str, list[str]]]]) -> Iterator[tuple[str, dict[str, str]]]:
    """The first option of each choice: what the model states."""
    for entries in choices.values():
        for name, fields in entries.items():
            yield name, {key: listed[0] for key, listed in fields.items()}


def _seen_from(folder: Path, path: Path) -> str:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()


def _explained(text: str) -> Iterator[str]:
    for line in text.splitlines():
        yield f"{line}  # the first is stated, half and double are assumed" if line.startswith(PERIOD) else line


def _comments(imported: Imported) -> str:
    """Comments on the requirements of the model, which hold as well."""
    document = imported.document
    lines = ["# What the model asks for holds as well:"]
    for name, flow in document.get("flows", {}).items():
        if "latency" in flow:
            lines.append(f"#   latency of {name} within {flow['latency']}")
    lines += [f"#   {text}" for text in document.get("requirements", ())]
    lines += [f"#   NOT READ: {item['reason']}" for item in document.get("unread", {}).values()]
    if len(lines) == 1:
        lines = ["# The model states no latency and no budget of a bus: `requirements` may."]
    return "".join(f"{line}\n" for line in lines)
