"""Other switches and tuning constants for the heuristics of the search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import pytest

from dse.encode import tuning as of_models
from dse.encode.scheduling import waiting_forms
from dse.encode.tuning import ModelTuning
from dse.search import tuning as of_search
from dse.search.tuning import DEFAULT, Tuning
from dse.verification import prover, tables

HEURISTICS = [
    *(item.name for item in fields(ModelTuning)),
    *(item.name for item in fields(Tuning) if hasattr(getattr(DEFAULT, item.name), "is_on")),
]
"""The names of all heuristics that have a switch."""


def tuning_with(groups: Mapping[str, dict[str, Any]], known: Tuning = DEFAULT) -> Tuning:
    """The tuning in which the constants of heuristics, given by name, are others."""
    for name, changes in groups.items():
        if hasattr(known.model, name):
            model = replace(known.model, **{name: replace(getattr(known.model, name), **changes)})
            known = replace(known, model=model)
        else:
            known = replace(known, **{name: replace(getattr(known, name), **changes)})
    return known


def tune(monkeypatch: pytest.MonkeyPatch, **groups: dict[str, Any]) -> Tuning:
    """Make other constants those of every search, beside those that were changed before."""
    found = tuning_with(groups, of_search.DEFAULT)
    monkeypatch.setattr(of_search, "DEFAULT", found)
    monkeypatch.setattr(of_models, "MODEL", found.model)
    return found


def learn_instead_of_tabulating(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let search and second proof learn waiting in small problems as in large ones, for which they make no tables."""
    monkeypatch.setattr(waiting_forms, "SCHEDULE_CASE_LIMIT", 2)
    monkeypatch.setattr(waiting_forms, "TABULATED_TASKS", 1)
    for name in ("FEW_JUDGED", "FEW"):
        monkeypatch.setattr(prover, name, 0)
    for name in ("FEW_CASES", "FEW_LEAVES"):
        monkeypatch.setattr(tables, name, 3)
