"""A launch file as a tree, whatever language it is written in, and the XML and YAML front ends that make it.

The tree is the one of launch's own front ends (the package launch_xml, launch_yaml): an action has a kind (``node``,
``group``), texts by name, and actions inside. Texts have substitutions such as ``$(var name)`` in them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dse.importers.allowance import at, spend
from dse.importers.ros2.launch.substitutions import Context
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue
from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, read_text
from dse.support.files.xml import walk

MOST_BYTES = 1_000_000
DEEPEST = 60
WHAT = "a launch file"
PIECES = 10
"""The share of the allowance that a part of a launch file takes."""


@dataclass
class Entity:
    """An action of a launch file, or a part of one: `texts` by attribute, `children` in their order.

    `later` gives what is in it when it is come to (a function of a Python file that is called then).
    """

    kind: str
    line: int
    texts: dict[str, str] = field(default_factory=dict)
    children: list[Entity] = field(default_factory=list)
    later: Callable[[Context], list[Entity]] | None = None

    def __post_init__(self) -> None:
        """Count it."""
        spend(PIECES)

    def text(self, *names: str) -> str:
        """The first of the texts that is there; "" where none is."""
        return next((self.texts[name] for name in names if name in self.texts), "")

    def of(self, *kinds: str) -> Iterator[Entity]:
        """The parts of a kind."""
        return (item for item in self.children if item.kind in kinds)


def problem(path: Path, message: str, line: int = 1, column: int = 0, hint: str = "") -> ProblemError:
    """A mistake of a launch file.

    One `ProblemError` with one diagnostic; `hint` says what would be right.
    """
    return ProblemError([Diagnostic(message, "", str(path), line, column, hint)])


def text_of(path: Path) -> str:
    """The text of a launch file.

    Raises
    ------
    ProblemError
        when it is none.
    """
    try:
        return read_text(path, MOST_BYTES, WHAT)
    except UnreadableFileError as error:
        raise problem(path, error.reason) from None


def read_xml(path: Path) -> Entity:
    """The actions of an XML launch file.

    Raises
    ------
    ProblemError
        when it is no launch file.
    """
    top = Entity("", 0)
    open_ = [top]

    def start(name: str, attributes: Mapping[str, str], line: int) -> None:
        with at(path, line):
            item = Entity(name.replace("-", "_"), line, dict(attributes))
        open_[-1].children.append(item)
        open_.append(item)

    def end(*_: object) -> None:
        open_.pop()

    walk(path, text_of(path), start, end, DEEPEST)
    [root] = top.children
    if root.kind != "launch":
        raise problem(path, f"expected <launch>, got <{root.kind[:40]}>", root.line)
    return root


def read_yaml(path: Path) -> Entity:
    """The actions of a YAML launch file. Errors as for `read_xml`.

    An `Entity` whose children are the actions, each with its line.
    """
    file = LocatedFile(path, WHAT)
    top = file.root["launch"]
    if not isinstance(top.data, list):
        raise problem(path, "expected `launch:` and a list of actions", top.line)
    with at(path, top.line):
        return Entity("launch", top.line, {}, [part for item in top for part in _actions(item)])


def _actions(item: LocatedValue) -> Iterator[Entity]:
    """An item of a list: actions by their kind."""
    for kind, body in (item.data if isinstance(item.data, dict) else {}).items():
        yield _entity(kind.replace("-", "_"), body)


def _entity(kind: str, body: LocatedValue) -> Entity:
    entity = Entity(kind, body.line)
    if isinstance(body.data, list):
        entity.children = [part for item in body for part in _actions(item)]
        return entity
    if isinstance(body.data, str):
        entity.texts["value"] = body.data
        return entity
    for key, value in (body.data or {}).items():
        if isinstance(value.data, str):
            entity.texts[key] = value.data
        elif isinstance(value.data, dict):
            entity.children.append(_entity(key, value))
        elif isinstance(value.data, list) and all(isinstance(part.data, str) for part in value):
            entity.texts[key] = f"[{', '.join(part.text for part in value)}]"
        elif isinstance(value.data, list) and key in ("children", "actions"):
            entity.children += [part for item in value for part in _actions(item)]
        elif isinstance(value.data, list):
            entity.children += [_entity(key, item) for item in value]
    return entity
