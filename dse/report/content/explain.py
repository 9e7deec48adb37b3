"""Explanations as pages."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.bounds import Ends, Impossible, impossible
from dse.analysis.diagnosis.overloads import KINDS
from dse.analysis.limits import FULLEST, build_limit
from dse.analysis.scheduling.overheads import safe_bounds
from dse.answers.explanation import Demand, Example, Explanation, GiveUp, Offer, Relaxation
from dse.answers.result import Clash, Conflict, Result
from dse.answers.tables.display import each_core_words, readable
from dse.report.amounts import amount_words, listed
from dse.report.page import MINUS, Block, Item, Listing, Page, Section, Text, few, listing, texts
from dse.report.words.basis import basis_words, waiting_verdict
from dse.report.words.clocks import boundary_words
from dse.report.words.contention import safe_words
from dse.report.words.lateness import delayed_words, late_words, overload_words, shorter_words
from dse.report.words.messages import late_message_words
from dse.report.words.reasons import exclusion_words
from dse.space.question.open_cores import is_scheduled
from dse.space.question.settings import ORIGIN
from dse.support.units import format_duration, format_number, format_ratio
from dse.support.units.text import count_words, first_of

DIGITS = 6
MOST_DECISIONS = 24
"""Maximum number of decisions of a design in one line."""
ROOM = 180
"""Letters of a design on a terminal: two lines."""
MOST_ASKED = 2
"""Demands of the caller that a title names."""
MOST_UNSEEN = 4
"""Maximum number of demands of a design that are named though it was not looked at why it breaks them."""
MOST_REDUCED = 20
"""Maximum number of demands that are listed of a set that may not be minimal."""
FOLLOWS = (
    "Late threads and flows that follow from an overloaded processor were not searched: relax the overload first, or "
    "use `dse explain --all`."
)
"""The sentence where threads need more than a processor has."""
REACHED = {"<=": "with {}", "<": "above {}", ">=": "with {}", ">": "below {}", "==": "with {}"}
"""Where a requirement leaves a design, by its operator: at the closest limit and on which side of it."""


def explanation_page(explanation: Explanation) -> Page:
    """The relaxations that make the problem feasible; then conflicts, each with the designs that show it minimal."""
    say = _Teller()
    if explanation.status == "feasible":
        say.strongly("FEASIBLE  a design meets every requirement and rule: there is no conflict to explain.")
        say.line(f"For example: {say.example(Example(explanation.design))}")
    elif explanation.status == "no structure":
        say.strongly(
            "INFEASIBLE  proved: the structure allows no design, without any requirement (bindings, options that the "
            "chosen types do not offer, threads that dispatch each other in a cycle)."
        )
    elif explanation.status == "incomplete":
        say.strongly("INCOMPLETE  stopped before it was known whether a design exists.")
    else:
        safe = safe_words(explanation.safe_bounds)
        alone = ", even if no thread waited for another" if explanation.without_waiting else ""
        say.strongly(f"INFEASIBLE  proved: no design meets every requirement and rule{alone}. {safe}".rstrip())
        for text in explanation.excluded:
            say.line(f"Also: {text}.")
        _tell_relaxations(say, explanation)
        _tell_conflict_sets(say, explanation)
    _tell_offers(say, explanation)
    _tell_designs(say, explanation)
    if explanation.status != "incomplete" and explanation.left_open:
        say.strongly("Stopped early. Left open:")
        for text in explanation.left_open:
            say.item(text)
        say.line("A longer --time-limit looks further.")
    spent = f"{count_words(explanation.solver_calls, 'question')} solved, {explanation.wall_s:.2f} s"
    basis = basis_words(explanation.problem.effective)
    verdict = waiting_verdict(explanation.waiting)
    say.line(f"{spent}; every design recomputed without the solver. {basis[:1].upper()}{basis[1:]}. {verdict}".rstrip())
    name = explanation.problem.name
    section = Section("explanation", "Conflicts and relaxations", tuple(say.blocks))
    limits = dict.fromkeys(item.demand.text for item in explanation.relaxations if item.demand.origin == ORIGIN)
    lead = f"{name}: {few(list(limits), MOST_ASKED, 'limits')}" if limits else name
    return Page(f"{name}: explanation", lead, (section,))


class _Teller:
    """Paragraphs and lists, one after the other; designs get letters in the order in which they are named."""

    def __init__(self) -> None:
        self.blocks: list[Block] = []
        self.examples: list[Example] = []

    def example(self, example: Example) -> str:
        """A design by its letter; `_tell_designs` says which they are, and what they break."""
        if example not in self.examples:
            self.examples.append(example)
        return f"design {_letters(self.examples.index(example))}"

    def demands(self, demands: Sequence[Demand]) -> str:
        """Requirements and rules in one line, without their places."""
        return "; ".join(f"{'' if item.kind == 'requirement' else f'{item.kind} '}{item.text}" for item in demands)

    def line(self, text: str) -> None:
        """A paragraph."""
        self.blocks.append(Text(text))

    def strongly(self, text: str) -> None:
        """A verdict."""
        self.blocks.append(Text(text, "strong"))

    def item(self, text: str, depth: int = 1, told: int | None = None) -> None:
        """A line of the list that stands last, or of a new one; a terminal has `told` letters of it."""
        last = self.blocks[-1] if self.blocks else None
        before = last.items if isinstance(last, Listing) else ()
        self.blocks = [
            *(self.blocks[:-1] if before else self.blocks),
            Listing((*before, Item(text, depth=depth, told=told))),
        ]


def _tell_conflict_sets(say: _Teller, explanation: Explanation) -> None:
    count = len(explanation.conflicts)
    bounds = _bounds_of(explanation.impossible)
    tells_apart = explanation.without_waiting and any(item.by_waiting for item in explanation.conflicts)
    for number, conflict in enumerate(explanation.conflicts, start=1):
        title = f"Conflict {number}" if count > 1 else "Conflict"
        alone = len(conflict.members) == 1
        said = "no design meets this" if alone else f"no design meets these {len(conflict.members)} together"
        waits = ", even if no thread waited for another" if tells_apart and not conflict.by_waiting else ""
        say.line(f"{title}: {said}{waits}")
        for demand, example in conflict.members:
            say.item(_demand(demand))
            bound = bounds.get((demand.text, demand.origin))
            if bound is not None:
                say.item(_bound_words(bound, explanation.currency), 2)
            say.item(_without(say, demand, example, alone=alone), 2)
    if explanation.reduced:
        count = len(explanation.reduced)
        shown = "" if count <= MOST_REDUCED else f", the first {MOST_REDUCED} of them"
        say.line(f"No design meets these {count} together; a part of them may already conflict{shown}:")
        for demand in explanation.reduced[:MOST_REDUCED]:
            say.item(_demand(demand))
    if explanation.every:
        say.line("All minimal conflicts are listed." if count > 1 else "This is the only minimal conflict.")
    elif explanation.least is not None:
        say.line(FOLLOWS)
    elif explanation.limited:
        say.line(f"Stopped at the limit of {count} conflicts; there are more (--limit).")
    else:
        say.line("Further conflicts are possible (--all).")


def _tell_relaxations(say: _Teller, explanation: Explanation) -> None:
    currency = explanation.currency
    helping = [item for item in explanation.relaxations if item.helps]
    if helping:
        say.line("Relaxing one of these is enough; each change is the smallest:")
        for item in helping:
            say.item(f"{_demand(item.demand)}: {_moved(say, item, currency)}")
    elif explanation.relaxations:
        say.line("Relaxing one requirement or rule is not enough.")
    if explanation.give_up is not None and not helping:
        _tell_give_up(say, explanation.give_up, currency)
    several = any(len(item.members) > 1 for item in explanation.conflicts)
    if explanation.least is not None and (several or len(explanation.least.members) > 1):
        _tell_least(say, explanation.least, _bounds_of(explanation.impossible), currency)


def _tell_least(say: _Teller, least: GiveUp, bounds: Bounds, currency: str) -> None:
    """The least number of demands that must be relaxed."""
    say.line(f"At least {len(least.members)} must be relaxed, for example these, each at least to:")
    for item in least.members:
        say.item(f"{_demand(item.demand)}{_least(item, currency, bounds)}")


def _least(item: Relaxation, currency: str, bounds: Bounds) -> str:
    """How far a demand must move at the least, where that was looked for, or is known."""
    bound = bounds.get((item.demand.text, item.demand.origin))
    if item.closest is None or item.limit is None:
        return f": {_bound_words(bound, currency)}" if bound is not None else ""
    if item.text.startswith(f"{item.demand.text} + "):
        return f": {readable(item.closest, item.unit, currency, DIGITS)} after its deadline{_deadline(item)}"
    closest = readable(item.closest, item.unit, currency, DIGITS)
    miss = amount_words(abs(item.closest - item.limit), item.unit, currency, DIGITS)
    return f": {closest}, {miss} {'more' if item.closest > item.limit else 'less'}"


def _tell_give_up(say: _Teller, give_up: GiveUp, currency: str) -> None:
    count = len(give_up.members)
    say.line(
        f"At least {count} must be relaxed; relaxing these is enough, for example in {say.example(give_up.example)}. "
        "The limit that each needs if the others are dropped:"
    )
    for item in give_up.members:
        if item.closest is None:  # a design without it alone is none without the others
            said = f": {_no_limit(item.unbounded)}{_because(item)}" if item.unbounded else ""
            say.item(f"{_demand(item.demand)}{said}")
        else:
            say.item(f"{_demand(item.demand)}: {_moved(say, item, currency)}")


def _moved(say: _Teller, item: Relaxation, currency: str) -> str:
    if item.closest is None or item.limit is None:
        named = f"feasible without it, for example {say.example(item.example)}"
        return f"{_no_limit(item.unbounded)}{_because(item)}; {named}" if item.unbounded else named
    closest = readable(item.closest, item.unit, currency, DIGITS)
    if item.text.startswith(f"{item.demand.text} + "):
        return (
            f"feasible if it may end {closest} after its deadline{_deadline(item)}, "
            f"for example {say.example(item.example)}"
        )
    where = REACHED[item.operator].format(closest)
    said = []
    if item.closest != item.limit:
        miss = amount_words(abs(item.closest - item.limit), item.unit, currency, DIGITS)
        said.append(f"{'+' if item.closest > item.limit else MINUS}{miss}")
    if item.thread:
        said.append(f"{item.thread} alone needs that much{_of_core(item.thread)}")
    aside = f" ({'; '.join(said)})" if said else ""
    lifted = f"`overload: allowed` for {item.overload}" if item.overload else ""
    written = " with ".join(part for part in (f"`{item.text}`" if item.text else "", lifted) if part)
    return f"feasible {where}{aside}: {written}, for example {say.example(item.example)}"


def _deadline(item: Relaxation) -> str:
    """``, of 5 ms``: the deadline of the thread in the example, where it is late there."""
    late = [one for one in item.example.late if one.late_ns == item.closest and one.limit_ns is not None]
    named = [one for one in late if item.demand.text == f"response time of {one.thread} <= its deadline"]
    return f" of {readable(named[0].limit_ns, 'ns', digits=DIGITS)}" if named and named[0].limit_ns is not None else ""


def _tell_offers(say: _Teller, explanation: Explanation) -> None:
    if not explanation.offered:
        return
    mended = [offer for offer in explanation.offers if offer.price is not None]
    if mended:
        say.line("Effect of the offered options, cheapest first:")
    else:
        say.line(
            "The problem stays infeasible with the offered options, alone or together."
            if explanation.complete
            else "Offers:"
        )
    for offer in explanation.offers:
        say.item(_offer(say, offer, explanation.currency))


def _offer(say: _Teller, offer: Offer, currency: str) -> str:
    name = " and ".join(offer.texts)
    if offer.price is None:
        return f"{name}: still infeasible, proved"
    price = readable(Fraction(offer.price), offer.unit, currency)
    return f"{name}: feasible, price at least {price}: {say.example(Example(offer.design))}"


def _demand(demand: Demand) -> str:
    kind = "" if demand.kind == "requirement" else f"{demand.kind} "
    return f"{kind}{demand.text}{_origin_words(demand.origin)}"


def _origin_words(origin: str) -> str:
    """Where a demand stands, in brackets."""
    return f" ({origin})" if origin else ""


def _without(say: _Teller, demand: Demand, example: Example, *, alone: bool) -> str:
    """A design without a member of a conflict, and what else it breaks."""
    named = say.example(example)
    if not example.besides(demand):
        return f"without it {named} meets everything else"
    if alone:
        return f"{named} violates it and further requirements"
    return f"without it {named} meets the others listed here, but violates further requirements"


def _no_limit(threads: Sequence[str]) -> str:
    """Why no limit of a requirement helps."""
    times = f"response time of {threads[0]} is" if len(threads) == 1 else f"response times of {', '.join(threads)} are"
    return f"no limit helps: at best the {times} unbounded"


def _because(item: Relaxation) -> str:
    """The remark that the threads without a bound have none because of others."""
    late = [one for one in item.example.late if one.thread in item.unbounded]
    causes = list(dict.fromkeys(name for one in late for name in one.endless if name not in item.unbounded))
    if not causes or not all(one.endless for one in late):
        return ""
    return f" because {listed(causes)} {'has' if len(causes) == 1 else 'have'} no bound"


def _tell_designs(say: _Teller, explanation: Explanation) -> None:
    """The designs that were named by letters, with all that they break: what is common to all of them once.

    Violations that were not examined are left out.
    """
    if not say.examples:
        return
    named = {demand for item in explanation.conflicts for demand, _ in item.members} if explanation.least else set()
    designs = [example.design for example in say.examples]
    names = list(dict.fromkeys(name for design in designs for name in design))
    differing = [name for name in names if len({design.get(name) for design in designs}) > 1]
    several = len(designs) > 1
    if several:
        say.line("The designs, by the decisions in which they differ:")
    for number, example in enumerate(say.examples):
        broken = say.demands([item for item in example.breaks if item in named or not named])
        what = f"violates {broken}" if broken else "meets every requirement"
        shown = _decisions(example.shown, differing if several else names)
        say.item(f"{_letters(number)} {what}: {shown or 'the only one that the file describes'}", int(several), ROOM)
        unseen = [item.text for item in example.besides(*named)] if named else []
        if unseen:
            say.item(f"also violated, causes not searched: {few(unseen, MOST_UNSEEN, 'demands')}", 1 + int(several))
        for overload in example.overloads:
            say.item(overload_words(overload), 1 + int(several))
        for text in (
            *map(late_words, example.late),
            *map(late_message_words, example.late_messages),
            *(f"with the fixed decision it is no valid design, which needs: {text}" for text in example.conditions),
        ):
            say.item(text, 1 + int(several))
        for delayed in example.delayed:
            say.item(delayed_words(delayed), 1 + int(several), ROOM)
        for text in boundary_words(example.boundaries):
            say.item(f"on one clock, {text.removesuffix('.')}", 1 + int(several))
        if example.shorter:
            say.item(f"it meets every requirement with {shorter_words(example.shorter)}", 1 + int(several))
    if several and len(differing) < len(names):
        shared = _decisions(designs[0], [name for name in names if name not in differing])
        say.item(f"same in every design: {shared}", told=ROOM)


def _decisions(design: Mapping[str, str], names: Sequence[str]) -> str:
    """Some decisions of a design, those that are active; the first of many."""
    texts = [f"{name.removesuffix('.type')} {design[name]}" for name in names if name in design]
    return first_of(texts, MOST_DECISIONS, " (--json has all)")


def _letters(number: int) -> str:
    """A, B, ..., Z, AA, AB, ...

    >>> _letters(0), _letters(25), _letters(26), _letters(27)
    ('A', 'Z', 'AA', 'AB')
    """
    head, last = divmod(number, 26)
    return (_letters(head - 1) if head else "") + chr(ord("A") + last)


def _of_core(who: str) -> str:
    """The words "of one core" behind what a thread needs; empty for what a core needs of itself."""
    return "" if who == FULLEST or who.startswith("core ") else " of one core"


# Requirements that no design meets as bounds alone show, in words.


Bounds: TypeAlias = Mapping[tuple[str, str], Impossible]
"""Bounds that no design can pass, by text and place of the requirement."""
MOST_PARTS = 6
"""The greatest number of parts of a figure that are told; the largest."""


def _bounds_of(items: Iterable[Impossible]) -> Bounds:
    """Bounds by the text and the place of their requirements."""
    return {(item.requirement.text, item.requirement.origin): item for item in items}


def impossible_words(item: Impossible, currency: str) -> str:
    """``no design meets latency of f <= 5 ms (p.yaml:12): it is at least 7 ms, the limit is 5 ms``.

    One sentence with the requirement, its place, the bound that no design passes, and the limit.
    """
    requirement = item.requirement
    where = f" ({requirement.origin})" if requirement.origin else ""
    return f"no design meets {requirement.text}{where}: {_bound_words(item, currency)}"


def _bound_words(item: Impossible, currency: str) -> str:
    """``it is at least 7 ms, the limit is 5 ms``; for a deadline, what executes; of a sum also what it is made of."""
    value, limit = (_figure(figure, item.unit, currency) for figure in (item.value, item.limit))
    if item.requirement.metric.key == "deadline":
        return f"its own work takes {value} at its longest, the deadline is {limit}"
    return f"it is at {item.side} {value}, the limit is {limit}{_of_each_core(item)}{_parts(item, currency)}"


def _of_each_core(item: Impossible) -> str:
    """The limit of one core that follows from a limit on the sum of several."""
    requirement = item.requirement
    share = requirement.limit.value * 10**6
    if requirement.metric.kind != "utilisation" or not share or item.limit in (0, share):
        return ""
    return f" ({each_core_words(item.limit, item.limit / requirement.limit.value)})"


def _parts(item: Impossible, currency: str) -> str:
    """The largest parts of a figure."""
    said = [f"{part.name} {_readable(part.value, item.unit, currency)}" for part in item.parts[:MOST_PARTS]]
    left = item.parts[MOST_PARTS:]
    if left:
        said.append(f"{len(left)} more {_readable(sum(part.value for part in left), item.unit, currency)}")
    return f": {', '.join(said)}" if said else ""


def _readable(value: Fraction | int, unit: str, currency: str) -> str:
    return readable(value, unit, currency, DIGITS)


def _figure(value: Fraction, unit: str, currency: str) -> str:
    """A figure in full; one without finite decimals to six, and as a fraction behind that."""
    text = _exact(value, unit, currency)
    is_fraction = "/" in text.split()[0]
    return f"{_readable(value, unit, currency)} (exact {text})" if is_fraction else text


def _exact(value: Fraction, unit: str, currency: str) -> str:
    if unit == "ns":
        return format_duration(value)
    if unit == "ppm":
        return format_ratio(value / 10**6)
    return f"{format_number(value / 100)} {currency}" if unit == "ct" else f"{format_number(value)} {unit}".rstrip()


# The conflicts of an infeasible result, in short.


def conflict_blocks(result: Result) -> Iterator[Block]:
    """The conflicts of an infeasible result, in short."""
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
        together = "No design meets these together; without any one of them, some design meets the others:"
        text = "No design meets this:" if alone else together
        yield text, tuple(_clash(clash, result.space.currency, bounds) for clash in conflict.members)
    if result.give_up:
        count = len(result.give_up)
        together = (
            f"Relaxing one is not enough; relaxing these {count} is. The closest value of each, without the others:"
        )
        yield (
            "Relaxing one limit is enough; it is stated once for several:" if count == 1 else together,
            tuple(_clash(clash, result.space.currency, {}) for clash in result.give_up),
        )
    limits = (item for item in result.space.requirements if item.metric.kind in KINDS and item.limit.value >= 1)
    full = {item.text for item in limits}
    if not result.give_up and any(_is_deferred(item, full) for item in result.conflicts):
        yield FOLLOWS, ()
    if excluded := exclusion_words(result.space):
        yield excluded, ()
    more = "lists all conflicts and the smallest relaxations" if result.conflicts else "says why"
    yield f"`dse explain` with the same options {more}.", ()


def _bounds(result: Result) -> Bounds:
    """Bounds that no design can pass, of those requirements that are a conflict by themselves."""
    alone = [(item.members[0].text, item.members[0].origin) for item in result.conflicts if len(item.members) == 1]
    named = [item for item in result.space.requirements if (item.text, item.origin) in alone]
    return _bounds_of(impossible([build_limit(result.space, item) for item in named], Ends(result.space)))


def _is_deferred(conflict: Conflict, full: Collection[str]) -> bool:
    """Whether what a conflict may lead to was not looked at.

    That is so where more of a processor is needed than there is, by limits with the texts `full`, and how far they are
    from being kept was not looked for.
    """
    is_sought = any(clash.is_sought for clash in conflict.members)
    return not conflict.by_waiting and not is_sought and any(clash.text in full for clash in conflict.members)


def _clash(clash: Clash, currency: str, bounds: Bounds) -> str:
    text = f"{clash.text}{_origin_words(clash.origin)}"
    bound = bounds.get((clash.text, clash.origin))
    if bound is not None and not clash.is_sought:
        return f"{text}: {_bound_words(bound, currency)}"
    if clash.unbounded:
        return f"{text}: {_no_limit(clash.unbounded)}"
    if clash.closest is None or clash.limit is None or clash.miss is None:
        return text if clash.is_sought else f"{text}: the distance to its limit was not searched"
    closest = readable(clash.closest, clash.unit, currency, DIGITS)
    if clash.text.endswith("<= its deadline"):
        return f"{text}: at best {closest} after it"
    miss = amount_words(clash.miss, clash.unit, currency, DIGITS)
    by_thread = f"; {clash.thread} alone needs that much{_of_core(clash.thread)}" if clash.thread else ""
    if clash.overload:
        by_thread += f"; it takes `overload: allowed` for {clash.overload}"
    if not clash.miss:
        return f"{text}: the closest is {closest}, which is the limit itself{by_thread}"
    side = "above" if clash.closest > clash.limit else "below"
    return f"{text}: the closest is {closest}, {miss} {side} the limit{by_thread}"
