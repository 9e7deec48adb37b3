"""What the tests of bad inputs share: one defect per file, the exact messages beside it, places that exist.

Of a long list of the keys that a section has, the messages show the first, so that no new key changes them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from dse.support.errors import EXIT_INVALID, Diagnostic, ProblemError

FOLDER = Path(__file__).parents[1] / "bad_inputs"
LONG_LIST = re.compile(r"\((allowed: [^,)]+), [^,)]+, [^)]+\)")
"""The keys of a section, where they are more than two."""


def bad_inputs(folder: Path) -> list[Path]:
    """The bad inputs of a folder; `valid` is what they are made from."""
    return sorted(path for path in folder.glob("*.yaml") if path.stem != "valid")


def messages(path: Path, read: Callable[[Path], object]) -> list[str]:
    """The diagnostics of a file that `read` must refuse, without its folder, and with long lists of keys cut short."""
    with pytest.raises(ProblemError) as caught:
        read(path)
    assert caught.value.exit_code == EXIT_INVALID
    assert_places_exist(caught.value.diagnostics)
    text = str(caught.value).replace(f"{path.parent}/", "")
    return LONG_LIST.sub(r"(\1, …)", text).splitlines()


def expected_messages(path: Path) -> list[str]:
    """The messages beside a bad input."""
    return path.with_suffix(".expected").read_text(encoding="utf-8").splitlines()


def assert_every_input_has_its_messages(folder: Path) -> None:
    assert {path.stem for path in bad_inputs(folder)} == {path.stem for path in folder.glob("*.expected")}


def assert_places_exist(diagnostics: Sequence[Diagnostic], text: str | None = None) -> None:
    """Lines and columns point into the file (or into `text`): at most one past the end of a line."""
    for item in diagnostics:
        if not item.line:
            continue
        whole = text if text is not None else Path(item.file).read_bytes().decode("utf-8-sig", "replace")
        lines = whole.splitlines()
        assert 1 <= item.line <= len(lines) + 1, item
        line = lines[item.line - 1] if item.line <= len(lines) else ""
        assert 0 <= item.column <= len(line) + 1, item
