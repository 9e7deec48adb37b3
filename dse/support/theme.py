"""Colours, by name: CSS variables in the report, which follow the light or dark setting; literal ones in figures.

The categorical colours are those of Okabe and Ito, told apart by colour-blind readers, darkened or lightened to keep a
contrast of at least 3 : 1 against the paper.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

LIGHT: Mapping[str, str] = {
    "paper": "#ffffff",
    "panel": "#f6f7f9",
    "ink": "#1c2430",
    "soft": "#566173",
    "line": "#c3cad5",
    "accent": "#b3261e",
    "c1": "#0066a8",
    "c2": "#b85c00",
    "c3": "#00805e",
    "c4": "#a8558c",
    "c5": "#8a7400",
    "c6": "#2f8fbf",
    "s1": "#b87d00",
    "s2": "#d1495b",
    "s3": "#7b3fa0",
    "s4": "#12306b",
    "d1": "#0072b2",
    "d2": "#d55e00",
    "d3": "#009e73",
    "d4": "#cc79a7",
    "k1": "#332288",
    "k2": "#88ccee",
    "k3": "#cc6677",
    "k4": "#ddcc77",
    "k5": "#44aa99",
    "k6": "#444444",
    "k7": "#999933",
    "ok": "#00664b",
    "okbg": "#e8f5f0",
    "warn": "#8a3c00",
    "warnbg": "#fdeee3",
    "bad": "#8c1d18",
    "badbg": "#fdecea",
}
DARK: Mapping[str, str] = {
    "paper": "#14181f",
    "panel": "#1d232d",
    "ink": "#e8ecf2",
    "soft": "#a9b4c4",
    "line": "#465163",
    "accent": "#ff8a80",
    "c1": "#56b4e9",
    "c2": "#f0a04b",
    "c3": "#3fc79a",
    "c4": "#d99ac2",
    "c5": "#e3d24f",
    "c6": "#8fd3ff",
    "s1": "#ffe08a",
    "s2": "#f58b6b",
    "s3": "#c184ee",
    "s4": "#3f5fc8",
    "d1": "#2f86d0",
    "d2": "#e8792b",
    "d3": "#1fb58a",
    "d4": "#dd93bd",
    "k1": "#8577e0",
    "k2": "#88ccee",
    "k3": "#cc6677",
    "k4": "#ddcc77",
    "k5": "#44aa99",
    "k6": "#e4e8ee",
    "k7": "#999933",
    "ok": "#6fd8b4",
    "okbg": "#12261f",
    "warn": "#f0a867",
    "warnbg": "#2b1f14",
    "bad": "#ff9d94",
    "badbg": "#331a18",
}


def css_variables(theme: Mapping[str, str]) -> str:
    """``--paper: #ffffff; …``."""
    return " ".join(f"--{name}: {colour};" for name, colour in theme.items())


def with_colours(text: str, theme: Mapping[str, str]) -> str:
    """The text with ``var(--name)`` replaced by the colour, where there is one of that name.

    >>> with_colours("fill: var(--ink); var(--x)", LIGHT)
    'fill: #1c2430; var(--x)'
    """
    return re.sub(r"var\(--([a-z0-9]+)\)", lambda match: theme.get(match.group(1), match.group()), text)
