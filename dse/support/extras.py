"""Optional packages that a default installation leaves out, and the message to whoever needs one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from dse.support.errors import UsageError

EXTRAS = {
    "can": ("cantools", "cantools"),
    "cluster": ("Dask", "distributed"),
    "png": ("resvg", "resvg_py"),
    "ros": ("rosbags", "rosbags"),
    "sensitivity": ("SciPy", "scipy"),
    "widget": ("anywidget", "anywidget"),
}
"""The extras of the package that commands need: what each brings, and what that is imported as."""


@contextmanager
def needed_for(what: str, extra: str) -> Iterator[None]:
    """Import the library of an extra inside; where it is not installed, say what needs it and what brings it.

    Parameters
    ----------
    what
        what was asked for, as a beginning of a sentence: ``A picture as PNG``.
    extra
        one of `EXTRAS`.

    Raises
    ------
    UsageError
        when an import inside fails.

    Examples
    --------
    >>> with needed_for("A picture as PNG", "png"):
    ...     import a_library_that_is_not_installed
    Traceback (most recent call last):
    dse.support.errors.UsageError: A picture as PNG needs resvg, the extra `png`: pip install 'dse-pareto[png]', ...
    """
    try:
        yield
    except ImportError as error:
        raise UsageError(f"{what} needs {how_to_install(extra)}") from error


def is_installed(extra: str) -> bool:
    """Whether the library of an extra is there; it is not imported.

    `extra` is one of `EXTRAS`, such as ``png`` or ``ros``.
    """
    return find_spec(EXTRAS[extra][1]) is not None


def how_to_install(extra: str) -> str:
    """The library of an extra and the commands that install it.

    >>> how_to_install("png")
    "resvg, the extra `png`: pip install 'dse-pareto[png]', or in a checkout pip install '.[png]'"
    """
    return (
        f"{EXTRAS[extra][0]}, the extra `{extra}`: pip install 'dse-pareto[{extra}]', "
        f"or in a checkout pip install '.[{extra}]'"
    )
