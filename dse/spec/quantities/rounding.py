"""Figures that reading a problem file has rounded, with their places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from dse.spec.loading.load import LoadedSpec
from dse.support.units import Rounded


def rounded_figures(loaded: LoadedSpec) -> Iterator[tuple[str, str]]:
    """Every figure that counts otherwise than it is written: its path, and what it counts as, in words.

    Times of demand are rounded up and times that there are down, to whole ns; each remark has both figures.
    """
    notes: dict[tuple[str, str], None] = {}
    for path, value in _figures(loaded.spec, ()):
        notes[".".join(path), value.note] = None
    yield from notes


def _figures(part: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Rounded]]:
    if isinstance(part, Rounded):
        yield path, part
    elif isinstance(part, BaseModel):
        for name, field in type(part).model_fields.items():
            yield from _figures(getattr(part, name), (*path, field.alias or name))
    elif isinstance(part, Mapping):
        for name, item in part.items():
            yield from _figures(item, (*path, str(name)))
    elif isinstance(part, tuple):
        for item in part:
            yield from _figures(item, path)
