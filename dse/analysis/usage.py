"""How much of a processor or a bus is used, by whom: sums of work, bytes or time on the bus, each times a rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import ceil, gcd, lcm

from dse.analysis.binding import (
    bit_times_ns,
    bus_stack,
    byte_times_ns,
    carrying_ns,
    overhead_bytes,
    own_core,
    sent_as,
    travels_whole,
    way_bytes,
    ways_over,
)
from dse.analysis.memo import Recall
from dse.analysis.rates import RateKey, source_rates_hz
from dse.analysis.terms import ZERO, Term, product_term
from dse.analysis.views import View
from dse.space.architecture.carriers import carriers
from dse.space.architecture.frames import bit_units, frame_at, wire_bytes
from dse.space.model.space import Connection, Space
from dse.space.model.trees import at, leaves
from dse.support.units import Exact, unrounded

ADDITIVE = ("can", "serial")
"""Frames in which each byte takes as long as any other: of CAN as far as one frame holds all."""


def utilisation_terms(space: Space, processor: int, core: int | None = None) -> tuple[Term, ...]:
    """Utilisation of a processor in ppm of one core: worst execution time on its type * activation rate, per thread.

    Of one `core`, from 1, alone: by the threads whose core that is. A hybrid thread's callback works at its input rate,
    its timer at 1 / period (docs/semantics.md, section 4.1). The component of a term is the thread, or the first one of
    its executor: what is put on a core as a whole.
    """
    terms = []
    for number, component in enumerate(space.components):
        if component.processor is None or processor not in set(leaves(component.processor)):
            continue
        if component.execution_ns is not None:
            terms.append(_work_term(space, processor, core, number, "activation"))
        if component.callback_ns is not None and "hybrid" in set(leaves(component.protocol)):
            terms.append(_work_term(space, processor, core, number, "input"))
    return tuple(terms)


def _work_term(space: Space, processor: int, core: int | None, number: int, kind: str) -> Term:
    component = space.components[number]
    key: RateKey = ("input", number) if kind == "input" else ("activation", number)
    tree = component.callback_ns if kind == "input" else component.execution_ns

    def coefficient(view: View) -> Fraction:
        """Worst execution time in microseconds: times a rate in Hz, that is ppm."""
        if at(component.processor, view) != processor:
            return ZERO
        if kind == "input" and at(component.protocol, view) != "hybrid":
            return ZERO
        if core is not None and _core(space, processor, number, view) != core:
            return ZERO
        rate = at(tree, view)
        if rate is None:
            return ZERO
        worst = rate[1]
        return Fraction(worst, 1000) if type(worst) is int else (ZERO + worst) / 1000

    label = component.name if kind == "activation" else f"{component.name} (callback)"
    return product_term(space, label, coefficient, key, _put_with(space, number))


def _put_with(space: Space, number: int) -> str:
    """The name of the first thread that has its core with a thread in any design; its own where that is a decision."""
    executor = space.components[number].executor
    is_open = executor is not None and any(space.executors[item].is_open for item in leaves(executor))
    return space.components[number if is_open else space.unit(number, [])].name


def _core(space: Space, processor: int, number: int, view: View) -> int:
    """The core of a thread that runs on a processor, stated or chosen (see `dse.space.question.metrics`).

    Where a study gives a processor of one core another, threads of a design that chose none stay on the first.
    """
    return own_core(space, number, view, max(1, at(space.processors[processor].cores, view))) or 1


def load_terms(space: Space, bus: int) -> tuple[Term, ...]:
    """Load of a bus in B/s: (size + overhead bytes) * rate, or the stated data rate, per connection (section 5).

    With frames it is that of the wire: the most bits of a message / 8 * rate (docs/semantics.md, section 5.3).
    """
    terms = []
    reach = all_reachable_buses(space)
    for number, connection in enumerate(space.connections):
        if bus not in reach[number]:
            continue
        terms.append(_load_term(space, bus, number, connection))
    return tuple(terms)


def reachable_buses(space: Space, connection: Connection) -> frozenset[int]:
    """Every bus that may carry the connection, directly or under a virtual bus.

    Indices of buses, over all options of the connection and of what carries it.
    """
    return carriers(space.buses, connection)


_REACH: Recall[tuple[frozenset[int], ...]] = Recall()


def all_reachable_buses(space: Space) -> tuple[frozenset[int], ...]:
    """The buses that may carry each connection, directly or under a virtual bus, by the connection's number.

    One frozenset of bus indices for each connection; remembered for each space.
    """

    def found(space: Space, _: object, __: View) -> tuple[frozenset[int], ...]:
        return tuple(reachable_buses(space, item) for item in space.connections)

    return _REACH.recall(space, "buses", View(()), found)


def _load_term(space: Space, bus: int, number: int, connection: Connection) -> Term:
    if connection.data_rate is not None:

        def stated(view: View) -> Fraction:
            ways = _ways(space, bus, number, view)
            rate: Fraction = ZERO + at(connection.data_rate, view)
            if not ways or frame_at(space.buses[bus].fixed_ns, view) is None:
                return rate * len(ways)
            each: Fraction = _carried_bytes(space, bus, number, ways, view) / at(connection.size_bytes, view)
            return rate * each

        return Term(connection.name, stated, component=connection.name)

    def coefficient(view: View) -> Fraction:
        return _carried_bytes(space, bus, number, _ways(space, bus, number, view), view)

    return product_term(space, connection.name, coefficient, ("delivery", number), connection.name)


def _ways(space: Space, bus: int, number: int, view: View) -> list[tuple[int, ...]]:
    """The ways on which a bus carries a connection, but those on which it does for an earlier one."""
    ways = ways_over(space, space.connections[number], bus, view)
    return [way for way in ways if not _is_repeated(space, way[0], number, view)]


def _is_repeated(space: Space, head: int, number: int, view: View) -> bool:
    """Whether a bus that a connection is bound to carries an earlier one of its port: sent once."""
    connection = space.connections[number]
    if connection.from_port is None:
        return False
    port = (connection.source, connection.from_port)
    return bool(at(space.buses[head].broadcast, view)) and any(
        (other.source, other.from_port) == port and head in bus_stack(space, other, view)
        for other in space.connections[:number]
    )


def _carried_bytes(space: Space, bus: int, number: int, ways: Sequence[Sequence[int]], view: View) -> Fraction:
    """What a bus carries for one message: its bytes with all overheads, or with frames the most that it takes."""
    slot, total = space.buses[bus], ZERO
    frame = frame_at(slot.fixed_ns, view) if ways else None

    def carried(size: Exact) -> Exact:
        return size if frame is None else wire_bytes(frame, ceil(size), at(slot.bandwidth_bps, view))

    for way in ways:
        total = total + _part(space, bus, number, way, view, carried)
    return total


def _part(
    space: Space, bus: int, number: int, way: Sequence[int], view: View, taken: Callable[[Exact], Exact]
) -> Exact:
    """The share of a bus's load or busy time that a connection has, as `taken` gives it for a message of a size in B.

    In a frame of several connections each has what its data take, and the one whose message it is all else. Where that
    is no sum of parts (CAN FD fills up), or some of them may stay on a processor, one of them has it all.
    """
    connection = space.connections[number]
    if connection.carried_in is None and not connection.riders:
        return taken(way_bytes(space, connection, way, view))
    frame = frame_at(space.buses[bus].fixed_ns, view)
    if (frame is None or frame.protocol in ADDITIVE) and travels_whole(space, number):
        is_carried = at(connection.carried_in, view) is not None
        around = overhead_bytes(space, way, view)
        whole = taken(around + at(connection.size_bytes, view))
        return whole - taken(around) if is_carried else whole
    is_counted = sent_as(space, number, bus, view) == number
    return taken(way_bytes(space, connection, way, view)) if is_counted else ZERO


def payload_terms(space: Space, bus: int) -> tuple[Term, ...]:
    """The load of a bus without its frames, in B/s: what OSATE counts.

    `Term` objects of data without headers, gaps and stuff bits (docs/semantics.md, section 3.7).
    """
    slot = replace(space.buses[bus], fixed_ns=None)
    return load_terms(replace(space, buses=(*space.buses[:bus], slot, *space.buses[bus + 1 :])), bus)


def busy_terms(space: Space, bus: int) -> tuple[Term, ...]:
    """Busy time of a physical bus in ppm: longest transmission time * message rate, per connection.

    See docs/semantics.md, section 5.2.
    """
    reached = (number for number, buses in enumerate(all_reachable_buses(space)) if bus in buses)
    return tuple(_busy_term(space, bus, number) for number in reached)


def _busy_term(space: Space, bus: int, number: int) -> Term:
    connection = space.connections[number]

    def coefficient(view: View) -> Fraction:
        """Longest time on the bus in microseconds: times a rate in Hz, that is ppm."""

        def taken(size: Exact) -> Exact:
            times = carrying_ns(space, space.buses[bus], connection, size, view)
            return ZERO if times is None else times[1]

        total = ZERO
        for way in ways_over(space, connection, bus, view):
            total = total + _part(space, bus, number, way, view, taken)
        return total / 1000

    return product_term(space, connection.name, coefficient, ("delivery", number), connection.name)


def utilisation_scale(space: Space, terms: Sequence[Term]) -> int:
    """The common denominator of all utilisations, in ppm, that the terms can sum to.

    Of execution times over periods, over all options that the terms may take.
    """

    def work(term: Term) -> set[Fraction]:
        assert term.rate is not None
        kind, number = term.rate
        component = space.components[number]
        tree = component.callback_ns if kind == "input" else component.execution_ns
        return {Fraction(leaf[1], 1000) for leaf in leaves(tree) if leaf is not None}

    return _scale(space, terms, work)


def load_scale(space: Space, bus: int, terms: Sequence[Term]) -> int:
    """The common denominator of all loads, in B/s, that the terms can sum to.

    Of sizes times rates, over all options; with frames also of bits on the wire.
    """

    def sizes(term: Term) -> set[Fraction]:
        return plain_sizes(_connection(space, term)) | wire

    wire = {unit / 8 for unit, _ in bit_units(space.buses[bus].fixed_ns, space.buses[bus].bandwidth_bps)}

    def plain_sizes(connection: Connection) -> set[Fraction]:
        return _sizes(space, connection) or {Fraction(0)}

    whole = 1
    for connection in (_connection(space, term) for term in terms if term.rate is None):
        each = [unit / size for unit in wire for size in leaves(connection.size_bytes) if size]
        rates = [Fraction(leaf) for leaf in leaves(connection.data_rate)]
        whole = lcm(whole, *((rate * part).denominator for rate in rates for part in (1, *each)))
    return lcm(whole, _scale(space, [term for term in terms if term.rate is not None], sizes))


def busy_scale(space: Space, bus: int, terms: Sequence[Term]) -> int:
    """The common denominator of all busy times, in ppm, that the terms can sum to.

    Of transmission times times rates, over all options of bus type and size.
    """
    slot = space.buses[bus]

    def times(term: Term) -> set[Fraction]:
        """Times of the fixed part and of all bytes: what both give together has no other denominators."""
        connection = _connection(space, term)
        sizes = _sizes(space, connection) - {Fraction(0)}
        fixed, per_byte = (
            {Fraction(leaf[1]) for leaf in leaves(tree) if isinstance(leaf, tuple)}
            for tree in (slot.fixed_ns, slot.per_byte_ns)
        )
        each = per_byte | byte_times_ns(slot)
        return {part / 1000 for part in fixed | bit_times_ns(slot) | {one * size for one in each for size in sizes}}

    return _scale(space, terms, times)


def _connection(space: Space, term: Term) -> Connection:
    if term.rate is not None:
        return space.connections[term.rate[1]]
    return next(item for item in space.connections if item.name == term.label)


def _sizes(space: Space, connection: Connection) -> set[Fraction]:
    """The sizes that a message may have on its buses, or others with the same denominators where there are overheads.

    Under OSATE's profiles those that are stated in bits count as they are.
    """
    data = {leaf for leaf in leaves(connection.size_bytes) if leaf is not None}
    extra = {
        leaf for bus in reachable_buses(space, connection) for leaf in leaves(space.buses[bus].overhead_bytes) if leaf
    }
    stated = {Fraction(leaf if space.profile == "dse" else unrounded(leaf)) for leaf in data | extra}
    whole = lcm(*(size.denominator for size in stated))
    is_shared = bool(connection.riders) or connection.carried_in is not None
    return {Fraction(1, whole)} if extra or is_shared else stated


def _scale(space: Space, terms: Sequence[Term], coefficients: Callable[[Term], set[Fraction]]) -> int:
    """The common denominator of every coefficient times every source rate.

    `coefficients` gives all that a term may have, or others with the same denominators.
    """
    sources = source_rates_hz(space)
    scale = 1
    for term in terms:
        assert term.rate is not None
        factors = {factor.as_integer_ratio() for factor in coefficients(term)}
        rates = [rate.as_integer_ratio() for rate in sources[term.rate]]
        for above, below in factors:
            for over, under in rates:  # the denominator of the product; fractions would take five times as long
                whole = below * under
                scale = lcm(scale, whole // gcd(above * over, whole))
    return scale
