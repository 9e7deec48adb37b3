"""Rules between decisions: a recursive-descent parser for conditions.

Precedence from loose to tight: ``implies`` and ``requires``, ``or``, ``and``, ``not``, comparisons. Where a reader may
take it otherwise (``A and B requires C``, ``not A requires B``, ``A implies B implies C``) parentheses are asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Literal

from dse.spec.language.expressions import (
    And,
    Compare,
    Condition,
    MultipleOf,
    Not,
    OneOf,
    Operator,
    Or,
    Ref,
    RuleExpr,
    Used,
)
from dse.spec.language.scan import STOPS, ExpressionError, Scanner, operator_at
from dse.support.errors import did_you_mean
from dse.support.units import shown

MAX_DEPTH = 50
_CONNECTIVES = ("and", "or", "implies", "requires", "then")
_KEYWORDS = (*_CONNECTIVES, "not", "if", "in", "is")


@lru_cache(maxsize=2)
def _longest(names: frozenset[str], bare: frozenset[str]) -> int:
    """The length of the longest name; every rule of a file has the same names."""
    return max(map(len, names | bare), default=0)


class RuleParser:
    """Parses one rule; `names` are decisions, `bare` types and slots.

    Recursive descent over the text; precedence from low to high: ``implies``, ``or``, ``and``, ``not``, comparison.
    Known names may contain blanks.
    """

    def __init__(self, text: str, names: Collection[str], bare: Collection[str]) -> None:
        self.text = text
        self.at = 0
        self.depth = 0
        self.names = frozenset(names)
        self.bare = frozenset(bare)
        self._scanner = Scanner(text)
        self._bracketed: list[Condition] = []
        self._implied: list[Condition] = []
        self._longest = _longest(self.names, self.bare)

    def rule(self) -> RuleExpr:
        """Parse the whole text.

        A `RuleExpr` with the verb ``require`` where none is written. Raises `ExpressionError` with the place of the
        mistake.
        """
        verb: Literal["require", "forbid"] = "require"
        if self._take_keyword("forbid"):
            verb = "forbid"
        else:
            self._take_keyword("require")
        condition = self._implication()
        self._skip()
        if self.at < len(self.text):
            raise self._error(f"expected the end of the rule, got {shown(self.text[self.at :])}")
        return RuleExpr(self.text.strip(), verb, condition)

    # --- conditions -----------------------------------------------------------------------------------------------

    def _implication(self) -> Condition:
        with self._deeper():
            if self._take_keyword("if"):
                left = self._implication()
                if not self._take_keyword("then"):
                    raise self._error('expected "then"')
                self._bracketed.append(condition := Or((Not(left), self._implication())))
                return condition
            start, left = self.at, self._disjunction()
            self._skip()
            for word, at in (("implies", self.at), ("requires", self.at)):
                if self._take_keyword(word):
                    middle, right = self.at, self._implication()
                    self._refuse_doubt(word, (left, right), at, (start, at, middle, self.at))
                    self._implied.append(made := Or((Not(left), right)))
                    return made
            return left

    def _refuse_doubt(
        self, word: str, sides: tuple[Condition, Condition], at: int, places: tuple[int, int, int, int]
    ) -> None:
        """``A and B requires C`` has two readings, as has ``A implies B implies C``.

        `at` is where the word stands, `places` are the beginnings and ends of both sides.
        """
        left, right = sides
        bare = [not any(side is item for item in self._bracketed) for side in sides]
        chained = bare[1] and any(right is item for item in self._implied)
        tight = word == "requires" and (
            (bare[0] and isinstance(left, And | Or | Not)) or (bare[1] and isinstance(right, And | Or))
        )
        if chained or tight:
            texts = [self.text[places[0] : places[1]].strip(), self.text[places[2] : places[3]].strip()]
            compound = [alone and isinstance(side, And | Or | Not) for side, alone in zip(sides, bare, strict=True)]
            shown_sides = [f"({text})" if several else text for text, several in zip(texts, compound, strict=True)]
            self.at = at
            hint = f"such as {shown_sides[0]} {word} {shown_sides[1]}"
            raise self._error(
                f"{shown(word)} can be read in two ways here: say with parentheses what belongs together", hint
            )

    def _disjunction(self) -> Condition:
        operands = [self._conjunction()]
        while self._take_keyword("or"):
            operands.append(self._conjunction())
        return operands[0] if len(operands) == 1 else Or(tuple(operands))

    def _conjunction(self) -> Condition:
        operands = [self._negation()]
        while self._take_keyword("and"):
            operands.append(self._negation())
        return operands[0] if len(operands) == 1 else And(tuple(operands))

    def _negation(self) -> Condition:
        if self._take_keyword("not"):
            with self._deeper():
                return Not(self._negation())
        if self._take("("):
            condition = self._implication()
            if not self._take(")"):
                raise self._error('expected ")"')
            self._bracketed.append(condition)
            return condition
        return self._comparison()

    def _comparison(self) -> Condition:
        self._skip()
        start = self.at
        name = self._reference()
        self._skip()
        operator = operator_at(self.text, self.at)
        if name in self.names:
            return self._compare(Ref(name), operator)
        if operator is not None or self._is_word("in") or self._is_word("is"):
            self.at = start
            hint = f'did you mean "{name}.type"?' if f"{name}.type" in self.names else ""
            raise self._error(f"{shown(name)} is not a decision and cannot be compared", hint)
        return Used(name)

    def _compare(self, left: Ref, operator: tuple[int, Operator] | None) -> Condition:
        if operator is not None:
            self.at += operator[0]
            condition = Compare(left, operator[1], self._operand())
            self._refuse_chain()
            return condition
        if self._take_word("in"):
            return OneOf(left, self._values())
        if self._take_word("not"):
            if not self._take_word("in"):
                raise self._error('expected "in"')
            return Not(OneOf(left, self._values()))
        if self._take_word("is"):
            self._take_word("a")
            if not (self._take_word("multiple") and self._take_word("of")):
                raise self._error('expected "a multiple of"')
            return MultipleOf(left, self._decision())
        operators = "==, !=, <, <=, >, >=, in, is a multiple of"
        raise self._error(f"expected a comparison after {shown(left.name)}", operators)

    def _refuse_chain(self) -> None:
        self._skip()
        if operator_at(self.text, self.at):
            raise self._error("one comparison at a time", 'join comparisons with "and"')

    # --- operands -------------------------------------------------------------------------------------------------

    def _decision(self) -> Ref:
        self._skip()
        start = self.at
        name = self._reference()
        if name not in self.names:
            self.at = start
            raise self._error(f"{shown(name)} is not a decision", self._closest(name, self.names))
        return Ref(name)

    def _operand(self) -> Ref | str:
        """A known decision, or literal text up to a connective, a closing bracket, a comma or the end."""
        self._skip()
        quoted = self._take_quoted()
        if quoted is not None:
            return Ref(quoted) if quoted in self.names else quoted
        known = self._peek_known()
        if known is not None and self._stops(self.at + len(known)):
            self.at += len(known)
            return Ref(known) if known in self.names else known
        return self._literal()

    def _literal(self) -> str:
        start = self.at
        while not self._stops(self.at):
            if operator_at(self.text, self.at) or self.text[self.at] in "([":
                break
            self.at += 1
            if self.text[self.at - 1].isspace():
                self._skip()
        literal = self.text[start : self.at].strip()
        if not literal:
            raise self._error("expected a value")
        return literal

    def _values(self) -> tuple[str, ...]:
        if not self._take("["):
            raise self._error('expected "["', 'such as "my_bus.type in [can_250k, can_500k]"')
        values: list[str] = []
        while not values or self._take(","):
            value = self._operand()
            values.append(value.name if isinstance(value, Ref) else value)
        if not self._take("]"):
            raise self._error('expected "," or "]"')
        return tuple(values)

    def _reference(self) -> str:
        """A known name, quoted or not."""
        self._skip()
        start = self.at
        quoted = self._take_quoted()
        if quoted is not None and (quoted in self.names or quoted in self.bare):
            return quoted
        known = self._peek_known() if quoted is None else None
        if known is not None:
            self.at += len(known)
            return known
        wrong = self._unknown() if quoted is None else quoted
        self.at = start
        if not wrong:
            raise self._error("expected the name of a decision, type or slot")
        hint = self._closest(wrong, self.names | self.bare)
        raise self._error(f"unknown name {shown(wrong)} in a rule", hint, unknown=wrong)

    def _unknown(self) -> str:
        start = self.at
        while self.at < len(self.text) and self.text[self.at] not in STOPS:
            if self.text[self.at].isspace():
                self._skip()
                if any(self._is_word(word) for word in _KEYWORDS):
                    break
            else:
                self.at += 1
        return self.text[start : self.at].strip()

    def _closest(self, name: str, known: Collection[str]) -> str:
        return did_you_mean(name, sorted(known))

    # --- characters and words -------------------------------------------------------------------------------------

    @contextmanager
    def _deeper(self) -> Iterator[None]:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self._error(f"nested deeper than {MAX_DEPTH} levels")
        yield
        self.depth -= 1

    def _error(self, message: str, hint: str = "", *, unknown: str = "") -> ExpressionError:
        return ExpressionError(message, self.at, hint, unknown=unknown)

    def _skip(self) -> None:
        self.at = self._after_blanks(self.at)

    def _after_blanks(self, at: int) -> int:
        while at < len(self.text) and self.text[at].isspace():
            at += 1
        return at

    def _boundary(self, at: int) -> bool:
        return at >= len(self.text) or self.text[at].isspace() or self.text[at] in STOPS

    def _word_at(self, word: str, at: int) -> bool:
        return self.text.startswith(word, at) and self._boundary(at + len(word))

    def _is_word(self, word: str) -> bool:
        return self._word_at(word, self.at)

    def _take(self, sign: str) -> bool:
        self._skip()
        taken = self.text.startswith(sign, self.at)
        self.at += len(sign) if taken else 0
        return taken

    def _take_word(self, word: str) -> bool:
        self._skip()
        taken = self._is_word(word)
        self.at += len(word) if taken else 0
        return taken

    def _take_keyword(self, word: str) -> bool:
        """Take the word unless a longer known name begins here."""
        self._skip()
        return len(self._peek_known() or "") <= len(word) and self._take_word(word)

    def _peek_known(self) -> str | None:
        """The longest known name that begins here and ends at a boundary."""
        last = min(len(self.text), self.at + self._longest)
        texts = (self.text[self.at : end] for end in range(last, self.at, -1) if self._boundary(end))
        return next((name for name in texts if name in self.names or name in self.bare), None)

    def _take_quoted(self) -> str | None:
        """Take ``'text'`` or ``'text'.field``, if it begins here."""
        if self.at >= len(self.text) or not self._scanner.opens_quote(self.at):
            return None
        end = self._scanner.quoted_end(self.at)
        inner, field = self.text[self.at + 1 : end], end + 1
        self.at = end + 1
        if self.text[field : field + 1] == ".":
            while not self._boundary(self.at):
                self.at += 1
        return inner + self.text[field : self.at]

    def _stops(self, at: int) -> bool:
        """Whether an operand ends here: at the end, a closing bracket, a comma, or before a connective."""
        ahead = self._after_blanks(at)
        if ahead >= len(self.text) or self.text[ahead] in "),]":
            return True
        separated = ahead > at or at == 0 or self.text[at - 1].isspace()
        return separated and any(self._word_at(word, ahead) for word in _CONNECTIVES)
