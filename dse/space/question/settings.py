"""How a question is to be read: settings that go by one name in the file, in `Space`, in `Changes` and in results.

Which deadlines are requirements is decided here (`deadline_requirements`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from dse.space.model.criteria import Metric, Requirement
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import leaves
from dse.space.question.implied import with_implied
from dse.support.units import TIME, Quantity

SETTINGS: Mapping[str, tuple[str, ...]] = {
    "profile": ("dse", "osate-2.2", "osate-2.19"),
    "worst_case": ("execution_time", "deadline"),
    "system": ("asynchronous", "synchronous"),
    "partition_output": ("major_frame", "partition_end"),
    "best_case": ("empty_queue", "full_queue"),
    "bus_queuing": ("counted", "not_counted"),
    "processing": ("execution_time", "response_time"),
    "deadlines": ("stated", "all", "none"),
    "overload": ("forbidden", "allowed"),
}
"""Every setting with its values: they change the answer, so that results state all of them."""
OSATE_WORDS = {
    "AS": ("system", "asynchronous"), "SS": ("system", "synchronous"),
    "MF": ("partition_output", "major_frame"), "PE": ("partition_output", "partition_end"),
    "ET": ("worst_case", "execution_time"), "DL": ("worst_case", "deadline"),
    "EQ": ("best_case", "empty_queue"), "FQ": ("best_case", "full_queue"),
    "EQL": ("bus_queuing", "counted"), "DQL": ("bus_queuing", "not_counted"),
}  # fmt: skip
"""OSATE's abbreviations, of which the names of its reports are made, such as ``AS-MF-DL-EQ-EQL``."""
OSATE_SETTINGS = tuple(dict.fromkeys(name for name, _ in OSATE_WORDS.values()))
"""The settings that the profile `dse` does not look at."""
ORIGIN = "command line"


def profile_defaults(profile: str) -> dict[str, str]:
    """The settings that follow the profile where the file does not state them, by name.

    Under the profile *dse* threads wait for the CPU (``processing: response_time``), and stated deadlines are limits.
    For OSATE a deadline is an input of latency, no limit, and no thread waits.
    """
    if profile == "dse":
        return {"processing": "response_time", "deadlines": "stated"}
    return {"processing": "execution_time", "deadlines": "none"}


def stated_settings(stated: Mapping[str, str | None]) -> dict[str, str]:
    """The settings of a file, those that it leaves out as they are under its profile.

    `stated` has every setting by name, None where the file does not say.
    """
    defaults = profile_defaults(stated["profile"] or "dse")
    return {name: value if value is not None else defaults[name] for name, value in stated.items()}


def osate_settings(text: str) -> dict[str, str]:
    """The settings that a text of OSATE's abbreviations asks for; those that it leaves out stay as they are.

    Raises
    ------
    ValueError
        for a word that is none of them, or two of one kind.

    Examples
    --------
    >>> osate_settings("SS-DL")
    {'system': 'synchronous', 'worst_case': 'deadline'}
    """
    found: dict[str, str] = {}
    for word in text.upper().split("-"):
        name, value = OSATE_WORDS.get(word, ("", ""))
        if not name or name in found:
            known = ", ".join(OSATE_WORDS)
            raise ValueError(f"expected OSATE's settings such as AS-MF-DL-EQ-EQL, got {text!r}: one each of {known}")
        found[name] = value
    return found


def settings_of(space: Space) -> dict[str, str]:
    """The settings of a question, by name.

    The names are those of the problem file: profile, worst_case, processing and so on.
    """
    return {name: getattr(space, name) for name in SETTINGS}


def with_settings(space: Space, given: Mapping[str, str | None], stated: Mapping[str, str | None]) -> Space:
    """The space under other settings, its deadlines required as these say.

    `stated` are the settings of the file by name: those that are None there follow the profile that is given.
    """
    chosen: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    for name, value in profile_defaults(chosen["profile"]).items() if "profile" in chosen else ():
        if stated[name] is None:
            chosen.setdefault(name, value)
    changed = replace(space, **chosen)
    if changed.overload != space.overload:
        changed = with_implied(changed)
    return changed if changed.deadlines == space.deadlines else with_deadlines(changed, lambda _: ORIGIN)


def with_deadlines(space: Space, origin: Callable[[Component | Connection], str]) -> Space:
    """The space with the deadlines that its settings require among its requirements, after the flows' own latencies.

    They take the place of those that were there; `origin` says where each comes from.
    """
    found = deadline_requirements(space, origin)
    others = [item for item in space.requirements if item.metric.key != "deadline"]
    first = sum(flow.required_ns is not None for flow in space.flows)
    return replace(space, requirements=(*others[:first], *found, *others[first:]))


def deadline_requirements(space: Space, origin: Callable[[Component | Connection], str]) -> list[Requirement]:
    """A requirement for each deadline of a thread or message that `Space.deadlines` counts.

    With ``all`` a thread without a deadline ends by its period. `dse.analysis.limits` reads the limit itself.
    """
    found = []

    def add(of: Component | Connection, kind: str, number: int, longest_ns: int) -> None:
        metric = Metric(f"response time of {of.name}", kind, number, "deadline")
        limit = Quantity(Fraction(longest_ns, 10**9), TIME, "s")
        found.append(Requirement(f"{metric.name} <= its deadline", metric, "<=", limit, origin(of)))

    for number, component in enumerate(space.components) if space.deadlines != "none" else ():
        trees = (component.deadline_ns, component.period_ns)[: 2 if space.deadlines == "all" else 1]
        times = [leaf for tree in trees for leaf in leaves(tree) if leaf is not None]
        if component.processor is not None and times and space.is_last_piece(number):
            add(component, "response time", number, max(times))
    for number, wire in enumerate(space.connections) if space.deadlines != "none" else ():
        times = [leaf for leaf in leaves(wire.deadline_ns) if leaf is not None]
        if times:
            add(wire, "message response", number, max(times))
    return found
