"""By which rules the figures of an answer count, and what 100 % of utilisation is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from dse.analysis.diagnosis.front_verdicts import uncounted_buses, waiting_counted
from dse.report.amounts import listed
from dse.space.model.metric_kinds import flows_in, is_of_message
from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.space.question.open_cores import asked_metrics, is_scheduled
from dse.space.question.settings import OSATE_SETTINGS, SETTINGS, profile_defaults, settings_of

PER_CORE = "Utilisation counts one core as 100 %, n cores as n times that; a limit of 70 % is one of each core."
NOTHING_MISSING: Mapping[str, str] = MappingProxyType({})
PROCESSORS = "processors"
"""All processors together, among the resources for which waiting is counted."""


def basis_parts(settings: Mapping[str, Any]) -> dict[str, str]:
    """The rules by which figures count, from settings by name (`dse.space.question.settings`).

    Returns a phrase for each setting that is worth a word: ``profile`` and ``processing`` always, others where they
    differ from what is usual under the profile.
    """
    parts = {"profile": f"profile {settings['profile']}"}
    if settings["profile"] != "dse":
        parts["worst_case"] = f"worst case by {settings['worst_case'].replace('_', ' ')}"
        for name in OSATE_SETTINGS:
            if name != "worst_case" and settings.get(name, SETTINGS[name][0]) != SETTINGS[name][0]:
                parts[name] = f"{name.replace('_', ' ')}: {settings[name].replace('_', ' ')}"
    parts["processing"] = f"processing by {settings['processing'].replace('_', ' ')}"
    if settings["deadlines"] != profile_defaults(settings["profile"])["deadlines"]:
        parts["deadlines"] = f"deadlines: {settings['deadlines']}"
    if settings["overload"] != "forbidden":
        parts["overload"] = "overload allowed"
    if settings.get("robust"):
        parts["robust"] = "robust: requirements hold for all stated values"
    return parts


def basis_words(settings: Mapping[str, Any]) -> str:
    """The rules by which figures count, in one line.

    >>> basis_words({"profile": "dse", "worst_case": "deadline", "processing": "response_time", "deadlines": "all",
    ...     "overload": "allowed"})
    'profile dse, processing by response time, deadlines: all, overload allowed'
    """
    return ", ".join(basis_parts(settings).values())


def counted_delays(waiting: Mapping[str, Sequence[str]]) -> str:
    """The delays that latencies count besides waiting: execution, transmission, and the faults of wires that have some.

    >>> counted_delays({"counted": ["can0"], "not_counted": [], "faults": ["can0"]})
    'execution, transmission, faults of can0'
    """
    faults = [f"faults of {listed(waiting['faults'])}"] if waiting.get("faults") else []
    return ", ".join(["execution", "transmission", *faults])


def waiting_verdict(waiting: Mapping[str, Sequence[str]], missing: Mapping[str, str] = NOTHING_MISSING) -> str:
    """The sentence on the resources for which waiting is counted, and on those for which it is not; "" without any.

    `waiting` is the form of `waiting_counted`; buses are named where some are counted and others are not, or where some
    are `missing` a figure: what, by the name of the bus (`missing_figures`).

    >>> waiting_verdict({"counted": ["processors", "can0"], "not_counted": []})
    'Waiting counted: processors, buses.'
    >>> waiting_verdict({"counted": ["processors", "can0"], "not_counted": ["ser0", "eth0"]})
    'Waiting counted: processors, can0; not counted: ser0, eth0.'
    >>> waiting_verdict({"counted": [], "not_counted": ["processors", "can0"]})
    'Waiting not counted: processors, buses.'
    >>> waiting_verdict({"counted": ["processors"], "not_counted": ["can0"]}, {"can0": "no `identifier` of lamp"})
    'Waiting counted: processors; not counted: can0 (no `identifier` of lamp).'
    """
    parts = {key: waiting.get(key, ()) for key in ("counted", "not_counted")}
    buses = {key: [name for name in names if name != PROCESSORS] for key, names in parts.items()}
    is_one = not (buses["counted"] and buses["not_counted"]) and not any(
        name in missing for name in buses["not_counted"]
    )
    buses["not_counted"] = [f"{name} ({missing[name]})" if name in missing else name for name in buses["not_counted"]]
    names = {
        key.replace("_", " "): [PROCESSORS] * (PROCESSORS in part)
        + (["buses"] if is_one and buses[key] else buses[key])
        for key, part in parts.items()
    }
    said = [f"{what}: {', '.join(which)}" for what, which in names.items() if which]
    return f"Waiting {'; '.join(said)}." if said else ""


def missing_figures(space: Space) -> dict[str, str]:
    """The figures without which waiting for a bus is not counted, by its name: ``no `identifier` of lamp``.

    Of buses that state how they arbitrate, or of whose messages one states an identifier or a priority.
    """
    return {bus.name: bus.uncounted for bus in uncounted_buses(space) if bus.uncounted}


def counts_latencies(space: Space) -> bool:
    """Whether a requirement or an objective is about the latency of a flow, or a response time."""
    return any(
        flows_in(space, metric) or is_scheduled(space, metric) or is_of_message(space, metric)
        for metric in asked_metrics(space)
    )


def counting_words(space: Space, settings: Mapping[str, Any] | None = None) -> str:
    """The delays that latencies count, the verdict on waiting, and unusual settings; "" if no latency is asked.

    Sentences such as ``execution, transmission. Waiting not counted: processors. Deadlines: all.`` `settings` are those
    of the question by name; None for those of the space, which do not say whether it is robust.
    """
    if not counts_latencies(space):
        return ""
    waiting = waiting_counted(space)
    omitted = {"processing", "overload", *(["profile"] if space.profile == "dse" else [])}
    rules = ", ".join(text for name, text in basis_parts(settings or settings_of(space)).items() if name not in omitted)
    said = [
        f"{counted_delays(waiting)}.",
        waiting_verdict(waiting, missing_figures(space)),
        f"{rules[:1].upper()}{rules[1:]}." if rules else "",
    ]
    return " ".join(filter(None, said))


def scale_words(space: Space) -> str:
    """The remark that 100 % of utilisation is one core; "" where every processor has one core.

    A remark, because 150 % is a valid utilisation of a processor with two cores.
    """
    several = any(count > 1 for slot in space.processors for count in leaves(slot.cores))
    return PER_CORE if several else ""


def scale_of(names: Iterable[str]) -> str:
    """The remark that 100 % of utilisation is one core, for studies; "" if no name is about a utilisation.

    `names` are metrics and requirements of the study.
    """
    return PER_CORE if any("utilisation" in name for name in names) else ""
