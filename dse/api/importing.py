"""`dse.import_file`: other formats to problem files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dse.errors import Diagnostic
from dse.importers.registry import read_foreign
from dse.spec.writing import block_text


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


def import_file(
    path: str | Path,
    form: str | None = None,
    times: Sequence[str | Path] = (),
    bags: Sequence[str | Path] = (),
    **options: str | None,
) -> ImportedFile:
    """A file of another format as the text of a problem file.

    Parameters
    ----------
    path
        the file; for some formats a folder.
    form
        the name of the format; told by the file's suffix where it is left out.
    times
        measured execution times for the threads that the file has: CSV as `dse fit` reads them, or traces.
    bags
        recordings of ROS, for the sizes of topics and the rates of those that come from outside.
    options
        those of the format; ``dse import --help`` lists them.

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
    given = {name: value for name, value in options.items() if value is not None}
    found = read_foreign(Path(path), form, given)
    document, remarks = dict(found.document), found.remarks
    if times or bags:
        from dse.api.timed import with_bag, with_times

        if times:
            document, said = with_times(found, times)
            remarks += said
        for bag in bags:
            document, said = with_bag(document, Path(bag))
            remarks += said
    return ImportedFile(block_text(document), remarks)
