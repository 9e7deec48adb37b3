"""What an incomplete front is worth, in words."""

from __future__ import annotations

from dse.report.words import amount_words, listed
from dse.results.missing import Outlook, outlooks_of
from dse.results.result import Result
from dse.results.values import counted

TITLE = "Proved of every design that may be missing"


def missing_words(result: Result) -> list[str]:
    """How good a design can be that a stopped search did not find: phrases that follow `TITLE`; none if it finished."""
    currency, outlooks = result.space.currency, outlooks_of(result)
    said = [_outlook(item, currency) for item in outlooks]
    near = [
        f"{amount_words(item.near, item.unit, currency)} in {item.name}" for item in outlooks if item.near is not None
    ]
    return [*said, f"some design found is worse by at most {listed(near)}"] if near else said


def _outlook(item: Outlook, currency: str) -> str:
    """``price: no less than 240 EUR, 50 EUR less than the best found``."""
    word = "less" if item.sense == "minimise" else "more"
    bound = f"{item.name}: no {word} than {counted(item.bound, item.unit, currency)}"
    if item.best is None:
        return f"{bound}; nothing was found yet"
    if not item.possible_gain:
        return f"{bound}; the best is found: {counted(item.best, item.unit, currency)}"
    gain = amount_words(item.possible_gain, item.unit, currency)
    return f"{bound}, {gain} {word} than the best found"
