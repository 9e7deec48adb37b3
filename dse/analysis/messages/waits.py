"""The response times of messages of a design, told bus by bus: what each waits for until it is there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Annotated

from dse.analysis.binding import frame_of
from dse.analysis.messages.stages import bus_of, counted_buses, message_key, wrapping_ns
from dse.analysis.scheduling.busy_window import Stream
from dse.analysis.scheduling.fixed_point import Window
from dse.analysis.scheduling.model import NO_PROCESSOR
from dse.analysis.scheduling.parts import Delay, Parts
from dse.analysis.scheduling.resolve import resource_of_bus
from dse.analysis.scheduling.responses import messages_of
from dse.analysis.scheduling.waits import stated_name
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.space.model.space import Connection, Design, Space
from dse.space.model.trees import at
from dse.spec.schema.fields import ANY_IDENTIFIER
from dse.support.json_fields import Data, Json, Of
from dse.support.units import Exact

NOTHING = Parts()


class Precedence(Data):
    """Messages that go before another one.

    Names are those of connections; times in ns.
    """

    WRITTEN = (
        Of("name", "The message that goes first, by its connection.", key="message", kind=str),
        Of("jobs", "How many of it, from the beginning of the busy period on.", kind=int),
        Of("work_ns", "What these take together.", kind=Fraction),
    )


@dataclass(frozen=True)
class MessageResponse:
    """How long a message takes at most from when it is handed to its bus until it is there.

    That is its longest transmission, what keeps the bus when it comes, the messages that go before it and earlier ones
    of its own, and faults of the wire, less what is over when it comes. Its `window` decides that.
    """

    WRITTEN = (
        *("name", "carries", "identifier", "priority", "transmission_ns", "releases", "blocking_ns", "blocked_by"),
        *("interference", "earlier_ns", "faults", "faults_ns", "over_ns", "response_ns", "deadline_ns"),
        *("meets_deadline", "because", "needed_ppm"),
    )

    name: Annotated[str, "The connection whose message it is."]
    identifier: Annotated[int | None, "Its identifier, stated or chosen; null where it has none."]
    transmission_ns: Annotated[tuple[Exact, Exact], "The shortest and the longest time of its frames alone."]
    releases: Annotated[tuple[Stream, ...] | None, "When it is handed to the bus; null where its jitter has no bound."]
    response_ns: Annotated[Exact | None, "The longest time from then until it is there; null without a bound."]
    deadline_ns: Annotated[int | None, "The least deadline of what is in the message; null where there is none."]
    meets_deadline: Annotated[
        bool | None, "Whether that is met, with whatever else carries the message; null without one."
    ]
    parts: Parts = NOTHING
    blocker: str = ""
    because: Annotated[
        tuple[str, ...], "Of one without a bound those because of which it has none; missing without.", Json(default=())
    ] = ()
    needed_ppm: Annotated[
        Fraction | None,
        "Of one without a bound of which no other is the cause: the share of the bus that it and what goes first need, "
        "in ppm, where that is all or more; missing elsewhere.",
        Json(default=None),
    ] = None
    carries: Annotated[
        tuple[str, ...], "The other connections whose data are in the message; missing without.", Json(default=())
    ] = ()
    window: Window | None = None
    priority: Annotated[
        int | None, "Its priority where this decides, on Ethernet; missing elsewhere.", Json(default=None)
    ] = None

    @property
    def interference(self) -> Annotated[tuple[Delay, ...], Json(kind=tuple[Precedence, ...])]:
        """The messages that go before it, the worst one; empty where it has no bound.

        One `Delay` in ns for each message, with the number of its frames; from the busy period that gives the response
        time.
        """
        return self.parts.delays()

    @property
    def blocking_ns(self) -> Exact:
        """The blocking: the longest time that a less urgent frame that has begun keeps the bus.

        In ns; at most one frame blocks, because frames are not preempted.
        """
        return self.parts.blocked_ns

    @property
    def blocked_by(self) -> Annotated[str, Json(default="")]:
        """The message of that frame; missing where there is none."""
        return self.blocker if self.parts.blocked_ns else ""

    @property
    def earlier_ns(self) -> Annotated[Exact, Json(default=0)]:
        """The transmission time of earlier messages of the same connection that go first; missing where there are none.

        In ns; above 0 where a message can be queued while its predecessor still waits.
        """
        return self.parts.earlier_ns

    @property
    def faults(self) -> Annotated[int, Json(default=0)]:
        """The number of faults of the wire before the worst message is over; missing where none are counted."""
        return self.parts.faults

    @property
    def faults_ns(self) -> Annotated[Exact, Json(default=0)]:
        """The time that these faults cost: error frames and frames that are sent again; missing where none are counted.

        In ns.
        """
        return self.parts.faults_ns

    @property
    def over_ns(self) -> Annotated[Exact, Json(default=0)]:
        """The part of the interference and blocking that is over when the message is queued; missing where it is 0.

        In ns; the part of the busy period before the message is queued.
        """
        return self.parts.over_ns


def chosen_identifiers(space: Space, view: View) -> dict[int, int]:
    """The identifiers of the connections of a whole design that may have any, by connection."""
    found: dict[int, int] = {}
    for bus in counted_buses(space):
        carried = [number for number in range(len(space.connections)) if bus_of(space, number, view) == bus]
        free = [number for number in carried if at(space.connections[number].identifier, view) == ANY_IDENTIFIER]
        resource = resource_of_bus(space, bus, view) if free else None
        if resource is None or resource.wire is None or not resource.wire.identifiers:
            continue
        numbers = {entry.key: number for entry, number in zip(resource.entries, resource.wire.identifiers, strict=True)}
        found |= {number: numbers[message_key(space, number, view)] for number in free}
    return found


def named_identifiers(space: Space, design: Design) -> dict[str, str]:
    """The identifiers of the connections of a design that may have any, as ``0x10``, by the name of the connection."""
    chosen = chosen_identifiers(space, View(design))
    return {space.connections[number].name: f"{identifier:#x}" for number, identifier in sorted(chosen.items())}


def with_identifiers(space: Space, view: View) -> Space:
    """The space in which messages that may have any identifier have those of a whole design."""
    chosen = chosen_identifiers(space, view)
    wires = list(space.connections)
    for number, identifier in chosen.items():
        wires[number] = replace(wires[number], identifier=identifier)
    return replace(space, connections=tuple(wires)) if chosen else space


def _number(connection: Connection, view: View) -> int | None:
    """The identifier of a message on a bus where identifiers decide nothing; None where it states none."""
    stated = at(connection.identifier, view)
    return stated if isinstance(stated, int) else None


def message_responses(space: Space, bus: int, view: View) -> Iterator[MessageResponse]:
    """The messages of a counted bus in a whole design, in the order in which they go first.

    One `MessageResponse` for each message, with parts that add up to the response time in ns.
    """
    solution = messages_of(space, view)
    resources = solution.system.resources
    resource = next(item for item in resources if (item.processor, item.core) == (NO_PROCESSOR, bus))
    assert resource.wire is not None
    for position, entry in enumerate(resource.entries):
        number, stage = entry.key[0], solution.system.stages[entry.key]
        connection, response = space.connections[number], solution.ends[entry.key]
        window, streams = solution.windows.of(resource, position), solution.windows.events.streams(entry.key)
        loss = solution.loss_of(entry.key)
        because = () if loss is None else solution.because(loss)
        needed = None if loss is None or because else solution.overload(loss)
        parts = window.parts() if window is not None and response is not None else None
        frame = frame_of(space, connection, view)
        deadlines = [limit for item in frame if (limit := at(item.deadline_ns, view)) is not None]
        deadline = min(deadlines, default=None)
        longest = None if response is None else response + wrapping_ns(space, number, bus, view)[1]
        yield MessageResponse(
            connection.name,
            resource.wire.identifiers[position] if resource.wire.identifiers else _number(connection, view),
            (stage.best_ns, stage.worst_ns),
            streams,
            response,
            deadline,
            None if deadline is None else longest is not None and longest <= deadline,
            parts or NOTHING,
            stated_name(space, entry.blockers[0][0]) if entry.blockers else "",
            tuple(dict.fromkeys(stated_name(space, key) for key in because)),
            None if needed is None else needed * PPM,
            tuple(item.name for item in frame if item.name != connection.name),
            window,
            at(connection.priority, view) if resource.wire.arbitration == "classes" else None,
        )
