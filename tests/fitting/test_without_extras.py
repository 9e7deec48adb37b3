"""What `dse fit` does without SciPy: all but quantile lines and extreme values, which are told what brings it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from dse.cli.main import run
from tests.helpers.small import TABLES


def test_without_scipy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy", None)
    assert run(["fit", str(TABLES / "table_5_3.csv"), "--round-trip", "--method", "envelope"]) == 0
    capsys.readouterr()
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["bytes,delay_us", *(f"{n % 2},{n}" for n in range(900))]), encoding="utf-8")
    for options in (["--method", "quantile"], ["--extremes", "100"]):
        assert run(["fit", str(path), *options]) == 2
        assert f"{' '.join(options[: 2 if 'quantile' in options else 1])} needs SciPy" in capsys.readouterr().err
