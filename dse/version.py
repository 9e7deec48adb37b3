"""The version of this code, whatever name it is installed under: pyproject.toml reads it from here."""

__version__ = "0.1.0"
