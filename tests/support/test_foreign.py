"""Errors of libraries become mistakes with a place; those of our own functions stay what they are."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.parsers import expat

import pytest
import yaml

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.foreign import reading
from dse.support.files.xml import walk, xml_text
from dse.support.timelimit import OutOfTime

PATH = Path("some.file")


def told(work: Callable[[], Any], **more: Any) -> str:
    with pytest.raises(ProblemError) as caught, reading(PATH, "no such thing", **more):
        work()
    return str(caught.value)


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda: struct.unpack("<I", b"x"), "some.file: no such thing: unpack requires a buffer of 4 bytes (is it cut"),
        (lambda: dict[str, int]()["topic"], "some.file: no such thing: KeyError: 'topic' (is it"),
        (lambda: [].pop(), "some.file: no such thing: IndexError: pop from empty list (is"),
        (lambda: yaml.safe_load("a: [1,\n b: }"), "some.file:2:5: no such thing: expected the node content, but found"),
        (lambda: expat.ParserCreate().Parse("<a>\n <b", True), "some.file:2:2: no such thing: unclosed token (is it"),
        (lambda: int("9" * 5000), "some.file: no such thing: it has a number of too many digits (is it cut off?)"),
        (lambda: bytes(10**18), "some.file: no such thing: it takes more memory than there is (is it cut off?)"),
        (
            lambda: Path("/no/such/file").read_text(encoding="utf-8"),
            "some.file: no such thing: No such file or directory (is it cut off?)",
        ),
    ],
)
def test_what_a_library_raises_is_told_with_its_place(work: Callable[[], Any], message: str) -> None:
    assert told(work).startswith(message)


def test_words_without_a_place_may_name_something_that_has_one() -> None:
    def fail() -> None:
        raise RuntimeError("message Speed is odd")

    assert told(fail, hint="", place=lambda words: (words.count("Speed"), 7)) == (
        "some.file:1:7: no such thing: message Speed is odd"
    )


def test_our_own_errors_pass() -> None:
    mistake = ProblemError([Diagnostic("ours")])
    for error in (mistake, OutOfTime(), KeyboardInterrupt()):
        with pytest.raises(type(error)) as caught, reading(PATH, "no such thing"):
            raise error
        assert caught.value is error


def test_a_fault_of_a_function_of_dse_that_a_library_calls_is_none_of_the_file() -> None:
    namespace: dict[str, Any] = {"__name__": "dse.made_up"}
    exec("def broken(name, attributes, line):\n    return attributes['x']", namespace)
    with pytest.raises(KeyError):
        walk(PATH, "<a/>", namespace["broken"])


# --- XML


def elements(data: bytes) -> list[tuple[str, str, int]]:
    found: list[tuple[str, str, int]] = []
    walk(
        PATH,
        xml_text(PATH, data),
        lambda name, attributes, line: None,
        lambda name, text, line: found.append((name, text, line)),
    )
    return found


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1", "shift_jis", "gb18030", "utf-8-sig"])
def test_every_encoding_that_is_stated_is_read(encoding: str) -> None:
    """Also those of several bytes, which expat refuses."""
    word = "größer" if encoding == "iso-8859-1" else "日本"
    text = f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>\n<a>\n<b>{word}</b></a>'
    assert elements(text.encode(encoding)) == [("b", word, 3), ("a", "", 3)]


@pytest.mark.parametrize("encoding", ["x-unknown", "hex", "utf-16", "undefined", "."])
def test_encodings_that_there_are_not(encoding: str) -> None:
    with pytest.raises(ProblemError, match=r"some.file:1: the encoding '.*' cannot be read \(save it as UTF-8\)"):
        elements(f'<?xml version="1.0" encoding="{encoding}"?><a/>'.encode())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"<a>\n<b></a>", "some.file:2:6: not XML: mismatched tag"),
        (b"", "some.file:1:1: not XML: no element found"),
        (b"<a>\n\xff</a>", "some.file:2: the file is not utf-8 text"),
        (b"<a>\n\x00</a>", "some.file:2:1: not XML: not well-formed (invalid token)"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "some.file:1: a document type is not expected here"),
        (b"<a>" * 100_000, "some.file:1: more than 200 levels"),
    ],
)
def test_xml_that_is_none(data: bytes, message: str) -> None:
    with pytest.raises(ProblemError) as caught:
        elements(data)
    assert str(caught.value).startswith(message)
