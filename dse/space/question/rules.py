"""Rules with their names resolved."""

from __future__ import annotations

from typing import Any

from dse.space.model.criteria import Atom, MultipleTest, PairTest, ResolvedCondition, Rule, UsedTest, ValueTest
from dse.space.model.space import EMPTY, Reference, Space
from dse.space.model.trees import Tree, leaves
from dse.space.options import offered_value, read_value
from dse.space.question.metrics import QuestionError
from dse.spec.language.expressions import And, Compare, Condition, MultipleOf, Not, OneOf, Or, Ref, Used
from dse.spec.language.grammar import parse_rule
from dse.support.errors import did_you_mean
from dse.support.units import shown

ORDERED = (
    "duration",
    "offset",
    "data size",
    "bandwidth",
    "data rate",
    "rate",
    "money",
    "power",
    "total",
    "count",
    "identifier",
)


def read_rule(space: Space, text: str, origin: str = "") -> Rule:
    """A rule with its names resolved.

    Raises `ExpressionError` for a mistake of form, `QuestionError` for a value that is no option. `origin` is shown
    with the rule.
    """
    expression = parse_rule(text, list(space.references), _bare_names(space))
    return Rule(text, expression.verb, _resolve(space, expression.condition), origin)


def _bare_names(space: Space) -> list[str]:
    slots = [slot.name for slot in (*space.processors, *space.buses)]
    types = [str(text) for item in space.references.values() if item.kind == "type" for text in item.texts.values()]
    types += [name for names in space.catalogue.values() for name in names]
    return [*slots, *(name for name in dict.fromkeys(types) if name != EMPTY)]


def unoffered_types(space: Space) -> list[str]:
    """The types of the catalogues that nothing may have.

    Rules that name only such types can never apply, which `dse check` remarks.
    """
    offered = {str(text) for item in space.references.values() if item.kind == "type" for text in item.texts.values()}
    return [name for names in space.catalogue.values() for name in names if name not in offered]


def _compared_value(space: Space, reference: Reference, text: str) -> Any:
    """The value that a rule compares with: an option, or a type of the catalogue that is none (any more)."""
    if reference.kind == "type":
        owner = reference.name.removesuffix(".type")
        sections = {item.name: "processor_types" for item in space.processors}
        sections |= {item.name: "bus_types" for item in space.buses}
        sections |= {item.name: f"{item.section.removesuffix('s')}_types" for item in space.components}
        if text in space.catalogue.get(sections.get(owner, ""), ()):
            return text
    return offered_value(reference, text)


def _resolve(space: Space, condition: Condition) -> ResolvedCondition:
    if isinstance(condition, Not):
        return Not(_resolve(space, condition.operand))
    if isinstance(condition, And | Or):
        operands = tuple(_resolve(space, item) for item in condition.operands)
        return And(operands) if isinstance(condition, And) else Or(operands)
    return _atom(space, condition)


def _atom(space: Space, condition: Condition) -> Atom:
    references = space.references
    if isinstance(condition, Used):
        return _used(space, condition.name)
    if isinstance(condition, OneOf):
        reference = references[condition.ref.name]
        return ValueTest(
            reference.tree, "in", tuple(_compared_value(space, reference, text) for text in condition.values)
        )
    if isinstance(condition, MultipleOf):
        left, right = references[condition.left.name], references[condition.right.name]
        if left.kind != "duration" or right.kind != "duration":
            raise QuestionError("only a period can be a multiple of a period")
        return MultipleTest(left.tree, right.tree)
    assert isinstance(condition, Compare)
    left = references[condition.left.name]
    ordered = condition.operator not in ("==", "!=")
    if ordered and left.kind not in ORDERED:
        raise QuestionError(f"{left.name} has no order: compare it with == or !=")
    if isinstance(condition.right, Ref):
        right = references[condition.right.name]
        if right.kind != left.kind:
            raise QuestionError(f"{left.name} and {right.name} are of different kinds")
        return PairTest(left.tree, condition.operator, right.tree)
    if condition.operator == "==" or left.kind == "type":
        return ValueTest(left.tree, condition.operator, _compared_value(space, left, condition.right))
    return ValueTest(left.tree, condition.operator, read_value(left, condition.right))


def _used(space: Space, name: str) -> UsedTest:
    """A slot that is not empty, or a type that some slot or component has, or to which something is bound directly.

    A type of the catalogue that nothing may have is used in no design.
    """
    slots = {slot.name: slot for slot in (*space.processors, *space.buses)}
    if name in slots and name not in slots[name].types:
        reference = space.references[f"{name}.type"]
        return UsedTest(((reference.tree, tuple(item for item in slots[name].types if item != EMPTY)),))
    direct = [number for number, bus in enumerate(space.buses) if bus.direct and bus.name == name]
    own = {f"{name}.type"} if direct else set()
    having = [item for item in space.references.values() if item.kind == "type" and name in item.texts]
    if not having and not any(name in names for names in space.catalogue.values()):
        raise QuestionError(f"nothing is called {shown(name)}", did_you_mean(name, _bare_names(space)))
    bindings = [*(item.bus for item in space.connections), *(item.carrier for item in space.buses)]
    bound: list[tuple[Tree, tuple[int, ...]]] = [
        (tree, (number,)) for number in direct for tree in bindings if number in set(leaves(tree))
    ]
    return UsedTest((*((item.tree, (name,)) for item in having if item.name not in own), *bound))
