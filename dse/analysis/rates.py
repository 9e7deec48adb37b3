"""Activation rates: how often threads and devices run, and messages leave (docs/semantics.md, section 2)."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

from dse.analysis.views import View
from dse.space.architecture.joins import ALL, LATEST
from dse.space.model.arrivals import Arrivals, CyclicActivation, arrivals_of
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import NotOffered, at, leaves
from dse.spec.kinds import POLLING
from dse.support.graphs import shortest_cycle, strong_components
from dse.support.units import Exact

NS_PER_S = 10**9
ZERO = Fraction(0)
RateKey: TypeAlias = tuple[Literal["activation", "input", "slowest", "delivery"], int]


def is_event_triggered(component: Component, view: View) -> bool:
    """Aperiodic, sporadic, or neither protocol nor period stated.

    Jobs are then released by messages, at the rate of the inputs (docs/semantics.md, section 2).
    """
    return arrivals(component, view).by_inputs


def arrivals(component: Component, view: View) -> Arrivals:
    """The arrival rule by which the jobs of a component are released.

    The rule of its dispatch protocol in this design.
    """
    protocol = at(component.protocol, view)
    return arrivals_of(protocol, has_period=protocol is None and at(component.period_ns, view) is not None)


def is_periodic(component: Component, view: View) -> bool:
    """Has a period and is not explicitly sporadic or aperiodic; a hybrid component's timer is periodic.

    The complement of `is_event_triggered` in this design.
    """
    return not is_event_triggered(component, view)


def passes_rates_on(component: Component, view: View) -> bool:
    """Whether the rate of a component follows from those of its inputs: it is event-triggered, or waits for all.

    A cycle of such components has no rate, so that the design is invalid.
    """
    arrival = arrivals(component, view)
    return arrival.by_inputs or (arrival.by_timer and is_joined(component, view))


def is_joined(component: Component, view: View) -> bool:
    """Whether a job of a component needs a message of each of its triggers.

    True for ``join: all`` (docs/semantics.md, section 3.8).
    """
    return bool(at(component.join, view) == ALL)


def input_room(space: Space, component: Component, wire: int, view: View) -> int | None:
    """The largest number of messages of a trigger of a join of all that wait for the others; None: no limit.

    The timer of a hybrid thread takes all that has come, and so does a pairing of the newest.
    """
    if not arrivals(component, view).by_inputs or at(component.pairing, view) == LATEST:
        return 1
    size = at(space.connections[wire].queue_size, view)
    size = at(component.queue_size, view) if size is None else size
    return None if size is None else max(1, size)


def kept_jobs(space: Space, component: Component, part: str, view: View) -> int | None:
    """The most jobs of a task that wait in an executor that polls while one runs; None where all that come wait.

    A timer has one: a release that comes while a job of it waits is skipped. What one connection dispatches has as many
    as the `queue_size` that is stated for it: the oldest message makes place for a new one.
    """
    if not may_poll(space, component) or not polls(space, component, view):
        return None
    arrival = arrivals(component, view)
    if is_joined(component, view) or arrival.is_separated:
        return None
    if part == "thread" and arrival.by_timer:
        return 1
    if len(component.triggers) != 1:
        return None
    size = at(space.connections[component.triggers[0]].queue_size, view)
    size = at(component.queue_size, view) if size is None else size
    return None if size is None else max(1, size)


def may_poll(space: Space, component: Component) -> bool:
    """Whether an executor that polls runs a thread in some design."""
    homes = [space.executors[number] for number in leaves(component.executor) if number is not None]
    return any(POLLING in leaves(home.kind) for home in homes)


def polls(space: Space, component: Component, view: View) -> bool:
    """Whether an executor that polls runs a thread."""
    number = at(component.executor, view)
    return number is not None and at(space.executors[number].kind, view) == POLLING


def rate_hz(space: Space, key: RateKey, view: View) -> Fraction:
    """The rate that `key` names, in Hz: of a component's activation or input, or of a connection's deliveries.

    * activation: 1 / period; event-triggered: the sum of the rates at which trigger connections deliver, or the least
      of them in a join of all; sporadic, and hybrid in such a join: at most 1 / period
    * input: that sum, also for a hybrid component, whose callback runs at it; slowest: the least of these rates
    * delivery: the rate that the connection states, its data rate over its data size, or the activation rate of its
      source

    Raises
    ------
    CyclicActivation
        when event-triggered components dispatch each other in a cycle.
    """
    known = view.memo.get(key)
    if known is None:
        known = _summed_up(space, key, view)
    rate: Fraction = known
    return rate


def _summed_up(space: Space, key: RateKey, view: View) -> Fraction:
    """A rate and those it is made of, each once; without recursion, for chains are as long as a problem has threads."""
    memo = view.memo
    pending = {key: _rate_hz(space, key, view)}
    rate: Fraction | None = None
    while pending:
        current, steps = next(reversed(pending.items()))
        try:
            wanted = next(steps) if rate is None else steps.send(rate)
        except StopIteration as end:
            memo[current] = rate = end.value
            del pending[current]
            continue
        rate = memo.get(wanted)
        if rate is None:
            if wanted in pending:
                raise CyclicActivation
            pending[wanted] = _rate_hz(space, wanted, view)
    assert rate is not None
    return rate


def _rate_hz(space: Space, key: RateKey, view: View) -> Generator[RateKey, Fraction, Fraction]:
    """The rate that `key` names, from the rates that it yields the keys of."""
    kind, number = key
    if kind == "activation":
        rule = dispatch(space.components[number], view)
        if not rule.by_inputs:
            return rule.own
        arriving = yield (rule.arriving, number)
        return rule.own + (arriving if rule.most is None else min(arriving, rule.most))
    if kind == "input":
        arriving = ZERO
        for wire in space.components[number].triggers:
            arriving += yield ("delivery", wire)
        return arriving
    if kind == "slowest":
        slowest: Fraction | None = None
        for wire in space.components[number].triggers:
            delivered = yield ("delivery", wire)
            slowest = delivered if slowest is None else min(slowest, delivered)
        return slowest or ZERO
    connection = space.connections[number]
    if connection.states_rate:
        return stated_hz(connection, view)
    return ZERO if connection.sender is None else (yield ("activation", connection.sender))


# --- the rules, which the encoder tabulates ---------------------------------------------------------------------------


class Dispatch(NamedTuple):
    """The rate of a component in Hz: its `own`, and where inputs release jobs theirs, at most `most` of it.

    Theirs is their sum, or where a job needs a message of each trigger that of the slowest.
    """

    own: Fraction
    by_inputs: bool = False
    most: Fraction | None = None
    joins: bool = False

    @property
    def arriving(self) -> Literal["input", "slowest"]:
        """The rate of the inputs that counts.

        ``input`` is the sum of all triggers' rates, ``slowest`` the least of them, which decides for a join of all.
        """
        return "slowest" if self.joins else "input"


def dispatch(component: Component, view: View) -> Dispatch:
    """The rule by which a component gets its rate.

    A `Dispatch` with rates in Hz, exact: the timer's, whether inputs count, the most that a separation admits, and
    whether inputs are joined.
    """
    arrival = arrivals(component, view)
    timer = _frequency_hz(at(component.period_ns, view)) if arrival.has_period else ZERO
    joins = is_joined(component, view)
    if joins and arrival.by_timer:  # a hybrid thread goes on at a release if all have come
        return Dispatch(ZERO, True, timer, True)
    return Dispatch(
        timer if arrival.by_timer else ZERO, arrival.by_inputs, timer if arrival.is_separated else None, joins
    )


def _frequency_hz(period_ns: Exact) -> Fraction:
    """How often per second something of a period comes."""
    return _plain_frequency_hz(period_ns) if type(period_ns) is int else NS_PER_S / (ZERO + period_ns)


@lru_cache(maxsize=4096)
def _plain_frequency_hz(period_ns: int) -> Fraction:
    return Fraction(NS_PER_S, period_ns)


def stated_hz(connection: Connection, view: View) -> Fraction:
    """The rate that a connection states: itself, or by its data rate over its size; 0 of messages without a size.

    In Hz, exact.
    """
    if connection.rate_hz is not None:
        rate: Fraction = ZERO + at(connection.rate_hz, view)
        return rate
    size = at(connection.size_bytes, view)
    messages: Fraction = (ZERO + at(connection.data_rate, view)) / size if size else ZERO
    return messages


def summands(space: Space, key: RateKey) -> list[RateKey]:
    """The rates that a rate is the sum, or the larger, or the smaller of.

    Keys, by which `rate_hz` computes recursively: activation from inputs, inputs from deliveries, deliveries from the
    sender's activation.
    """
    kind, number = key
    if kind == "activation":
        return [("input", number)]
    if kind in ("input", "slowest"):
        return [("delivery", wire) for wire in space.components[number].triggers]
    sender = space.connections[number].sender
    return [("activation", sender)] if sender is not None else []


def source_rates_of(space: Space, key: RateKey) -> frozenset[Fraction]:
    """The rates that a timer or a connection states at this point, over all designs.

    In Hz, exact: the rates that enter the system at this point, for a common denominator of all rates.
    """
    kind, number = key
    if kind == "activation":
        periods = [leaf for leaf in leaves(space.components[number].period_ns) if leaf is not None]
        return frozenset(Fraction(NS_PER_S, period) for period in periods)
    if kind in ("input", "slowest") or not space.connections[number].states_rate:
        return frozenset()
    connection = space.connections[number]
    if connection.rate_hz is not None:
        return frozenset(Fraction(leaf) for leaf in leaves(connection.rate_hz))
    sizes = {leaf for leaf in leaves(connection.size_bytes) if leaf}
    return frozenset(Fraction(leaf) / size for leaf in leaves(connection.data_rate) for size in sizes)


def active_cycle(space: Space, view: View) -> list[int]:
    """The components of a shortest cycle of dispatches in a design that has one, the first again at the end.

    Component indices; the cycle with the least index is chosen, so that the message is stable.
    """
    eager = {number for number, item in enumerate(space.components) if _is_surely_eager(item, view)}
    graph: dict[int, list[int]] = {number: [] for number in eager}
    for target in sorted(eager):
        for connection in (space.connections[number] for number in space.components[target].triggers):
            if connection.sender in eager:
                graph[connection.sender].append(target)
    cycles = [members for members in strong_components(graph) if len(members) > 1 or members[0] in graph[members[0]]]
    cycle = shortest_cycle(graph, min(min(members) for members in cycles))
    return [*cycle, cycle[0]]


def _is_surely_eager(component: Component, view: View) -> bool:
    """Whether its rate is that of its inputs; an option that is not offered is none."""
    try:
        return passes_rates_on(component, view)
    except NotOffered:
        return False


def source_rates_hz(space: Space) -> Mapping[RateKey, frozenset[Fraction]]:
    """For each rate the source rates that it is a sum of multiples of, over all designs; for common denominators.

    Every measure of utilisation and load asks for them, so those of the last architecture are kept: 80 processors and
    buses of 1000 threads took half a minute without.
    """
    for components, connections, known in _LAST:
        if components is space.components and connections is space.connections:
            return known
    rates = _find_source_rates(space)
    _LAST[:] = [(space.components, space.connections, rates)]
    return rates


_LAST: list[tuple[tuple[Component, ...], tuple[Connection, ...], Mapping[RateKey, frozenset[Fraction]]]] = []


def _find_source_rates(space: Space) -> dict[RateKey, frozenset[Fraction]]:
    rates = {key: source_rates_of(space, key) for key in all_keys(space)}
    sums: dict[RateKey, list[RateKey]] = {key: [] for key in rates}
    for key in rates:
        for item in summands(space, key):
            sums[item].append(key)
    grown = deque(rates)
    while grown:
        key = grown.popleft()
        for larger in sums[key]:
            if not rates[key] <= rates[larger]:
                rates[larger] |= rates[key]
                grown.append(larger)
    return rates


def all_keys(space: Space) -> list[RateKey]:
    """Every rate that a space has.

    Deliveries of connections first, then inputs, slowest input and activation of each component.
    """
    keys: list[RateKey] = [("delivery", number) for number in range(len(space.connections))]
    for number in range(len(space.components)):
        keys += [("input", number), ("slowest", number), ("activation", number)]
    return keys
