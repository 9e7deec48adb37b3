"""Small problems for tests: a few lines of a problem file, a design by the names of its options, exact figures."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from textwrap import dedent
from typing import Any

from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.rows import Row
from dse.analysis.measures import build_measure
from dse.analysis.views import View
from dse.examples.shipped import example_path
from dse.questions.problem import Problem, load
from dse.space.build import build_space
from dse.space.model.space import Design, Space
from dse.space.question.metrics import resolve_metrics
from dse.spec.language.expressions import MetricRef
from dse.spec.loading.load import parse_spec

MS, US = 10**6, 10**3
TABLES = Path(__file__).parents[2] / "problems" / "report" / "tables"
"""The printed tables of ECE-TR-25."""


def without_waiting(text: str) -> str:
    """The text of a problem file, in which no thread waits for the CPU unless the text says what counts itself."""
    return text if "processing:" in text else f"{dedent(text).rstrip()}\nprocessing: execution_time\n"


def space_of(text: str, **changes: Any) -> Space:
    """The space of a problem file without its first two lines, `without_waiting`, with fields of the space changed."""
    return replace(build_space(parse_spec(without_waiting("dse: 1\nname: small\n" + dedent(text)))), **changes)


def quick(problem: Problem) -> Problem:
    """The problem, in which no thread waits for the CPU unless its file says what counts itself."""
    spec = problem.loaded.spec
    return problem if spec.processing or spec.profile != "dse" else problem.ask(processing="execution_time")


def example(name: str, **changes: Any) -> Space:
    """The space of an example problem, `quick`, with fields of the space changed."""
    return replace(quick(load(example_path(name))).space, **changes)


def design_of(space: Space, options: dict[str, str] | None = None) -> Design:
    """The baseline (else first options) with some decisions changed: ``{"nav.period": "10 ms"}``."""
    chosen = [space.baseline.get(number, 0) for number in range(len(space.decisions))]
    for name, text in (options or {}).items():
        number = space.decision_index(name)
        assert number is not None, f"{name} is no decision"
        chosen[number] = space.decisions[number].options.index(text)
    return tuple(chosen)


def view_of(space: Space, options: dict[str, str] | None = None) -> View:
    """The view of `design_of`."""
    return View(design_of(space, options))


def figure(space: Space, metric: str, options: dict[str, str] | None = None) -> Fraction:
    """The exact value of ``METRIC of NAME`` in its display unit."""
    kind, _, of = metric.partition(" of ")
    [resolved] = resolve_metrics(space, MetricRef(kind, of or None))
    return build_measure(space, resolved).value(view_of(space, options))


def rows_of(space: Space, flow: str, options: dict[str, str] | None = None) -> tuple[Row, ...]:
    """The contributor table of a flow."""
    [found] = [item for item in space.flows if item.name == flow]
    return flow_rows(space, found, view_of(space, options))
