"""Sums of work under literals that must not exceed a time: rows of a bus on which messages wait."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor
from typing import Any

from dse.encode.linear import EXACT_LIMIT, Board
from dse.support.units import Exact


class Row:
    """constant + sum of coefficient * literal <= most; `blocked` is a variable on top, with its greatest value."""

    def __init__(self, board: Board, constant: int, most: int, blocked: tuple[Any, int] | None = None) -> None:
        self.board, self.constant, self.most, self.blocked = board, constant, most, blocked
        self.parts: dict[int, tuple[Any, int]] = {}

    def add(self, literal: Any, work: Exact, scale: int) -> None:
        """Work where a literal is true, rounded down."""
        counted = floor(work * scale)
        if literal.index == self.board.true.index:
            self.constant += counted
        elif counted > 0:
            before = self.parts.get(literal.index, (literal, 0))[1]
            self.parts[literal.index] = literal, before + counted

    def demand(self, where: Sequence[Any]) -> None:
        """The row where all these literals are true."""
        total = sum(counted for _, counted in self.parts.values()) + (self.blocked[1] if self.blocked else 0)
        if self.constant + total <= self.most or self.constant + total >= EXACT_LIMIT:
            return
        held = [literal for literal in where if literal.index != self.board.true.index]
        if self.constant > self.most:
            self.board.forbid(held)
            return
        form: Any = sum(counted * literal for literal, counted in self.parts.values())
        form = form if self.blocked is None else form + self.blocked[0]
        self.board.model.add(form <= self.most - self.constant).only_enforce_if(held)
