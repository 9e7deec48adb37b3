"""Whether a file is a problem file, told from its beginning: nothing is read into a problem for that."""

from __future__ import annotations

import re

_YAML = re.compile(r"""^["']?dse["']?\s*:""", re.MULTILINE)
_JSON = re.compile(r'[{,]\s*"dse"\s*:\s*\d')
_ANSWER = re.compile(r'\{\s*"format"\s*:\s*"dse-')


def is_problem(text: str) -> bool:
    r"""Whether a text says ``dse: 1`` of itself, as YAML or JSON; what a command has written as JSON does not.

    Examples
    --------
    >>> is_problem("name: Pump\ndse: 1\n"), is_problem('{"name": "Pump", "dse": 1}'), is_problem("rate: 2")
    (True, True, False)
    >>> is_problem('{"format": "dse-result/1", "source": {"dse": 1}}')
    False
    """
    if text.lstrip().startswith("{"):
        return _ANSWER.match(text.lstrip()) is None and _JSON.search(text) is not None
    return _YAML.search(text) is not None
