"""Texts in the boxes of a drawing: activation, place and types, with open decisions as ranges of options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any
from unicodedata import east_asian_width

from dse.analysis.rates import rate_hz
from dse.analysis.views import View
from dse.space.model.space import EMPTY, Component, Slot, Space
from dse.space.model.trees import NOT_OFFERED, Choice, Tree, at, leaves
from dse.space.question.open_cores import tells_cores_apart
from dse.support.units import format_duration, format_number, format_rate

SHOWN_OPTIONS = 2
ELSEWHERE = ("period", "dispatch_protocol", "processor")
"""Fields of a thread whose options its box shows otherwise than by the name of the field."""


@dataclass(frozen=True)
class TextLine:
    """A line of text, and whether it shows what is open, or was decided."""

    text: str
    is_open: bool = False


class Texts:
    """The texts of a problem, or of one of its designs, for which `view` stands.

    With `view` None open decisions are written as their options; with a view each text is the chosen one.
    """

    def __init__(self, space: Space, view: View | None, cores: Mapping[int, int]) -> None:
        self.space, self.view, self.cores = space, view, cores
        self.elsewhere = ELSEWHERE if tells_cores_apart(space) else (*ELSEWHERE, "core")
        """The fields that a component does not name as open: of alike cores each thread has one chosen anyway."""
        self.open: dict[str, list[str]] = {}
        """The fields with several options, by the component or connection that has them."""
        for number, item in enumerate(space.decisions):
            if item.is_open and number not in space.fixed:
                self.open.setdefault(item.component, []).append(item.field)

    def component(self, number: int) -> list[TextLine]:
        """The lines below the name of a component: its activation; where it runs in a design, or what else is open.

        One to three `TextLine` objects; names of processors are shortened to fit the box.
        """
        item = self.space.components[number]
        executors = [self.space.executors[leaf].name for leaf in leaves(item.executor) if leaf is not None]
        fields = [field for name in (item.name, *executors) for field in self.open.get(name, ())]
        lines = [self._options(item)]
        if self.view is not None:
            lines = [TextLine(self._chosen(number, item), lines[0].is_open)]
        processor = None if self.view is None else at(item.processor, self.view)
        if processor is not None and ("processor" in fields or number in self.cores):
            runs = f"on {self.space.processors[processor].name}"
            core = f", core {self.cores[number]}" if number in self.cores else ""
            lines.append(TextLine(f"{shortened(runs, 20)}{core}", "processor" in fields or "core" in fields))
        elif self.view is None and (further := [field for field in fields if field not in self.elsewhere]):
            lines.append(TextLine(f"open: {', '.join(dict.fromkeys(further))}", is_open=True))
        return lines

    def slot(self, item: Slot) -> TextLine:
        """The type of a processor or bus, or its options.

        ``A or B`` while the decision is open, ``not used`` for a slot that the design leaves empty; an empty text where
        type and slot have one name.
        """
        decision = self.space.decisions[item.type_decision]
        is_open = decision.is_open and item.type_decision not in self.space.fixed
        if self.view is not None:
            chosen = item.types[self.view[item.type_decision]]
            return TextLine("not used" if chosen == EMPTY else "" if chosen == item.name else chosen, is_open)
        fixed = self.space.fixed.get(item.type_decision)
        types = [name for name in (item.types if fixed is None else [item.types[fixed]]) if name != EMPTY]
        text = "" if types == [item.name] else " or ".join(types)
        return TextLine(f"{text} or none".strip() if is_open and EMPTY in item.types else text, is_open)

    def _chosen(self, number: int, item: Component) -> str:
        assert self.view is not None
        protocol, period = at(item.protocol, self.view), at(item.period_ns, self.view)
        if period is not None:
            return f"{protocol or 'periodic'} {format_duration(period)}"
        if item.section == "devices":
            return item.category
        rate = rate_hz(self.space, ("activation", number), self.view)
        return f"{protocol or 'event-triggered'}" + (f", {_rate(rate)}" if rate else "")

    def _options(self, item: Component) -> TextLine:
        """``periodic 10 … 100 ms, aperiodic``; open where there is more than one way."""
        numbers_of: dict[str | None, list[int]] = {}
        for protocol, period in _pairs(item.protocol, item.period_ns, dict(self.space.fixed)):
            periods = numbers_of.setdefault(protocol, [])
            if period is not None and period not in periods:
                periods.append(period)
        if item.section == "devices" and not any(numbers_of.values()):
            return TextLine(item.category)
        ways = sum(max(1, len(periods)) for periods in numbers_of.values())
        text = ", ".join(_activation(protocol, sorted(periods)) for protocol, periods in numbers_of.items())
        return TextLine(text, ways > 1)


def _activation(protocol: str | None, periods: Sequence[int]) -> str:
    if not periods:
        return protocol or "event-triggered"
    shown = periods if len(periods) <= SHOWN_OPTIONS else [periods[0], periods[-1]]
    *before, last = [format_duration(period) for period in shown]
    unit = last[last.index(" ") :]
    texts = [*(text.removesuffix(unit) for text in before), last]
    return f"{protocol or 'periodic'} {(', ' if len(shown) == len(periods) else ' … ').join(texts)}"


def _pairs(first: Tree, second: Tree, made: Mapping[int, int]) -> Iterator[tuple[Any, Any]]:
    """The leaves of two trees that some design has together."""
    for one, after in _walk(first, made):
        for other, _ in _walk(second, after):
            yield one, other


def _walk(tree: Tree, made: Mapping[int, int]) -> Iterator[tuple[Any, Mapping[int, int]]]:
    """Each leaf with the options that lead to it."""
    if not isinstance(tree, Choice):
        if tree is not NOT_OFFERED:
            yield tree, made
        return
    taken = made.get(tree.decision)
    for option, branch in enumerate(tree.branches):
        if taken in (None, option):
            yield from _walk(branch, {**made, tree.decision: option})


def _rate(rate: Fraction) -> str:
    return (
        format_rate(rate)
        if rate.denominator == 1
        else f"{float(rate):.4g} Hz"
        if rate < 1000
        else f"{format_number(round(rate))} Hz"
    )


def columns(text: str) -> int:
    """The width of a text in columns: wide letters take two.

    >>> columns("sprayer"), columns("噴霧")
    (7, 4)
    """
    return sum(2 if east_asian_width(char) in "WF" else 1 for char in text)


def shortened(text: str, room: int) -> str:
    """Text that takes at most `room` columns, without its middle if need be.

    >>> shortened("implement_controller", 10), shortened("sprayer", 10)
    ('impl…oller', 'sprayer')
    """
    if columns(text) <= room:
        return text
    head = list(_fitting(text, (room - 1) // 2))
    tail = list(_fitting(text[::-1], room - 1 - (room - 1) // 2))[::-1]
    return f"{''.join(head)}…{''.join(tail)}"


def _fitting(text: str, room: int) -> Iterator[str]:
    for char in text:
        room -= columns(char)
        if room < 0:
            return
        yield char
