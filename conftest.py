"""The examples in docstrings work on the problem of the README, `pump.yaml`, in a folder of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

PUMP = Path(__file__).parent / "tests" / "fuzz" / "pump.yaml"


@pytest.fixture(autouse=True)
def _pump(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Docstrings that name the problem find it."""
    if isinstance(request.node, pytest.DoctestItem) and any(
        "pump" in item.source for item in request.node.dtest.examples
    ):
        folder: Path = request.getfixturevalue("tmp_path")
        (folder / "pump.yaml").write_text(PUMP.read_text(encoding="utf-8"), encoding="utf-8")
        monkeypatch.chdir(folder)
