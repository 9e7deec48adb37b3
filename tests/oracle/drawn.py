"""The problems that the tests draw without more effort, as the generator draws them: to draw one may take seconds.

After a change of what the generator draws them by, draw them anew::

    python -m tests.oracle.generator
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

HERE = Path(__file__).parent
KEPT = HERE / "drawn.zip"
NO_SAY = ("__init__", "coverage", "drawn", "osate", "test_oracle")
"""Modules that the generator does not draw by; all others decide what it draws."""


def digest() -> bytes:
    """What tells whether the problems that are kept are those of the generator as it is."""
    sources = [path for path in sorted(HERE.glob("*.py")) if path.stem not in NO_SAY]
    return sha256("".join(path.read_text(encoding="utf-8") for path in sources).encode()).hexdigest().encode()


@cache
def kept() -> Mapping[str, str]:
    """The texts of the problems by ``tiny 7``; none if the generator has changed since."""
    with ZipFile(KEPT) as archive:
        if archive.comment != digest():
            return {}
        return {name: archive.read(name).decode() for name in archive.namelist()}


def keep(texts: Mapping[str, str]) -> None:
    """Write down what the generator draws; the same texts make the same file."""
    with ZipFile(KEPT, "w", ZIP_DEFLATED) as archive:
        archive.comment = digest()
        for name, text in texts.items():
            archive.writestr(ZipInfo(name), text, ZIP_DEFLATED)
