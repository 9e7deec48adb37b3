"""A design as a caller names it: decisions as texts, an alternative of a result with the question that it answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dse.answers.reading import decisions_in, read_result
from dse.questions.problem import Problem, changed, origin_of, read_choices, with_stated_cores
from dse.questions.question import QuestionChanges
from dse.questions.result_problem import belonging
from dse.space.question.settings import SETTINGS, settings_of
from dse.spec.language.grammar import ExpressionError, parse_assignment
from dse.spec.language.scan import quoted
from dse.support.errors import UsageError, about


@dataclass(frozen=True)
class NamedDesign:
    """The problem as it is asked of the design, the design's decisions as texts, and what is to be said of both.

    `texts` are ``DECISION=OPTION`` as on the command line; `remarks` say, for instance, that a design comes from a
    result of another question; `called` names the design in a title, such as ``design #1 of result.json``.
    """

    problem: Problem
    texts: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    called: str = "the baseline"


def named_design(problem: Problem, texts: Sequence[str]) -> NamedDesign:
    """The design that texts name, and the question that it is judged by.

    Parameters
    ----------
    problem
        as a caller asks it.
    texts
        ``name = option``, each a decision; and at most one ``RESULT.json#ID``, which stands for all decisions of that
        alternative and for the question of its result. What the caller asks comes on top of that question, further
        decisions take the place of those of the alternative.

    Raises
    ------
    UsageError
        when a result cannot be read, has no such alternative, or its decisions or question do not fit the problem.
    """
    own = [text for text in texts if design_reference(text) is None]
    for text in own:
        _check_form(text)
    references = [reference for text in texts if (reference := design_reference(text)) is not None]
    if len(references) > 1:
        raise UsageError("a design is one alternative of one result, and decisions on top of it: two are named")
    if not references:
        is_only = not any(item.is_open for item in problem.space.decisions)
        called = f"the baseline with {', '.join(own)}" if own else "the only design" if is_only else "the baseline"
        return NamedDesign(with_stated_cores(problem, own), tuple(own), called=called)
    [(path, number)] = references
    data = read_result(path)
    taken = {_name(text) for text in own}
    decisions = {name: option for name, option in decisions_in(data, number, path).items() if name not in taken}
    effective = dict(data["problem"]["effective"])
    effective["fixed"] = {name: option for name, option in effective["fixed"].items() if name not in taken}
    chosen = [f"{quoted(name)} = {option}" for name, option in decisions.items()]
    with about(path):
        differs = belonging(data, path, problem).differs
        own_question = with_stated_cores(changed(problem, QuestionChanges(result=effective)), [*chosen, *own])
        read_choices(own_question.space, chosen)
    remarks = [f"{problem.loaded.path} has changed since {path} was written: {'; '.join(differs)}"] if differs else []
    called = f"design #{number} of {path}" + (f" with {', '.join(own)}" if own else "")
    return NamedDesign(
        own_question, (*chosen, *own), (*remarks, *_remarks(problem, own_question, effective, path)), called
    )


def design_reference(text: str) -> tuple[str, str] | None:
    """The result file and the id that ``FILE#ID`` names; None for other texts.

    FILE ends with ``.json``, or is the name of a file that is there, and ID a number.
    """
    path, mark, number = text.rpartition("#")
    is_named = path.endswith(".json")
    if not is_named and number.strip().isdecimal():
        with suppress(OSError, ValueError):  # a text that cannot be a path
            is_named = Path(path).is_file()
    return (path, number) if mark and is_named else None


def _check_form(text: str) -> None:
    """Fail for a text that is neither an alternative of a result nor a decision with its option."""
    path, mark, number = text.rpartition("#")
    if "=" in text or ":" in text:
        return
    expected = "expected RESULT.json#ID or DECISION = OPTION"
    if mark and number.strip().isdecimal():
        raise UsageError(f"{text!r}: {expected}; there is no file {path!r}")
    raise UsageError(f"{text!r}: {expected}")


def _name(text: str) -> str:
    """The decision that a text is about; its mistakes are reported where it is read."""
    try:
        return parse_assignment(text)[0]
    except ExpressionError:
        return ""


def _remarks(problem: Problem, asked_problem: Problem, effective: Mapping[str, Any], path: str) -> Iterator[str]:
    """Where the question of the result is another than that of the file, and the caller's another than both."""
    own = origin_of(problem.base).effective
    settings = settings_of(asked_problem.space)
    theirs = {name: effective.get(name, own[name]) for name in SETTINGS}
    taken = [f"{_words(name)} {value}" for name, value in theirs.items() if own[name] != value == settings[name]]
    stated = {item.text for item in asked_problem.space.requirements} | {
        item.text for item in asked_problem.space.rules
    }
    for kind in ("requirements", "rules"):
        taken += [text for text in effective[kind] if text not in own[kind] and text in stated]
    taken += [f"{name} = {option}" for name, option in effective["fixed"].items()]
    if taken:
        yield f"as in {path}, beyond what the problem file asks: {'; '.join(taken)}"
    for name in SETTINGS:
        if settings[name] != theirs[name]:
            yield f"{_words(name)} is {settings[name]}, as asked here; in {path} it is {theirs[name]}"


def _words(setting: str) -> str:
    return setting.replace("_", " ")
