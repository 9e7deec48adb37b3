"""Checks that a JSON Schema cannot express: parts of a file must agree on objectives, designs and points."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from dse.answers.forms.codec import kind_of
from dse.answers.forms.registry import FormMistake, mistakes_in, mistakes_in_part
from dse.answers.studies.run_data import Found
from dse.support.errors import UsageError

Data = Mapping[str, Any]


def check_whole(name: str, data: object) -> Iterator[FormMistake]:
    """The mistakes in data of the form ``dse-NAME/1``: in their form, else in the consistency of their parts.

    >>> data = {"format": "dse-verification/1", "result": "r.json", "problem": "p.yaml", "status": "verified"}
    >>> lists = {key: [] for key in ("findings", "checked", "left_open", "remarks")}
    >>> list(check_whole("verification", {**data, **lists, "wall_s": 1}))
    []
    """
    mistakes = list(mistakes_in(name, data))
    yield from mistakes
    if not mistakes and name in AGREEMENTS and isinstance(data, dict):
        yield from AGREEMENTS[name](data)


def mistakes_in_outcome(data: Data) -> Iterator[FormMistake]:
    """The mistakes in the outcome of one run of a sweep, taken by itself.

    Mistakes of form first; only data of the right form are tested for unknown designs, order and figures.
    """
    mistakes = list(mistakes_in_part(kind_of(Found).form(), "sweep", data))
    yield from mistakes
    if not mistakes and data["kind"] in ("front", "breaks"):
        yield from (FormMistake(item.place.removeprefix("."), item.text) for item in _run(data, ""))


def _result(data: Data) -> Iterator[FormMistake]:
    question = data["problem"]["effective"]
    names = [info["name"] for info in data["objectives"]]
    if len(set(question["objectives"])) < len(question["objectives"]):
        yield FormMistake("problem.effective.objectives", "states an objective twice")
    if [f"{info['sense']} {info['name']}" for info in data["objectives"]] != question["objectives"]:
        yield FormMistake("objectives", "are not those of problem.effective")
    yield from _front(data["front"], "front", names)
    for at, others in enumerate(data["others"]):
        for number, design in enumerate(others["designs"]):
            yield from _same(design["objectives"], names, f"others[{at}].designs[{number}].objectives")
    yield from _regions(data, "", names)
    if question["robust"] is not ("robust" in data):
        yield FormMistake("robust", "is there exactly where the question is robust")
    elif question["robust"]:
        robust = data["robust"]
        yield from _front(robust["nominal_front"], "robust.nominal_front", names)
        yield from _regions(robust["nominal"], "robust.nominal.", names)
        yield from _same(robust["price"], names, "robust.price")
        known = {point["id"] for point in robust["nominal_front"]}
        for at, lost in enumerate(robust["lost"]):
            if lost["nominal_id"] not in known:
                yield FormMistake(f"robust.lost[{at}].nominal_id", "is no point of the nominal front")


def _front(points: Sequence[Data], place: str, names: Sequence[str]) -> Iterator[FormMistake]:
    """Each point has its objectives, which no other has; what is null stands for different sums without a bound."""
    seen: dict[tuple[int | None, ...], int] = {}
    for at, point in enumerate(points):
        wrong = list(_same(point["objectives"], names, f"{place}[{at}].objectives"))
        yield from wrong
        vector = tuple(point["objectives"].values() if wrong else (point["objectives"][name] for name in names))
        if None not in vector and seen.setdefault(vector, at) != at:
            yield FormMistake(f"{place}[{at}].objectives", f"are those of {place}[{seen[vector]}]")


def _regions(data: Data, place: str, names: Sequence[str]) -> Iterator[FormMistake]:
    """Refuted regions have a bound in each objective; open ones may have none in some."""
    for at, region in enumerate(data["refuted"]):
        yield from _same(region, names, f"{place}refuted[{at}]")
    for at, region in enumerate(data["unexplored"]):
        if not set(region) <= set(names):
            yield FormMistake(f"{place}unexplored[{at}]", "is not about its objectives")
    if data["potential"] and set(data["potential"]) != set(names):
        yield FormMistake(f"{place}potential", "is not about its objectives")


def _same(stated: Iterable[str], names: Sequence[str], place: str) -> Iterator[FormMistake]:
    if set(stated) != set(names):
        yield FormMistake(place, f"expected one entry for each of {', '.join(names)}")


def _sweep(data: Data) -> Iterator[FormMistake]:
    axes = [axis["name"] for axis in data["vary"] if "values" in axis]
    if not data["vary"]:
        yield FormMistake("vary", "is empty")
    for at, axis in enumerate(data["vary"]):
        if ("values" in axis) is ("interval" in axis) or axis.get("values") == []:
            yield FormMistake(f"vary[{at}]", "expected either values or an interval")
    solved = [run for run in data["runs"] if run["kind"] in ("front", "breaks")]
    for at, run in enumerate(data["runs"]):
        yield from _same(run["values"], axes, f"runs[{at}].values")
        for axis in data["vary"]:
            if axis["name"] in run["values"] and run["values"][axis["name"]] not in axis.get("values", ()):
                yield FormMistake(f"runs[{at}].values", f"{axis['name']} does not vary so")
        if run in solved:
            if run["objectives"] != solved[0]["objectives"]:
                yield FormMistake(f"runs[{at}].objectives", "are not those of the other runs")
            yield from _run(run, f"runs[{at}]")


def _run(run: Data, place: str) -> Iterator[FormMistake]:
    names = [info["name"] for info in run["objectives"]]
    if not names or len(set(names)) < len(names) or not set(names) <= set(run["units"]):
        yield FormMistake(f"{place}.objectives", "expected some, each once and with its unit")
    key = "front" if run["kind"] == "front" else "alternatives"
    if run["status"] != "incomplete" and (run["status"] == "infeasible") == bool(run[key]):
        yield FormMistake(f"{place}.status", f"{run['status']} does not fit what was found")
    for at, item in enumerate(run[key]):
        yield from _same(item["metrics"], list(run["units"]), f"{place}.{key}[{at}].metrics")
    if run.get("change") is not None:
        yield from _same(run["change"]["best"], names, f"{place}.change.best")
    if run["kind"] == "breaks":
        ids = [item["id"] for item in run["alternatives"]]
        if len(set(ids)) < len(ids):
            yield FormMistake(f"{place}.alternatives", "two have the same id")
        for at, stretch in enumerate(run["stretches"]):
            best = [stretch["best"]] if "best" in stretch else []
            if not {*best, *(entry["id"] for entry in stretch["front"])} <= set(ids):
                yield FormMistake(f"{place}.stretches[{at}]", "names a design that is not among the alternatives")
        if not set(ids) <= {entry["id"] for stretch in run["stretches"] for entry in stretch["front"]}:
            yield FormMistake(f"{place}.alternatives", "has a design that no stretch names")


def _sensitivity(data: Data) -> Iterator[FormMistake]:
    uncertainty = data["uncertainty"]
    for at, item in enumerate(uncertainty["indices"] if uncertainty else ()):
        for key in ("first", "effect", "spread", "over"):
            yield from _same(item[key], list(item["total"]), f"uncertainty.indices[{at}].{key}")


AGREEMENTS: Mapping[str, Callable[[Data], Iterator[FormMistake]]] = {
    "result": _result,
    "sweep": _sweep,
    "sensitivity": _sensitivity,
}
"""By format."""


def check_data(name: str, data: object, path: object) -> None:
    """Refuse data that are not of the form ``dse-NAME/1``; `path` is what they are called in the message.

    Raises
    ------
    UsageError
        naming the first place that is wrong, and how many others are.
    """
    mistakes = list(check_whole(name, data))
    if mistakes:
        more = f" (and {len(mistakes) - 1} more mistakes)" if len(mistakes) > 1 else ""
        raise UsageError(f"{path}: is not a whole {name}: {mistakes[0]}{more}")
