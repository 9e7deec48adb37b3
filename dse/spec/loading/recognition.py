"""Whether a file is a problem file, told from its beginning: nothing is read into a problem for that."""

from __future__ import annotations

import re
from pathlib import Path

from dse.importers.registry import IMPORTERS, importer_of
from dse.spec.loading.reader import YamlNode
from dse.support.errors import Diagnostic, ProblemError

_YAML = re.compile(r"""^["']?dse["']?\s*:""", re.MULTILINE)
_JSON = re.compile(r'[{,]\s*"dse"\s*:\s*\d')
NO_PROBLEM = "this is what a command of dse has written, not a problem file"
ANSWER_HINT = "name the problem file; an alternative of a result is --design RESULT.json#ID, its question --resume"
_ANSWER = re.compile(r'\{\s*"format"\s*:\s*"dse-')


def is_problem(text: str) -> bool:
    r"""Whether a text says ``dse: 1`` of itself, as YAML or JSON; what a command has written as JSON does not.

    Examples
    --------
    >>> is_problem("name: Pump\ndse: 1\n"), is_problem('{"name": "Pump", "dse": 1}'), is_problem("rate: 2")
    (True, True, False)
    >>> is_problem('{"format": "dse-result/1", "source": {"dse": 1}}')
    False
    """
    if text.lstrip().startswith("{"):
        return _ANSWER.match(text.lstrip()) is None and _JSON.search(text) is not None
    return _YAML.search(text) is not None


def of_another_format(path: Path, text: str) -> Diagnostic | None:
    """A mistake where a file is of a format of `dse import` alone, such as a CAN database; None for other files.

    The hint is the command that makes a problem file of it.
    """
    importer = None if path.is_dir() or is_problem(text) else importer_of(path)
    if importer not in IMPORTERS or importer.is_problem:
        return None
    hint = f"dse import {path} -o {path.name.partition('.')[0]}.yaml makes a problem file of it"
    return Diagnostic(f"expected a problem file, got one of the format {importer.name}", "", str(path), 1, 1, hint)


def no_answer(root: YamlNode, file: str) -> YamlNode:
    """The tree of a file, where that is not one of the formats that commands write.

    Raises
    ------
    ProblemError
        when it is, with the place that says so.
    """
    form = root.at(["format"]).value if isinstance(root.value, dict) else None
    if isinstance(form, str) and form.startswith("dse-"):
        place = root.place(["format"])
        raise ProblemError(
            [Diagnostic(NO_PROBLEM, "format", place.file or file, place.line, place.column, ANSWER_HINT)]
        )
    return root
