"""Explanations as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from rich.console import Console

from dse.report.plain import basis_words
from dse.report.words import amount_words
from dse.results.explanation import Decisions, Demand, Explanation, GiveUp, Offer, Relaxation
from dse.results.result import Clash, Result
from dse.results.values import readable

DIGITS = 6
REACHED = {"<=": "from {} on", "<": "beyond {}", ">=": "up to {}", ">": "below {}", "==": "at {}"}
"""Where a requirement leaves a design, by its operator: at the closest limit and on which side of it."""


def print_explanation(console: Console, explanation: Explanation) -> None:
    """Conflicts, each with the designs that show it minimal; then what would mend the problem."""
    say = _Printer(console, _differing(explanation))
    effective = explanation.problem.effective
    say.strongly(f"{explanation.problem.name} ({basis_words(effective)})")
    if explanation.status == "feasible":
        say.strongly("Feasible: there is a design that meets every requirement and rule; nothing to explain.")
        say.line(f"For example: {say.design(explanation.design)}")
    elif explanation.status == "no structure":
        say.strongly(
            "Infeasible, proved: the structure alone has no design, whatever is required (bindings, options that the "
            "chosen types do not offer, threads that dispatch each other in a circle)."
        )
    elif explanation.status == "incomplete":
        say.strongly("Stopped before it was known whether there is a design.")
    else:
        say.strongly("Infeasible, proved: no design meets every requirement and rule.")
        _print_conflict_sets(say, explanation)
        _print_relaxations(say, explanation)
    _print_offers(say, explanation)
    if explanation.status == "infeasible" and not explanation.complete:
        say.strongly("Stopped early: there may be more to say.")
    spent = f"{explanation.solver_calls} questions solved, {explanation.wall_s:.2f} s"
    say.line(f"{spent}; every design recomputed without the solver.")


def print_conflicts(console: Console, result: Result) -> None:
    """The short form after an infeasible solve."""
    say = _Printer(console)
    for text, items in conflict_words(result):
        say.line(text)
        for item in items:
            say.item(item)


def conflict_words(result: Result) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Why there is no design: sentences, each with the requirements and rules that it speaks of."""
    for conflict in result.conflicts:
        alone = len(conflict.members) == 1
        together = "These cannot hold together, but without any one of them the others can:"
        text = "This cannot be met by any design:" if alone else together
        yield text, tuple(_clash(clash, result.space.currency) for clash in conflict.members)
    if result.give_up:
        yield (
            f"No single change is enough. These {len(result.give_up)} together are; each at best, without the others:",
            tuple(_clash(clash, result.space.currency) for clash in result.give_up),
        )
    more = "shows all conflicts and the smallest changes that mend them" if result.conflicts else "says why"
    yield f"`dse explain` with the same options {more}.", ()


class _Printer:
    """Plain lines, in which brackets are no markup; of a design only the decisions in `names` (None: all)."""

    def __init__(self, console: Console, names: frozenset[str] | None = None) -> None:
        self.console = console
        self.names = names

    def design(self, decisions: Decisions) -> str:
        """A design in one line."""
        texts = [
            f"{name.removesuffix('.type')} {option}"
            for name, option in decisions.items()
            if self.names is None or name in self.names
        ]
        return ", ".join(texts) if texts else "the only design"

    def line(self, text: str) -> None:
        self.console.print(text, markup=False)

    def strongly(self, text: str) -> None:
        self.console.print(text, markup=False, style="bold")

    def item(self, text: str, depth: int = 1) -> None:
        self.console.print(f"{'  ' * depth}{text}", markup=False)


def _print_conflict_sets(say: _Printer, explanation: Explanation) -> None:
    count = len(explanation.conflicts)
    for number, conflict in enumerate(explanation.conflicts, start=1):
        title = f"Conflict {number}" if count > 1 else "Conflict"
        alone = len(conflict.members) == 1
        said = "no design meets this" if alone else f"no design meets these {len(conflict.members)} together"
        say.line(f"{title}: {said}")
        for demand, design in conflict.members:
            say.item(_demand(demand))
            rest = "without it there are designs" if alone else "the others without it"
            say.item(f"{rest}, e.g. {say.design(design)}", 2)
    if explanation.every:
        say.line("These are all minimal conflicts." if count > 1 else "There is no other minimal conflict.")
    elif explanation.limited:
        say.line(f"Stopped at the limit of {count} conflicts; there are more (--limit).")
    else:
        say.line("There may be further conflicts: --all lists them.")


def _print_relaxations(say: _Printer, explanation: Explanation) -> None:
    currency = explanation.currency
    helping = [item for item in explanation.relaxations if item.helps]
    if helping:
        say.line("One of these changes is enough, each the smallest of its kind:")
        for item in helping:
            say.item(f"{_demand(item.demand)}: {_moved(say, item, currency)}")
    elif explanation.relaxations:
        say.line("No single requirement or rule mends it, however far it moves.")
    if explanation.give_up is not None and not helping:
        _print_give_up(say, explanation.give_up, currency)


def _print_give_up(say: _Printer, give_up: GiveUp, currency: str) -> None:
    say.line(
        f"At least {len(give_up.members)} must give; these are enough (the limit of each when the others are given up):"
    )
    for item in give_up.members:
        say.item(f"{_demand(item.demand)}: {_moved(say, item, currency)}")
    say.item(f"then e.g. {say.design(give_up.design)}")


def _moved(say: _Printer, item: Relaxation, currency: str) -> str:
    if item.closest is None or item.limit is None:
        return f"given up, there are designs, e.g. {say.design(item.design)}"
    closest = readable(item.closest, item.unit, currency, DIGITS)
    if item.text.startswith(f"{item.demand.text} + "):
        return f"feasible when it may end {closest} after its deadline, e.g. {say.design(item.design)}"
    where = REACHED[item.operator].format(closest)
    said = []
    if item.closest != item.limit:
        miss = amount_words(abs(item.closest - item.limit), item.unit, currency, DIGITS)
        said.append(f"{miss} {'more' if item.closest > item.limit else 'less'}")
    if item.thread:
        said.append(f"{item.thread} alone needs so much of one core")
    aside = f" ({'; '.join(said)})" if said else ""
    return f"feasible {where}{aside}, i.e. `{item.text}`, e.g. {say.design(item.design)}"


def _print_offers(say: _Printer, explanation: Explanation) -> None:
    if not explanation.offered:
        return
    mended = [offer for offer in explanation.offers if offer.price is not None]
    if mended:
        say.line("What the offered options would change, cheapest first:")
    else:
        say.line("The offered options do not mend it, alone or together." if explanation.complete else "Offers:")
    for offer in explanation.offers:
        say.item(_offer(say, offer, explanation.currency))


def _offer(say: _Printer, offer: Offer, currency: str) -> str:
    name = " and ".join(offer.texts)
    if offer.price is None:
        return f"{name}: still infeasible, proved"
    price = readable(Fraction(offer.price), offer.unit, currency)
    return f"{name}: feasible, from {price} on: {say.design(offer.design)}"


def _demand(demand: Demand) -> str:
    kind = "" if demand.kind == "requirement" else f"{demand.kind} "
    return f"{kind}{demand.text}{_origin(demand.origin)}"


def _origin(origin: str) -> str:
    return f" ({origin})" if origin else ""


def _differing(explanation: Explanation) -> frozenset[str] | None:
    """The decisions in which the designs of an explanation differ; None (all) where it shows one design only."""
    shown = [explanation.design] if explanation.design else []
    shown += [design for conflict in explanation.conflicts for _, design in conflict.members]
    shown += [item.design for item in explanation.relaxations if item.helps]
    shown += [offer.design for offer in explanation.offers if offer.price is not None]
    if explanation.give_up is not None:
        shown += [explanation.give_up.design, *(item.design for item in explanation.give_up.members)]
    if len(shown) < 2:
        return None
    names = {name for design in shown for name in design}
    return frozenset(name for name in names if len({design.get(name) for design in shown}) > 1)


def _clash(clash: Clash, currency: str) -> str:
    text = f"{clash.text}{_origin(clash.origin)}"
    if clash.closest is None or clash.limit is None or clash.miss is None:
        return text
    closest = readable(clash.closest, clash.unit, currency, DIGITS)
    if clash.text.endswith("<= its deadline"):
        return f"{text}: at best {closest} after it"
    miss = amount_words(clash.miss, clash.unit, currency, DIGITS)
    by_thread = f"; {clash.thread} alone needs so much of one core" if clash.thread else ""
    if not clash.miss:
        return f"{text}: the closest is {closest}, which is the limit itself{by_thread}"
    side = "above" if clash.closest > clash.limit else "below"
    return f"{text}: the closest is {closest}, {miss} {side} the limit{by_thread}"
