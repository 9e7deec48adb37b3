"""A design back as the problem file it came from, its decisions fixed and the comments kept."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from dse.analysis.diagnosis.front_verdicts import core_by, cores_of
from dse.analysis.messages.waits import named_identifiers
from dse.analysis.views import View
from dse.answers.exports.formats import in_comment
from dse.answers.exports.yaml_editing import YamlDocument, flow_mapping
from dse.answers.result import Result
from dse.space.architecture.carriers import ALONE
from dse.space.architecture.joins import may_join
from dse.space.model.criteria import Metric, Requirement
from dse.space.model.space import EMPTY, Decision, Design, Space
from dse.space.model.trees import at
from dse.space.options import read_value
from dse.space.question.metrics import QuestionError
from dse.space.question.settings import SETTINGS, profile_defaults
from dse.spec.loading.writing import yaml_text
from dse.support.errors import ProblemError
from dse.support.units import UnitError

COMMAND_LINE = "command line"
SECTIONS = ("processors", "buses", "devices", "threads", "executors", "reservations", "connections")


def fixed_problem(text: str, result: Result, design: Design, title: str, folder: Path, source: Path) -> str:
    """The problem file with its decisions fixed as in `design`.

    Parameters
    ----------
    text
        the original file, read from `source`.
    title
        a line that says what this is.
    folder
        where the file will stand: paths of included files and of samples are made relative to it.
    """
    draft = YamlDocument(text)
    space = result.space
    rest = [decision for decision in _open(space) if not _fix_in_place(draft, space, decision, design)]
    _joins(draft, space, design)
    _moved(draft, ["include"], folder, source)
    _moved(draft, ["messages", "definitions"], folder, source)
    _samples(draft, folder, source)
    _question(draft, result)
    _rules(draft, space, rest, design)
    _baseline(draft, space, design)
    remarks = (title, *_cores(space, design), *_identifiers(space, design))
    return "".join(f"# {in_comment(line)}\n" for line in remarks) + draft.result()


def _joins(draft: YamlDocument, space: Space, design: Design) -> None:
    """A thread that a timer releases in this design waits for no inputs."""
    view = View(design)
    for item in space.components:
        path = ["threads", item.stated_as, "join"]
        if may_join(item) and at(item.join, view) is None and isinstance(draft.find(path), yaml.ScalarNode):
            draft.replace(path, "any")


def _cores(space: Space, design: Design) -> Iterator[str]:
    """The cores that first-fit gives, as remarks: stated they would no longer follow when something else is changed."""
    view = View(design)
    chosen = {
        number: core
        for number, core in cores_of(space, design).items()
        if core_by(space, space.components[number], view) == "first-fit"
    }
    if chosen:
        yield "Cores by first-fit, on which response times count (write `core: N` at a thread to pin it):"
    for processor, slot in enumerate(space.processors):
        for core in sorted(set(chosen.values())):
            names = [
                space.components[number].name
                for number, its in chosen.items()
                if its == core and at(space.components[number].processor, view) == processor
            ]
            if names:
                yield f"  {slot.name}, core {core}: {', '.join(names)}"


def _identifiers(space: Space, design: Design) -> Iterator[str]:
    """The identifiers that a rule gives, as remarks: stated they would no longer follow when something else changes."""
    chosen = named_identifiers(space, design)
    if chosen:
        yield "Identifiers of messages with `identifier: any` (write the number at a connection to keep it):"
    for name, number in chosen.items():
        yield f"  {name}: {number}"


def without(text: str, error: ProblemError) -> str | None:
    """The text without requirements, objectives and costs that make no sense any more; None if something else is wrong.

    A fixed design may leave a virtual bus without a user; a requirement on it then speaks of nothing.
    """
    draft = YamlDocument(text)
    costs = [item for item in error.diagnostics if item.path.startswith("cost_of_change.")]
    if costs:
        draft.drop_section("cost_of_change", "speaks of what this design does not have:")
    for diagnostic in error.diagnostics:
        if diagnostic in costs:
            continue
        match = re.fullmatch(r"(requirements|objectives)\[(\d+)\]", diagnostic.path)
        if match is None:
            return None
        draft.drop_item([match.group(1), int(match.group(2))], "speaks of what this design does not have:")
    return draft.result()


def _open(space: Space) -> list[Decision]:
    return [decision for decision in space.decisions if decision.is_open]


def _fix_in_place(draft: YamlDocument, space: Space, decision: Decision, design: Design) -> bool:
    """Replace every list of the decision that stands in the component itself.

    False when there is none, or it is shared.
    """
    section = next((name for name in SECTIONS if draft.find([name, decision.component]) is not None), None)
    if section is None:
        return False
    path = [section, decision.component, *_field_path(decision.field)]
    node = draft.find(path)
    if decision.field in ("core", "priority") and not isinstance(node, yaml.SequenceNode):
        return _pin(draft, path, _chosen(space, decision, design))
    if decision.field == "executor" and _leaves_one_empty(space, decision, design):
        return False
    places = [path] if isinstance(node, yaml.SequenceNode) else []
    if isinstance(node, yaml.MappingNode):
        places = [[*path, key.value] for key, value in node.value if isinstance(value, yaml.SequenceNode)]
    if not places or any(draft.is_shared(place) for place in places):
        return False
    chosen = _chosen(space, decision, design)
    if space.profile != "dse" and _would_count(space, decision, design):
        return False  # it stays open, and what a design does not use unused
    if decision.field == "carried_in" and chosen != ALONE:
        return False  # so that it may still have an identifier
    for place in places:
        sequence = draft.find(place)
        texts = [_canonical(space, decision, item.value) for item in sequence.value]
        if chosen in texts or chosen is None or chosen == EMPTY or len(places) > 1:
            draft.choose(sequence, texts.index(chosen) if chosen in texts else 0)
        else:
            return False
    return True


def _leaves_one_empty(space: Space, decision: Decision, design: Design) -> bool:
    """Whether no thread of the design runs in some executor of the decision: fixed, no thread might at all."""
    view = View(design)
    used = {
        space.executors[item].name for item in (at(one.executor, view) for one in space.components) if item is not None
    }
    return not used.issuperset(decision.options)


def _would_count(space: Space, decision: Decision, design: Design) -> bool:
    """Whether a figure that the design does not use would count for OSATE if it were stated.

    OSATE counts the period of an aperiodic thread, which a type may state, and the bus of a connection in a process.
    """
    fields = ("period", "bus") if decision.field != "type" else ("period",)
    unused = (item.field for item in _open(space) if item.component == decision.component
              and item.field in fields and _chosen(space, item, design) is None)  # fmt: skip
    return decision.field in unused if decision.field != "type" else any(unused)


def _pin(draft: YamlDocument, path: list[str], core: str | None) -> bool:
    """State the core of a thread that leaves it open; False where the thread is shared with others by an alias."""
    node, thread = draft.find(path), draft.find(path[:-1])
    if not isinstance(thread, yaml.MappingNode) or draft.is_shared(path[:-1]):
        return False
    if core is not None and node is not None:
        draft.replace(path, core)
    elif core is not None:
        draft.add_entry(path[:-1], path[-1], core)
    return True


def _field_path(field: str) -> list[str]:
    """``transmission_time.fixed`` is a field of a mapping; a total's name may have dots of its own."""
    if field.startswith("totals."):
        return ["totals", field.removeprefix("totals.")]
    return field.split(".")


def _chosen(space: Space, decision: Decision, design: Design) -> str | None:
    """The text of the chosen option; None where the design does not use the decision."""
    option = design[space.decisions.index(decision)]
    return decision.options[option] if option >= 0 else None


def _canonical(space: Space, decision: Decision, text: str) -> str:
    """An item of a list as the decision calls it."""
    reference = space.references.get(decision.name)
    if reference is None:
        return text
    try:
        return reference.texts.get(read_value(reference, text), text)
    except (QuestionError, UnitError):
        return text


def _moved(draft: YamlDocument, place: list[str | int], folder: Path, source: Path) -> None:
    """The files that a place names, one or several, are found from where the new file will stand."""
    node = draft.find(place)
    if node is None or folder.resolve() == source.parent.resolve():
        return
    items: list[Any] = node.value if isinstance(node, yaml.SequenceNode) else [node]
    for position, item in enumerate(items):
        path = [*place, position] if isinstance(node, yaml.SequenceNode) else place
        moved = os.path.relpath((source.parent / item.value).resolve(), folder.resolve())
        draft.replace(path, yaml_text(Path(moved).as_posix()))


def _samples(draft: YamlDocument, folder: Path, source: Path) -> None:
    """Files of samples are found from where the new file will stand."""
    node = draft.find(["uncertainty"])
    if not isinstance(node, yaml.MappingNode) or folder.resolve() == source.parent.resolve():
        return
    done = set()
    for key, _ in node.value:
        path = ["uncertainty", key.value, "samples"]
        item = draft.find(path)
        if isinstance(item, yaml.ScalarNode) and id(item) not in done:  # an alias leads to one that is moved already
            done.add(id(item))
            moved = os.path.relpath((source.parent / item.value).resolve(), folder.resolve())
            draft.replace(path, yaml_text(Path(moved).as_posix()))


def _question(draft: YamlDocument, result: Result) -> None:
    """The question as it was asked, where that is not what the file says."""
    asked = result.problem.effective
    reason = "as in the original file; this result was asked otherwise, see the end:"
    defaults = {name: values[0] for name, values in SETTINGS.items()}
    defaults |= profile_defaults(asked["profile"])
    for key, default in defaults.items():
        node = draft.find([key])
        stated = {"true": "all", "false": "none"}.get(node.value, node.value) if node is not None else default
        if stated != asked[key]:
            draft.set_section(key, [f"{key}: {asked[key]}"], str(asked[key]), reason)
    added = [
        item for item in result.space.requirements if item.origin == COMMAND_LINE and item.metric.key != "deadline"
    ]
    if added:
        draft.append_items("requirements", [yaml_text(_requirement_text(item)) for item in added])
    node = draft.find(["objectives"])
    stated = [str(item.value) for item in node.value] if node is not None else []
    if stated != [item.text for item in result.space.objectives]:
        texts = [yaml_text(f"{item.sense} {_metric_text(item.metric)}") for item in result.space.objectives]
        lines = ["objectives:", *(f"  - {text}" for text in texts)]
        draft.set_section("objectives", lines, "[" + ", ".join(texts) + "]", reason)


def _requirement_text(item: Requirement) -> str:
    """A requirement of the command line as a problem file states it, its name in quotes if need be."""
    if item.text.startswith(item.metric.name):
        return _metric_text(item.metric) + item.text.removeprefix(item.metric.name)
    return item.text


def _metric_text(metric: Metric) -> str:
    if metric.operands:
        return metric.name
    kind, of, name = metric.name.partition(" of ")
    if not of or not re.search(r"[<>=!]|\bof\b", name):
        return metric.name
    quote = "'" if '"' in name else '"'
    return f"{kind} of {quote}{name}{quote}"


def _rules(draft: YamlDocument, space: Space, rest: Sequence[Decision], design: Design) -> None:
    """The rules hold in the design and are done with; what could not be fixed in its place is fixed by a rule."""
    lines = []
    for decision in rest:
        chosen = _chosen(space, decision, design)
        if chosen is None or decision.follows:
            continue
        quote = "'" if '"' in decision.component else '"'
        value = f'"{chosen}"' if '"' not in chosen else f"'{chosen}'"
        lines.append(f"{quote}{decision.component}{quote}.{decision.field} == {value}")
    if space.rules or lines:
        flow = "[" + ", ".join(yaml_text(text) for text in lines) + "]"
        block = [
            "rules:  # decisions that are not made where they are stated",
            *(f"  - {yaml_text(text)}" for text in lines),
        ]
        draft.set_section(
            "rules", block if lines else [], flow, "they hold in this design, which decides everything they speak of:"
        )


def _baseline(draft: YamlDocument, space: Space, design: Design) -> None:
    """The design itself, decision by decision."""
    made: dict[str, dict[str, str]] = {}
    for decision in _open(space):
        chosen = _chosen(space, decision, design)
        if chosen is not None and not decision.follows:
            made.setdefault(decision.component, {})[decision.field] = chosen
    lines = ["baseline:", *(f"  {yaml_text(name)}: {flow_mapping(fields)}" for name, fields in made.items())]
    flow = "{" + ", ".join(f"{yaml_text(name)}: {flow_mapping(fields)}" for name, fields in made.items()) + "}"
    draft.set_section("baseline", lines if made else [], flow, "the baseline of the original file:")
