"""A problem made in Python, without a file: parts are added by name, and options are lists, as in a problem file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import timedelta
from typing import Any, Generic, TypeAlias, TypeVar

from dse.support import arguments
from dse.support.errors import UsageError

Value: TypeAlias = Any
"""What a key of a problem file may have: a text, a number, a mapping, a ``timedelta``, or a list of options."""


P = TypeVar("P")


class Builder(Generic[P]):
    """A problem that is being made; `dse.Problem.build` begins one.

    Each ``add_…`` takes the name of a part and its keys of the problem file (docs/problem-file.md) as keywords, and
    returns the name, by which other parts refer to it. A list of values is a decision. A time may be a ``timedelta``.
    `problem` reads it: mistakes are told there, all at once, with the key that each is about.

    Examples
    --------
    >>> import dse
    >>> model = dse.Problem.build("Pump")
    >>> small = model.add_processor_type("small", cores=2, price="60 EUR")
    >>> large = model.add_processor_type("large", cores=4, price="240 EUR")
    >>> computer = model.add_processor("computer", type=[small, large])
    >>> wire = model.add_bus_type("can_250k", bandwidth="250 kbit/s", transmission_time={"fixed": "128 us"})
    >>> can = model.add_bus("can0", type=wire)
    >>> sensor = model.add_device("sensor", period="10 ms")
    >>> work = {small: "2 ms .. 4 ms", large: "1 ms .. 2 ms"}
    >>> control = model.add_thread(
    ...     "control", processor=computer, period=["5 ms", "10 ms"], compute_execution_time=work
    ... )
    >>> model.connect(sensor, control, data_size="8 B", bus=can)
    'sensor_to_control'
    >>> flow = model.add_flow("main", path=[sensor, control])
    >>> model.require(f"utilisation of {computer} <= 70 %")
    >>> model.rule("small requires control.period == 10 ms")
    >>> model.set("baseline", {computer: {"type": small}, control: {"period": "10 ms"}})
    >>> model.minimise(f"jitter of {flow}", "price")
    >>> [dict(point.decisions) for point in dse.solve(model.problem())][0]
    {'computer.type': 'large', 'control.period': '5 ms', 'control.core': '1'}
    """

    def __init__(self, name: str, read: Callable[[Mapping[str, Any]], P], /, **settings: Value) -> None:
        self._read = read
        self._document: dict[str, Any] = {"dse": 1, "name": arguments.text("name", name), **_plain(settings)}

    def _add(self, section: str, name: str, keys: Mapping[str, Value]) -> str:
        there = self._document.setdefault(section, {})
        if arguments.text("name", name) in there:
            raise UsageError(f"{section}: {name!r} is there already")
        there[name] = _plain(keys)
        return name

    def add_processor_type(self, name: str, **keys: Value) -> str:
        """Add a type of computer.

        Keywords are the keys of ``processor_types`` in a problem file: ``cores``, ``price="60 EUR"``, ``power``,
        ``context_switch`` and others. Returns the name, for `add_processor`.
        """
        return self._add("processor_types", name, keys)

    def add_bus_type(self, name: str, **keys: Value) -> str:
        """Add a type of bus.

        Keywords are the keys of ``bus_types``: ``bandwidth="500 kbit/s"``, ``transmission_time``, ``price``,
        ``frame`` and others. Returns the name, for `add_bus`.
        """
        return self._add("bus_types", name, keys)

    def add_processor(self, name: str, type: str | Sequence[str], **keys: Value) -> str:  # noqa: A002 (the file's key)
        """Add a computer; a list of types leaves the choice to dse.

        Returns the name, for `add_thread`.
        """
        return self._add("processors", name, {"type": type, **keys})

    def add_bus(self, name: str, type: str | Sequence[str], **keys: Value) -> str:  # noqa: A002 (the file's key)
        """Add a bus; a list of types leaves the choice to dse.

        Returns the name, for `connect`.
        """
        return self._add("buses", name, {"type": type, **keys})

    def add_device(self, name: str, **keys: Value) -> str:
        """Add a sensor or an actuator.

        Keywords are the keys of ``devices``: ``period="20 ms"``, ``compute_execution_time``, ``price`` and others.
        Returns the name, for `connect` and `add_flow`.
        """
        return self._add("devices", name, keys)

    def add_thread(self, name: str, processor: str | Sequence[str], **keys: Value) -> str:
        """Add a thread on a processor, or on one of several.

        Keywords are the keys of ``threads``: ``period=["5 ms", "10 ms"]``, ``dispatch_protocol``,
        ``compute_execution_time``, ``priority`` and others; a list leaves the choice to dse. Returns the name.
        """
        return self._add("threads", name, {"processor": processor, **keys})

    def add_flow(self, name: str, path: Sequence[Value], **keys: Value) -> str:
        """Add an end-to-end flow through devices and threads, in order.

        Returns its name, for requirements and objectives such as ``jitter of NAME``.
        """
        return self._add("flows", name, {"path": list(path), **keys})

    def connect(self, source: str, target: str, name: str = "", **keys: Value) -> str:
        """Connect two components.

        Keywords are the keys of ``connections``: ``bus``, ``data_size="16 B"`` and others. Returns its name, which is
        ``SOURCE_to_TARGET`` where none is given.
        """
        return self._add("connections", name or f"{source}_to_{target}", {"from": source, "to": target, **keys})

    def require(self, *texts: str) -> None:
        """Add requirements, as texts.

        For example ``"jitter of main <= 20 ms"``.
        """
        self._document.setdefault("requirements", []).extend(texts)

    def rule(self, *texts: str) -> None:
        """Add rules between decisions, as texts.

        For example ``"computer == large implies control.period == 5 ms"``.
        """
        self._document.setdefault("rules", []).extend(texts)

    def minimise(self, *metrics: str) -> None:
        """Add metrics to minimise, as texts.

        For example ``"jitter of main"``, ``"price"``.
        """
        self._document.setdefault("objectives", []).extend(f"minimise {metric}" for metric in metrics)

    def maximise(self, *metrics: str) -> None:
        """Add metrics to maximise, as texts.

        For example a total that the problem declares.
        """
        self._document.setdefault("objectives", []).extend(f"maximise {metric}" for metric in metrics)

    def set(self, section: str, value: Value) -> None:
        """Set any other key of the file's top level, such as ``baseline``, ``metrics`` or ``uncertainty``.

        `value` is plain data as a file has it: text, numbers, lists and mappings, checked only when the problem is
        built. A section that is set a second time replaces the first.
        """
        self._document[section] = _plain(value)

    def problem(self) -> P:
        """The problem.

        Raises
        ------
        ProblemError
            with every mistake in it.
        """
        return self._read(self._document)

    def __repr__(self) -> str:
        """One line: its name, and how much has been added."""
        count = sum(len(part) for part in self._document.values() if isinstance(part, dict | list))
        return f"<Builder of {self._document['name']!r}: {count} entries>"


def _plain(value: Value) -> Any:
    """The value as a problem file has it."""
    if isinstance(value, timedelta):
        return arguments.duration("time", value)
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
