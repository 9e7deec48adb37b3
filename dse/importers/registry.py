"""Which formats `dse import` reads, and what an importer is.

A further format is a module with one function ``read`` and one line in `IMPORTERS`, or an entry point
``dse.importers`` of another package that leads to an `Importer`; CONTRIBUTING.md shows it step by step. Everything
else (the command, its options, the keyword arguments of `dse.import_file`, the texts of help) follows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias

from dse.support.errors import Diagnostic, ProblemError, UsageError
from dse.support.files.reading import UnreadableFileError, beginning, obstacle
from dse.support.plugins import plugged
from dse.support.timelimit import in_time

Key: TypeAlias = tuple[str | int, ...]
"""Keys and positions that lead to a value of a problem file, such as ``("threads", "nav", "period")``."""
STORED_PORTS = ("data", "data_access")
"""Kinds of ports at which data lie until their reader runs: nothing that comes there dispatches it."""


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a file; line and column count from 1."""

    file: str
    line: int
    column: int


@dataclass(frozen=True)
class Imported:
    """The document that an importer made from a file, with remarks.

    `document` is plain data with the keys of a problem file (or of a file to include); `remarks` say what was not
    understood or left out, each with its place; `places` tell where a value comes from, by its path in the document.
    `entities` are what threads are in ROS, such as ``/cam@Timer(10000000)``, by which other files speak of them.
    `made_up` are names that the file does not have: what they name is not what another file has under such a name.
    `aliases` lead from the names that threads have in other files to those in `document`. `publishers` are the
    callbacks that publish a topic of a node, by node and topic, as they were seen. `is_measured`: it was seen while the
    system ran, which counts more than what a description says; `is_own`: it is a problem file, which counts most.
    """

    document: Mapping[str, Any]
    remarks: tuple[Diagnostic, ...] = ()
    places: Mapping[Key, Place] = field(default_factory=dict)
    entities: Mapping[str, str] = field(default_factory=dict)
    made_up: frozenset[str] = frozenset()
    aliases: Mapping[str, str] = field(default_factory=dict)
    publishers: Mapping[tuple[str, str], tuple[str, ...]] = field(default_factory=dict)
    is_measured: bool = False
    is_own: bool = False


Read: TypeAlias = Callable[[Path, Mapping[str, Any]], Imported]
"""A file (or folder) and the options given, by name. Raises `ProblemError` with located findings."""


@dataclass(frozen=True)
class Importer:
    """One format.

    `home` is the module whose `function` (see `Read`) reads it, imported when it is used. `options` has a help
    text for each option of the command line (``--name``) and keyword of `dse.import_file`. `is_problem`: its documents
    are whole problems, so that every command takes such a file where it takes a problem file. `telltale`, where several
    formats share a suffix, is a pattern that only files of this one have; `sure` are suffixes that need none; `inside`
    is the name of a file that only its folders have.
    """

    name: str
    suffixes: tuple[str, ...]
    what: str
    home: str
    options: Mapping[str, str] = field(default_factory=dict)
    is_problem: bool = False
    telltale: str = ""
    inside: str = ""
    sure: tuple[str, ...] = ()
    function: str = "read"

    @property
    def read(self) -> Read:
        """The function that reads it."""
        function: Read = getattr(import_module(self.home), self.function)
        return function


YAML = (".yaml", ".yml")
OF_ROS2 = {
    "cores": "number of cores of the computer; default: as many as callbacks are pinned to, or as the trace has CPUs.",
    "rate": "rate of topics that nothing in the file publishes, such as 10 Hz.",
}
OF_LAUNCH = {
    "timers": "parameters that state the rate or period of timers, with their unit: 'fps [Hz], /cam:grab.period_ms "
    "[ms]'; default: those of well-known names.",
    "arguments": "launch arguments, as ros2 launch takes them: 'name:=value, other:=value'.",
    "workspace": "folder of the packages to which launch files refer; default: the folder around the package of FILE.",
}
IMPORTERS: tuple[Importer, ...] = (
    Importer(
        "aadl",
        (".aadl",),
        "AADL models: an .aadl file with those around it that it needs, or a folder of them",
        "dse.importers.aadl.reading",
        {
            "root": "the system implementation to instantiate, package::type.implementation.",
            "mode": "the mode of the system (of components by their path: sw.m2; several with commas).",
            "library": "folder with packages that the model imports (several with commas).",
        },
        is_problem=True,
    ),
    Importer(
        "can",
        (".dbc", ".kcd", ".sym", ".arxml"),
        "CAN databases: DBC, KCD, SYM, ARXML",
        "dse.importers.can",
        {
            "bandwidth": "bit rate of the buses, such as 500 kbit/s, where the file does not state it.",
            "data-bandwidth": "bit rate of the data of CAN FD, where the file does not state it.",
            "cycle": "cycle time of messages that state none: 100 ms for all, 'NAME=20 ms, DIAG_*=1 s' for some, "
            "none leaves them out.",
            "to": "the receiver at which messages with several receivers end.",
        },
    ),
    Importer(
        "amalthea",
        (".amxmi",),
        "Amalthea models (APP4MC; the XML of the WATERS challenges)",
        "dse.importers.amalthea",
        {"frequency": "frequency of the processing units, such as 200 MHz, where the model does not state it."},
    ),
    Importer(
        "caret",
        YAML,
        "architecture files of CARET (ROS 2)",
        "dse.importers.ros2.caret",
        OF_ROS2,
        telltale="^named_paths:",
    ),
    Importer(
        "cie",
        YAML,
        "configurations and templates of the callback-isolated executor (ROS 2)",
        "dse.importers.ros2.cie",
        OF_ROS2,
        telltale="^callback_groups:",
    ),
    Importer(
        "launch",
        (".xml", ".py", *YAML),
        "launch files (XML, YAML, Python), as far as they are static (ROS 2)",
        "dse.importers.ros2.launch.reading",
        {**OF_ROS2, **OF_LAUNCH},
        telltale=r"^launch\s*:|<launch\b|def generate_launch_description\b",
        sure=tuple(f"{mark}launch{end}" for mark in "._" for end in (".xml", ".py", *YAML, "")),
    ),
    Importer(
        "parameters",
        YAML,
        "parameter files: rates and periods of timers (ROS 2)",
        "dse.importers.ros2.launch.reading",
        {**OF_ROS2, "timers": OF_LAUNCH["timers"]},
        telltale="ros__parameters",
        function="read_parameters",
    ),
    Importer(
        "autoware",
        YAML,
        "design files of Autoware: a system, module or node with those that it needs (ROS 2)",
        "dse.importers.autoware.reading",
        {
            **OF_ROS2,
            "mode": "mode of the system; default: its default mode.",
            "workspace": "folder with the design files that FILE needs; default: around its package, or `design`.",
        },
        telltale=r"^autoware_system_design_format\s*:",
        sure=tuple(f".{kind}.yaml" for kind in ("node", "module", "system")),
    ),
    Importer(
        "trace",
        (".txt",),
        "traces of ros2_tracing: the folder of a CTF trace, or what babeltrace2 prints of it (ROS 2)",
        "dse.importers.ros2.trace",
        OF_ROS2,
        telltale=r"^\[",
        inside="metadata",
    ),
)


MOST_LOOKED_AT = 4_000_000
"""The number of characters of a file that are looked at for what tells its format."""
NODES = "nodes"
"""The option by which parameter files learn which nodes the files named before them have."""
PUBLISHERS = "publishers"
"""The option by which descriptions learn which callbacks publish the topics of a node: `Imported.publishers`."""
CHOICES = "choices"
"""The option of importers of whole problems that names what may be chosen: for each section, types by component."""


def importers() -> tuple[Importer, ...]:
    """The formats of dse, and those of other packages: what entry points ``dse.importers`` lead to.

    Raises
    ------
    UsageError
        when one of these is no `Importer`, or has the name of another.
    """
    every = list(IMPORTERS)
    for name, item in plugged("dse.importers"):
        if not isinstance(item, Importer):
            raise UsageError(f"plug-in {name!r}: expected a dse.importers.registry.Importer; got {item!r}")
        if item.name in {other.name for other in every}:
            raise UsageError(f"plug-in {name!r}: there is a format {item.name!r} already")
        every.append(item)
    return tuple(every)


def is_model(path: Path) -> bool:
    """Whether every command takes this file (or folder) where it takes a problem file.

    True for formats whose importer makes a whole problem, such as AADL.
    """
    if path.is_dir():
        return any(found_below(path, "*.aadl"))
    importer = importer_of(path)
    return importer is not None and importer.is_problem


def found_below(folder: Path, pattern: str) -> Iterator[Path]:
    """The files and folders below a folder whose name matches a pattern; symbolic links are not followed.

    `pattern` is a shell pattern; names in alphabetical order within each folder.
    """
    for here, folders, files in in_time(os.walk(folder)):
        yield from (Path(here) / name for name in sorted([*folders, *files]) if fnmatchcase(name, pattern))


def importer_of(path: Path, form: str | None = None) -> Importer | None:
    """The importer of that name, or else of the file's suffix; None where none has it.

    Raises
    ------
    UsageError
        when there is no format of that name.
    """
    if form is None and path.is_dir():
        if is_model(path):
            return IMPORTERS[0]
        return next((item for item in IMPORTERS if item.inside and any(found_below(path, item.inside))), IMPORTERS[0])
    sure = next((item for item in IMPORTERS if form is None and _is_called_so(item, path)), None)
    own = sure or next((item for item in IMPORTERS if _is_of(item, path, form)), None)
    if own is not None or (form is None and path.name.lower().endswith(YAML)):
        return own  # other packages are not asked about every problem file
    importer = next((item for item in importers()[len(IMPORTERS) :] if _is_of(item, path, form)), None)
    if importer is None and form is not None:
        raise UsageError(f"there is no format {form!r}: there are {', '.join(item.name for item in importers())}")
    return importer


def _is_of(importer: Importer, path: Path, form: str | None) -> bool:
    """Whether a file is read by an importer: that of the name, or else of its suffix."""
    if form is not None:
        return importer.name == form
    is_its = path.name.lower().endswith(importer.suffixes) and _tells(path, importer.telltale)
    return is_its or _is_called_so(importer, path)


def _is_called_so(importer: Importer, path: Path) -> bool:
    """Whether the name of a file alone tells that it is of a format."""
    return path.name.lower().endswith(importer.sure or ("\n",))


def _tells(path: Path, pattern: str) -> bool:
    """Whether a file has what tells its format."""
    if not pattern:
        return True
    try:
        text = beginning(path, MOST_LOOKED_AT).decode("utf-8", "replace")
    except UnreadableFileError:
        return False
    return re.search(pattern, text, re.MULTILINE) is not None


def _check_content(path: Path) -> None:
    """Stop where formats have this suffix, but the file has nothing of them.

    Raises
    ------
    ProblemError
        which says what such files are.
    """
    near = [item for item in IMPORTERS if path.name.lower().endswith(item.suffixes)]
    if not near or obstacle(path) is not None or path.is_dir():
        return
    expected = "; ".join(item.what for item in near)
    words = "the file is empty" if path.stat().st_size == 0 else "nothing in it tells what it is"
    names = ", ".join(item.name for item in near)
    raise ProblemError([Diagnostic(f"{words}: expected {expected}", "", str(path), 1, hint=f"or --format: {names}")])


def read_foreign(path: Path, form: str | None = None, options: Mapping[str, Any] | None = None) -> Imported:
    """Import a file of another format as a document.

    Raises
    ------
    UsageError
        when no importer reads such files, or it has no such option.
    ProblemError
        when the file is wrong, with every finding.
    """
    importer = importer_of(path, form)
    if importer is None:
        _check_content(path)
        known = "; ".join(f"{item.name} ({item.what})" for item in importers())
        raise UsageError(f"{path}: its name does not say which format it has; name it with --format: {known}")
    stated = dict(options or {})
    for name in stated:
        if name not in importer.options and name not in (CHOICES, NODES, PUBLISHERS):
            what = ", ".join(f"--{item}" for item in importer.options) or "none"
            raise UsageError(f"--{name}: {importer.name} has no such option; it has {what}")
    if not path.is_dir() and (missing := obstacle(path)) is not None:
        raise UsageError(f"{path}: {missing}")
    return importer.read(path, stated)
