"""A plot of an answer as a picture: shown in a notebook, or written to a file."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.report.content.front.document import Document
from dse.report.dispatch import Told, page_of
from dse.report.output import check_alternative, drawings, png_of
from dse.report.page import Plot
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.files.writing import write_file, write_files


@dataclass(frozen=True, repr=False)
class Picture:
    """A plot as SVG.

    `svg` is its text; a notebook shows it, `save` writes it as SVG or PNG.
    """

    name: str
    svg: str

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        """One line: which plot it is."""
        return f"<Picture {self.name!r}>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as ``.svg`` or ``.png``.

        Raises
        ------
        UsageError
            when the path ends in neither; of ``.png`` without the extra `png`.
        """
        target = Path(path)
        if target.suffix.lower() == ".svg":
            write_file(str(target), self.svg)
        elif target.suffix.lower() == ".png":
            write_files(target.parent, [(target.name, png_of(self.svg))])
        else:
            raise UsageError(f"{target}: expected a path that ends in .svg or .png")


@arguments.checked(
    answer=arguments.ANSWER, kind=arguments.optional_text, alternative=arguments.Whole(1, 10**9, is_optional=True)
)
def plot(answer: Told, kind: str | None = None, alternative: int | None = None) -> Picture:
    """A plot of an answer.

    Parameters
    ----------
    answer
        what `dse.solve` or any other verb returned.
    kind
        which plot, where there are several: of a front ``scatter`` (the default), ``parallel``, ``latency``,
        ``timeline``, ``usage``, ``deadlines`` or ``architecture``; of other answers the name of one of theirs.
    alternative
        of a front, the id of the design that is highlighted or is drawn; None: the first in rank.

    Raises
    ------
    UsageError
        when there is no such plot or alternative.

    Examples
    --------
    >>> import dse
    >>> dse.plot(dse.solve("pump.yaml"))
    <Picture 'scatter'>
    """
    front = answer.robust if isinstance(answer, RobustResult) else answer
    known = []
    for name, draw in _plots(front, alternative):
        known.append(re.sub(r"^\d+-|-\d+$", "", name))
        if kind is None or kind in (name, known[-1]):
            return Picture(known[-1], draw())
    if not known:
        raise UsageError("there is nothing to draw in this answer")
    raise UsageError(f"kind {kind!r}: there are {', '.join(dict.fromkeys(known))}")


def _plots(answer: Told, alternative: int | None) -> Iterator[tuple[str, Callable[[], str]]]:
    """The name of each plot, and what draws it."""
    if isinstance(answer, Result):
        check_alternative(answer, alternative, "the result")
        document = Document(answer)
        if answer.front:
            yield from drawings(document, alternative)
        return
    if alternative is not None:
        raise UsageError("only a front has alternatives")
    for item in chain.from_iterable(section.plots for section in page_of(answer).sections):
        yield item.name, partial(_svg, item)


def _svg(item: Plot) -> str:
    return item.draw().standalone()
