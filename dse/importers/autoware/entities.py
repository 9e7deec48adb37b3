"""Design files by the names of what they define, with `base`, `remove`, `override` and the mode of a system."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dse.importers.allowance import spend
from dse.importers.registry import found_below
from dse.importers.ros2.packages import workspace_of
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue
from dse.support.errors import ProblemError, UsageError

WHAT = "a design file of Autoware"
KINDS = ("node", "module", "system")
FORMAT = "autoware_system_design_format"
KEYED = ("instances", "components", "subscribers", "publishers", "processes", "node_groups", "modes")
"""Lists whose entries have names: one of an `override` takes the place of another of its name."""
OTHER_NAMES = {"inputs": "subscribers", "outputs": "publishers", "instances": "components"}
"""Older files call ports inputs and outputs; the instances of a module are the components of a system."""
DEEPEST = 20
"""The greatest number of levels of entities that are based on others, or hold others."""


@dataclass(frozen=True)
class Part:
    """A value with its file."""

    value: LocatedValue
    file: LocatedFile

    def remark(self, message: str, hint: str = "") -> None:
        """Note what is left out, or was assumed, at the line of the value."""
        self.file.remark(self.value, message, hint)

    def text(self, key: str) -> str:
        """The text under a key; "" where there is none."""
        return self.value[key].text


@dataclass
class Entity:
    """A node, module or system: the entries of its lists, with what it is based on."""

    name: str
    kind: str
    file: LocatedFile
    lists: dict[str, list[Part]] = field(default_factory=dict)
    modes: dict[str, Part] = field(default_factory=dict)

    def entries(self, key: str) -> list[Part]:
        """The entries of a list."""
        return self.lists.get(OTHER_NAMES.get(key, key), [])

    def apply(self, part: Part) -> None:
        """Take away what `remove` names, then put in what `override` has."""
        self._remove(Part(part.value["remove"], part.file))
        self.add(Part(part.value["override"], part.file))

    def add(self, part: Part) -> None:
        """Put in lists: what has the name of an entry takes its place, everything else comes behind."""
        for key in (*KEYED, "inputs", "outputs", "connections"):
            entries = self.lists.setdefault(OTHER_NAMES.get(key, key), [])
            for item in part.value[key]:
                spend()
                fresh, name = Part(item, part.file), item["name"].text
                place = next((at for at, old in enumerate(entries) if name and old.text("name") == name), None)
                if place is None or key == "connections":
                    entries.append(fresh)
                else:
                    entries[place] = fresh

    def _remove(self, part: Part) -> None:
        for key in (*KEYED, "inputs", "outputs"):
            gone = {item["name"].text or item.text for item in part.value[key]}
            list_name = OTHER_NAMES.get(key, key)
            if not gone:
                continue
            self.lists[list_name] = [one for one in self.entries(key) if one.text("name") not in gone]
            if list_name == "components":
                ends = [(one, ends_of(one.value)) for one in self.entries("connections")]
                kept = [one for one, names in ends if not any(end.split(".")[0] in gone for end in names)]
                self.lists["connections"] = kept
        cut = {frozenset(ends_of(item)) for item in part.value["connections"]}
        self.lists["connections"] = [
            one for one in self.entries("connections") if frozenset(ends_of(one.value)) not in cut
        ]


def ends_of(connection: LocatedValue) -> tuple[str, ...]:
    """The two ends of a connection: a list of two, or the values of a mapping."""
    ends = connection.data
    items = ends.values() if isinstance(ends, dict) else list(connection)
    return tuple(item.text for item in items)


class Library:
    """The design files of a workspace, each read once, when something names what it defines."""

    def __init__(self, path: Path, workspace: str | None) -> None:
        """Take the file to import, and the folder to search for other files, if one is stated.

        Raises
        ------
        UsageError
            when that is no folder.
        """
        self.path = path
        if workspace is not None and not Path(workspace).is_dir():
            raise UsageError(f"--workspace {workspace}: there is no such folder")
        design = next((folder for folder in path.parents if folder.name == "design"), path.parent)
        self.root = Path(workspace) if workspace is not None else workspace_of(path) or design
        self.files: list[LocatedFile] = []
        self._paths: dict[str, Path] | None = None
        self._known: dict[str, Entity | None] = {}

    def main(self) -> Entity:
        """The entity that the imported file defines.

        Raises
        ------
        ProblemError
            when it is no design file.
        """
        file = self._open(self.path)
        name = file.root["name"].text or self.path.name.removesuffix(self.path.suffix)
        entity = self._entity(name, file, 0)
        if entity.kind not in KINDS:
            words = f"expected the name of a node, module or system, such as Robot.system; got {name[:60]!r}"
            file.wrong(file.root["name"], words)
        file.check()
        return entity

    def named(self, name: str, place: Part, depth: int = 0) -> Entity | None:
        """The entity with a name; None, and a remark, where no file defines it or the file cannot be read."""
        if name not in self._known:
            self._known[name] = None  # until it is read: nothing is based on itself
            self._known[name] = self._read(name, place, depth)
        elif self._known[name] is None:
            place.remark(f"{name[:80]} is left out: it cannot be read, or is based on itself")
        return self._known[name]

    def _read(self, name: str, place: Part, depth: int) -> Entity | None:
        path = self._path_of(name)
        if path is None or depth > DEEPEST:
            words = "it is based on too many others" if path is not None else f"there is no {name[:80]}.yaml"
            place.remark(f"{name[:80]} is left out: {words} below {self.root.name or self.root}", "or give --workspace")
            return None
        try:
            return self._entity(name, self._open(path), depth)
        except ProblemError as error:
            place.remark(f"{name[:80]} is left out: {error.diagnostics[0].message}")
            return None

    def _open(self, path: Path) -> LocatedFile:
        file = LocatedFile(path, WHAT)
        self.files.append(file)
        if not file.root[FORMAT].text:
            file.wrong(file.root, f"expected `{FORMAT}`: this is no design file")
        file.check()
        return file

    def _entity(self, name: str, file: LocatedFile, depth: int) -> Entity:
        entity = Entity(name, name.rpartition(".")[2], file)
        whole = Part(file.root, file)
        base = whole.text("base")
        known = self.named(base, whole, depth + 1) if base else None
        if known is not None:
            entity.lists = {key: list(items) for key, items in known.lists.items()}
            entity.modes = dict(known.modes)
        entity.add(whole)
        entity.apply(whole)
        for item in entity.entries("modes"):
            for part in (whole, Part(file.root["override"], file)):
                own = part.value[item.text("name")]
                if isinstance(own.data, dict):
                    entity.modes[item.text("name")] = Part(own, file)
        return entity

    def _path_of(self, name: str) -> Path | None:
        if self._paths is None:
            self._paths = {}
            for kind in KINDS:
                for path in found_below(self.root, f"*.{kind}.yaml"):
                    spend()
                    self._paths.setdefault(path.name, path)
        return self._paths.get(f"{name}.yaml")


def in_mode(entity: Entity, stated: str | None) -> str:
    """Put a system into a mode: the stated one, else the default one; its name.

    Raises
    ------
    UsageError
        when there is no such mode.
    """
    modes: Mapping[str, Part] = {item.text("name"): item for item in entity.entries("modes")}
    if stated is not None and stated not in modes:
        raise UsageError(f"--mode {stated}: {entity.name} has {', '.join(modes) or 'no modes'}")
    default = next(_default_modes(modes), "")
    name = default if stated is None else stated
    if name in entity.modes:
        entity.apply(entity.modes[name])
    return name


def _default_modes(modes: Mapping[str, Part]) -> Iterator[str]:
    for name, item in modes.items():
        if item.text("default").lower() == "true":
            yield name
    yield from modes
