"""The sections of a classifier: prototypes, features, flows, subcomponents, connections, modes."""

from __future__ import annotations

from collections.abc import Callable

from dse.importers.aadl.syntax.cursor import Cursor
from dse.importers.aadl.syntax.tree import (
    Binding,
    Classifier,
    Connection,
    Feature,
    Flow,
    FlowSpec,
    Mode,
    Path,
    Prototype,
    Reference,
    Subcomponent,
    Value,
)
from dse.importers.aadl.syntax.values import read_association, read_block, read_value

CATEGORIES = (
    "thread group", "subprogram group", "virtual bus", "virtual processor", "abstract", "data", "subprogram", "thread",
    "process", "processor", "memory", "bus", "device", "system",
)  # fmt: skip
"""Of components; those of two words first."""
PORTS = ("event data port", "data port", "event port", "feature group", "parameter", "feature", "port")
ACCESSES = tuple(f"{word} access" for word in ("virtual bus", "bus", "data", "subprogram group", "subprogram"))
CONNECTIONS = (*ACCESSES, "feature group", "feature", "port", "parameter", "access")
SECTIONS = (
    "prototypes", "features", "flows", "subcomponents", "connections", "modes", "requires modes", "properties", "calls",
    "internal features", "processor features",
)  # fmt: skip


def accept_words(cursor: Cursor, choices: tuple[str, ...]) -> str:
    """The first of some texts of one or more words that comes next, or ""."""
    return next((text for text in choices if cursor.accept(*text.split())), "")


def category_of(cursor: Cursor) -> str:
    """A component category, or ""."""
    return accept_words(cursor, CATEGORIES)


def _is_another_section(cursor: Cursor) -> bool:
    if cursor.token.key in ("end", "annex", "inverse"):
        return True
    return any(cursor.sees(*text.split()) and cursor.ahead(len(text.split())).key != ":" for text in SECTIONS)


def read_section(cursor: Cursor, name: str, into: Classifier) -> None:
    """The entries of a section, behind its name.

    Entries are appended to the lists of `into`; an unknown section is skipped entry by entry.
    """
    if cursor.accept("none", ";"):
        return
    readers: dict[str, Callable[[], object]] = {
        "prototypes": lambda: into.prototypes.append(_prototype(cursor)),
        "features": lambda: into.features.append(_feature(cursor)),
        "subcomponents": lambda: into.subcomponents.append(_subcomponent(cursor)),
        "connections": lambda: into.connections.append(_connection(cursor)),
        "flows": lambda: _flow(cursor, into),
        "modes": lambda: _mode(cursor, into),
        "requires modes": lambda: _mode(cursor, into),
        "properties": lambda: into.properties.append(read_association(cursor)),
    }
    reader = readers.get(name, lambda: _skip_entry(cursor))
    while not _is_another_section(cursor):
        reader()


def _skip_entry(cursor: Cursor) -> None:
    """Calls and internal features carry no figure that is looked at."""
    if cursor.token.kind != "name":
        cursor.fail(f'an entry, another section ({", ".join(SECTIONS)}) or "end"')
    cursor.skip(";")
    cursor.expect(";")


def _headed(cursor: Cursor, what: str) -> tuple[str, bool]:
    """``name : [refined to]``."""
    name = cursor.name(f'{what}, another section or "end"')
    cursor.expect(":")
    refined = cursor.accept("refined")
    if refined:
        cursor.expect("to")
    return name, refined


def _in_modes(cursor: Cursor) -> tuple[str, ...] | None:
    """``in modes (a, b => c)``: the modes, or None where it does not stand; ``all`` is None, too."""
    if not cursor.accept("in", "modes"):
        return None
    cursor.expect("(")
    modes = []
    while True:
        modes.append(cursor.name("the name of a mode"))
        if cursor.accept("->"):
            cursor.name("the name of a mode")
        if cursor.accept("=>"):
            cursor.name("the name of a mode")
        if not cursor.accept(","):
            break
    cursor.expect(")", 'a comma or ")"')
    return None if [item.lower() for item in modes] == ["all"] else tuple(modes)


def read_bindings(cursor: Cursor) -> tuple[Binding, ...]:
    """``(prototype => category classifier, …)``, or nothing.

    Actuals that are no classifiers have the classifier None.
    """
    if not (cursor.sees("(") and cursor.ahead().kind == "name" and cursor.ahead(2).key == "=>"):
        return ()
    cursor.expect("(")
    bindings = []
    while True:
        place = cursor.place
        name = cursor.name("the name of a prototype")
        cursor.expect("=>")
        several = cursor.accept("(")
        category_of(cursor)
        accept_words(cursor, ("in out", "in", "out", "provides", "requires"))
        accept_words(cursor, (*PORTS, *ACCESSES))
        reference: Reference | None = None
        inner: tuple[Binding, ...] = ()
        if cursor.token.kind == "name":
            reference = cursor.reference()
            inner = read_bindings(cursor)
        if several:
            cursor.skip(")")
            cursor.expect(")")
            reference = None
        bindings.append(Binding(name, reference, place, inner))
        if not cursor.accept(","):
            break
    cursor.expect(")", 'a comma or ")"')
    return tuple(bindings)


def _dimensions(cursor: Cursor) -> tuple[Value | None, ...]:
    """``[2][N]``; None for ``[]``."""
    dimensions: list[Value | None] = []
    while cursor.accept("["):
        dimensions.append(None if cursor.sees("]") else read_value(cursor))
        cursor.expect("]")
    if dimensions and cursor.sees("("):  # a classifier for each element
        cursor.remark("classifiers for each element of an array are not followed", cursor.place)
        cursor.skip(")")
        cursor.expect(")")
    return tuple(dimensions)


def _prototype(cursor: Cursor) -> Prototype:
    place = cursor.place
    name, _ = _headed(cursor, "a prototype")
    category = category_of(cursor)
    constraint: Reference | None = None
    if not category:
        accept_words(cursor, ("in out", "in", "out", "provides", "requires"))
        accept_words(cursor, (*PORTS, *ACCESSES))
    if cursor.token.kind == "name":
        constraint = cursor.reference()
    _dimensions(cursor)
    read_block(cursor)
    cursor.expect(";")
    return Prototype(name, category, constraint, place)


def _feature(cursor: Cursor) -> Feature:
    place = cursor.place
    name, refined = _headed(cursor, "a feature")
    direction = accept_words(cursor, ("in out", "in", "out", "provides", "requires"))
    kind = accept_words(cursor, (*PORTS, *ACCESSES))
    if not kind and cursor.sees("prototype"):
        kind = "feature"
    if not kind or kind == "port":
        cursor.fail("the kind of the feature (such as event data port, feature group, bus access)")
    if kind == "feature":
        accept_words(cursor, ("prototype",))
    inverse = cursor.accept("inverse")
    if inverse:
        cursor.expect("of")
    classifier = cursor.reference() if cursor.token.kind == "name" else None
    bound = read_bindings(cursor)
    if bound:
        cursor.remark("the prototypes bound here are not followed", bound[0].place)
    dimensions = _dimensions(cursor)
    properties = read_block(cursor)
    _in_modes(cursor)
    cursor.expect(";", 'a classifier, "{" or ";"')
    return Feature(name, kind, direction, classifier, inverse, dimensions, properties, refined, place)


def _subcomponent(cursor: Cursor) -> Subcomponent:
    place = cursor.place
    name, refined = _headed(cursor, "a subcomponent")
    category = category_of(cursor)
    if not category:
        cursor.fail("a category (such as thread, device, virtual bus)")
    classifier = cursor.reference() if cursor.token.kind == "name" and not cursor.sees("in", "modes") else None
    bindings = read_bindings(cursor)
    dimensions = _dimensions(cursor)
    properties = read_block(cursor)
    modes = _in_modes(cursor)
    cursor.expect(";", 'a classifier, "{", "in modes" or ";"')
    return Subcomponent(name, category, classifier, bindings, dimensions, properties, refined, modes, place)


def _connection(cursor: Cursor) -> Connection:
    place = cursor.place
    name, refined = "", False
    if cursor.ahead().key == ":":
        name, refined = _headed(cursor, "a connection")
    elif cursor.token.kind != "name":
        cursor.fail('a connection, another section or "end"')
    kind = accept_words(cursor, CONNECTIONS)
    if not kind:
        cursor.fail("the kind of the connection (such as port, feature group, bus access)")
    source: Path = ()
    target: Path = ()
    both_ways = False
    if cursor.token.kind == "name" and not cursor.sees("in", "modes"):
        source = _end(cursor)
        both_ways = cursor.token.key == "<->"
        if not both_ways and cursor.token.key != "->":
            cursor.fail('"->" or "<->"')
        cursor.take()
        target = _end(cursor)
    elif not refined:
        cursor.fail("the source of the connection")
    properties = read_block(cursor)
    modes = _in_modes(cursor)
    cursor.expect(";", '"{", "in modes" or ";"')
    return Connection(name, kind, source, target, both_ways, properties, refined, modes, place)


def _end(cursor: Cursor) -> Path:
    """The end of a connection; ``self.x`` and ``processor.x`` keep their first word."""
    return cursor.path("a feature")


def _flow(cursor: Cursor, into: Classifier) -> None:
    place = cursor.place
    name, refined = _headed(cursor, "a flow")
    if cursor.accept("end", "to", "end"):
        cursor.expect("flow")
        elements = _elements(cursor, refined)
        properties, modes = read_block(cursor), _in_modes(cursor)
        cursor.expect(";", '"->", "{", "in modes" or ";"')
        into.flows.append(Flow(name, "end to end", elements, properties, refined, modes, place))
        return
    if not cursor.accept("flow"):
        cursor.fail('"flow source", "flow sink", "flow path" or "end to end flow"')
    kind = accept_words(cursor, ("source", "sink", "path"))
    if not kind:
        cursor.fail('"source", "sink" or "path"')
    elements = _elements(cursor, refined)
    properties, modes = read_block(cursor), _in_modes(cursor)
    cursor.expect(";", '"->", "{", "in modes" or ";"')
    if into.is_implementation:
        into.flows.append(Flow(name, kind, elements, properties, refined, modes, place))
        return
    if len(elements) > 2 or (elements and (len(elements) == 2) != (kind == "path")):
        wanted = "two features" if kind == "path" else "one feature"
        cursor.text.fail(f"a flow {kind} of a type has {wanted}", _offset(cursor, place))
    entry = elements[0] if elements and kind != "source" else ()
    leaving = elements[-1] if elements and kind != "sink" else ()
    into.specs.append(FlowSpec(name, kind, entry, leaving, properties, refined, modes, place))


def _offset(cursor: Cursor, place: object) -> int:
    return next(token.offset for token in cursor.tokens if cursor.text.place(token.offset) == place)


def _elements(cursor: Cursor, refined: bool) -> tuple[Path, ...]:
    if refined and (cursor.token.key in ("{", ";") or cursor.sees("in", "modes")):
        return ()
    elements = [cursor.path("an element of the flow")]
    while cursor.accept("->"):
        elements.append(cursor.path("an element of the flow"))
    return tuple(elements)


def _mode(cursor: Cursor, into: Classifier) -> None:
    place = cursor.place
    if cursor.ahead().key == "-[":  # a transition without a name
        _transition(cursor)
        return
    name, _ = _headed(cursor, "a mode")
    initial = cursor.accept("initial")
    if cursor.accept("mode"):
        _say_unread(cursor, "mode")
        cursor.expect(";")
        into.modes.append(Mode(name, initial, place))
    elif not initial and cursor.ahead().key == "-[":
        _transition(cursor)
    else:
        cursor.fail('"mode", "initial mode" or a transition')


def _transition(cursor: Cursor) -> None:
    """Which mode follows which is not looked at: each is analysed by itself."""
    cursor.name("the name of a mode")
    cursor.expect("-[")
    while cursor.token.key not in ("]->", ";") and cursor.token.kind != "end":
        cursor.take()
    cursor.expect("]->")
    cursor.name("the name of a mode")
    _say_unread(cursor, "mode transition")
    cursor.expect(";")


def _say_unread(cursor: Cursor, of: str) -> None:
    """Read the properties of a mode or of a transition: no figure here depends on them."""
    for association in read_block(cursor):
        cursor.remark(f"{association.name} of a {of} is not looked at", association.place)
