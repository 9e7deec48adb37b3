"""The words in which a caller changes a question: one set of keywords for `Problem.ask` and for every verb."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, TypeAlias, TypedDict

from dse.space.question.settings import SETTINGS
from dse.spec.language.scan import quoted
from dse.support.arguments import nearest, refuse, respelt
from dse.support.errors import UsageError

Texts: TypeAlias = str | Sequence[str]
"""One text, or several."""
Named: TypeAlias = Texts | Mapping[str, str]
"""One text, several, or the text of each name."""


class HasDecisions(Protocol):
    """A point of a front, a further design, an analysis: whatever says which option each decision has."""

    @property
    def decisions(self) -> Mapping[str, str]:
        """The chosen option by decision.

        Names of decisions to names of options; inactive decisions may be missing.
        """


Decided: TypeAlias = Mapping[str, str] | Sequence[str] | HasDecisions | None
"""A design: decisions by name, texts ``name = option``, or a point of a front; nothing is the baseline."""


def decisions_as_texts(design: Decided) -> list[str]:
    """A design as texts ``name = option``.

    Raises
    ------
    UsageError
        when it is none.

    Examples
    --------
    >>> decisions_as_texts({"control.period": "10 ms"})
    ["'control.period' = 10 ms"]
    """
    stated = getattr(design, "decisions", design)
    texts = (
        [f"{quoted(name)} = {option}" for name, option in stated.items()]
        if isinstance(stated, Mapping)
        else stated or ()
    )
    if isinstance(texts, str) or not isinstance(texts, Iterable) or not all(isinstance(text, str) for text in texts):
        raise UsageError(
            f'design: expected decisions by name, texts such as "control.period = 10 ms", or a point; got {design!r}'
        )
    return list(texts)


class Question(TypedDict, total=False):
    """The keywords by which a caller extends the question of a problem file.

    ``max_METRIC`` limits a metric, as text with a unit: ``"20 ms"`` for every flow, processor or bus, ``"my_flow=20
    ms"`` or ``{"my_flow": "20 ms"}`` for one. ``require`` holds requirements and rules in the words of the problem
    file, ``minimise`` and ``maximise`` metrics, which replace the objectives of the file, ``objectives`` the same with
    their sense and in their order (``"minimise price"``), ``fix`` decisions such as
    ``"gnss_provider.period = 20 ms"`` or ``{"gnss_provider.period": "20 ms"}``, as the decisions of a point are. The
    others are settings, which replace those of the file.
    """

    max_jitter: Named
    max_latency: Named
    max_utilisation: Named
    max_load: Named
    max_busy: Named
    max_price: Named
    max_power: Named
    max_changes: Named
    require: Texts
    minimise: Texts
    maximise: Texts
    objectives: Texts
    fix: Named
    profile: str | None
    worst_case: str | None
    system: str | None
    partition_output: str | None
    best_case: str | None
    bus_queuing: str | None
    processing: str | None
    deadlines: str | None
    overload: str | None


@dataclass(frozen=True)
class QuestionChanges:
    """A caller's changes, read.

    `limits` are (metric, text) pairs such as ("jitter", "20 ms") or ("jitter", "my_flow=20 ms"); `require` holds
    requirements and rules; `objectives`, where given, replace those of the file; `fix` holds ``decision = option``
    texts. The next ones are settings, each with the values that the problem file has for it. `result` is the
    ``effective`` block of a result whose question takes the place of the file's, under all other changes. `cores`
    makes every open core a decision, whatever is asked: for designs that state cores.
    """

    limits: Sequence[tuple[str, str]] = ()
    require: Sequence[str] = ()
    objectives: Sequence[str] = ()
    fix: Sequence[str] = ()
    profile: str | None = None
    worst_case: str | None = None
    system: str | None = None
    partition_output: str | None = None
    best_case: str | None = None
    bus_queuing: str | None = None
    processing: str | None = None
    deadlines: str | None = None
    result: Mapping[str, Any] | None = None
    cores: bool = False
    overload: str | None = None

    @property
    def settings(self) -> dict[str, str | None]:
        """The settings by name (`dse.space.question.settings`); None where the file's holds.

        Keys such as ``processing``, ``deadlines``, ``overload`` and ``profile``, each with a word of its setting or
        None.
        """
        return {name: getattr(self, name) for name in SETTINGS}

    @property
    def is_anything(self) -> bool:
        """Whether there is any change.

        False for a verb that was called without any keyword of `Problem.ask`: the question is the file's.
        """
        return any((self.limits, self.require, self.objectives, self.fix, *self.settings.values()))

    def then(self, more: QuestionChanges) -> QuestionChanges:
        """Combine with further changes: limits, requirements and fixed decisions add up, the other settings replace.

        A new `QuestionChanges`; neither of the two is modified. Of settings and objectives the later statement holds,
        so that a result's question can be asked again with one more limit.
        """
        settings: dict[str, Any] = {name: value for name, value in more.settings.items() if value is not None}
        return replace(
            self,
            result=more.result or self.result,
            cores=more.cores or self.cores,
            limits=(*self.limits, *more.limits),
            require=(*self.require, *more.require),
            objectives=more.objectives or self.objectives,
            fix=(*self.fix, *more.fix),
            **settings,
        )


def changes_of(question: Mapping[str, Any]) -> QuestionChanges:
    """The changes that the keywords of a `Question` ask for.

    Raises
    ------
    UsageError
        for a keyword that is none, or a value that is neither a text nor several.

    Examples
    --------
    >>> changes_of({"max_jitter": "20 ms"}).limits
    (('jitter', '20 ms'),)
    >>> changes_of({"max_jitter": {"main": "20 ms"}, "fix": {"filter.period": "10 ms"}}).fix
    ("'filter.period' = 10 ms",)
    """
    known = (*Question.__annotations__,)
    for name in question:
        if name not in known:
            raise UsageError(f"unknown keyword {name!r}{nearest(name, known)}")
    limits = tuple((metric, text) for metric in LIMITED for text in _texts(question, f"max_{metric}", "{}={}"))
    objectives = (
        *_texts(question, "objectives"),
        *(f"minimise {text}" for text in _texts(question, "minimise")),
        *(f"maximise {text}" for text in _texts(question, "maximise")),
    )
    settings: dict[str, Any] = {name: respelt(question.get(name), words) for name, words in SETTINGS.items()}
    return QuestionChanges(
        limits, _texts(question, "require"), objectives, _texts(question, "fix", "{} = {}"), **settings
    )


def _texts(question: Mapping[str, Any], name: str, named: str = "") -> tuple[str, ...]:
    """One text or several; the text of each name is written as `named` says."""
    stated: Any = () if question.get(name) is None else question[name]
    is_mapping = isinstance(stated, Mapping)
    several = stated.values() if is_mapping else stated
    parts = tuple(several) if isinstance(several, Iterable) and not isinstance(several, str) else (stated,)
    if not all(isinstance(text, str) for text in parts) or (is_mapping and not named):
        what = 'text with a unit, such as "20 ms"' if name.startswith("max_") else "text"
        refuse(name, f"names, each with a {what}" if is_mapping and named else f"a {what}, or several", stated)
    if not is_mapping:
        return parts
    return tuple(named.format(quoted(key) if name == "fix" else key, text) for key, text in stated.items())


# The metrics that ``--max-METRIC`` and ``max_METRIC`` limit; light, for the command line reads it before its work.


class Limited(NamedTuple):
    """The parts of the help text on a limit of a metric: example, elements with a limit each, name, owner.

    Used to write the keyword's help text: `example` is a value with its unit, such as ``20 ms``.
    """

    example: str
    of: str = ""
    called: str = ""
    whose: str = "of the system"


LIMITED: Mapping[str, Limited] = {
    "jitter": Limited("20ms", "flow"),
    "latency": Limited("20ms", "flow"),
    "utilisation": Limited("70%", "processor"),
    "load": Limited("50%", "bus"),
    "busy": Limited("80%", "bus", "busy time"),
    "price": Limited("500EUR"),
    "power": Limited("10W"),
    "changes": Limited("3", whose="against the baseline"),
}
"""By metric; each has a keyword ``max_METRIC`` in `dse.questions.question.Question` too."""
