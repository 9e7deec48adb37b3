"""A study as a page, made of the data that ``--json`` writes, so that a page made later says the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from dse.answers.result import Result
from dse.answers.studies.sensitivity import SensitivityResult
from dse.answers.studies.sweep import SweepResult
from dse.report.amounts import Data
from dse.report.content.sensitivity import robust_section, sensitivity_sections
from dse.report.content.sweep import sweep_sections
from dse.report.page import Page, Section, labelled, listing, texts
from dse.report.words.basis import basis_words
from dse.report.words.contention import processing_words, study_settings
from dse.report.words.reasons import GAPS, REDUCED
from dse.support.errors import UsageError


def sections_of(data: Data) -> list[Section]:
    """The sections of a study.

    Raises
    ------
    UsageError
        when the data are not those of a study.
    """
    makers: dict[str, Callable[[Data], Iterator[Section]]] = {
        SweepResult.format(): sweep_sections,
        SensitivityResult.format(): sensitivity_sections,
        Result.format(): lambda data: iter([robust_section(data)]),
    }
    form = data.get("format")
    if form not in makers or (form == Result.format() and "robust" not in data):
        raise UsageError(f"it is no study: expected {', '.join([*makers][:-1])} or {Result.format()} of solve --robust")
    return list(makers[form](data))


def study_page(data: Data) -> Page:
    """The whole page of a study.

    `data` is the JSON of a sweep, of a sensitivity study or of a robust front; its ``format`` tells which.
    """
    problem = data["problem"]
    kinds = {SweepResult.format(): "sweep", SensitivityResult.format(): "sensitivity"}
    kind = kinds.get(data["format"], "robustness")
    axes = " and ".join(axis["name"].rstrip(" <=>") for axis in data.get("vary", ()))
    what = {"sweep": f"sweep of {axes}" if axes else "sweep", "sensitivity": "margins and influence of the inputs"}
    lead = f"{problem['name']}: {what.get(kind, 'robust front')}"
    return Page(f"{problem['name']}: {kind}", lead, (*sections_of(data), _basis(data)))


def _basis(data: Mapping[str, Any]) -> Section:
    """Where the figures of a study come from, and what the model does not see."""
    problem, settings = data["problem"], study_settings(data)
    carried = "; the JSON carries its text" if data.get("files") else ""
    entries = [("Problem", f"{problem['name']}, SHA-256 {problem['sha256']}{carried}")]
    if settings:
        entries.append(("Latency rules", basis_words(settings)))
    if "semantics" in data:
        entries.append(("Semantics", str(data["semantics"])))
    if problem.get("changes"):
        entries.append(
            ("Changes by the caller", "; ".join(f"{name}: {value}" for name, value in problem["changes"].items()))
        )
    if "seed" in data:
        entries.append(("Seed", str(data["seed"])))
    gaps = (REDUCED, *((processing_words(settings),) if settings else ()), *GAPS)
    blocks = (*labelled(entries), *texts("Known gaps of the model:"), *listing(gaps))
    return Section("basis", "What this rests on", blocks, is_for_files=True)
