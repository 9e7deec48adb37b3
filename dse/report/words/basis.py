"""By which rules the figures of an answer count, and what 100 % of utilisation is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.space.question.settings import OSATE_SETTINGS, SETTINGS, profile_defaults

PER_CORE = "Utilisation counts one core as 100 %, n cores as n times that; a limit of 70 % is one of each core."


def basis_parts(settings: Mapping[str, Any]) -> dict[str, str]:
    """The rules by which figures count, from settings by name (`dse.space.question.settings`).

    Returns a phrase for each setting that is worth a word: ``profile`` and ``processing`` always, others where they
    differ from what is usual under the profile.
    """
    found = {"profile": f"profile {settings['profile']}"}
    if settings["profile"] != "dse":
        found["worst_case"] = f"worst case by {settings['worst_case'].replace('_', ' ')}"
        for name in OSATE_SETTINGS:
            if name != "worst_case" and settings.get(name, SETTINGS[name][0]) != SETTINGS[name][0]:
                found[name] = f"{name.replace('_', ' ')}: {settings[name].replace('_', ' ')}"
    found["processing"] = f"processing by {settings['processing'].replace('_', ' ')}"
    if settings["deadlines"] != profile_defaults(settings["profile"])["deadlines"]:
        found["deadlines"] = f"deadlines: {settings['deadlines']}"
    if settings["overload"] != "forbidden":
        found["overload"] = "overload allowed"
    if settings.get("robust"):
        found["robust"] = "robust: requirements hold for all stated values"
    return found


def basis_words(settings: Mapping[str, Any]) -> str:
    """The rules by which figures count, in one line.

    >>> basis_words({"profile": "dse", "worst_case": "deadline", "processing": "response_time", "deadlines": "all",
    ...     "overload": "allowed"})
    'profile dse, processing by response time, deadlines: all, overload allowed'
    """
    return ", ".join(basis_parts(settings).values())


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
