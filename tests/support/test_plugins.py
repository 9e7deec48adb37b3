"""Importers and metrics of other packages, by entry points."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.measures import Measure
from dse.analysis.terms import Term
from dse.analysis.views import View
from dse.importers.registry import Imported, Importer, importers
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import MetricPlugin
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.plugins import plugged
from dse.support.units import TIME

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


def total_period(space: Space, metric: Metric) -> Measure:
    """The periods of the elements of a flow, added up."""
    steps = space.flows[metric.index or 0].steps
    threads = {step.index for step in steps if step.kind == "component"}

    def period_of(number: int, view: View) -> Fraction:
        return Fraction(at(space.components[number].period_ns, view) or 0)

    terms = tuple(Term(space.components[number].name, partial(period_of, number)) for number in sorted(threads))
    return Measure(metric, "ns", terms, 1)


PERIODS = MetricPlugin("total period", "flow", TIME, total_period)


def read_lamp(path: Path, options: Any) -> Imported:
    """A file with the period of a lamp."""
    return Imported({"dse": 1, "name": "Lamp", "devices": {"lamp": {"period": path.read_text().strip()}}})


LAMP = Importer("lamp", (".lamp",), "the period of a lamp", "tests.support.test_plugins", function="read_lamp")
OTHER = 3


@pytest.fixture(autouse=True)
def _fresh() -> Iterator[None]:
    plugged.cache_clear()
    yield
    plugged.cache_clear()


def install(monkeypatch: pytest.MonkeyPatch, **points: str) -> None:
    """As if another package had these entry points, by name ``group__name``."""

    def entry_points(*, group: str) -> EntryPoints:
        named = ((key.partition("__"), value) for key, value in points.items())
        return EntryPoints(
            EntryPoint(name, f"tests.support.test_plugins:{value}" if value.isidentifier() else value, f"dse.{of}")
            for (of, _, name), value in named
            if f"dse.{of}" == group
        )

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)


def test_a_metric_of_another_package_is_required_minimised_and_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, metrics__periods="PERIODS")
    found = dse.solve(PUMP, minimise=["total period of sensor_to_valve", "price"])
    assert found.status == "complete" and bool(dse.verify(found))
    frame = found.frame()
    assert frame["total period of sensor_to_valve [ms]"].min() == 26  # sensor 20 ms, control 5 ms, valve 1 ms
    tight = dse.solve(PUMP, require="total period of sensor_to_valve <= 26 ms", minimise=["price"])
    assert dse.analyse(PUMP, tight[0], require="total period of sensor_to_valve <= 26 ms").is_feasible
    with pytest.raises(dse.UsageError, match="unknown metric"):
        dse.solve(PUMP, minimise="totl period of sensor_to_valve")


def test_a_format_of_another_package_is_imported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    install(monkeypatch, importers__lamp="LAMP")
    (tmp_path / "a.lamp").write_text("1 s", encoding="utf-8")
    assert dse.loads(dse.import_file(tmp_path / "a.lamp").text).name == "Lamp"
    assert importers()[-1] is LAMP


@pytest.mark.parametrize(
    ("point", "value", "said"),
    [
        ("importers__x", "OTHER", "plug-in 'x': expected a dse.importers.registry.Importer; got 3"),
        ("importers__x", "no.such.module:thing", "plug-in 'x' of an unknown package: ModuleNotFoundError"),
        ("metrics__y", "OTHER", "plug-in 'y': expected a dse.space.model.metric_kinds.MetricPlugin; got 3"),
    ],
)
def test_a_plug_in_that_is_none_is_named(
    point: str, value: str, said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    install(monkeypatch, **{point: value})
    (tmp_path / "a.lamp").write_text("1 s", encoding="utf-8")
    ask = dse.import_file if point.startswith("importers") else partial(dse.solve, minimise="whatever")
    with pytest.raises(dse.UsageError) as error:
        ask(tmp_path / "a.lamp" if point.startswith("importers") else PUMP)
    assert said in str(error.value)
