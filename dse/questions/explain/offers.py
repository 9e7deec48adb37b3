"""What if: offers such as ``computer.type += Spectra``, added to the problem as it was written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import build_measure
from dse.analysis.views import View
from dse.answers.explanation import Offer
from dse.answers.result import decisions_of
from dse.questions.problem import Problem, changed
from dse.search.feasibility.guarded_model import TimeLeft
from dse.search.feasibility.oracle import find_design
from dse.space.build import build_space
from dse.space.model.criteria import Metric
from dse.space.model.space import Space
from dse.spec.language.grammar import ExpressionError, parse_assignment
from dse.spec.loading.load import LoadedSpec
from dse.spec.schema.model import Spec
from dse.support.errors import ProblemError, UsageError
from dse.support.timelimit import OutOfTime, until

MOST_COMBINATIONS = 200
SLOTS = ("processors", "buses")
"""The components whose type goes by their own name, as in every table of ours."""
SECTIONS = {
    "processors": "processor_types",
    "buses": "bus_types",
    "devices": "device_types",
    "threads": "thread_types",
    "executors": None,
    "reservations": None,
    "connections": None,
}


def with_offers(problem: Problem, texts: tuple[str, ...]) -> Problem:
    """The problem rebuilt with further options, and the caller's changes applied to it.

    Raises
    ------
    UsageError
        when an offer names no list of options, or what it names does not fit the problem.
    """
    loaded = problem.loaded
    for text in texts:
        loaded = _offered(loaded, text)
    try:
        built = Problem(loaded, build_space(loaded))
    except ProblemError as error:
        raise UsageError(f"with the offer {', '.join(texts)}: {error.diagnostics[0]}") from error
    return changed(built, problem.changes)


def _offered(loaded: LoadedSpec, text: str) -> LoadedSpec:
    try:
        name, value = parse_assignment(text.replace("+=", "=", 1))
    except ExpressionError as error:
        form = "" if "=" in text else 'an offer is COMPONENT.FIELD += OPTION, such as "computer.type += Spectra"'
        raise UsageError(f"offer {text!r}: {form or error}") from error
    spec = loaded.spec
    component, _, field = name.rpartition(".")
    if any(name in getattr(spec, section) for section in SLOTS):
        component, field = name, "type"
    section = next((section for section in SECTIONS if component in getattr(spec, section)), None)
    if section is None:
        raise UsageError(f"offer {text!r}: nothing is called {component!r}; an offer is COMPONENT.FIELD += OPTION")
    owner = getattr(spec, section)[component]
    options = _options(spec, section, owner, field, text)
    new = _value(owner, field, value, text)
    if new in options:
        raise UsageError(f"offer {text!r}: it is an option already")
    entries = {**getattr(spec, section), component: owner.model_copy(update={field: (*options, new)})}
    return replace(loaded, spec=spec.model_copy(update={section: entries}))


def _options(spec: Spec, section: str, owner: Any, field: str, text: str) -> tuple[Any, ...]:
    """The options that the field has so far: its own, else those of the component's only type."""
    known = _fields(owner)
    if field not in known:
        raise UsageError(f"offer {text!r}: {field!r} has no options here; those of {', '.join(known)} can be offered")
    options = getattr(owner, field)
    if options is None and field != "type":
        catalogue = SECTIONS[section]
        types: tuple[str, ...] = getattr(owner, "type", None) or ()
        if catalogue is not None and len(types) == 1 and types[0] in getattr(spec, catalogue):
            options = getattr(getattr(spec, catalogue)[types[0]], field, None)
    if options is None:
        raise UsageError(f"offer {text!r}: the problem states nothing for it, so there is nothing to add to")
    if isinstance(options, Mapping):
        raise UsageError(f"offer {text!r}: it has a figure for each processor type; offer a type instead")
    return tuple(options)


def _fields(owner: Any) -> list[str]:
    """The fields of a component that take a list of options."""
    fields = []
    for name, info in type(owner).model_fields.items():
        marks = f"{info.annotation} {info.metadata}"
        if "OneOrMore" in marks and name != "totals":
            fields.append(name)
    return fields


def _value(owner: Any, field: str, value: str, text: str) -> Any:
    info = type(owner).model_fields[field]
    kind: Any = info.annotation
    for mark in info.metadata:
        kind = Annotated[kind, mark]
    adapter: TypeAdapter[Any] = TypeAdapter(kind)
    stated: Any = int(value) if field == "queue_size" and value.isdigit() else value
    try:
        read = adapter.validate_python(stated)
    except ValidationError as error:
        first = error.errors()[0]
        raise UsageError(f"offer {text!r}: {first.get('ctx', {}).get('message', first['msg'])}") from error
    return read[0]


def cheapest_offers(
    problem: Problem, texts: Sequence[str], seed: int, deadline: float | None
) -> tuple[tuple[Offer, ...], bool]:
    """Each offer alone, cheapest design first; where none suffices, the smallest combinations that do.

    False where the time, Ctrl-C or the number of combinations ended it before.
    """
    combined: Iterable[tuple[str, ...]] = (
        group for count in range(1, len(texts) + 1) for group in combinations(texts, count)
    )
    offers: list[Offer] = []
    for position, group in enumerate(combined):
        mended = [offer for offer in offers if offer.price is not None]
        if mended and len(group) > len(mended[0].texts):
            break
        if position >= MOST_COMBINATIONS:
            return _by_price(offers), False
        try:
            with until(deadline):
                offers.append(_tried(with_offers(problem, group).space, group, seed, deadline))
        except (OutOfTime, KeyboardInterrupt):
            return _by_price(offers), False
    return _by_price(offers), True


def _by_price(offers: list[Offer]) -> tuple[Offer, ...]:
    """Offers that make the problem feasible, cheapest first; then single offers that do not."""
    kept = [offer for offer in offers if offer.price is not None or len(offer.texts) == 1]
    return tuple(sorted(kept, key=lambda offer: (offer.price is None, offer.price or 0, offer.texts)))


def _tried(space: Space, texts: tuple[str, ...], seed: int, deadline: float | None) -> Offer:
    price = build_measure(space, Metric("price", "price", None, "price"))
    demanded = replace(space, objectives=())
    design = find_design(demanded, price, seed=seed, time_left=TimeLeft(deadline))
    if design is None:
        return Offer(texts, None, price.counting_unit, {})
    assert Evaluator(demanded).evaluate(design).is_feasible
    return Offer(texts, price.integer(View(design)), price.counting_unit, decisions_of(space, design))
