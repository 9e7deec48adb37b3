"""The question and the designs that a result states, as a space and designs: names are taken as they are."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, cast

from dse.analysis.measures import all_metrics
from dse.questions.complete_design import complete_design
from dse.questions.question import Question
from dse.space.build import build_space
from dse.space.model.criteria import Objective, Requirement, Rule
from dse.space.model.space import Design, Space
from dse.space.question.implied import with_implied
from dse.space.question.limits import own_limit
from dse.space.question.metrics import QuestionError
from dse.space.question.open_cores import with_all_cores, with_open_cores
from dse.space.question.reading import read_objective, read_requirements
from dse.space.question.rules import read_rule
from dse.space.question.settings import (
    ORIGIN,
    OSATE_SETTINGS,
    SETTINGS,
    settings_of,
    stated_settings,
    with_settings,
)
from dse.spec.language.grammar import ExpressionError, parse_requirement
from dse.spec.loading.load import LoadedSpec
from dse.support import arguments
from dse.support.errors import ProblemError, UsageError


def restated_space(loaded: LoadedSpec, space: Space, effective: Mapping[str, Any]) -> Space:
    """The space of a file with exactly the question that the ``effective`` block of a result states.

    Raises
    ------
    UsageError
        when the block is not one that `dse.solve` writes for this problem.
    """
    try:
        space = set_up(loaded, space, _settings(effective), replaced=replaced_objectives(space, effective))
        requirements = [
            item for text in dict.fromkeys(effective["requirements"]) for item in _requirements(space, text)
        ]
        rules = [_rule(space, text) for text in effective["rules"]]
        objectives = tuple(_objective(space, text) for text in effective["objectives"])
        if len({item.metric for item in objectives}) != len(objectives):
            raise UsageError("the result states an objective twice")
        space = replace(space, requirements=tuple(requirements), rules=tuple(rules), objectives=objectives)
        space = with_implied(space)
        fixed = _named_choices(with_all_cores(space), effective["fixed"])
    except (ExpressionError, QuestionError) as error:
        raise UsageError(f"the result does not state a question that fits the problem: {error}") from error
    return with_open_cores(replace(space, fixed=fixed))


def replaced_objectives(space: Space, effective: Mapping[str, Any]) -> list[int]:
    """The numbers of the file's objectives that a result does not have.

    Indices into ``space.objectives``, ascending. Objectives are compared as text with their sense, such as ``minimise
    price``.
    """
    asked = set(effective["objectives"])
    return [number for number, item in enumerate(space.objectives) if f"{item.sense} {item.metric.name}" not in asked]


def _settings(effective: Mapping[str, Any]) -> dict[str, str]:
    """All settings of a result; one that does not state them all is of an older meaning."""
    settings = {}
    for name, allowed in SETTINGS.items():
        if name not in effective and name in OSATE_SETTINGS and effective.get("profile") == "dse":
            continue  # what was written before there was this setting did not look at it
        if name not in effective:
            raise UsageError(
                f"the result does not state {name!r}: a version of dse wrote it that answered another question "
                "(solve the problem again)"
            )
        if effective[name] not in allowed:
            raise UsageError(f"the result states the {name} {effective[name]!r}: it is one of {', '.join(allowed)}")
        settings[name] = effective[name]
    return settings


def asked_as(loaded: LoadedSpec, space: Space, effective: Mapping[str, Any]) -> Space:
    """The space with the question of a result, and with what its file demands beyond that: it may have changed.

    Errors as for `restated_space`.
    """
    asked = restated_space(loaded, space, effective)
    own = set_up(loaded, space, _settings(effective), replaced=replaced_objectives(space, effective))
    known = {*effective["requirements"], *effective["rules"]}
    requirements = [item for item in own.requirements if item.text not in known]
    rules = [item for item in own.rules if item.text not in known]
    return replace(
        asked,
        requirements=(*asked.requirements, *requirements),
        rules=(*asked.rules, *rules),
    )


def stated_question(space: Space) -> dict[str, Any]:
    """The question of a space in the words of a result: requirements, rules, objectives, fixed decisions, settings.

    The mapping that stands in JSON results as ``problem.effective``. Implied limits (100 % of a core or bus) are listed
    apart from those of the user.
    """
    return {
        "requirements": [item.text for item in space.requirements if not item.implied],
        "implied": [item.text for item in space.requirements if item.implied],
        "rules": [item.text for item in space.rules],
        "objectives": [f"{item.sense} {item.metric.name}" for item in space.objectives],
        "fixed": {
            space.decisions[decision].name: space.decisions[decision].options[option]
            for decision, option in space.fixed.items()
        },
        **settings_of(space),
    }


def question_of(space: Space, effective: Mapping[str, Any]) -> Question:
    """The question of a result, as far as it differs from the file's question, as keywords of `Problem.ask`.

    Keywords for `Problem.ask`: settings that differ, requirements and rules that the file does not state, decisions
    fixed beyond it, and the objectives where they differ.
    """
    own = stated_question(space)
    asked: dict[str, Any] = {name: effective[name] for name in SETTINGS if effective[name] != own[name]}
    stated = {*own["requirements"], *own["rules"]}
    asked["require"] = [text for text in (*effective["requirements"], *effective["rules"]) if text not in stated]
    fixed = effective["fixed"].items() - own["fixed"].items()
    asked["fix"] = {name: option for name, option in effective["fixed"].items() if (name, option) in fixed}
    if effective["objectives"] != own["objectives"]:
        asked["objectives"] = effective["objectives"]
    return cast(Question, asked)


def set_up(
    loaded: LoadedSpec, space: Space, given: Mapping[str, str | None], *, replaced: Collection[int] = ()
) -> Space:
    """The space of a file under the settings given; those that are None stay.

    `replaced` are the numbers of the file's objectives in whose place others are asked: these may be of what the
    settings do not know.

    Raises
    ------
    UsageError
        when there is no such setting, it has no such value, or the file could not state it.
    """
    for name, value in given.items():
        if name not in SETTINGS:
            raise UsageError(f"there is no setting {name!r}{arguments.nearest(name, SETTINGS)}")
        if value is not None and value not in SETTINGS[name]:
            arguments.Word(tuple(SETTINGS[name]))(name, value)
    space = with_settings(space, given, loaded.spec.model_dump(include=set(SETTINGS)))
    _check_file_under(loaded, settings_of(space), replaced)
    return space


def _check_file_under(loaded: LoadedSpec, settings: Mapping[str, str], replaced: Collection[int]) -> None:
    """Refuse settings that the file is refused with where it states them itself, in the words of that refusal."""
    spec = loaded.spec
    stated = stated_settings(spec.model_dump(include=set(SETTINGS)))
    other = {name: value for name, value in settings.items() if value != stated[name]}
    if not other:
        return
    try:
        build_space(replace(loaded, spec=spec.model_copy(update=other)))
    except ProblemError as error:
        unasked = {f"objectives[{number}]" for number in replaced}
        mistakes = [str(item) for item in error.diagnostics if item.path not in unasked]
        if mistakes:
            said = ", ".join(f"{name}: {value}" for name, value in other.items())
            raise UsageError("\n".join([f"the problem is refused with {said}", *mistakes])) from error


def _named_choices(space: Space, decisions: Mapping[str, str]) -> dict[int, int]:
    """Options by decision, from names and canonical texts as results have them.

    Raises
    ------
    UsageError
        when the problem has no such decision or option.
    """
    choices = {}
    for name, option in decisions.items():
        index = space.decision_index(name)
        if index is None or option not in space.decisions[index].options:
            raise UsageError(f"the problem has no decision {name!r} with an option {option!r}")
        choices[index] = space.decisions[index].options.index(option)
    return choices


def named_design(space: Space, decisions: Mapping[str, str]) -> Design:
    """The design of a result's point; errors as for `_named_choices`, or when it leaves something open.

    `decisions` are names of decisions and options. Raises `UsageError` where a name is unknown, an option excludes
    another, or an active decision is missing.
    """
    return complete_design(space, _named_choices(space, decisions))


def _requirements(space: Space, text: str) -> list[Requirement]:
    """The requirements of the file with this text; else what the text says."""
    own = [item for item in space.requirements if item.text == text and not item.implied]
    if own:
        return own
    for metric in sorted(all_metrics(space), key=lambda item: len(item.name), reverse=True):
        rest = text.removeprefix(metric.name).lstrip()
        if text.startswith(metric.name) and rest[:1] in ("<", ">", "="):
            stated = parse_requirement(f"price {rest}")
            limit = own_limit(space, metric, stated.limit)
            return [Requirement(text, metric, stated.operator, limit, ORIGIN)]
    return [replace(item, text=text) for item in read_requirements(space, text, ORIGIN)]


def _rule(space: Space, text: str) -> Rule:
    own = [item for item in space.rules if item.text == text]
    return own[0] if own else read_rule(space, text, ORIGIN)


def _objective(space: Space, text: str) -> Objective:
    for own in space.objectives:
        if f"{own.sense} {own.metric.name}" == text:
            return own
    sense, _, name = text.partition(" ")
    for metric in all_metrics(space):
        if metric.name == name and sense in ("minimise", "maximise"):
            return Objective(text, "minimise" if sense == "minimise" else "maximise", metric)
    return read_objective(space, text)
