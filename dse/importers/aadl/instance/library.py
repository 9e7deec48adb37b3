"""The files of a model: which are read, and what a name in one of them means."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dse.importers.aadl.syntax.parser import parse
from dse.importers.aadl.syntax.predeclared import BASE_TYPES, PREDECLARED
from dse.importers.aadl.syntax.tokens import finding
from dse.importers.aadl.syntax.tree import Classifier, Package, PropertySet, Reference
from dse.importers.registry import Place, found_below
from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, beginning, read_bytes

MAX_BYTES = 20_000_000
MAX_FILES = 3000
"""The greatest number of files of a folder that are looked at."""
SUFFIX = ".aadl"
MOST_NAMES = 5
"""The most names that a remark lists behind the first."""
_DECLARES = re.compile(r"^[ \t]*(?:package[ \t]+([\w:]+)|property[ \t]+set[ \t]+(\w+)[ \t\r\n]+is)", re.M | re.I)


@dataclass
class Library:
    """Packages and property sets by key; `findings` are mistakes, `main` is what was named."""

    packages: dict[str, Package] = field(default_factory=dict)
    sets: dict[str, PropertySet] = field(default_factory=dict)
    findings: list[Diagnostic] = field(default_factory=list)
    main: list[Package] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    _told: set[tuple[str, str]] = field(default_factory=set)
    _doubts: dict[tuple[str, str], list[tuple[str, Place]]] = field(default_factory=dict)

    def add(self, path: Path, text: str, file: str) -> list[str]:
        """Read one file; returns the names of packages and property sets that it asks for."""
        parsed = parse(text, file)
        self.files.append(path)
        self.findings += parsed.findings
        for item in parsed.remarks:
            self.remark(item.message, Place(item.file, item.line, item.column), item.hint)
        for package in parsed.unit.packages:
            other = self.packages.setdefault(package.name.lower(), package)
            if other is not package:
                first = f"{other.place.file}:{other.place.line}"
                self.findings.append(
                    finding(f"package {package.name} is declared twice, first in {first}", package.place)
                )
        for property_set in parsed.unit.sets:
            self.sets.setdefault(property_set.name.lower(), property_set)
        return [name for package in parsed.unit.packages for name in _asked(package)]

    def remark(self, message: str, place: Place, hint: str = "", *, about: str = "") -> None:
        """A doubt; what it is `about` is written in place of ``{}``, and told with others of which the same holds."""
        self._doubts.setdefault((message, hint), []).append((about, place))

    def remarks(self) -> list[Diagnostic]:
        """The doubts by place: one for each message, with the number of places, or of those that it is about.

        Warnings; equal remarks about several names are one.
        """
        remarks = []
        for (message, hint), doubt in self._doubts.items():
            names, places = dict.fromkeys(name for name, _ in doubt if name), {place for _, place in doubt}
            first, *more = names or [""]
            text = message.replace("{}", first) if first else message
            if more:
                listed = ", ".join(more[:MOST_NAMES]) + (", …" if len(more) > MOST_NAMES else "")
                text += f" (and {len(more)} more: {listed})"
            elif len(places) > 1:
                text += f" (at {len(places)} places, first here)"
            place = doubt[0][1] if names else min(places, key=lambda item: (item.file, item.line, item.column))
            remarks.append(finding(text, place, hint, warning=True))
        return sorted(remarks, key=lambda item: (item.file, item.line, item.column))

    def fail(self, message: str, place: Place, hint: str = "") -> None:
        """Report a mistake, once."""
        if (str(place), message) not in self._told:
            self._told.add((str(place), message))
            self.findings.append(finding(message, place, hint))

    def find(self, reference: Reference, package: str) -> Classifier | None:
        """The classifier that a reference in a package means, or None.

        Names are compared without regard to case; renames of the package are followed.
        """
        here = self.packages.get(package.lower())
        key = reference.name.lower()
        if reference.package:
            named = self._package(reference.package, here)
            return None if named is None else named.classifiers.get(key)
        if here is None:
            return None
        if key in here.classifiers:
            return here.classifiers[key]
        return next((classifier for classifier in self._renamed(here, key) if classifier is not None), None)

    def _package(self, name: str, here: Package | None) -> Package | None:
        aliases = [item for item in (here.renames if here else ()) if not item.name]
        for item in aliases:
            if item.alias.lower() == name.lower():
                return self.packages.get(item.package.lower())
        return self.packages.get(name.lower())

    def _renamed(self, here: Package, key: str) -> Iterator[Classifier | None]:
        stem, _, implementation = key.partition(".")
        for item in here.renames:
            there = self.packages.get(item.package.lower())
            if there is None or not item.name:
                continue
            if item.name.lower() == "all" and item.alias.lower() == "all":
                yield there.classifiers.get(key)
            elif item.alias.lower() == stem:
                name = item.name.lower()
                yield there.classifiers.get(f"{name}.{implementation}" if implementation else name)

    def fail_absent(self, reference: Reference, package: str) -> None:
        """A reference that leads nowhere, as a mistake."""
        here, hint = self.packages.get(package.lower()), ""
        message = f"there is no classifier {reference}"
        if reference.package and self._package(reference.package, here) is None:
            message = f"package {reference.package} is in none of the files that were read"
            hint = "--library FOLDER, or `library` in a file that decides, names where else to look"
        self.fail(message, reference.place, hint)


def _asked(package: Package) -> Iterable[str]:
    yield from (name for name, _ in package.withs)
    yield from (item.package for item in package.renames)


def load_library(path: Path, folders: Sequence[Path] = ()) -> Library:
    """A file with those around it that it needs, or every file of a folder; further ones are looked for in `folders`.

    Raises
    ------
    ProblemError
        when there is nothing to read, or a text is none.
    """
    library = Library()
    builtin = parse(BASE_TYPES, "Base_Types")
    library.packages.update({item.name.lower(): item for item in builtin.unit.packages})
    if path.is_dir():
        texts = _texts(_files(path))
        if not texts:
            raise ProblemError([Diagnostic(f"there is no file *{SUFFIX} in it", file=str(path))])
        wanted = [name for file, text in texts.items() for name in library.add(file, text, str(file))]
    else:
        wanted = library.add(path, _text(path), str(path))
    library.main = [item for item in library.packages.values() if item.name != "Base_Types"]
    if folders or not path.is_dir():
        _add_asked(library, path, folders, wanted)
    return library


def _add_asked(library: Library, path: Path, folders: Sequence[Path], wanted: list[str]) -> None:
    """The files around a model, and in folders of libraries, that declare what it asks for, and what those ask for."""
    where: dict[str, Path] | None = None
    while wanted:
        name = wanted.pop().lower()
        if name in library.packages or name in library.sets or name in PREDECLARED:
            continue
        if where is None:
            where = {}
            for files in ([] if path.is_dir() else [_around(path)], *([_files(folder)] for folder in folders)):
                for source in files:
                    where = {**_declared(source), **where}
        if name in where and where[name] not in library.files:
            file = where[name]
            wanted += library.add(file, _text(file), str(file))
    for package in list(library.packages.values()):
        for name, place in package.withs:
            if name.lower() not in {*library.packages, *library.sets, *PREDECLARED}:
                hint = "--library names a folder in which to look for it"
                library.remark(f"{name} is in none of the files around this one", place, hint)


def _around(path: Path) -> list[Path]:
    """The other files of the folder of a file, or of the one around that where it is one of packages alone."""
    folder = path.parent
    if folder.resolve().name.lower() in ("packages", "propertysets", "aadl", "model", "models"):
        folder = folder.parent if folder != Path() else Path("..")
    return [file for file in _files(folder) if file.resolve() != path.resolve()]


def _declared(files: Iterable[Path]) -> dict[str, Path]:
    """Which of some files declares which package or property set, the first first; that makes them no inputs."""
    declared: dict[str, Path] = {}
    for file in files:
        try:
            text = _decoded(beginning(file, MAX_BYTES))
        except UnreadableFileError as error:
            raise ProblemError([Diagnostic(error.reason, file=str(file))]) from None
        for names in _DECLARES.findall(text):
            for name in filter(None, names):
                declared.setdefault(name.lower(), file)
    return declared


def _files(folder: Path) -> list[Path]:
    files = []
    for file in found_below(folder, f"*{SUFFIX}"):
        if file.is_file():
            files.append(file)
        if len(files) > MAX_FILES:
            raise ProblemError([Diagnostic(f"more than {MAX_FILES} files *{SUFFIX} in it", file=str(folder))])
    return sorted(files)


def _texts(files: Iterable[Path]) -> dict[Path, str]:
    return {file: _text(file) for file in files}


def _text(path: Path) -> str:
    """The text of a file, which becomes an input."""
    try:
        return _decoded(read_bytes(path, MAX_BYTES, "a model"))
    except UnreadableFileError as error:
        raise ProblemError([Diagnostic(error.reason, file=str(path))]) from None


def _decoded(data: bytes) -> str:
    """UTF-8, else Latin-1, which older tools wrote comments in; names of AADL are ASCII."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
