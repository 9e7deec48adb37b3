"""The priority of a thread: a number, a rule that orders it, several of these as a decision."""

from __future__ import annotations

from dse.space.properties import FieldReader, Ledger, Owner
from dse.space.trees import Tree
from dse.spec.fields import PRIORITY_RULES


def read_priority(ledger: Ledger, owner: Owner) -> Tree:
    """The priority of a thread as its leaves have it: a number, the name of a rule, or None where nothing is stated.

    Numbers and rules have no order among each other, so that no list has both.
    """
    given = getattr(owner.own, "priority", None) or ()
    rules = [item for item in given if item in PRIORITY_RULES]
    if rules and len(rules) < len(given):
        ledger.error((*owner.path, "priority"), f"{rules[0]} and a number: a list has numbers, or rules that order")
        return None
    reader = FieldReader(ledger, owner, "priority", "rule" if rules else "count", str)
    return reader.read(lambda model: model.priority)
