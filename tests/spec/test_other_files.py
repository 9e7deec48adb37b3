"""A problem file may name any file of the machine: of one that is not YAML no message has a word."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.support.errors import ProblemError
from tests.helpers.diagnostics import FOLDER

VALID = (FOLDER / "valid.yaml").read_text(encoding="utf-8")
SECRETS = {
    "words": "hunter2:x:0:0:hunter2:/hunter2:/bin/sh\nhunter2 and more\n",
    "number": "4712471247124712\n",
    "settings": "USER=hunter2\nPASSWORD=hunter2\n",
    "quote": '"hunter2',
    "list": "- hunter2\n- hunter2\n",
    "tag": "!hunter2 {a: 1}\n",
    "alias": "*hunter2\n",
    "alias of itself": "a: &hunter2 [*hunter2]\n",
    "handle": "a: !hunter2!b 1\n",
    "directive": "%hunter2 1\n---\n",
    "twice, then broken": "hunter2: a\nhunter2: b\n[[\n",
    "tabs": "a:\n\thunter2: b\n",
    "no text": "hunter2\xff",
    "control": "hunter2\x01",
}
PLACES = {
    "include": "include: [{file}]",
    "samples": "uncertainty: {{threads.nav.compute_execution_time.Spectra: {{samples: {file}}}}}",
    "column": "uncertainty: {{threads.nav.compute_execution_time.Spectra: {{samples: {file}, column: a}}}}",
    "definitions": "messages: {{definitions: {file}}}",
    "of": "of: {file}",
}


def said(path: Path) -> str:
    with pytest.raises(ProblemError) as caught:
        dse.load(path)
    assert caught.value.diagnostics
    return str(caught.value)


@pytest.mark.parametrize("suffix", ["", ".yaml", ".csv", ".msg", ".idl"])
@pytest.mark.parametrize("secret", SECRETS)
def test_nothing_is_quoted(secret: str, suffix: str, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    (tmp_path / f"other{suffix}").write_bytes(SECRETS[secret].encode("latin-1"))
    path = tmp_path / "problem.yaml"
    for place, form in PLACES.items():
        if place == "samples" and secret == "number":
            continue  # which is a sample
        text = VALID.replace("data_size: 30 B", "message: std_msgs/Header") if place == "definitions" else VALID
        path.write_text(f"{text}\n{form.format(file=f'other{suffix}')}\n", encoding="utf-8")
        words = said(path)
        assert "hunter2" not in words and "4712" not in words, place
    assert "hunter2" not in said(tmp_path / f"other{suffix}")
    assert "4712" not in said(tmp_path / f"other{suffix}")


def test_names_of_columns_are_told(tmp_path: Path) -> None:
    (tmp_path / "other.csv").write_text("size [B],delay\n1,2\n", encoding="utf-8")
    path = tmp_path / "problem.yaml"
    path.write_text(f"{VALID}\n{PLACES['samples'].format(file='other.csv')}\n", encoding="utf-8")
    assert "other.csv has 2 columns (say which with `column`: size [B], delay)" in said(path)
    (tmp_path / "other.csv").write_text("hunter2=a,b:c\n1,2\n", encoding="utf-8")
    assert "other.csv has 2 columns (say which with `column`)" in said(path)
