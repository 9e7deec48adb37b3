"""A study as a page, as Markdown and as figures: what `dse.report.sections` says, set."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dse.report.contention import processing_words
from dse.report.drawing import STYLE
from dse.report.html import POLICY, asset, environment, hashes, libraries, packed_json, without_plots
from dse.report.markdown import escaped, section_lines
from dse.report.parts import numbered, study_specs
from dse.report.plain import basis_words
from dse.report.plot_files import png_of, svg_of
from dse.report.sections import sections_of
from dse.report.theme import DARK, LIGHT, css_variables
from dse.report.words import GAPS, REDUCED
from dse.report.writing import SUFFIXES
from dse.space.settings import SETTINGS


def study_files(data: Mapping[str, Any], csv: str | None, json: str | None) -> Iterator[tuple[str, str]]:
    """(file name, content) of each file of a study's report: HTML, Markdown, and CSV and JSON where they are given."""
    page, words, table, whole = study_names(data["problem"]["name"], _kind(data))
    yield page, study_page(data)
    yield words, study_markdown(data)
    if csv is not None:
        yield table, csv
    if json is not None:
        yield whole, json


def study_names(problem: str, kind: str) -> list[str]:
    """The files of the report of a ``sweep`` or ``sensitivity``: HTML, Markdown, CSV and JSON.

    >>> study_names("My <robot>", "sweep")[0]
    'My-robot-sweep.html'
    """
    return [f"{_stem(problem)}-{kind}{suffix}" for suffix in SUFFIXES]


def study_figures(data: Mapping[str, Any], formats: Sequence[str]) -> Iterator[tuple[str, str | bytes]]:
    """(file name, content) of each plot of a study."""
    for section in sections_of(data):
        for plot in section.plots:
            svg = svg_of(plot.spec)
            for kind in formats:
                yield f"{study_name(data)}-{_stem(plot.name)}.{kind}", svg if kind == "svg" else png_of(svg)


def study_name(data: Mapping[str, Any]) -> str:
    """The stem of a study's files: name of the problem and kind of study.

    >>> study_name({"format": "dse-sweep/1", "problem": {"name": "My <robot>"}})
    'My-robot-sweep'
    """
    return f"{_stem(data['problem']['name'])}-{_kind(data)}"


def _kind(data: Mapping[str, Any]) -> str:
    return str(data["format"]).removeprefix("dse-").partition("/")[0]


def _stem(text: str) -> str:
    return re.sub(r"[^\w.-]+", "-", text).strip("-.")[:80] or "study"


def study_page(data: Mapping[str, Any]) -> str:
    """The whole page, which needs no network."""
    sections = sections_of(data)
    specs = study_specs(sections)
    bundle, script = libraries() if specs else "", asset("report.js")
    nothing: dict[str, Any] = {"chosen": None, "objectives": [], "front": [], "lines": [], "fragments": {}}
    return (
        environment()
        .get_template("study.html.j2")
        .render(
            title=_title(data),
            sections=numbered(sections),
            basis=_basis(data),
            gaps=_gaps(data),
            style=asset("report.css") + STYLE,
            light=css_variables(LIGHT),
            dark=css_variables(DARK),
            data=packed_json({**nothing, "specs": {"studies": specs}}),
            bundle=bundle,
            script=script,
            without_plots=without_plots(bundle) if specs else "",
            policy=f"{POLICY}; script-src {hashes([bundle, script])}",
        )
    )


def study_markdown(data: Mapping[str, Any]) -> str:
    """The same as Markdown, without the plots."""
    lines = [f"# {escaped(_title(data))}", ""]
    for section in sections_of(data):
        lines += section_lines(section)
    lines += ["## What this rests on", ""]
    lines += [f"- **{escaped(label)}**: {escaped(text)}" for label, text in _basis(data)]
    return "\n".join(lines) + "\n"


def _title(data: Mapping[str, Any]) -> str:
    kind = {"dse-sweep/1": "sweep", "dse-sensitivity/1": "sensitivity"}.get(data["format"], "robustness")
    return f"{data['problem']['name']}: {kind}"


def _settings(data: Mapping[str, Any]) -> Mapping[str, str]:
    """The settings of the question that a study asked; nothing where an older one does not state them."""
    settings: Mapping[str, str] = data["problem"].get("effective", data["problem"])
    return settings if set(SETTINGS) <= set(settings) else {}


def _gaps(data: Mapping[str, Any]) -> tuple[str, ...]:
    """What the model does not see."""
    settings = _settings(data)
    return (REDUCED, *((processing_words(settings),) if settings else ()), *GAPS)


def _basis(data: Mapping[str, Any]) -> list[tuple[str, str]]:
    problem = data["problem"]
    found = [("Problem", f"{problem['name']}, SHA-256 {problem['sha256']}")]
    if settings := _settings(data):
        found.append(("Latency rules", basis_words(settings)))
    if "semantics" in data:
        found.append(("Semantics", str(data["semantics"])))
    if problem.get("changes"):
        found.append(
            ("Changes by the caller", "; ".join(f"{name}: {value}" for name, value in problem["changes"].items()))
        )
    if "seed" in data:
        found.append(("Seed", str(data["seed"])))
    return found
