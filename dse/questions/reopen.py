"""A result file as a `Result` again: its problem read anew, and every figure recomputed and compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from dse.analysis.evaluate import Evaluator
from dse.answers.base import DataAnswer
from dse.answers.designs import FurtherAsked, FurtherDesign, FurtherDesigns, InsistedPoint, Point
from dse.answers.forms.codec import Form
from dse.answers.forms.consistency import check_data
from dse.answers.forms.registry import FORMS
from dse.answers.question_data import Origin
from dse.answers.reading import no_json, read_result
from dse.answers.result import Clash, Conflict, ObjectiveInfo, Result, Search, decisions_of
from dse.answers.tables.display import figures_of
from dse.questions.complete_design import baseline_design
from dse.questions.problem import Problem, origin_of
from dse.questions.result_question import named_design
from dse.questions.stopped_search import search_of
from dse.questions.verify.contention import stated_verdicts
from dse.questions.verify.insisting import stated_insisting
from dse.questions.verify.points import Bench, check_ranks
from dse.search.front import FrontSearch
from dse.space.model.space import Design
from dse.support import arguments
from dse.support.errors import UsageError, about
from dse.support.files.plain_json import parse_json
from dse.support.files.reading import UnreadableFileError, read_text


@arguments.checked(path=arguments.path, problem=arguments.optional_path)
def reopen(path: str | Path, problem: str | Path | None = None) -> Result:
    """The result at `path`, as `dse.solve` returned it; of a robust one its front (`dse.reopen_robust` has all of it).

    Parameters
    ----------
    path
        what ``dse solve --json`` wrote.
    problem
        the problem file, where it is no longer where the result says.

    Raises
    ------
    UsageError
        when the file is no result, its problem is not found or means something else now, or a figure is not the one
        that the analysis finds.

    Examples
    --------
    >>> import dse
    >>> import pathlib
    >>> written = pathlib.Path("pump.json").write_text(dse.solve("pump.yaml").to_json(), encoding="utf-8")
    >>> dse.reopen("pump.json")
    <Result of 'Pump': complete, 4 points>
    """
    with about(path):
        data = read_result(path)
        return found_again(data, *search_of(data, path, problem), path)


def found_again(data: Mapping[str, Any], problem: Problem, search: FrontSearch, path: str | Path) -> Result:
    """The result of whole data that were read from `path`: of what they ask, and found; errors as for `reopen`.

    `data` has passed the checks of the form. Each point is evaluated again from its decisions; `search` has the regions
    that are proved empty and those that are left.

    Raises `UsageError` where objectives, figures, ids or ranks differ from what the analysis computes.
    """
    space = problem.space
    evaluator = Evaluator(space)
    infos = tuple(
        ObjectiveInfo(measure.metric.name, objective.sense, measure.counting_unit)
        for measure, objective in zip(evaluator.objectives, space.objectives, strict=True)
    )
    if [vars(info) for info in infos] != data["objectives"]:
        raise UsageError(f"{path}: its objectives are not those of the problem")
    designs = list(search.points.values())
    front = tuple(
        _point(evaluator, item, design, infos, path) for item, design in zip(data["front"], designs, strict=True)
    )
    _check_ranks(Bench(data, problem, asked=problem, designs=designs), front, path)
    ranking = data["ranking"]
    result = Result(
        problem=_origin(problem, data["problem"]["file"]),
        space=space,
        status=data["status"],
        objectives=infos,
        counting_units=evaluator.counting_units,
        rounded=evaluator.rounded,
        front=front,
        unexplored=tuple(data["unexplored"]),
        refuted=tuple(data["refuted"]),
        potential=data["potential"],
        conflicts=tuple(_conflict(item) for item in data["conflicts"]),
        give_up=_conflict({"members": data.get("give_up", [])}).members,
        search=Search(**data["search"]),
        baseline=baseline_design(space),
        ranking=ranking["method"],
        ranking_words=ranking["words"],
        others=tuple(_others(evaluator, item, infos, path) for item in data["others"]),
        others_asked=_others_asked(data.get("others_asked")),
    )
    if data.get("insisting") is not None:
        result = replace(result, insisting=stated_insisting(data["insisting"], _insisted(evaluator, data, infos, path)))
    return replace(result, contended=stated_verdicts(result, data, path))


def _check_ranks(bench: Bench, front: tuple[Point, ...], path: str | Path) -> None:
    """Check the claims about the front as a whole, except completeness, which `dse verify` proves."""
    vectors = [[point.objectives[name] for name in bench.names] for point in front]
    bench.vectors += [tuple(sign * value for sign, value in zip(bench.signs, row, strict=True)) for row in vectors]
    check_ranks(bench)
    if bench.findings:
        finding = bench.findings[0]
        raise UsageError(f"{path}: {finding.place} {finding.text} (`dse verify` says all that is wrong)")


def _origin(problem: Problem, named: str) -> Origin:
    """The file goes by the name that the result gives it, as long as it is found there."""
    origin = origin_of(problem)
    return replace(origin, file=named) if Path(named).is_file() else origin


def _checked(
    evaluator: Evaluator, item: Mapping[str, Any], design: Design, infos: tuple[ObjectiveInfo, ...], path: str | Path
) -> dict[str, Any]:
    """Objectives, metrics, decisions and design, as the analysis finds them."""
    evaluation = evaluator.evaluate(design)
    named = f"{path}: alternative {item['id']}"
    if not evaluation.is_feasible:
        raise UsageError(f"{named} is no design of the problem that meets its requirements")
    objectives = dict(zip((info.name for info in infos), evaluation.objectives, strict=True))
    stated = figures_of(objectives)
    if stated != item["objectives"]:
        raise UsageError(f"{named} has other figures than the result says: {stated}")
    return {
        "objectives": objectives,
        "counts": evaluator.metric_values(evaluation.design),
        "counting_units": evaluator.counting_units,
        "decisions": decisions_of(evaluator.space, evaluation.design),
        "design": evaluation.design,
    }


def _point(
    evaluator: Evaluator, item: Mapping[str, Any], design: Design, infos: tuple[ObjectiveInfo, ...], path: str | Path
) -> Point:
    checked = _checked(evaluator, item, design, infos, path)
    return Point(
        id=item["id"],
        rank=item["rank"],
        score=item["score"],
        is_first=item.get("is_first") is not False,
        **checked,
    )


def _others(
    evaluator: Evaluator, item: Mapping[str, Any], infos: tuple[ObjectiveInfo, ...], path: str | Path
) -> FurtherDesigns:
    designs = []
    for design_data in item["designs"]:
        checked = _checked(evaluator, design_data, named_design(evaluator.space, design_data["decisions"]), infos, path)
        dominated = tuple(design_data["dominated_by"])
        designs.append(
            FurtherDesign(
                id=design_data["id"], dominated_by=dominated, different=design_data["different_decisions"], **checked
            )
        )
    return FurtherDesigns(item["of"], Fraction(item["within"]), tuple(designs), item["more"])


def _insisted(
    evaluator: Evaluator, data: Mapping[str, Any], infos: tuple[ObjectiveInfo, ...], path: str | Path
) -> list[InsistedPoint]:
    """The points that only fronts with an option have."""
    return [
        InsistedPoint(
            id=item["id"], **_checked(evaluator, item, named_design(evaluator.space, item["decisions"]), infos, path)
        )
        for item in data["insisting"]["points"]
    ]


def _others_asked(item: Mapping[str, Any] | None) -> FurtherAsked | None:
    if item is None:
        return None
    within = None if item["within"] is None else Fraction(item["within"])
    return FurtherAsked(item["count"], within, tuple(item["points"]))


def _conflict(item: Mapping[str, Any]) -> Conflict:
    members = []
    for clash in item["members"]:
        limit, closest = (None if clash[name] is None else Fraction(clash[name]) for name in ("limit", "closest"))
        more = {"unbounded": tuple(clash.get("unbounded", ())), "is_sought": clash.get("looked_for", True)}
        more["overload"] = clash.get("overload", "")
        thread = clash["thread"] or ""
        members.append(Clash(clash["text"], clash["origin"], clash["unit"], limit, closest, thread, **more))
    return Conflict(tuple(members))


# `dse.read`: what a command wrote as JSON, as typed data.


ANSWERS: Final[Mapping[str, tuple[str, str]]] = {
    "sweep": ("dse.answers.studies.sweep", "SweepResult"),
    "sensitivity": ("dse.answers.studies.sensitivity", "SensitivityResult"),
    "verification": ("dse.answers.verification", "Verification"),
    "sizes": ("dse.questions.verbs.sizes", "Sizes"),
}
"""The formats whose answers are made of nothing but their data, and where these answers are."""


@arguments.checked(path=arguments.path)
def read(path: str | Path) -> DataAnswer | Form:
    """Read a file that a command wrote with ``--json``, of any format, without computing anything again.

    Parameters
    ----------
    path
        the file.

    Returns
    -------
    DataAnswer or Form
        of a sweep, sensitivities, a verification and sizes the answer as the verb returned it, with its tables and its
        report; of every other format its data, with an attribute for each field (docs/formats.md). Figures are exact.
        A result that is to be ranked, exported or compared is opened with `dse.reopen`, which computes it anew.

    Raises
    ------
    UsageError
        when the file cannot be read, or is not of the format that it names: with the first place that is wrong.

    Examples
    --------
    >>> import dse
    >>> import pathlib
    >>> found = dse.sweep("pump.yaml", "price=60EUR..300EUR", store=None)
    >>> written = pathlib.Path("prices.json").write_text(found.to_json(), encoding="utf-8")
    >>> dse.read("prices.json") == found
    True
    >>> written = pathlib.Path("check.json").write_text(dse.check("pump.yaml").to_json(), encoding="utf-8")
    >>> dse.read("check.json").space_size
    768
    """
    try:
        text = read_text(path, what="an answer")
        data = parse_json(text)
    except UnreadableFileError as error:
        raise UsageError(f"{path}: cannot be read: {error.reason}") from error
    except ValueError as error:
        raise UsageError(f"{path}: {no_json(text, error)}") from error
    name = _name_of(data)
    if name is None:
        known = ", ".join(f"dse-{name}/1" for name in FORMS)
        raise UsageError(f"{path}: names no format that is known: {known}")
    check_data(name, data, path)
    if name in ANSWERS:
        from importlib import import_module

        module, answer = ANSWERS[name]
        kind: type[DataAnswer] = getattr(import_module(module), answer)
        return kind.from_dict(data)
    parsed: Any = FORMS[name].model_validate(data)
    form: Form = getattr(parsed, "root", parsed)
    return form


def _name_of(data: Any) -> str | None:
    """The format that data name, without the tool and the version."""
    stated = data.get("format") if isinstance(data, dict) else None
    return next((name for name in FORMS if stated == f"dse-{name}/1"), None)
