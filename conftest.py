"""Docstrings with files work in a folder of their own, where the README's `pump.yaml` and `delays.csv` are."""

from __future__ import annotations

from pathlib import Path

import pytest

DELAYS = "size_bytes,min_us,max_us\n0,10,20\n100,12,25\n200,14,30\n"
PUMP = Path(__file__).parent / "tests" / "fuzz" / "pump.yaml"


@pytest.fixture(autouse=True)
def _pump(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Docstrings that name the problem find it."""
    if isinstance(request.node, pytest.DoctestItem) and any(
        "pump" in item.source or ".aadl" in item.source or "delays.csv" in item.source
        for item in request.node.dtest.examples
    ):
        folder: Path = request.getfixturevalue("tmp_path")
        (folder / "delays.csv").write_text(DELAYS, encoding="utf-8")
        (folder / "pump.yaml").write_text(PUMP.read_text(encoding="utf-8"), encoding="utf-8")
        monkeypatch.chdir(folder)
