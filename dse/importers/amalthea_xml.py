"""The XML of Amalthea models as a tree of elements, with what they refer to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from dse.importers.allowance import spend
from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, read_bytes
from dse.support.files.xml import walk, xml_text

MOST_BYTES = 64_000_000


@dataclass
class Element:
    """An element of the file: its tag, its type (of several that stand under one tag), its attributes, its parts.

    Prefixes of tags and attributes are dropped; `kind` comes from ``xsi:type`` and is empty without one.
    """

    tag: str
    kind: str
    attributes: Mapping[str, str]
    line: int
    parts: list[Element] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its name, as others refer to it."""
        return self.attributes.get("name", "")

    def of(self, *tags: str) -> Iterator[Element]:
        """The parts with one of these tags."""
        return (item for item in self.parts if item.tag in tags)

    def all(self) -> Iterator[Element]:
        """The element and all elements inside it, in the order of the file.

        Depth-first; each element uses up a piece of the allowance.
        """
        waiting = [self]
        while waiting:
            item = waiting.pop()
            spend()
            yield item
            waiting += reversed(item.parts)

    def refers(self, attribute: str) -> list[str]:
        """The names of what an attribute refers to: ``A?type=Task B?type=Task``, or parts with an ``href``.

        Names are unquoted; kinds behind ``?`` are dropped.
        """
        texts = self.attributes.get(attribute, "").split()
        texts += [item.attributes["href"] for item in self.of(attribute) if "href" in item.attributes]
        return [unquote(text.rpartition("#")[2].partition("?")[0]) for text in texts]


def tree(path: Path) -> Element:
    """The elements of a file, from its ``am:Amalthea`` on.

    Raises
    ------
    ProblemError
        when the file cannot be read, or is no Amalthea model.
    """
    try:
        text = xml_text(path, read_bytes(path, MOST_BYTES, "an Amalthea model"))
    except UnreadableFileError as error:
        raise ProblemError([Diagnostic(error.reason, file=str(path))]) from None
    top = Element("", "", {}, 0)
    open_ = [top]

    def start(tag: str, attributes: Mapping[str, str], line: int) -> None:
        spend()
        plain = {key.rpartition(":")[2]: value for key, value in attributes.items()}
        kind = attributes.get("xsi:type", "").rpartition(":")[2]
        item = Element(tag.rpartition(":")[2], kind, plain, line)
        open_[-1].parts.append(item)
        open_.append(item)

    def end(tag: str, said: str, line: int) -> None:
        open_.pop()

    walk(path, text, start, end)
    [root] = top.parts
    if root.tag != "Amalthea":
        raise ProblemError(
            [Diagnostic(f"expected <am:Amalthea>, got <{root.tag[:40]}>", file=str(path), line=root.line)]
        )
    return root
