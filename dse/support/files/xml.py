"""XML: its text in the encoding that it states, and its elements one after the other, with their lines."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Mapping
from typing import TypeAlias
from xml.parsers import expat

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.foreign import reading
from dse.support.files.guard import PathLike

DEEPEST = 200
BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
_STATED = re.compile(rb"""<\?xml\s[^>]{0,200}?\bencoding\s*=\s*["']([\w.:-]{1,40})["']""")
Start: TypeAlias = Callable[[str, Mapping[str, str], int], None]
"""The function for the beginning of an element: its name, its attributes, its line."""


End: TypeAlias = Callable[[str, str, int], None]
"""The function for the end of an element: its name, the last characters in it, the line of its end."""
TEXT_LENGTH = 100
"""The number of characters of an element that are kept, the last ones: it has a number, or nobody asks."""


def xml_text(path: PathLike, data: bytes) -> str:
    """The text of an XML file, in the encoding of its byte order mark, the one that it states, or else UTF-8.

    Whoever parses the text need not know the encoding: expat refuses those of several bytes, and Python has them.

    Raises
    ------
    ProblemError
        when it is not in that encoding, or there is none of that name.
    """
    for mark, encoding in BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return _decoded(path, data[len(mark) :], encoding)
    match = _STATED.match(data)
    encoding = match[1].decode("ascii") if match else "utf-8"
    if match and not _is_one(encoding):
        text, hint = f"the encoding {encoding!r} cannot be read", "save it as UTF-8"
        raise ProblemError([Diagnostic(text, file=str(path), line=1, hint=hint)])
    return _decoded(path, data, encoding)


def _is_one(encoding: str) -> bool:
    """Whether it is an encoding in which the declaration that states it can be read."""
    try:
        return b"<?xml".decode(encoding) == "<?xml"
    except (LookupError, UnicodeError):
        return False


def _decoded(path: PathLike, data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeError as error:
        line = data.count(b"\n", 0, getattr(error, "start", 0)) + 1
        raise ProblemError([Diagnostic(f"the file is not {encoding} text", file=str(path), line=line)]) from None


def walk(path: PathLike, text: str, start: Start, end: End | None = None, deepest: int = DEEPEST) -> None:
    """Go through the elements of an XML document in their order.

    Raises
    ------
    ProblemError
        when it is no XML, has a document type (which may expand without end), or is nested deeper than `deepest`.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    texts: list[str] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        if len(texts) >= deepest:
            raise _mistake(path, f"more than {deepest} levels", parser.CurrentLineNumber)
        texts.append("")
        start(name, attributes, parser.CurrentLineNumber)

    def said(data: str) -> None:
        texts[-1] = (texts[-1] + data.strip())[-TEXT_LENGTH:]

    def finish(name: str) -> None:
        text = texts.pop()
        if end is not None:
            end(name, text, parser.CurrentLineNumber)

    def refuse(*_: object) -> None:
        raise _mistake(path, "a document type is not expected here", parser.CurrentLineNumber)

    parser.StartElementHandler, parser.EndElementHandler = begin, finish
    parser.StartDoctypeDeclHandler = refuse
    if end is not None:
        parser.CharacterDataHandler = said
    with reading(path, "not XML"):
        parser.Parse(text, True)


def _mistake(path: PathLike, message: str, line: int) -> ProblemError:
    return ProblemError([Diagnostic(message, file=str(path), line=line)])
