"""Packages of ROS: folders with a package.xml, which has their name."""

from __future__ import annotations

import os
import re
from pathlib import Path

from dse.support.files.reading import UnreadableFileError, beginning, real
from dse.support.timelimit import in_time

MOST_FOLDERS = 50_000
LEFT_OUT = ("build", "log", "node_modules", "__pycache__")
_NAME = re.compile(rb"<name>\s*([\w-]+)\s*</name>")


class Packages:
    """Finds packages in a workspace, which is looked through when the first one is asked for.

    Called with a package's name, it returns the folder or None.
    """

    def __init__(self, file: Path, stated: str | None) -> None:
        """`stated` is the folder that the user names; without one it is that around the package of the file."""
        self.root = Path(stated) if stated is not None else workspace_of(file)
        self._found: dict[str, Path] | None = None

    def __call__(self, name: str) -> Path | None:
        """The folder of a package."""
        if self._found is None:
            self._found = _packages(self.root) if self.root is not None else {}
        return self._found.get(name)


def workspace_of(file: Path) -> Path | None:
    """The folder ``src`` or the repository around the package that has the file, else the folder around the package."""
    folders = list(real(file).parents)
    package = next((folder for folder in folders if (folder / "package.xml").is_file()), None)
    if package is None:
        return None
    around = folders[folders.index(package) + 1 :]
    return next((folder for folder in around if folder.name == "src" or (folder / ".git").exists()), package.parent)


def _packages(root: Path) -> dict[str, Path]:
    folder_of: dict[str, Path] = {}
    for number, (folder, folders, files) in enumerate(in_time(os.walk(root))):
        if number > MOST_FOLDERS:
            break
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in LEFT_OUT)
        if "package.xml" in files:
            folder_of.setdefault(_name_of(Path(folder)), Path(folder))
            folders[:] = [name for name in folders if name not in ("launch", "config", "params", "include", "test")]
    return folder_of


def package_around(folder: Path) -> str | None:
    """The name of the package that has a folder: that of the nearest package.xml, in it or above; None without one.

    Read from the tag ``name`` of the package.xml.
    """
    folders = (folder, *folder.parents)
    package = next((item for item in folders if (item / "package.xml").is_file()), None)
    return None if package is None else _name_of(package)


def _name_of(package: Path) -> str:
    """The name in a package.xml, else that of its folder."""
    try:
        match = _NAME.search(beginning(package / "package.xml", 100_000))
    except UnreadableFileError:
        match = None
    return match[1].decode() if match else package.name
