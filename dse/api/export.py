"""`dse.export`: a chosen design for other tools, and back as a problem file that gives the same figures."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path
from typing import Literal, get_args

from dse.analysis.evaluate import Evaluator
from dse.analysis.views import View
from dse.api.completing import complete_design
from dse.api.problem import load_carried
from dse.errors import ProblemError, UsageError
from dse.results.cie import cie_configuration
from dse.results.export import fixed_problem, without
from dse.results.export_formats import graphml, graphviz, pinning_table, ros2_parameters
from dse.results.points import FurtherDesign, Point
from dse.results.solve import Result
from dse.space.metric_kinds import counts_changes
from dse.space.types import Design, Space
from dse.spec.model import Ros2
from dse.spec.writing import block_text

Format = Literal["problem", "ros2", "cie", "pinning", "dot", "graphml", "aadl"]
TRIALS = 5


def export(
    result: Result,
    alternative: int | str,
    form: Format = "problem",
    folder: str | Path = ".",
    *,
    response_times: bool = False,
) -> str:
    """One design of a result as text.

    Parameters
    ----------
    result
        from `dse.solve` or `dse.api.reopen.reopen`.
    alternative
        the id of a point (``3``), or of another design (``3.1``).
    form
        ``problem``: the problem file with its decisions fixed; ``ros2``: a parameter file with the rates; ``cie``: a
        configuration of the callback-isolated executor, with priorities and cores; ``pinning``: cores and
        priority levels of threads as CSV; ``dot``;
        ``graphml``; ``aadl``: a model, or an implementation that extends the one that the problem is of.
    folder
        where a problem file will stand: it decides how included files and those of samples are named.
    response_times
        whether an AADL model gets the computed response times of its threads as SEI::Response_Time, which OSATE's
        latencies then count instead of execution times.

    Raises
    ------
    UsageError
        when there is no such design or form, or response times are asked for in another form than AADL.

    Examples
    --------
    >>> import dse
    >>> chosen = dse.loads(dse.export(dse.solve("pump.yaml"), 1))
    >>> chosen.space.baseline is not None
    True
    """
    if form not in get_args(Format):
        raise UsageError(f"form: expected {', '.join(get_args(Format))}; got {form!r}")
    if response_times and form != "aadl":
        raise UsageError("response times are written to AADL models only")
    chosen = find_design(result, alternative)
    title = f"{result.problem.name}: alternative {chosen.id} of dse solve, problem SHA-256 {result.problem.sha256}"
    if form == "ros2":
        return ros2_parameters(result.space, chosen.design, title, _names(result))
    if form == "cie":
        return cie_configuration(result.space, chosen.design, title, _names(result))
    if form == "pinning":
        return pinning_table(result.space, chosen.design, title)
    if form == "dot":
        return graphviz(result.space, chosen.design)
    if form == "graphml":
        return graphml(result.space, chosen.design)
    if form == "aadl":
        from dse.api.exporting_aadl import aadl_text

        return aadl_text(result, chosen.design, title, response_times=response_times)
    return _problem(result, chosen.design, title, Path(folder))


def _names(result: Result) -> Ros2 | None:
    """How ROS 2 calls what the problem names."""
    return load_carried(result.problem.file, result.problem.texts).loaded.spec.ros2


def find_design(result: Result, alternative: int | str) -> Point | FurtherDesign:
    """The point or other design with that id.

    Raises
    ------
    UsageError
        when there is none.
    """
    candidates: list[Point | FurtherDesign] = [
        *result.front,
        *(item for others in result.others for item in others.designs),
    ]
    for item in candidates:
        if str(item.id) == str(alternative):
            return item
    ids = ", ".join(str(item.id) for item in candidates[:40])
    raise UsageError(f"there is no alternative {alternative}; ids: {ids or 'none'}")


def _problem(result: Result, design: Design, title: str, folder: Path) -> str:
    """The fixed problem file, after a copy has been read back, with the result's texts, and has given the figures."""
    source = Path(result.problem.file)
    original = _original(result, folder)
    texts = [fixed_problem(original, result, design, title, where, source) for where in (folder, source.parent)]
    path = source.parent / "exported.yaml"
    for _ in range(TRIALS):
        try:
            check_same(result, design, load_carried(path, {**result.problem.texts, path.name: texts[1]}).space)
        except ProblemError as error:
            cleaned = [without(text, error) for text in texts]
            if None in cleaned:
                raise AssertionError(f"the exported problem does not load: {error}") from error
            texts = [text for text in cleaned if text is not None]
        else:
            return texts[0]
    raise AssertionError("the exported problem does not load")


def _original(result: Result, folder: Path) -> str:
    """The problem file as it was read; with its includes merged in where these cannot be used from `folder`.

    Names of samples are relative to the main file: those of an included one would not be found from another.
    """
    problem = result.problem
    source = Path(problem.file)
    text = problem.texts[source.name]
    merges = re.search(r"^of:", text, re.M) is not None or (problem.is_carried and len(problem.texts) > 1)
    if not merges and folder.resolve() != source.parent.resolve() and len(problem.texts) > 1:
        loaded = load_carried(problem.file, problem.texts).loaded
        merges = any(
            isinstance(stated.samples, str)
            and loaded.source_of(("uncertainty", key, "samples")) is not loaded.sources[0]
            for key, stated in loaded.spec.uncertainty.items()
        )
    if merges:
        return block_text(load_carried(problem.file, problem.texts).loaded.document)
    return text.removeprefix("\ufeff")


def check_same(result: Result, design: Design, space: Space) -> None:
    """The exported problem must have the design as its baseline, with the very figures; from there nothing changes."""
    there = complete_design(space, space.baseline)
    mine, theirs = figures(result.space, design), figures(space, there)
    told = {name: value for name, value in theirs.items() if name in mine}  # more have figures where less is open
    differing = {name: (value, mine[name]) for name, value in told.items() if mine[name] != value}
    assert not differing, f"the exported problem has other figures: {differing}"


def figures(space: Space, design: Design) -> dict[str, Fraction]:
    """Every metric of a design but how much it changes, exact, by name."""
    view = View(design)
    metrics = Evaluator(space).metrics
    return {item.metric.name: item.value(view) for item in metrics if not counts_changes(space, item.metric)}
