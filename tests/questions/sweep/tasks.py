"""What workers are given to do in `test_sweep.py`: a module of its own, for each of them starts by importing it."""

from __future__ import annotations

import os
import signal
from pathlib import Path


def doubled(payload: str) -> str:
    return payload * 2


def dies_once(payload: str) -> str:
    """Kills its own process the first time."""
    mark = Path(payload.partition(":")[0])
    if payload.endswith("!") and not mark.exists():
        mark.write_text("x")
        os.kill(os.getpid(), signal.SIGKILL)
    return payload[-1]


def always_dies(payload: str) -> str:
    if payload == "3":
        os.kill(os.getpid(), signal.SIGKILL)
    return payload


def fails(payload: str) -> str:
    raise ValueError(payload)
