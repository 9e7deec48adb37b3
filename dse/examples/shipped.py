"""The problems that come with dse: complete files to read, to run, and to start from.

They live in `problems/` of the repository and travel inside the wheel, so that every installation has
them.
"""

from __future__ import annotations

from pathlib import Path

from dse.support import arguments
from dse.support.errors import UsageError, did_you_mean


def example_folder() -> Path:
    """The folder that holds the example problems, and in `catalogues/` what they include."""
    package = Path(__file__).parents[1]
    installed = package / "problems"
    return installed if installed.is_dir() else package.parent / "problems"


def example_files() -> tuple[Path, ...]:
    """The example problems, sorted by name; catalogues are none.

    >>> [path.stem for path in example_files()][2:4]
    ['inmark', 'inmark_can']
    """
    return tuple(sorted(example_folder().glob("*.yaml")))


@arguments.checked(name=arguments.text)
def example_path(name: str) -> Path:
    """The file of the example called `name`, with or without its suffix.

    Parameters
    ----------
    name
        such as ``"inmark"``; ``dse new --list`` has all.

    Raises
    ------
    UsageError
        There is no such example; the message names the closest one, or all.

    Examples
    --------
    >>> example_path("inmark").name
    'inmark.yaml'
    """
    known = {path.stem: path for path in example_files()}
    stem = name.removesuffix(".yaml")
    if stem in known:
        return known[stem]
    hint = did_you_mean(stem, known) or f"known: {', '.join(known)}"
    raise UsageError(f'no example is called "{name}" ({hint})')
