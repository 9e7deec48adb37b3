"""Property values and associations, read from their text."""

from __future__ import annotations

import re
from fractions import Fraction

from dse.importers.aadl.syntax.cursor import Cursor
from dse.importers.aadl.syntax.tree import (
    Association,
    Classified,
    Computed,
    Listed,
    ModalValue,
    Number,
    Path,
    Properties,
    Range,
    Record,
    Reference,
    Referred,
    StringLiteral,
    Value,
    Word,
)

_ESCAPED = re.compile(r'""|\\(["\\nt])')
_MEANT = {"n": "\n", "t": "\t"}
MOST_DIGITS = 60
"""The greatest number of digits, and the greatest exponent, that a number may have."""


def _text_within(quoted: str) -> str:
    """The text between quotes: a quote is doubled, as the standard has it, or behind a backslash, as OSATE has it."""
    return _ESCAPED.sub(lambda text: _MEANT.get(text[1], text[1]) if text[1] else '"', quoted)


def read_block(cursor: Cursor) -> Properties:
    """``{a => b; c => d;}``, or nothing."""
    if not cursor.accept("{"):
        return ()
    properties = []
    while not cursor.accept("}"):
        properties.append(read_association(cursor, 'a property or "}"'))
    return tuple(properties)


def read_association(cursor: Cursor, what: str = "a property") -> Association:
    """``Set::Name => value applies to path in binding (classifier);``."""
    place = cursor.place
    *package, name = cursor.qualified(what)
    appends = cursor.token.key == "+=>"
    if not appends and cursor.token.key != "=>":
        cursor.fail('"=>" or "+=>"')
    cursor.take()
    cursor.accept("constant")
    values = [_modal_value(cursor)]
    while cursor.accept(","):
        values.append(_modal_value(cursor))
    applies: list[Path] = []
    binding: list[Reference] = []
    if cursor.accept("applies"):
        cursor.expect("to")
        applies = _paths(cursor)
    if cursor.accept("in", "binding"):
        cursor.expect("(")
        binding.append(cursor.reference())
        while cursor.accept(","):
            binding.append(cursor.reference())
        cursor.expect(")")
    cursor.expect(";", 'a comma, "applies to" or ";"' if not applies else 'a comma or ";"')
    return Association(
        "::".join(package), name, name.lower(), tuple(values), tuple(applies), tuple(binding), appends, place
    )


def _paths(cursor: Cursor) -> list[Path]:
    """Paths with commas; one that is missing between two lines is remarked on."""
    paths = [cursor.path("the path of a component, connection or flow")]
    while True:
        if cursor.accept(","):
            paths.append(cursor.path("the path of a component, connection or flow"))
        elif cursor.token.kind == "name" and cursor.token.key != "in":
            cursor.remark("expected a comma before this path: read as if there were one", cursor.place)
            paths.append(cursor.path())
        else:
            return paths


def _modal_value(cursor: Cursor) -> ModalValue:
    value = read_value(cursor)
    modes: tuple[str, ...] | None = None
    if cursor.accept("in", "modes"):
        modes = cursor.names("the name of a mode")
    return ModalValue(value, modes)


def read_value(cursor: Cursor) -> Value:
    """A property expression.

    Raises
    ------
    ProblemError
        where there is none.
    """
    place = cursor.place
    low = _operand(cursor)
    if cursor.accept(".."):
        high = _operand(cursor)
        if cursor.accept("delta"):
            _operand(cursor)
        return Range(low, high, place)
    if cursor.token.key in ("and", "or"):
        cursor.skip(",", ";", ")", "]", "}", "applies", "in")
        return Computed("a condition", place)
    return low


def _operand(cursor: Cursor) -> Value:
    place, token = cursor.place, cursor.token
    if token.kind == "number" or token.key in ("+", "-"):
        return _number(cursor)
    if token.kind == "string":
        cursor.take()
        return StringLiteral(_text_within(token.text[1:-1]), place)
    if token.key in ("true", "false"):
        cursor.take()
        return Word("", token.key, False, place)
    if token.key == "(":
        return _listed(cursor)
    if token.key == "[":
        return _record(cursor)
    if token.key == "not":
        cursor.take()
        _operand(cursor)
        return Computed("a condition", place)
    if cursor.ahead().key == "(" and token.key in ("reference", "classifier", "compute", "value"):
        return _called(cursor)
    if token.kind == "name":
        return _word(cursor, negative=False)
    cursor.fail("a value")


def _word(cursor: Cursor, *, negative: bool) -> Word | Classified:
    place = cursor.place
    reference = cursor.reference("a value")
    if "." in reference.name:
        return Classified(reference, place)
    return Word(reference.package, reference.name, negative, place)


def _listed(cursor: Cursor) -> Listed:
    place = cursor.place
    cursor.expect("(")
    items: list[Value] = []
    while not cursor.accept(")"):
        if items:
            cursor.expect(",", 'a comma or ")"')
        items.append(read_value(cursor))
    return Listed(tuple(items), place)


def _record(cursor: Cursor) -> Record:
    place = cursor.place
    cursor.expect("[")
    fields: list[tuple[str, Value]] = []
    while not cursor.accept("]"):
        name = cursor.name('the name of a field or "]"')
        cursor.expect("=>")
        fields.append((name.lower(), read_value(cursor)))
        cursor.expect(";")
    return Record(tuple(fields), place)


def _called(cursor: Cursor) -> Value:
    place, word = cursor.place, cursor.take().key
    cursor.expect("(")
    value: Value
    if word == "reference":
        value = Referred(cursor.path("the path of what is referred to"), place)
        cursor.skip(")")  # an annex subclause within
    elif word == "classifier":
        value = Classified(cursor.reference(), place)
    elif word == "value":
        value = _word(cursor, negative=False)
    else:
        value = Computed(f"compute ({cursor.name('the name of a function')})", place)
    cursor.expect(")")
    return value


def _number(cursor: Cursor) -> Value:
    place = cursor.place
    negative = False
    while cursor.token.key in ("+", "-"):
        negative ^= cursor.take().key == "-"
    if cursor.token.kind == "name":
        return _word(cursor, negative=negative)
    token = cursor.token
    if token.kind != "number":
        cursor.fail("a number")
    value = _fraction(cursor, token.text)
    cursor.take()
    unit = ""
    if cursor.token.kind == "name" and cursor.token.key not in ("in", "applies", "delta", "and", "or"):
        unit = cursor.take().text
    return Number(-value if negative else value, unit, place)


def _fraction(cursor: Cursor, text: str) -> Fraction:
    """``1_000``, ``1.5e-3``, ``16#FF#e2``."""
    plain = text.replace("_", "").lower()
    exponent = plain.rpartition("#" if "#" in plain else "e")[2].lstrip("e") if _has_exponent(plain) else "0"
    if len(plain) > MOST_DIGITS or len(exponent) > 4 or abs(int(exponent)) > MOST_DIGITS:
        cursor.fail(f"a number of at most {MOST_DIGITS} digits")
    if "#" not in plain:
        return Fraction(plain)
    base, digits, _ = plain.split("#")
    if not 2 <= int(base) <= 16 or any(int(digit, 16) >= int(base) for digit in digits):
        cursor.fail(f"a number of base {base}")
    return Fraction(int(digits, int(base))) * Fraction(int(base)) ** int(exponent)


def _has_exponent(plain: str) -> bool:
    return not plain.endswith("#") if "#" in plain else "e" in plain
