"""By which rules the figures of an answer count, and what 100 % of utilisation is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from dse.analysis.diagnosis.front_verdicts import leaves_out_buses, uncounted_buses
from dse.analysis.latency.rows import counts_responses
from dse.analysis.messages.stages import counted_buses
from dse.report.amounts import listed
from dse.space.model.metric_kinds import flows_in
from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.space.question.open_cores import is_scheduled
from dse.space.question.settings import OSATE_SETTINGS, SETTINGS, profile_defaults, settings_of

PER_CORE = "Utilisation counts one core as 100 %, n cores as n times that; a limit of 70 % is one of each core."


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


def counted_parts(space: Space) -> tuple[list[str], list[str]]:
    """The delays that latencies count, and those that they leave out; two empty lists where no latency is asked for.

    Lists of nouns such as *execution* and *waiting for the CPU*, to be joined in a sentence.
    """
    asked = [item.metric for item in space.requirements] + [item.metric for item in space.objectives]
    if not any(flows_in(space, metric) or is_scheduled(space, metric) for metric in asked):
        return [], []
    is_counted = counts_responses(space) and any(item.processor is not None for item in space.components)
    counted = ["execution", *(["waiting for the CPU"] if is_counted else []), "transmission"]
    counted += ["waiting for the bus"] if counted_buses(space) else []
    left = [] if counts_responses(space) else ["waiting for the CPU"]
    if leaves_out_buses(space):
        of = f" of {listed([bus.name for bus in uncounted_buses(space)])}" if counted_buses(space) else ""
        left += [f"bus arbitration{of}"]
    return counted, left


def counting_words(space: Space, settings: Mapping[str, Any] | None = None) -> str:
    """The delays that latencies count and those that they leave out, and unusual settings; "" if no latency is asked.

    Sentences such as ``execution, transmission. Not waiting for the CPU. Deadlines: all.`` `settings` are those of the
    question by name; None for those of the space, which do not say whether it is robust.
    """
    counted, left = counted_parts(space)
    if not counted:
        return ""
    said = f"{', '.join(counted)}." + (f" Not {', not '.join(left)}." if left else "")
    omitted = {"processing", "overload", *(["profile"] if space.profile == "dse" else [])}
    rules = ", ".join(text for name, text in basis_parts(settings or settings_of(space)).items() if name not in omitted)
    return f"{said} {rules[:1].upper()}{rules[1:]}.".rstrip(" .") + "."


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
