"""What `dse solve` will refuse because its sums leave exact arithmetic, found without solving."""

from __future__ import annotations

from collections.abc import Iterator

from dse.analysis.bounds import Ends, largest
from dse.analysis.evaluate import Evaluator
from dse.errors import TooLargeError

SURELY_EXACT = 2**43
"""Sums below this are exact whatever the search makes of them; of others it is asked."""


def too_large(evaluator: Evaluator, ends: Ends) -> Iterator[str]:
    """The first objective or requirement that the search cannot count exactly, with its place, as the search says.

    Raises
    ------
    OutOfTime
        when the limit in force comes before it is known.
    """
    measures = [*evaluator.objectives, *(limit.measure for limit in evaluator.limits)]
    found = (largest(ends, measure) for measure in measures)
    if all(figure is not None and figure < SURELY_EXACT for figure in found):
        return
    from dse.encode.model import encode

    try:
        encode(evaluator)
    except TooLargeError as error:
        yield str(error)
