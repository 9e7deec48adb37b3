"""What the designs of a study's fronts keep when response times count, where the fronts leave that out; as data."""

from __future__ import annotations

from typing import Any

from dse.analysis.contention import ContentionReferee, with_contention
from dse.analysis.measures import Measure, build_measure
from dse.analysis.views import View
from dse.results.contention import contended
from dse.results.display import exact
from dse.results.forms.result import Contention
from dse.results.forms.writing import written
from dse.space.criteria import Metric
from dse.space.types import Design, Space


class Jury:
    """Says of each design of a front what it keeps with contention; nothing where the front counts all of that."""

    def __init__(self, space: Space, limited: Metric | None = None) -> None:
        """Judge designs of `space`; `limited` is a metric whose limit varies: it is told as it is with contention."""
        counted = with_contention(space)
        self._referee = None if counted is None else ContentionReferee(counted)
        self._limited = limited
        self._measures: dict[int, tuple[Space, Measure]] = {}

    def says(self, design: Design) -> dict[str, Any]:
        """``contention`` of a design as JSON has it.

        Raises
        ------
        OutOfTime
            when the limit of time in force is up.
        """
        if self._referee is None:
            return {}
        found = self._referee.judge(design)
        said = written(Contention, contended(found))
        if self._limited is not None:
            said["limited"] = exact(self._measure(found.space, self._limited).value(View(found.design)))
        return {"contention": said}

    def _measure(self, space: Space, metric: Metric) -> Measure:
        if id(space) not in self._measures:
            self._measures[id(space)] = space, build_measure(space, metric)  # with the space, whose id stays its own
        return self._measures[id(space)][1]
