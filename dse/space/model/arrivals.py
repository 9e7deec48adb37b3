"""How work arrives: what releases jobs under each dispatch protocol (docs/semantics.md, section 2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class CyclicActivation(Exception):
    """Event-triggered components dispatch each other in a cycle: the design has no rates."""


class Arrivals(NamedTuple):
    """The rule that releases jobs: a timer, once in each period, or inputs, as often as they come.

    Of a protocol that is `separated` jobs that inputs release are at least a period apart.
    """

    by_timer: bool = False
    by_inputs: bool = False
    is_separated: bool = False

    @property
    def has_period(self) -> bool:
        """Whether there must be a period."""
        return self.by_timer or self.is_separated


PROTOCOLS: Mapping[str, Arrivals] = {
    "periodic": Arrivals(by_timer=True),
    "aperiodic": Arrivals(by_inputs=True),
    "sporadic": Arrivals(by_inputs=True, is_separated=True),
    "hybrid": Arrivals(by_timer=True),  # its inputs run its callback
}
"""By the protocol that a file states; without one a component with a period is periodic, any other aperiodic."""
BY_INPUTS = tuple(name for name, arrivals in PROTOCOLS.items() if arrivals.by_inputs)


def arrivals_of(protocol: str | None, *, has_period: bool) -> Arrivals:
    """The arrival rule of a dispatch protocol.

    >>> arrivals_of(None, has_period=False).by_inputs
    True
    """
    return PROTOCOLS[protocol or ("periodic" if has_period else "aperiodic")]
