"""The conflicts of an infeasible result, in short."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from dse.analysis.bounds import Ends, impossible
from dse.analysis.limits import build_limit
from dse.analysis.overheads import safe_bounds
from dse.analysis.overloads import KINDS
from dse.report.amounts import amount_words
from dse.report.contention import safe_words
from dse.report.explain import DIGITS, FOLLOWS, no_limit, of_core, origin_words
from dse.report.impossible import Bounds, bound_words, bounds_of
from dse.report.page import Block, listing, texts
from dse.report.words import exclusion_words
from dse.results.display import readable
from dse.results.points import Clash, Conflict
from dse.results.solve import Result
from dse.space.cores import is_scheduled


def conflict_blocks(result: Result) -> Iterator[Block]:
    """The short form of it after an infeasible solve."""
    for text, items in _conflict_words(result):
        yield from texts(text)
        yield from listing(items)


def _conflict_words(result: Result) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Why there is no design: sentences, each with the requirements and rules that it speaks of."""
    is_counted = any(is_scheduled(result.space, item.metric) for item in result.space.requirements)
    if is_counted and all(conflict.by_waiting for conflict in result.conflicts):
        yield safe_words(safe_bounds(result.space), is_known=bool(result.conflicts)), ()
    bounds = _bounds(result)
    for conflict in result.conflicts:
        alone = len(conflict.members) == 1
        together = "These cannot hold together, but without any one of them the others can:"
        text = "This cannot be met by any design:" if alone else together
        yield text, tuple(_clash(clash, result.space.currency, bounds) for clash in conflict.members)
    if result.give_up:
        count = len(result.give_up)
        together = f"No single change is enough. These {count} together are; each at best, without the others:"
        yield (
            "One change is enough, to a limit that is stated once for several:" if count == 1 else together,
            tuple(_clash(clash, result.space.currency, {}) for clash in result.give_up),
        )
    limits = (item for item in result.space.requirements if item.metric.kind in KINDS and item.limit.value >= 1)
    full = {item.text for item in limits}
    if not result.give_up and any(_is_deferred(item, full) for item in result.conflicts):
        yield FOLLOWS, ()
    if excluded := exclusion_words(result.space):
        yield excluded, ()
    more = "shows all conflicts and the smallest changes that mend them" if result.conflicts else "says why"
    yield f"`dse explain` with the same options {more}.", ()


def _bounds(result: Result) -> Bounds:
    """What no design can have less (or more) of, of those requirements that are a conflict by themselves."""
    alone = [(item.members[0].text, item.members[0].origin) for item in result.conflicts if len(item.members) == 1]
    named = [item for item in result.space.requirements if (item.text, item.origin) in alone]
    return bounds_of(impossible([build_limit(result.space, item) for item in named], Ends(result.space)))


def _is_deferred(conflict: Conflict, full: Collection[str]) -> bool:
    """Whether what a conflict may lead to was not looked at.

    That is so where more of a processor is needed than there is, by limits with the texts `full`, and how far they are
    from being kept was not looked for.
    """
    is_sought = any(clash.is_sought for clash in conflict.members)
    return not conflict.by_waiting and not is_sought and any(clash.text in full for clash in conflict.members)


def _clash(clash: Clash, currency: str, bounds: Bounds) -> str:
    text = f"{clash.text}{origin_words(clash.origin)}"
    bound = bounds.get((clash.text, clash.origin))
    if bound is not None and not clash.is_sought:
        return f"{text}: {bound_words(bound, currency)}"
    if clash.unbounded:
        return f"{text}: {no_limit(clash.unbounded)}"
    if clash.closest is None or clash.limit is None or clash.miss is None:
        return text if clash.is_sought else f"{text}: how far it is from its limit was not looked at"
    closest = readable(clash.closest, clash.unit, currency, DIGITS)
    if clash.text.endswith("<= its deadline"):
        return f"{text}: at best {closest} after it"
    miss = amount_words(clash.miss, clash.unit, currency, DIGITS)
    by_thread = f"; {clash.thread} alone needs so much{of_core(clash.thread)}" if clash.thread else ""
    if clash.overload:
        by_thread += f"; it takes `overload: allowed` for {clash.overload}"
    if not clash.miss:
        return f"{text}: the closest is {closest}, which is the limit itself{by_thread}"
    side = "above" if clash.closest > clash.limit else "below"
    return f"{text}: the closest is {closest}, {miss} {side} the limit{by_thread}"
