"""How a message takes its turn on a bus that messages wait for, as the plan of a simulation tells it.

Reads the space on its own, without `dse.analysis`, so that a mistake there is not repeated here.
"""

from __future__ import annotations

from dataclasses import dataclass

from dse.simulation.readings import FaultFigures, PlanFigures, Range
from dse.space.model.space import Space
from dse.spec.kinds import Arbitration


@dataclass(frozen=True)
class BusTurn:
    """How a message takes its turn on its bus: what decides, its identifier, and the ranges of its frames' times.

    `line` tells on which of the lines of a bus it waits: with ``none`` each sender has one. With `rides_on` it is the
    message of that connection, by its number: a broadcast bus carries both at once. Where a sender queues messages as
    they come only the oldest in its `queue` competes; it is empty of others. `faults` are those of the wire.
    """

    arbitration: Arbitration
    identifier: int
    sender: int
    frames: tuple[Range, ...]
    line: tuple[int, int]
    rides_on: int | None = None
    queue: str = ""
    faults: FaultFigures | None = None


def bus_turn_of(space: Space, figures: PlanFigures, number: int) -> BusTurn | None:
    """How the message of a connection takes its turn on its bus; None where it waits for none."""
    part, connection = figures.connections[number], space.connections[number]
    if part.arbitration is None or part.bus is None:
        return None
    sender = -1 - number if connection.source is None else connection.source
    first = next(
        other
        for other in (*part.frame, *range(number + 1))
        if other == number
        or (other in part.frame and figures.connections[other].bus == part.bus)
        or (
            part.is_shared
            and connection.from_port is not None
            and figures.connections[other] == part
            and space.connections[other].source == connection.source
            and space.connections[other].from_port == connection.from_port
        )
    )
    line = (part.bus, sender if part.arbitration == "none" else 0)
    return BusTurn(
        part.arbitration,
        part.identifier or 0,
        sender,
        part.frames,
        line,
        None if first == number else first,
        figures.transmit_queue(connection.source),
        part.faults,
    )
