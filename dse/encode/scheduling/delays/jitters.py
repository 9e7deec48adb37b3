"""Release jitter in the search's model: at least what is added on the way to a thread that events release.

A variable for each thread that another one releases: what the connection to it varies, what the job before varies and
waits, and the jitter of that one. Threads that may be one chain vary and wait together
(`dse.encode.scheduling.delays.chains`). All rows are necessary conditions.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Protocol

from ortools.sat.python import cp_model

from dse.analysis.binding import transmission_ns
from dse.analysis.rates import is_event_triggered
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses
from dse.analysis.scheduling.tasks import alone_ns, longest_alone_ns, shortest_alone_ns
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.encode.linear import Board, Form, floor_int
from dse.encode.scheduling.delays.chains import ChainRows, Waiting
from dse.space.architecture.chains import way_up
from dse.space.model.space import Component
from dse.space.model.trees import leaves
from dse.support.units import Exact


class WaitingOfAll(Waiting, Protocol):
    """The interface of the waiting times of threads and chains that these rows use."""

    chains: ChainRows

    def expression(self, form: Form) -> Any:
        """A form in the model's variables."""


class Jitters:
    """The jitter of the releases of threads in one model, in its unit of time."""

    def __init__(self, waiting: WaitingOfAll) -> None:
        self.waiting = waiting
        self.variables: dict[int, int] = {}
        self.upstream: dict[int, int] = {}
        """What dispatches a thread whose jitter is known: its only source."""

    def copy(self, waiting: WaitingOfAll) -> Jitters:
        """The jitter of the same threads in a copy of the model."""
        other = Jitters(waiting)
        other.variables, other.upstream = self.variables, self.upstream  # nothing is added once there are copies
        return other

    def add(self, board: Board, number: int, below: frozenset[int]) -> cp_model.IntVar | None:
        """At least the jitter of the only source, and what its job and the connection add, where events dispatch it.

        None where several sources do, or one that holds events back.
        """
        if number in self.variables:
            return self.waiting.combined.variable(self.variables[number])
        component = self.waiting.space.components[number]
        eager = self._eager(board, component)
        if eager is None or len(component.triggers) != 1 or number in below:
            return None
        wire = self.waiting.space.connections[component.triggers[0]]

        def carrying(view: View) -> int:
            if not is_event_triggered(component, view):
                return 0
            least, most, _ = transmission_ns(self.waiting.space, wire, view)
            return floor_int(Fraction(most - least) * self.waiting.scale)

        forms, waits = [board.form(board.table(carrying))], list[Any]()
        if wire.source is not None and wire.rate_hz is None and wire.data_rate is None:
            if len(way_up(self.waiting.space, wire.source)) > 1:
                return self._chained_jitter(board, number, wire.source, forms[0], eager, below)
            source = self.waiting.space.components[wire.source]
            if "sporadic" in set(leaves(source.protocol)):
                return None

            def varying(view: View, number: int = wire.source) -> int:
                shortest = shortest_alone_ns(self.waiting.space, number, "thread", view)
                return self.waiting.scale * (longest_alone_ns(self.waiting.space, number, "thread", view) - shortest)

            forms.append(board.form(board.table(varying)))
            self.upstream[number] = wire.source
            if wire.source in self.waiting.places.threads and self.waiting.executes(wire.source):
                waits.append(self.waiting.chains.variable(FlowChain((wire.source,), has_source=True)))
            further = self.add(board, wire.source, below | {number})
            if further is not None:
                waits.append(further)
        most = sum(form.high for form in forms) + sum(
            self.waiting.model.proto.variables[item.index].domain[1] for item in waits
        )
        variable = self.waiting.model.new_int_var(0, most, "")  # several on the way may have no bound
        parts = [self.waiting.expression(form) for form in forms]
        self.waiting.model.add(variable >= sum([*parts, *waits])).only_enforce_if(self.waiting.combined.literal(eager))
        self.variables[number] = variable.index
        return variable

    def _chained_jitter(
        self, board: Board, number: int, source: int, carried: Form, eager: int, below: frozenset[int]
    ) -> cp_model.IntVar:
        """At least the jitter that the connection to a thread adds, behind a thread that may be chained itself.

        Where events release all threads of a part of that chain but the first, and a timer releases that one or it is
        the first of all, what they vary and wait together is in it, too.
        """
        chain = way_up(self.waiting.space, source)
        chain = chain[
            max((place + 1 for place, item in enumerate(chain) if not self.waiting.executes(item)), default=0) :
        ]
        self.upstream[number] = source
        variable = self.waiting.model.new_int_var(
            0, carried.high + 2 * len(chain) * UNBOUNDED_NS * self.waiting.scale, ""
        )
        self.variables[number] = variable.index
        where = [eager]
        self.waiting.model.add(variable >= self.waiting.expression(carried)).only_enforce_if(
            self.waiting.combined.literal(eager)
        )
        if any("sporadic" in set(leaves(self.waiting.space.components[item].protocol)) for item in chain):
            return variable
        for start in reversed(range(len(chain))):
            part, first = chain[start:], self.waiting.places.threads.get(chain[start])
            total = (
                self.waiting.expression(carried)
                + self.waiting.expression(self._varying(board, part))
                + self.waiting.chains.variable(FlowChain(part, has_source=True))
            )
            for literal, _ in [item for item in (first.modes if first is not None else ()) if item[1] is not None]:
                held = [self.waiting.combined.literal(index) for index in (*where, literal)]
                self.waiting.model.add(variable >= total).only_enforce_if(held)
            eager_one = self._eager(board, self.waiting.space.components[chain[start]])
            if eager_one is None:
                break
            where.append(eager_one)
            if not start and chain == way_up(self.waiting.space, source):
                further = self.add(board, chain[0], below | {number})
                held = [self.waiting.combined.literal(index) for index in where]
                self.waiting.model.add(variable >= total + (0 if further is None else further)).only_enforce_if(held)
        return variable

    def _varying(self, board: Board, chain: Sequence[int]) -> Form:
        """How much more than at least the threads of a chain take at most by themselves."""

        def varying(view: View) -> int:
            times = (alone_ns(self.waiting.space.components[item], "thread", view) for item in chain)
            return self.waiting.scale * sum(most - least for least, most in times)

        return board.form(board.table(varying))

    def _eager(self, board: Board, component: Component) -> int | None:
        """A literal that is true where events dispatch a component; None where they never do."""
        found = [literal for literal, value in board.table(lambda view: is_event_triggered(component, view)) if value]
        return board.any_of(found).index if found else None

    def before(self, number: int, view: View) -> list[int]:
        """The thread that dispatches one in a design, the one before it and so on, whose waiting is its jitter."""
        found: list[int] = []
        while number in self.upstream and is_event_triggered(self.waiting.space.components[number], view):
            number = self.upstream[number]
            found.append(number)
        return found

    def of(self, number: int, view: View) -> Exact:
        """The jitter of a thread's releases in a design, as the rows count it."""
        chain = self.before(number, view)
        known = all_responses(self.waiting.space, view)
        total: Exact = 0
        for target, source in zip([number, *chain], [*chain, None], strict=True):
            component = self.waiting.space.components[target]
            if target not in self.variables or not is_event_triggered(component, view):
                break
            least, most, _ = transmission_ns(
                self.waiting.space, self.waiting.space.connections[component.triggers[0]], view
            )
            total += most - least
            if source is not None:
                alone = longest_alone_ns(self.waiting.space, source, "thread", view)
                found = known.get((source, "thread"), alone)
                response = UNBOUNDED_NS if found is None else max(found, alone)
                total += response - shortest_alone_ns(self.waiting.space, source, "thread", view)
        return total
