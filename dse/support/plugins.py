"""Entry points of other packages: looked for where something is asked that dse itself does not have."""

from __future__ import annotations

from functools import cache
from typing import Any

from dse.support.errors import UsageError


@cache
def plugged(group: str) -> tuple[tuple[str, Any], ...]:
    """The name of each entry point of a group, such as ``dse.importers``, and what it leads to.

    Raises
    ------
    UsageError
        when one cannot be imported, naming the package that it is of.
    """
    from importlib.metadata import entry_points  # a quarter of a second

    loaded = []
    for item in sorted(entry_points(group=group), key=lambda item: item.name):
        try:
            loaded.append((item.name, item.load()))
        except Exception as error:  # whatever the other package does
            package = item.dist.name if item.dist is not None else "an unknown package"
            raise UsageError(f"plug-in {item.name!r} of {package}: {type(error).__name__}: {error}") from error
    return tuple(loaded)
