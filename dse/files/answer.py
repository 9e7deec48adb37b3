"""What the answers of all verbs have in common: a form, in which they are written as JSON."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any


def json_text(data: Mapping[str, Any]) -> str:
    """Data as every command writes them: with a line for each entry, in whatever letters they have."""
    return json.dumps(data, ensure_ascii=False, indent=1) + "\n"


class Answer(ABC):
    """An answer that has a form, which `dse schema --of` prints."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The answer in its form, as plain data."""

    def to_json(self) -> str:
        """`to_dict` as text."""
        return json_text(self.to_dict())
