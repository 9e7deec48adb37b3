"""A cursor over the tokens of a file: what every rule of the grammar is written with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from dse.importers.aadl.syntax.tokens import SourceText, Token, finding
from dse.importers.aadl.syntax.tree import Path, Reference
from dse.importers.allowance import spend
from dse.importers.registry import Place
from dse.support.errors import Diagnostic


class Cursor:
    """The tokens of a file and a position among them; `remarks` collects what was read with a doubt.

    Recursive descent with a look-ahead of any length; keys are tokens in small letters.
    """

    def __init__(self, text: SourceText) -> None:
        self.text = text
        self.tokens: Sequence[Token] = list(text.tokens())
        self.at = 0
        self.remarks: list[Diagnostic] = []

    @property
    def token(self) -> Token:
        """The token under the cursor; the last one behind the end."""
        return self.tokens[min(self.at, len(self.tokens) - 1)]

    @property
    def place(self) -> Place:
        """Its place."""
        return self.text.place(self.token.offset)

    def ahead(self, count: int = 1) -> Token:
        """A token further on; the last one behind the end."""
        return self.tokens[min(self.at + count, len(self.tokens) - 1)]

    def take(self) -> Token:
        """The token under the cursor, which moves on."""
        spend()
        token = self.token
        if token.kind != "end":
            self.at += 1
        return token

    def sees(self, *keys: str) -> bool:
        """Whether these tokens come next."""
        return all(self.ahead(number).key == key for number, key in enumerate(keys))

    def accept(self, *keys: str) -> bool:
        """Take these tokens if they come next."""
        is_next = self.sees(*keys)
        if is_next:
            self.at += len(keys)
        return is_next

    def fail(self, expected: str, hint: str = "") -> NoReturn:
        """Raise: something else was expected here."""
        token = self.token
        got = token.text if token.kind == "end" else f'"{_brief(token.text)}"'
        self.text.fail(f"expected {expected}, got {got}", token.offset, hint)

    def expect(self, key: str, what: str = "") -> Token:
        """Take the token, which must come next."""
        if self.token.key != key:
            self.fail(what or f'"{key}"')
        return self.take()

    def name(self, what: str = "a name") -> str:
        """A name, as written."""
        if self.token.kind != "name" or self.token.key == "end":
            self.fail(what)
        return self.take().text

    def remark(self, message: str, place: Place, hint: str = "") -> None:
        """Note a doubt."""
        self.remarks.append(finding(message, place, hint, warning=True))

    def qualified(self, what: str) -> tuple[str, ...]:
        """``a::b::c``: its names."""
        names = [self.name(what)]
        while self.accept("::"):
            names.append(self.name(what))
        return tuple(names)

    def reference(self, what: str = "the name of a classifier") -> Reference:
        """``package::type.implementation``."""
        place = self.place
        *package, name = self.qualified(what)
        if self.accept("."):
            name = f"{name}.{self.name('the name of an implementation')}"
        return Reference("::".join(package), name, place)

    def path(self, what: str = "a name") -> Path:
        """``a.b[2].c``, ``a[1..2]``."""
        parts = [self._element(what)]
        while self.accept("."):
            parts.append(self._element(what))
        return tuple(parts)

    def _element(self, what: str) -> str:
        """A name with its indices, each a number or a range: ``x[2]``, ``x[1..3][2]``."""
        name = self.name(what)
        while self.sees("[") and self.ahead().kind == "number":
            self.expect("[")
            index = self.take().text
            if self.accept(".."):
                if self.token.kind != "number":
                    self.fail("the last index")
                index = f"{index}..{self.take().text}"
            self.expect("]", '"]"')
            name = f"{name}[{index}]"
        return name

    def names(self, what: str) -> tuple[str, ...]:
        """``(a, b)``."""
        self.expect("(")
        names = [self.name(what)]
        while self.accept(","):
            names.append(self.name(what))
        self.expect(")", 'a comma or ")"')
        return tuple(names)

    def skip(self, *ends: str) -> None:
        """Move on to one of these tokens, past what is in brackets; fails where there is none.

        For parts of AADL that are not followed, such as annexes in a feature.
        """
        start, depth = self.place, 0
        while depth or self.token.key not in ends:
            token = self.take()
            depth += token.key in ("(", "[", "{")
            depth -= token.key in (")", "]", "}") and depth > 0
            if token.kind == "end":
                wanted = " or ".join(f'"{end}"' for end in ends)
                self.fail(wanted, f"of what begins at {start.line}:{start.column}")


def _brief(text: str) -> str:
    line = text.partition("\n")[0]
    return line if len(line) <= 40 and line == text else f"{line[:40]}…"
