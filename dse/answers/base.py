"""The base of the answers of all verbs: a format, in which they are written as JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from dse.support.files.writing import write_file


def json_text(data: Mapping[str, Any]) -> str:
    """Data as every command writes them: with a line for each entry, in whatever letters they have.

    >>> print(json_text({"front": [{"price": 3, "name": "ä"}, {}]}), end="")
    {
     "front": [
      {
       "price": 3,
       "name": "ä"
      },
      {}
     ]
    }
    """
    return f"{json.dumps(data, ensure_ascii=False, indent=1)}\n"


def to_file(text: str, path: str | os.PathLike[str] | None) -> str:
    """The text, which is written to a file where there is a path for it: whole or not at all.

    Returned in any case, so that a caller can print it. The file is complete or unchanged, even when the process is
    killed.
    """
    if path is not None:
        write_file(os.fspath(path), text)
    return text


class Answer:
    """The base of every answer that is written as JSON.

    `to_dict` gives plain data in the format of its class, such as ``dse-result/1``; `to_json` its text. In a
    terminal an answer is one line, in a notebook a table.
    """

    FORMAT: ClassVar[str]
    """The name of its format: ``result`` for ``dse-result/1``, which `dse schema --of result` prints."""

    @classmethod
    def format(cls) -> str:
        """The name of the format with its version, such as ``dse-result/1``."""
        return f"dse-{cls.FORMAT}/1"

    def __repr__(self) -> str:
        """One line: what it is an answer about, and its status where it has one."""
        problem = getattr(self, "problem", None)
        named = problem.get("name") if isinstance(problem, Mapping) else getattr(problem, "name", None)
        named = named or getattr(getattr(self, "space", None), "name", None) or ", ".join(getattr(self, "names", ()))
        status = self._verdict()
        return f"<{type(self).__name__}{f' of {named!r}' if named else ''}{f': {status}' if status else ''}>"

    def _verdict(self) -> str:
        """The answer in a few words, for `repr`."""
        return str(getattr(self, "status", ""))

    def _repr_html_(self) -> str:
        """For a notebook: the line of `repr`, and `frame` as a table in the units that engineers read."""
        from html import escape

        make = getattr(self, "frame", None)
        heading = f"<p>{escape(repr(self)[1:-1])}</p>"
        if make is None:
            return heading
        frame = make()
        return f"{heading}{frame.to_html(index=False, escape=True, max_rows=60)}"

    def to_dict(self) -> dict[str, Any]:
        """The answer in its format, as plain data: exact figures, fractions as text where they are no integers.

        Keys are those of docs/formats.md; reading the mapping again gives an equal answer.
        """
        from dse.answers.forms.codec import written

        return written(type(self), self)

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """The answer as JSON text (`to_dict`), also written to `path` where one is given: whole or not at all."""
        return to_file(json_text(self.to_dict()), path)


class DataAnswer(Answer):
    """The base of answers that hold only the data of their format.

    Such an answer is read back from its JSON with `dse.read`, equal to the one that was written.
    """

    @classmethod
    def _read(cls, data: Mapping[str, Any]) -> Mapping[str, Any]:
        """Fields that no entry of the data has by itself."""
        return {}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The answer that `to_dict` made these data of; nothing is computed again.

        Raises
        ------
        UsageError
            when the data are not of its format, naming the first place that is wrong.
        """
        from dse.answers.forms.codec import read_as
        from dse.answers.forms.consistency import check_data

        check_data(cls.FORMAT, data, "the data")
        return read_as(cls, data, **cls._read(data))
