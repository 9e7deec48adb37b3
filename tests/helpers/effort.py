"""How much the random tests try: one setting, `DSE_EFFORT`, for all of them.

``DSE_EFFORT=20`` draws twenty times as many cases as usual and runs what else takes minutes (clusters, all problems of
the studies); ``DSE_EFFORT=1:5000`` draws others than usual, from seed 5000 on; ``DSE_EFFORT=0.1`` draws a tenth.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TypeVar

import pytest

T = TypeVar("T")

_FACTOR, _, _FIRST = os.environ.get("DSE_EFFORT", "1").partition(":")
FACTOR = float(_FACTOR or "1")
USUALLY = 0.04
"""So many of the cases that a test names are drawn without more effort: the whole suite has to end in minutes."""
FIRST = int(_FIRST or "0")
"""The first seed."""
LONG = FACTOR >= 10
"""Whether what takes minutes is run too."""
long_test = pytest.mark.skipif(not LONG, reason="takes minutes: set DSE_EFFORT=10")


def few(values: Sequence[T], usually: int = 1) -> Sequence[T]:
    """The first values of a list whose cases are alike; all of them where what takes minutes is run too."""
    return values if LONG else values[:usually]


def cases(usual: int, first: int = 0) -> range:
    """The seeds of a random test that usually draws so many, from `first` on."""
    return range(first + FIRST, first + FIRST + count(usual))


def count(usual: int) -> int:
    """How many to draw where a test names so many at an effort of 1 / `USUALLY`; never none."""
    return max(1, round(usual * FACTOR * USUALLY))
