"""Arguments of the public verbs, each checked as the option of the command line is.

A verb states its checks by the names of its keywords: `checked`. A check takes the name and the value that was given,
and returns the value to work with, or raises `UsageError` with what would be right.
"""

from __future__ import annotations

import inspect
import math
import operator
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from datetime import timedelta
from difflib import get_close_matches
from fractions import Fraction
from functools import wraps
from numbers import Real
from typing import Any, NoReturn, TypeAlias, TypeVar, cast

from dse.support.errors import UsageError
from dse.support.timelimit import TimeLimit
from dse.support.units import DIMENSIONLESS, TIME, UnitError, parse_quantity

F = TypeVar("F", bound=Callable[..., Any])
Check: TypeAlias = Callable[[str, Any], Any]
Span: TypeAlias = float | timedelta | str
"""A time on the clock of the wall: seconds, a ``timedelta``, or text such as ``"2 min"``."""
BOOLEANS = ("bool", "bool_")


def checked(*, also: Collection[str] = (), **checks: Check) -> Callable[[F], F]:
    """Check the arguments of a verb before it runs; a keyword that it does not have is refused with the nearest.

    Parameters
    ----------
    also
        further keywords that it takes, of a question or of formats; it checks those itself.
    checks
        by the name of the parameter.
    """

    def decorate(verb: F) -> F:
        signature = inspect.signature(verb)
        is_open = any(item.kind is item.VAR_KEYWORD for item in signature.parameters.values())
        known = [name for name, item in signature.parameters.items() if item.kind is not item.VAR_KEYWORD]
        named = [name for name in known if signature.parameters[name].kind is not inspect.Parameter.VAR_POSITIONAL]

        @wraps(verb)
        def run(*arguments: Any, **keywords: Any) -> Any:
            for name in keywords if also or not is_open else ():
                if name not in named and name not in also:
                    raise UsageError(f"{verb.__name__}: unknown keyword {name!r}{nearest(name, [*named, *also])}")
            bound = signature.bind(*arguments, **keywords)
            for name, check in checks.items():
                if name in bound.arguments:
                    bound.arguments[name] = check(name, bound.arguments[name])
            return verb(*bound.args, **bound.kwargs)

        run.checks = checks  # type: ignore[attr-defined]
        return cast(F, run)

    return decorate


def nearest(text: str, known: Iterable[str]) -> str:
    """`` (did you mean "seed"?)``, or all that there are: what follows a text that is none of them.

    Used behind a message about an unknown word; case does not count.
    """
    names = list(known)
    close = get_close_matches(text.lower(), [name.lower() for name in names], 1)
    match = [name for name in names if name.lower() in close]
    return f' (did you mean "{match[0]}"?)' if match else f" (there are {', '.join(names)})"


def refuse(name: str, expected: str, value: object) -> NoReturn:
    """Say what an argument is to be.

    Raises
    ------
    UsageError
        always.
    """
    text = repr(value)
    raise UsageError(f"{name}: expected {expected}; got {text if len(text) <= 100 else f'{text[:100]}…'}")


@dataclass(frozen=True)
class Whole:
    """A whole number from `least` to `most`; also one of numpy. None where it may be left out.

    Called with the keyword's name and its value; raises `UsageError` for anything else.
    """

    least: int
    most: int
    is_optional: bool = False

    def __call__(self, name: str, value: Any) -> int | None:
        """The number."""
        if value is None and self.is_optional:
            return None
        words = f"a whole number from {self.least:,} to {self.most:,}"
        if type(value).__name__ in BOOLEANS:
            refuse(name, words, value)
        try:
            number = operator.index(value)
        except TypeError:
            refuse(name, words, value)
        if not self.least <= number <= self.most:
            refuse(name, words, value)
        return number


@dataclass(frozen=True)
class Word:
    """One of some words.

    Called with the keyword's name and its value; raises `UsageError` with the nearest word.
    """

    words: tuple[str, ...]

    def __call__(self, name: str, value: Any) -> str:
        """The word."""
        if not isinstance(value, str):
            refuse(name, ", ".join(self.words), value)
        word = str(respelt(value, self.words))
        if word not in self.words:
            raise UsageError(f"{name}: expected {', '.join(self.words)}; got {value!r}{hint(value, self.words)}")
        return word


def respelt(value: Any, words: Collection[str]) -> Any:
    """A text as one of the words has it, which may be written with hyphens or spaces; anything else as it is.

    >>> respelt("response-time", ("execution_time", "response_time")), respelt("any", ("first_fit",))
    ('response_time', 'any')
    """
    plain = re.sub(r"[-_ ]", "_", value) if isinstance(value, str) else value
    return next((word for word in words if re.sub(r"[-_ ]", "_", word) == plain), value)


def hint(text: str, words: Collection[str]) -> str:
    """`` (did you mean "worst"?)``, or "" where none is close.

    For messages that do not list all words.
    """
    near = nearest(text, words)
    return near if near.startswith(" (did") else ""


def flag(name: str, value: Any) -> bool:
    """True or False, also those of numpy.

    Raises `UsageError` for anything else, 0 and 1 included.
    """
    if type(value).__name__ not in BOOLEANS:
        refuse(name, "True or False", value)
    return bool(value)


def optional_flag(name: str, value: Any) -> bool | None:
    """True, False or None."""
    return None if value is None else flag(name, value)


def text(name: str, value: Any) -> str:
    """A text.

    Raises `UsageError` for anything else.
    """
    if not isinstance(value, str):
        refuse(name, "a text", value)
    return value


def optional_text(name: str, value: Any) -> str | None:
    """A text, or None."""
    return None if value is None else text(name, value)


def texts(name: str, value: Any) -> tuple[str, ...]:
    """One text, or several.

    A tuple; raises `UsageError` for mappings and for items that are no texts.
    """
    several = (value,) if isinstance(value, str) else value
    if isinstance(several, Mapping) or not isinstance(several, Iterable):
        refuse(name, "a text, or several", value)
    items = tuple(several)
    if not all(isinstance(item, str) for item in items):
        refuse(name, "a text, or several", value)
    return items


def named_texts(name: str, value: Any) -> Mapping[str, str] | None:
    """Texts by name, or None.

    Raises `UsageError` for anything but a mapping from text to text.
    """
    if value is not None and not (
        isinstance(value, Mapping) and all(isinstance(part, str) for pair in value.items() for part in pair)
    ):
        refuse(name, "texts by name", value)
    return cast("Mapping[str, str] | None", value)


def path(name: str, value: Any) -> str | os.PathLike[str]:
    """A path.

    Text or `os.PathLike`; raises `UsageError` for anything else and for a NUL in it.
    """
    if not isinstance(value, str | os.PathLike) or "\0" in os.fspath(value):
        refuse(name, "a path", value)
    return value


def optional_path(name: str, value: Any) -> str | os.PathLike[str] | None:
    """A path, or None."""
    return None if value is None else path(name, value)


def paths(name: str, value: Any) -> tuple[str | os.PathLike[str], ...]:
    """One path, or several.

    A tuple; raises `UsageError` for mappings and for items that are no paths.
    """
    several = (value,) if isinstance(value, str | os.PathLike) else value
    if isinstance(several, Mapping) or not isinstance(several, Iterable):
        refuse(name, "a path, or several", value)
    return tuple(path(name, item) for item in several)


def lengths(name: str, value: Any) -> Mapping[str, int] | None:
    """Whole numbers by name, or None; how many there may be is for the verb to say.

    Raises `UsageError` for values outside 0 .. 10¹².
    """
    if value is None:
        return None
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        refuse(name, "whole numbers by name", value)
    return {key: cast(int, Whole(0, 10**12)(f"{name}[{key!r}]", item)) for key, item in value.items()}


@dataclass(frozen=True)
class InstanceOf:
    """An object of one of some classes of dse, by their names; `called` is what a reader knows it as.

    `or_else` are further types that are accepted, None among them where it may be left out.
    """

    classes: tuple[str, ...]
    called: str
    or_else: tuple[type, ...] = ()

    def __call__(self, name: str, value: Any) -> Any:
        """The object itself."""
        names = {item.__name__ for item in type(value).__mro__ if item.__module__.partition(".")[0] == "dse"}
        if names.isdisjoint(self.classes) and not isinstance(value, self.or_else):
            refuse(name, self.called, value)
        return value


PATHS = (str, os.PathLike)
RESULT = InstanceOf(("Result",), "a result, as dse.solve or dse.reopen return it")
DRAWN = InstanceOf(("Result", "Problem"), "a result, as dse.solve or dse.reopen return it, or a problem to draw")
ANSWER = InstanceOf(("Answer", "DataAnswer"), "the answer of a verb, such as that of dse.solve")
STATED = InstanceOf(("Result", "RobustResult"), "a result, its dictionary, or the path of its file", (Mapping, *PATHS))
PROBLEM = InstanceOf(("Problem",), "a problem or the path of its file", (*PATHS, type(None)))


def call(name: str, value: Any) -> Callable[..., Any] | None:
    """Something to call, or None.

    Raises `UsageError` for what cannot be called.
    """
    if value is not None and not callable(value):
        refuse(name, "a function", value)
    return cast("Callable[..., Any] | None", value)


def span(name: str, value: Any) -> float | None:
    """A positive number of seconds of a `Span`, or None.

    In seconds, from a number, a ``timedelta`` or text such as ``2 min``. Raises `UsageError` for anything else, and for
    0 and less.
    """
    words = 'a positive time: seconds, a timedelta, or text such as "2 min"'
    if value is None:
        return None
    if isinstance(value, timedelta):
        seconds = value.total_seconds()
    elif isinstance(value, str):
        try:
            seconds = read_span(value)
        except UnitError as error:
            raise UsageError(f"{name}: {value!r}: {error.message}") from error
    elif _is_number(value):
        seconds = float(value)
    else:
        refuse(name, words, value)
    if not 0 < seconds < math.inf:
        refuse(name, words, value)
    return seconds


def time_limit(span_given: Span | None) -> TimeLimit:
    """The limit that begins now and lasts a `Span`; none for None.

    A `TimeLimit` on the monotonic clock; raises `UsageError` as `span` does.
    """
    return TimeLimit.after(span("time_limit_s", span_given))


def _is_number(value: object) -> bool:
    """Whether it is a real number, and no truth value."""
    return isinstance(value, Real) and type(value).__name__ not in BOOLEANS


def read_span(text: str) -> float:
    """Seconds from ``90``, ``90s`` or ``1.5 min``.

    Raises
    ------
    UnitError
        for anything else.
    """
    quantity = parse_quantity(text)
    if quantity.unit and quantity.dimension != TIME:
        raise UnitError('expected seconds or a duration with its unit, such as "2min"')
    return float(quantity.value)


def duration(name: str, value: Any) -> str | None:
    """A time of the system as text with its unit; a ``timedelta`` becomes one.

    In whole microseconds for a ``timedelta``; raises `UsageError` for a number without a unit.
    """
    if isinstance(value, timedelta):
        return f"{value // timedelta(microseconds=1)} us"
    if value is not None and not isinstance(value, str):
        refuse(name, 'a duration with its unit, such as "10 s", or a timedelta', value)
    return value


def share(name: str, value: Any) -> Fraction:
    """A share above 0 and below 1: a number, or text such as ``10 %``.

    An exact fraction; raises `UsageError` for anything else.
    """
    words = 'a share above 0 and below 100 %, such as 0.1 or "10 %"'
    ratio: Fraction | None = None
    if isinstance(value, str):
        try:
            quantity = parse_quantity(value)
        except UnitError as error:
            raise UsageError(f"{name}: {value!r}: {error.message}") from error
        ratio = quantity.value if quantity.dimension == DIMENSIONLESS else None
    elif isinstance(value, Fraction):
        ratio = value
    elif _is_number(value) and math.isfinite(value):
        ratio = Fraction(float(value)).limit_denominator(10**9)
    if ratio is None or not 0 < ratio < 1:
        refuse(name, words, value)
    return ratio


SEED = Whole(0, 2**31 - 1)
"""Of a solver, or of samples."""
