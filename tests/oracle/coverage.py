"""What a problem file uses, so that a test can say what the generator covers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from .grammar import operands
from .problem import Problem, as_list


def features(text: str) -> set[str]:
    """The kinds of decision, component, requirement, rule and objective that a problem file uses."""
    document = yaml.load(text, Loader=yaml.BaseLoader)
    problem = Problem(document)
    return {*_decision_features(problem), *_component_features(problem), *_question_features(problem)}


def _decision_features(problem: Problem) -> Iterator[str]:
    for decision, options in problem.decisions.items():
        name, field = problem.owner(decision)
        section = problem.section_of[name]
        yield f"decision {section}.{field}"
        own = problem.component(name)
        if field == "dispatch_protocol":
            yield from (f"protocol option {option}" for option in options)
        if field != "type" and field not in own:
            yield f"alternatives inside {section} type"
        if isinstance(own.get(field), dict):
            yield "alternatives inside a processor type map"
        if section == "connections" and field == "bus":
            virtual = {option not in problem.sections["buses"] for option in options}
            yield from ["bus or middleware"] if len(virtual) == 2 else []
    if not problem.decisions:
        yield "no decision"


def _component_features(problem: Problem) -> Iterator[str]:
    if len(problem.sections["processors"]) > 1:
        yield "several processors"
    for section in ("processors", "buses"):
        for name, body in problem.sections[section].items():
            if body.get("optional") == "true":
                yield f"optional {section}"
                if len(problem.types(name)) == 2:
                    yield "optional slot with one type"
            if "bus" in body:
                yield "virtual on physical" if as_list(body["bus"])[0] != "middleware" else "stack of three"
    for body in problem.sections["bus_types"].values():
        kind = "virtual bus" if "virtual" in body else "bus"
        for field in ("transmission_time", "latency"):
            if field in body:
                per_type = isinstance(body[field], dict) and "RT101" in body[field]
                if body[field] == "from bandwidth":
                    yield "transmission time from bandwidth"
                yield f"{kind} {field}{' per processor type' if per_type else ''}"
        if "overhead" in body:
            yield f"{kind} overhead"
    yield from _frame_features(problem)
    yield from _task_features(problem)
    yield from _connection_features(problem)


def _frame_features(problem: Problem) -> Iterator[str]:
    for body in problem.sections["bus_types"].values():
        if "frame" in body:
            yield f"frame {body['frame'] if isinstance(body['frame'], str) else body['frame']['protocol']}"


def _task_features(problem: Problem) -> Iterator[str]:
    for section in ("devices", "threads"):
        for body in problem.sections[section].values():
            yield from (f"{section}.{field}" for field in body if field not in ("processor", "price", "power"))
            yield from (f"protocol {protocol}" for protocol in as_list(body.get("dispatch_protocol")))
            if section == "threads" and "processor" not in body:
                yield "thread without processor"
            for figure in ("price", "power", "totals"):
                if figure in body:
                    yield "figures of a device or thread"


def _connection_features(problem: Problem) -> Iterator[str]:
    names = list(problem.section_of)
    for body in problem.sections["connections"].values():
        yield from (f"connections.{field}" for field in body if field not in ("from", "to"))
        if "from" not in body or "to" not in body:
            yield "boundary"
        elif problem.section_of[body["from"]] == problem.section_of[body["to"]] == "threads":
            if names.index(body["from"]) > names.index(body["to"]):
                yield "feedback"
            processes = {problem.component(end).get("process") for end in (body["from"], body["to"])}
            if None not in processes and len(processes) == 1:
                yield "connection inside a process"
            elif problem.need_not_travel(body):
                homes = [set(as_list(problem.component(end).get("processor"))) for end in (body["from"], body["to"])]
                if homes[0] & homes[1]:
                    yield "connection on one processor" if len(homes[0] | homes[1]) == 1 else "perhaps on one processor"
        if body.get("port") in ("data", "data_access"):
            yield "data port" if body["port"] == "data" else "data access"
        if "bus" not in body:
            yield "unbound connection"
        if any(bus in problem.sections["bus_types"] for bus in as_list(body.get("bus"))):
            yield "virtual bus type used directly"
        if "data_rate" in body:
            yield f"data_rate {'with' if 'data_size' in body else 'without'} data_size"
    yield from _flow_features(problem)


def _flow_features(problem: Problem) -> Iterator[str]:
    for flow in problem.sections["flows"].values():
        path = flow["path"]
        if path[0] in problem.sections["connections"] or path[-1] in problem.sections["connections"]:
            yield "flow from or to the boundary"
        if any(element in problem.sections["connections"] for element in path[1:-1]):
            yield "connection named in a path"
        if "latency" in flow:
            yield "required latency of a flow"


def _segment_features(problem: Problem) -> Iterator[str]:
    for body in problem.sections["processor_types"].values():
        if "serves" in body:
            yield f"accelerator by {body['serves']}"
    for name, body in problem.sections["threads"].items():
        for piece in body.get("segments", ()):
            yield "segment on an accelerator" if "processor" in piece else "segment on the own processor"
            yield from (
                ["segment with a time for each type"] if isinstance(piece["compute_execution_time"], dict) else []
            )
        if "segments" in body and len(problem.types(name)) < 2 and not problem.is_always_timed(name):
            yield "segments that events release"
        slots = as_list(body.get("processor"))
        kinds = [problem.sections["processor_types"][kind] for slot in slots for kind in as_list(_kinds(problem, slot))]
        if any("serves" in kind for kind in kinds):
            yield "whole thread on an accelerator"
        for key in ("executor", "reservation"):
            yield from [f"{key} beside segments"] if key in body else []


def _host_features(problem: Problem) -> Iterator[str]:
    """Where executors and reservations are, and who may run in them."""
    for section in ("executors", "reservations"):
        for name, body in problem.sections[section].items():
            yield from (f"{section}.{field}" for field in body)
            yield from [f"listed cores of {section}"] if isinstance(body.get("core"), list) else []
            is_open = name in problem.places and len(problem.cores(name)) > 1
            if is_open and f"{name}.core" not in problem.decisions:
                yield f"open core of {section} that is no decision"
    for name in problem.sections["executors"]:
        inside = [names for names in map(as_list, _executors(problem)) if name in names]
        if all(len(names) > 1 for names in inside):
            yield "executor that may be empty"
        elif any(len(names) > 1 for names in inside):
            yield "executor of which some are chosen"
    for body in problem.sections["threads"].values():
        if "executor" in body:
            yield from (f"{key} of a thread in an executor" for key in ("process", "priority") if key in body)
    for text in (text for rule in problem.rules for text in operands(rule.condition)):
        yield from (f"rule about {field}" for field in ("core", "executor", "processor") if text.endswith(f".{field}"))
    yield from _lacking(problem)


def _executors(problem: Problem) -> list[Any]:
    return [body.get("executor") for body in problem.sections["threads"].values()]


def _lacking(problem: Problem) -> Iterator[str]:
    """Cores that are offered where some processor or type has none of that number."""
    for place in problem.places:
        slots = as_list(problem.component(place)["processor"])
        most = max(map(int, problem.cores(place)))
        if problem.stated_cores(place) and most > min(map(problem.most_cores, slots)):
            yield "core that a processor lacks"
        kinds = [problem.sections["processor_types"][kind] for slot in slots for kind in as_list(_kinds(problem, slot))]
        if any(most > int(as_list(kind.get("cores", "1"))[0]) for kind in kinds):
            yield "core that a type lacks"


def _kinds(problem: Problem, slot: str) -> Any:
    return problem.component(slot)["type"]


def _timeliness_features(problem: Problem) -> Iterator[str]:
    if any(problem.deadline_fields(name) for name in problem.sections["threads"]):
        yield f"deadlines {problem.document.get('deadlines', 'stated')}"
        if any(field.endswith(".core") for field in problem.decisions):
            yield "open cores"
    elif problem.document.get("deadlines") == "none":
        yield "deadlines none"
    if problem.counts_responses:
        yield "processing response_time"


def _question_features(problem: Problem) -> Iterator[str]:
    yield f"{len(problem.objectives)} objectives"
    for objective in problem.objectives:
        yield "minimise" if objective.sign > 0 else "maximise"
        yield f"objective {objective.metric.name}"
        kinds = {"utilisation": "processors", "latency": "flows", "load": "buses"}
        section = kinds.get(objective.metric.name)
        if section and objective.metric.of is None and len(problem.sections[section]) > 1:
            yield f"objective {objective.metric.name} (all)"
    for requirement in problem.requirements:
        yield f"operator {requirement.operator}"
        yield f"requirement {requirement.metric.name}{'' if requirement.metric.of else ' (general)'}"
        if requirement.metric.name == "load":
            yield "load share" if requirement.limit.endswith(("%", "ppm")) else "load in B/s"
    for rule in problem.rules:
        yield from (
            "rule " + word
            for word in (
                "require",
                "forbid",
                "implies",
                "requires",
                " and ",
                " or ",
                "not ",
                " in [",
                "is a multiple of",
                "==",
                "!=",
                "<=",
                ">=",
                "(",
            )
            if word in rule.text
        )
        yield "rule without verb" if not rule.text.startswith(("require ", "forbid ")) else "rule with verb"
    yield from _timeliness_features(problem)
    yield from _segment_features(problem)
    yield from _host_features(problem)
    for key in ("metrics", "totals", "baseline", "cost_of_change"):
        if problem.document.get(key):
            yield key
    if any(" " in name for name in problem.section_of):
        yield "name with a blank"
