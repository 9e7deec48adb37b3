"""Flows, and the steps that they are of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from dse.support.units import Exact


@dataclass(frozen=True)
class StepFigures:
    """Time ranges in ns that a component has in one flow; those of execution and response where it is not periodic.

    As the path of a flow states them for one element; None where nothing is stated.
    """

    latency_ns: tuple[Exact, Exact] | None = None
    execution_ns: tuple[Exact, Exact] | None = None
    response_ns: tuple[Exact, Exact] | None = None


@dataclass(frozen=True)
class Step:
    """One element of a flow: a component reached over connection `via` (None for the first), or a connection.

    Where a problem speaks of clocks `since` are the elements before it, which may share its clock; of a component that
    may join all its triggers `before` are the elements before it. One that `only_reads` counts until it reads: what it
    does with that does not. `chain` are the threads in a row of the flow that may be one chain with it on a core, the
    first of them first, itself among them. It `has_source` where the flow comes to the first of these through all that
    may release it, from a source of its own on; a connection does where it comes so to what sends it. Then a thread
    that another component may release is a chain by itself; others alone are none. `unlinked` is an element of a flow
    that is part of another one: there OSATE has lost the connection that leads to it.
    """

    kind: Literal["component", "connection"]
    index: int
    via: int | None = None
    sender: int | None = None
    since: tuple[Step, ...] = field(default=(), hash=False)  # which have their own
    before: tuple[Step, ...] = field(default=(), hash=False)
    figures: StepFigures | None = field(default=None, hash=False)
    only_reads: bool = False
    chain: tuple[int, ...] = ()
    has_source: bool = False
    unlinked: bool = False


@dataclass(frozen=True)
class Flow:
    """An end-to-end flow; `required_ns` is AADL's stated latency range, if any.

    Steps alternate between components and connections.
    """

    name: str
    steps: tuple[Step, ...]
    required_ns: tuple[Exact, Exact] | None


@dataclass(frozen=True)
class UnreadFlow:
    """A flow of a model that its import could not follow: nothing is known of its latency.

    A requirement on it counts as not met, and `dse solve` refuses the problem.
    """

    name: Annotated[str, "The flow."]
    requirement: Annotated[str, "What its latency was to keep, in words; empty where the model states nothing."]
    reason: Annotated[str, "Why it could not be followed."]
    origin: Annotated[str, "Where it stands."]
