"""Modules that libraries import and this program seldom needs, imported when something asks for them.

Pydantic looks for plugins through `importlib.metadata`, and OR-tools' CP-SAT offers variables as pandas' series; both
cost a tenth of what a short command takes (340 of 1,060 modules of a short solve, `tests/cli/test_startup.py`), and
nothing here uses either.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, cast

POSTPONED = {"ortools.sat.python.cp_model": "pandas", "pydantic.plugin._loader": "importlib.metadata"}
"""Which import of another module waits while a module is imported."""


def postpone() -> None:
    """Postpone imports of heavy modules in this process; modules that are already imported stay.

    An import hook that replaces heavy modules by placeholders, which load the module on first use.
    """
    sys.meta_path.insert(0, _Finder())


class _StandIn(ModuleType):
    """A module that is not there yet: while another is imported its names stand for themselves, then it is imported."""

    is_standing = True

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)

        def ask(cls: type[object], *value: Any, **named: Any) -> object:
            return getattr(import_module(self.__name__), name)(*value, **named)

        return type(name, (), {"__new__": ask}) if self.is_standing else getattr(import_module(self.__name__), name)


class _Finder:
    """Finds the modules whose imports wait."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module as it would be found, with a loader that lets its import wait."""
        other = POSTPONED.get(fullname)
        if other is None or other in sys.modules:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = cast(Any, _Loader(spec.loader, other))
        return spec


class _Loader:
    """Runs a module with something else under the name of another."""

    def __init__(self, loader: Any, other: str) -> None:
        self.loader = loader
        self.other = other

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """The module as its own loader makes it."""
        made: ModuleType | None = self.loader.create_module(spec)
        return made

    def exec_module(self, module: ModuleType) -> None:
        """Run it; whoever imports the other afterwards gets that."""
        standing = sys.modules[self.other] = _StandIn(self.other)
        try:
            self.loader.exec_module(module)
        finally:
            del sys.modules[self.other]
            standing.is_standing = False
