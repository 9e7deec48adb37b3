"""One defect per file, and the exact message beside it; hostile inputs are generated."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import pytest

from dse.spec.loading.load import load_spec, parse_spec
from dse.spec.loading.reader import MAX_BYTES
from dse.spec.schema.model import Thread
from dse.support.errors import ProblemError
from tests.helpers import diagnostics
from tests.helpers.diagnostics import FOLDER, assert_every_input_has_its_messages, bad_inputs, expected_messages

VALID = (FOLDER / "valid.yaml").read_text(encoding="utf-8")
messages = partial(diagnostics.messages, read=load_spec)


@pytest.mark.parametrize("path", bad_inputs(FOLDER), ids=lambda path: path.stem)
def test_message(path: Path) -> None:
    assert messages(path) == expected_messages(path)


def test_every_bad_input_has_its_message_and_the_base_is_valid() -> None:
    assert_every_input_has_its_messages(FOLDER)
    load_spec(FOLDER / "valid.yaml")


@pytest.mark.parametrize("path", sorted((FOLDER / "semantic").glob("*.yaml")), ids=lambda path: path.stem)
def test_semantic_defects_are_structurally_sound(path: Path) -> None:
    load_spec(path)


def test_all_keys_of_a_section_are_named_where_none_is_near() -> None:
    with pytest.raises(ProblemError) as caught:
        parse_spec(VALID.replace("threads:\n  nav:", "threads:\n  nav:\n    zzzzz: 1", 1))
    keys = [info.alias or name for name, info in Thread.model_fields.items()]
    assert caught.value.diagnostics[0].hint == f"allowed: {', '.join(keys)}"


def test_windows_line_ends_and_byte_order_mark_are_welcome(tmp_path: Path) -> None:
    path = tmp_path / "problem.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + VALID.replace("\n", "\r\n").encode())
    assert load_spec(path).spec == parse_spec(VALID).spec


def test_missing_file_and_directory(tmp_path: Path) -> None:
    assert messages(tmp_path / "nothing.yaml") == ["nothing.yaml: no such file"]
    (tmp_path / "folder").mkdir()
    assert messages(tmp_path / "folder") == ["folder: expected a file, this is a directory"]


def test_file_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "secret.yaml"
    path.write_text(VALID)

    def refuse(path: Path, flags: int) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    assert messages(path) == ["secret.yaml: cannot be read: Permission denied"]


def test_huge_file_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as stream:
        stream.truncate(50 * 10**6)
    assert messages(path) == ["huge.yaml: the file is larger than 8 MB"]
    path.write_bytes(b"x" * (MAX_BYTES + 1))
    assert messages(path) == ["huge.yaml: the file is larger than 8 MB"]


def test_nonsense_of_allowed_size(tmp_path: Path) -> None:
    path = tmp_path / "nonsense.yaml"
    path.write_bytes(bytes(range(32, 127)) * 10_000)
    assert len(messages(path)) == 1
    path.write_bytes(bytes(range(256)) * 100)
    assert len(messages(path)) == 1


def test_alias_bomb(tmp_path: Path) -> None:
    levels = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    levels += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    path = tmp_path / "bomb.yaml"
    path.write_text("\n".join(levels))
    [message] = messages(path)
    assert message.endswith("more than 500000 values, aliases counted as often as they are used")


@pytest.mark.parametrize("text", ["[" * 1_000_000, "{a: " * 250_000, "- " * 500_000, "? " * 500_000])
def test_deep_nesting(text: str) -> None:
    with pytest.raises(ProblemError, match="nested deeper than 64 levels"):
        parse_spec(text)


def test_deep_nesting_by_aliases() -> None:
    text = "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 100))
    with pytest.raises(ProblemError, match="nested deeper than 64 levels"):
        parse_spec(text)


def test_many_findings_are_all_told_in_the_order_of_the_file() -> None:
    """How many of them are shown is for whoever shows them."""
    with pytest.raises(ProblemError) as caught:
        parse_spec(VALID + "".join(f"unknown_{n}: 1\n" for n in range(2000)))
    assert [item.path for item in caught.value.diagnostics] == [f"unknown_{n}" for n in range(2000)]


def test_nuls() -> None:
    with pytest.raises(ProblemError, match="<text>:1:1: control character U\\+0000 in the text"):
        parse_spec("\0" * 1000)


def test_long_texts_are_shortened_in_messages() -> None:
    for line in ("x" * 10**6 + ": 1\n", f"profile: {'y' * 10**6}\n", f"devices: {{g: {{period: {'9' * 10**5} s}}}}\n"):
        with pytest.raises(ProblemError) as caught:
            parse_spec(f"dse: 1\nname: x\n{line}")
        assert len(str(caught.value)) < 1000
