"""The version of this code, whatever name it is installed under: pyproject.toml reads it from here.

And of what its figures mean.
"""

__version__ = "0.1.0"
SEMANTICS = 1
"""Raised when the meaning of the figures changes (docs/semantics.md): results and stores of another one are refused."""
