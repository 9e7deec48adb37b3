"""A loaded problem, and the question as it is really asked: the file's, with the caller's changes."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Unpack

from dse.answers.question_data import Origin
from dse.questions.builder import Builder
from dse.questions.question import Question, QuestionChanges, changes_of
from dse.questions.result_question import (
    asked_as,
    question_of,
    replaced_objectives,
    restated_space,
    set_up,
    stated_question,
)
from dse.space.build import build_space, every_mistake
from dse.space.model.criteria import Objective, Requirement, Rule
from dse.space.model.metric_kinds import RESERVED
from dse.space.model.space import Space
from dse.space.options import read_option
from dse.space.question.implied import with_implied
from dse.space.question.metrics import QuestionError
from dse.space.question.open_cores import with_all_cores, with_open_cores
from dse.space.question.reading import read_objective, read_requirements
from dse.space.question.rules import read_rule
from dse.space.question.settings import ORIGIN
from dse.spec.language.grammar import ExpressionError, parse_assignment, parse_limit, parse_requirement
from dse.spec.language.scan import CALL
from dse.spec.loading.load import LoadedSpec, UnreadableError, load_spec, parse_spec
from dse.spec.schema.model import Imported
from dse.support import arguments
from dse.support.errors import UsageError

if TYPE_CHECKING:
    from dse.answers.result import Result
    from dse.answers.robust import RobustResult


@dataclass(frozen=True)
class Problem:
    """A valid problem: what was read, and the space of designs that it describes.

    Examples
    --------
    >>> import dse
    >>> dse.load("pump.yaml")
    <Problem 'Pump': 7 open decisions>
    """

    loaded: LoadedSpec
    space: Space
    changes: QuestionChanges = field(default_factory=QuestionChanges)
    """What a caller has asked beyond the file."""
    stated: Space | None = None
    """The space as the file states it, where `changes` have made another of it."""
    robust: bool = False
    """Whether every requirement is to hold for all values that `uncertainty` states (`dse.questions.robust.robust`)."""

    @property
    def name(self) -> str:
        """The problem's own name.

        The key ``name`` of the problem file, or the name that an importer gave to the model.
        """
        return self.space.name

    @property
    def base(self) -> Problem:
        """The problem as its file states it.

        A `Problem` without the changes that `ask` made: requirements, objectives, fixed decisions and settings are
        those of the file. Itself where nothing was changed.
        """
        return self if self.stated is None else Problem(self.loaded, self.stated)

    def ask(self, **question: Unpack[Question]) -> Problem:
        """The problem with a changed question; `dse.questions.question.Question` lists the keywords.

        Further limits, requirements and fixed decisions are added to those asked before; objectives and settings take
        the place of those.

        Raises
        ------
        UsageError
            for texts that do not parse or name what is not there.

        Examples
        --------
        >>> lamp = load({"dse": 1, "name": "Idle", "devices": {"lamp": {"period": ["1 s", "2 s"], "price": "3 EUR"}}})
        >>> asked = lamp.ask(fix="lamp.period = 2 s", minimise="price").ask(max_price="5 EUR")
        >>> [item.text for item in asked.space.requirements]
        ['price <= 5 EUR']
        """
        return changed(self, changes_of(question))

    @staticmethod
    def build(name: str, **settings: Any) -> Builder[Problem]:
        """A problem to be made in Python: a `Builder` of it, with settings such as ``processing="response_time"``.

        Parts are added by name (`Builder.add_thread` and so on), then `Builder.problem` checks them as a file is
        checked. Nothing is checked before.
        """
        return Builder(name, load, **settings)

    def __repr__(self) -> str:
        """One line: the name, and how much there is to decide."""
        return f"<Problem {self.name!r}: {sum(item.is_open for item in self.space.decisions)} open decisions>"


@dataclass(frozen=True)
class Model(os.PathLike[str]):
    """An AADL model: its path, and what of it is meant; every verb takes it where it takes a problem file.

    Parameters
    ----------
    path
        an ``.aadl`` file or a folder of them.
    root
        the system implementation, ``package::type.implementation``; may be left out where only one is used by no other.
    mode
        the mode that it is in; the initial one where it is left out.
    library
        folders in which packages are looked for that it asks for, besides the folder around it.

    Examples
    --------
    >>> import dse
    >>> text = "package p public system s end s; system implementation s.i end s.i; end p;"
    >>> written = Path("lamp.aadl").write_text(text, encoding="utf-8")
    >>> dse.load(dse.Model("lamp.aadl", root="p::s.i")).name
    'p::s.i'
    """

    path: str | Path
    root: str | None = None
    mode: str | None = None
    library: Sequence[str | Path] = ()

    def __fspath__(self) -> str:
        """The path alone."""
        return os.fspath(self.path)

    def __str__(self) -> str:
        """The path alone."""
        return os.fspath(self.path)

    @property
    def options(self) -> dict[str, str]:
        """The import options that are stated, by name.

        At most ``root``, ``mode`` and ``library`` (folders separated by commas), as the options of ``dse import`` have
        them; what is not stated is left out.
        """
        folders = ",".join(os.fspath(item) for item in self.library) or None
        stated = (("root", self.root), ("mode", self.mode), ("library", folders))
        return {name: text for name, text in stated if text is not None}


def model_of(path: Path, imported: Imported) -> Model:
    """The model that a problem was imported from, which is now at a path: with its root, mode and libraries.

    A `Model` whose library folders are relative to the model's folder, so that a moved model still finds them.
    """
    base = path if path.is_dir() else path.parent
    return Model(path, imported.root, imported.mode, [base / folder for folder in imported.library])


Source: TypeAlias = "Problem | str | Path | Model | Mapping[str, Any] | Result | RobustResult"
"""What every verb takes: a loaded problem, the path of a problem file or model, its content as text or mapping, or a
result, which stands for the question that it answers."""


def load(source: Source) -> Problem:
    """Read a problem.

    Parameters
    ----------
    source
        the path of a YAML file or of a model (`Model` says which root of it is meant); or the content of a problem
        file, as text of several lines or as a mapping (then nothing is included). A problem that is loaded already is
        given back. Of a result it is the problem that the result answers, with everything that was asked of it.

    Raises
    ------
    ProblemError
        with every mistake in the file and its includes, each with its line and column.
    UsageError
        when the source is nothing of that kind.

    Examples
    --------
    >>> load({"dse": 1, "name": "Idle", "devices": {"lamp": {"period": ["1 s", "2 s"]}}}).name
    'Idle'
    """
    if isinstance(source, Problem):
        return source
    if isinstance(source, Mapping):
        import yaml

        return loads(yaml.safe_dump(dict(source), sort_keys=False, allow_unicode=True), "<mapping>")
    if isinstance(source, str) and "\n" in source:
        return loads(source)
    if not isinstance(source, str | os.PathLike):
        return _answered(source)
    options = source.options if isinstance(source, Model) else None
    return _problem(lambda: load_spec(Path(source), None, options))


def _answered(source: object) -> Problem:
    """The problem of a result, as it was read then, and the question."""
    origin = getattr(source, "problem", None)
    if not isinstance(origin, Origin):
        said = f"a {type(source).__name__}" if source is not None else "nothing"
        raise UsageError(f"expected a problem, its file, text or mapping, or a result; got {said}")
    problem = load_carried(origin.file, origin.texts)
    return problem.ask(**question_of(problem.space, origin.effective))


def load_carried(name: str | Path, texts: Mapping[str, str]) -> Problem:
    """Read a problem from the texts of its files, as `LoadedSpec.texts` has them; nothing is read from the disk.

    Errors as for `load`.
    """
    return _problem(lambda: load_spec(Path(name), texts))


@arguments.checked(text=arguments.text, name=arguments.text)
def loads(text: str, name: str = "<text>") -> Problem:
    """Read a problem from text; it cannot include files. Errors as for `load`.

    Parameters
    ----------
    text
        the content of a problem file.
    name
        what messages call it.

    Examples
    --------
    >>> import dse
    >>> dse.loads("{dse: 1, name: Idle, devices: {lamp: {period: 1 s}}}").name
    'Idle'
    """
    return _problem(lambda: parse_spec(text, name))


def _problem(read: Callable[[], LoadedSpec]) -> Problem:
    try:
        loaded = read()
    except UnreadableError as error:
        raise every_mistake(error) from None
    return Problem(loaded, build_space(loaded))


def changed(problem: Problem, changes: QuestionChanges) -> Problem:
    """The problem with further changes; a requirement that is there in the same words is not listed again.

    Raises
    ------
    UsageError
        for texts that do not parse or name what is not there, and settings that the file could not state.
    """
    base, changes = problem.base, problem.changes.then(changes)
    space_asked = base.space
    replaced: Collection[int] = ()
    if changes.result is not None:
        space_asked = asked_as(base.loaded, base.space, changes.result)
        replaced = replaced_objectives(base.space, changes.result)
    if changes.objectives:
        replaced = range(len(base.space.objectives))
    space = set_up(base.loaded, space_asked, changes.settings, replaced=replaced)
    requirements: list[Requirement] = list(space.requirements)
    rules: list[Rule] = list(space.rules)
    for metric, text in changes.limits:
        _add_new(requirements, _limit(space, metric, text))
    for text in changes.require:
        parsed = _requirement_or_rule(space, text)
        if isinstance(parsed, Rule):
            rules.append(parsed)
        else:
            _add_new(requirements, parsed)
    objectives = _objectives(space, changes.objectives) if changes.objectives else space.objectives
    space = replace(space, requirements=tuple(requirements), rules=tuple(rules), objectives=objectives)
    space = with_implied(space)
    space = replace(space, fixed={**space.fixed, **read_choices(with_all_cores(space), changes.fix)})
    space = with_all_cores(space) if changes.cores else with_open_cores(space)
    return Problem(base.loaded, space, changes, base.space)


def _add_new(requirements: list[Requirement], more: Sequence[Requirement]) -> None:
    """Add the requirements that are not there yet word for word; another limit on one metric is another requirement."""
    stated = {(item.text, item.metric) for item in requirements if not item.implied}
    requirements += [item for item in more if (item.text, item.metric) not in stated]


def _limit(space: Space, metric: str, text: str) -> tuple[Requirement, ...]:
    """``--max-METRIC [NAME=]QUANTITY``."""
    option = f"--max-{metric}"
    try:
        name, _ = parse_limit(text)
        quantity = text if name is None else text.rpartition("=")[2]
        of = "" if name is None else f' of "{name}"'
        requirements = read_requirements(space, f"{metric}{of} <= {quantity.strip()}", ORIGIN)
    except (ExpressionError, QuestionError) as error:
        raise UsageError(f"{option} {text}: {error}") from error
    limit = f"<= {_spaced(quantity)}"
    return tuple(
        replace(item, text=f"{item.metric.name} {limit}", stated=f"{metric} {limit}" if item.stated else "")
        for item in requirements
    )


def _spaced(quantity: str) -> str:
    """``20ms`` as ``20 ms``."""
    return re.sub(r"(?<=\d)(?=[^\d.eE_\s])", " ", quantity.strip(), count=1)


def _requirement_or_rule(space: Space, text: str) -> tuple[Requirement, ...] | Rule:
    """A requirement where the text begins with a metric, else a rule."""
    derived = [item.name for item in space.derived]
    metrics = [*RESERVED, *space.totals, *derived]
    body = re.sub(r"^\s*(require|forbid)\s+", "", text)
    is_metric = any(re.match(rf"{re.escape(name)}(\s|[<>=≤≥]|$)", body) for name in metrics)
    is_metric = is_metric or CALL.match(body) is not None
    try:
        if is_metric and not any(body.startswith(f"{name}.") for name in metrics):
            return read_requirements(space, body, ORIGIN)
        return read_rule(space, text, ORIGIN)
    except (ExpressionError, QuestionError) as error:
        said = None if is_metric else _of_quoted_or_misspelt_metric(space, body)
        if isinstance(said, tuple):
            return said
        raise UsageError(f"--require {text!r}: {said or error}") from error


def _of_quoted_or_misspelt_metric(space: Space, text: str) -> tuple[Requirement, ...] | QuestionError | None:
    """A requirement, or what is wrong with one; None where a text has not its form, or names a decision."""
    try:
        written = parse_requirement(text)
        return None if "." in str(written.metric) else read_requirements(space, text, ORIGIN)
    except ExpressionError:
        return None
    except QuestionError as error:
        return error


def _objectives(space: Space, texts: Sequence[str]) -> tuple[Objective, ...]:
    objectives: list[Objective] = []
    for text in texts:
        try:
            objective = read_objective(space, text, ORIGIN)
        except (ExpressionError, QuestionError) as error:
            raise UsageError(f"objective {text!r}: {error}") from error
        if any(objective.metric == other.metric for other in objectives):
            raise UsageError(f"objective {text!r}: {objective.metric.name!r} is already an objective")
        objectives.append(objective)
    return tuple(objectives)


def read_choices(space: Space, texts: Sequence[str]) -> Mapping[int, int]:
    """Texts such as ``gnss_provider.period = 20 ms`` as options by decision; a fixed field must have the very value.

    Raises
    ------
    UsageError
        for an unknown decision, or an option that it does not have.
    """
    choices: dict[int, int] = {}
    for text in texts:
        try:
            name, value = parse_assignment(text)
            decision, option = read_option(space, name, value)
        except (ExpressionError, QuestionError) as error:
            raise UsageError(f"{text!r}: {error}") from error
        if decision is not None:
            if choices.get(decision, option) != option:
                raise UsageError(f"{text!r}: {name} is already set to another option")
            choices[decision] = option
    return choices


def with_stated_cores(problem: Problem, texts: Sequence[str]) -> Problem:
    """The problem, with every open core a decision where one of the texts ``name = option`` states one.

    A stated core counts whatever is asked: in response times that are only told, in the use of each core.
    """
    names = {item.decision.name for item in (*problem.space.open_cores, *problem.space.open_priorities)}
    if not any(text.partition("=")[0].strip().strip("'\"") in names for text in texts):
        return problem
    return changed(problem, QuestionChanges(cores=True))


# The question of a result, and which problem a result answers.


def restated(problem: Problem, effective: Mapping[str, Any]) -> Problem:
    """The problem with exactly the question that the ``effective`` block of a result states.

    Raises
    ------
    UsageError
        when the block is not one that `dse.solve` writes for this problem.
    """
    return replace(problem, space=restated_space(problem.loaded, problem.space, effective), robust=effective["robust"])


def origin_of(problem: Problem) -> Origin:
    """The origin of a problem: name, file, hashes, and the complete question.

    An `Origin` with the SHA-256 hashes of the file and of what it includes, the texts themselves, and the effective
    question, so that a result can be checked without its file.
    """
    loaded = problem.loaded
    return Origin(
        name=problem.name,
        file=str(loaded.path),
        sha256=loaded.sha256,
        includes=loaded.includes,
        effective={**stated_question(problem.space), "robust": problem.robust},
        identity=loaded.identity,
        texts=loaded.texts,
        is_carried=loaded.is_carried,
    )
