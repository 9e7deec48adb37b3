"""`dse.import_file`: other formats to problem files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dse.importers.registry import (
    MOST_LOOKED_AT,
    NODES,
    PUBLISHERS,
    YAML,
    Imported,
    Importer,
    importer_of,
    read_foreign,
)
from dse.importers.ros2.matching import entities_of, node_of
from dse.importers.ros2.merging import merged
from dse.questions.verbs.import_times import TRACE, is_trace
from dse.spec.loading.load import load_spec
from dse.spec.loading.recognition import is_problem
from dse.spec.loading.writing import block_text
from dse.support import arguments
from dse.support.errors import Diagnostic, UsageError
from dse.support.files.reading import UnreadableFileError, beginning


@dataclass(frozen=True)
class ImportedFile:
    """The text of a problem file (or of a file to include), and what was left out or not understood on the way.

    Examples
    --------
    >>> ImportedFile("dse: 1").remarks
    ()
    """

    text: str
    remarks: tuple[Diagnostic, ...] = ()
    document: Mapping[str, Any] = field(default_factory=dict)
    """The file as plain data."""


@arguments.checked(path=arguments.paths, form=arguments.optional_text, times=arguments.paths, bags=arguments.paths)
def import_file(
    path: str | Path | Sequence[str | Path],
    form: str | None = None,
    times: Sequence[str | Path] = (),
    bags: Sequence[str | Path] = (),
    **options: str | None,
) -> ImportedFile:
    """A file of another format, or several that make one problem, as the text of a problem file.

    Parameters
    ----------
    path
        the file; for some formats a folder; or several files, of which those named first count where they differ.
        Problem files are among them what they are.
    form
        the name of the format; told by the file's suffix where it is left out.
    times
        measured execution times for the threads that the files have: CSV as `dse fit` reads them, or traces.
    bags
        recordings of ROS, for the sizes of topics and the rates of those that come from outside.
    options
        those of the formats; ``dse import --help`` lists them.

    Raises
    ------
    UsageError
        when no importer reads such files, or it has no such option.
    ProblemError
        when the file is wrong, with every finding.

    Examples
    --------
    >>> import pathlib
    >>> text = "package p public system s end s; system implementation s.i end s.i; end p;"
    >>> written = pathlib.Path("idle.aadl").write_text(text, encoding="utf-8")
    >>> print(import_file("idle.aadl").text.splitlines()[1])
    name: "p::s.i"
    """
    stated = {name: value for name, value in options.items() if value is not None}
    paths = [Path(item) for item in ([path] if isinstance(path, str | Path) else path)]
    if not paths:
        raise UsageError("no file is named")
    if form is not None and len(paths) > 1:
        raise UsageError("--format: of several files each one tells its format by itself")
    cores = {"cores": stated["cores"]} if "cores" in stated else {}
    traces = {Path(item): read_foreign(Path(item), TRACE, cores) for item in times if is_trace(Path(item))}
    imported = _several(paths, form, stated, traces)
    document, remarks = dict(imported.document), imported.remarks
    if times or bags:
        from dse.questions.verbs.import_times import with_bag, with_times

        if times:
            document, said = with_times(imported, times, traces)
            remarks += said
        for bag in bags:
            document, said = with_bag(document, Path(bag))
            remarks += said
    return ImportedFile(block_text(document), remarks, document)


def _several(
    paths: Sequence[Path], form: str | None, options: Mapping[str, Any], traces: Mapping[Path, Imported]
) -> Imported:
    """The merged content of all files; each option goes to the files whose format has it, traces inform all files."""
    importers = [None if _is_problem(path, form) else importer_of(path, form) for path in paths]
    known = {name for item in importers if item is not None for name in item.options}
    for name in options:
        if len(paths) > 1 and name not in known:
            raise UsageError(f"--{name}: none of these formats has such an option")
    late = [
        number for number, item in enumerate(importers) if number and item is not None and item.name == "parameters"
    ]
    order = [number for number in range(len(paths)) if number not in late]

    def own_options(importer: Importer | None) -> dict[str, Any]:
        return {
            key: value for key, value in options.items() if len(paths) == 1 or (importer and key in importer.options)
        }

    read_before = {
        number: read_foreign(paths[number], form, own_options(item))
        for number, item in enumerate(importers)
        if item is not None and item.name == TRACE
    }
    seen = {key: of for item in (*traces.values(), *read_before.values()) for key, of in item.publishers.items()}
    imported: Imported | None = None
    for number in (*order, *late):
        importer = importers[number]
        own = own_options(importer)
        if seen:
            own[PUBLISHERS] = seen
        if number in late and imported is not None:
            own[NODES] = _nodes(imported)
        is_own = importer is None and _is_problem(paths[number], form)
        if number in read_before:
            read = read_before[number]
        else:
            read = _problem(paths[number]) if is_own else read_foreign(paths[number], form, own)
        imported = read if imported is None else merged(imported, read)
    assert imported is not None
    return imported


def _nodes(imported: Imported) -> list[str]:
    """The nodes whose timers a parameter file may concern: those with timers, or of which nothing is known."""
    return list(dict.fromkeys(node_of(text) for text in imported.entities.values() if "@Subscription" not in text))


def _is_problem(path: Path, form: str | None) -> bool:
    """Whether it is a problem file."""
    if form is not None or not path.is_file() or not path.name.lower().endswith(YAML):
        return False
    try:
        text = beginning(path, MOST_LOOKED_AT).decode("utf-8", "replace")
    except UnreadableFileError:
        return False
    return is_problem(text)


def _problem(path: Path) -> Imported:
    """A problem file as one of several sources, or as it is."""
    loaded = load_spec(path)
    document = loaded.sources[0].node.to_data() if len(loaded.sources) == 1 else dict(loaded.document)
    return Imported(document, (), {}, entities_of(document), is_own=True)
