"""Names that ROS 2 has for what a problem file names: `ros2` in the file, for `dse export`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from dse.spec.loading.reader import PathPart
from dse.spec.schema.model import Ros2, Spec
from dse.support.units import PARAMETER_RATES as RATES
from dse.support.units import PARAMETER_TIMES_NS as UNITS
from dse.support.units import shown

FIELDS = ("period", "rate", "offset")
EXPECTED = "expected THREAD.period, THREAD.rate, THREAD.offset or THREAD.PARAMETER"
_PARAMETER = re.compile(r"(?P<name>[A-Za-z_][\w./-]*)(\s*\[\s*(?P<whole>int\s+)?(?P<unit>\w+)\s*\])?")
_NODE = re.compile(r"(/[A-Za-z_]\w*)+")
HOLE = re.compile(r"\{([^{}]*)\}")
"""Where the period of a thread stands in the id of a callback group."""


@dataclass(frozen=True)
class Parameter:
    """A parameter that holds the `field` of a thread, in `unit`; `is_whole`: as an integer.

    `field` is ``period``, ``rate``, ``offset`` or a parameter of the thread, whose `unit` is "" for that of its own;
    `name` is the parameter as its ROS 2 node declares it.
    """

    thread: str
    field: str
    name: str
    unit: str
    is_whole: bool

    def value(self, period_ns: Fraction, rate_hz: Fraction, offset_ns: Fraction) -> Fraction:
        """The figure in the unit of the parameter.

        Exact; `period_ns`, `rate_hz` and `offset_ns` are those of the thread in the chosen design.
        """
        if self.field == "rate":
            return _stated_rate(rate_hz, period_ns) / RATES[self.unit]
        return (period_ns if self.field == "period" else offset_ns) / UNITS[self.unit]


def _stated_rate(rate_hz: Fraction, period_ns: Fraction) -> Fraction:
    """The rate, or that in thousandths of which the period is what is left in whole nanoseconds: 30 Hz, 33333333 ns."""
    near = Fraction(round(rate_hz * 1000), 1000)
    is_it = near > 0 and period_ns.denominator == 1 and round(10**9 / near) == period_ns
    return near if is_it else rate_hz


def read_parameter(key: str, text: str) -> Parameter | str:
    """The parameter that an entry of `parameters` states, or what is wrong with it.

    >>> read_parameter("cam.grab.period", "grab.period_ms [int ms]")
    Parameter(thread='cam.grab', field='period', name='grab.period_ms', unit='ms', is_whole=True)
    >>> read_parameter("cam.grab.rate", "fps").unit
    'Hz'
    """
    thread, _, field = key.rpartition(".")
    if not thread:
        return EXPECTED
    match = _PARAMETER.fullmatch(text.strip())
    if field not in FIELDS:
        if match is None:
            return "expected the name of a parameter, and its unit in brackets where it is another one"
        is_whole = match["whole"] is not None or match["unit"] == "int"
        return Parameter(
            thread, field, match["name"], "" if match["unit"] in (None, "int") else match["unit"], is_whole
        )
    known = RATES if field == "rate" else UNITS
    if match is None or (match["unit"] is not None and match["unit"] not in known):
        units = ", ".join(known)
        return (
            f"expected the name of a parameter, and its unit in brackets where it is not {next(iter(known))} ({units})"
        )
    return Parameter(thread, field, match["name"], match["unit"] or next(iter(known)), match["whole"] is not None)


def mistakes(spec: Spec) -> Iterator[tuple[tuple[PathPart, ...], str]]:
    """The mistakes in the ROS 2 names of a problem, each with its path.

    Pairs of a path in the file and a message: unknown parts, names twice, names that ROS 2 does not allow.
    """
    stated = spec.ros2
    if stated is None:
        return
    processes = {name for thread in spec.threads.values() for name in thread.process or ()}
    nodes = {*processes, *spec.executors, *spec.threads}
    first: dict[str, str] = {}
    for name, text in stated.nodes.items():
        if first.setdefault(text, name) != name and not _share(spec, first[text], name):
            yield ("ros2", "nodes", name), f"{shown(first[text])} has this name too"
        if name not in nodes:
            yield ("ros2", "nodes", name), f"there is no process, executor or thread {shown(name)}"
        if not _NODE.fullmatch(text):
            yield ("ros2", "nodes", name), f'expected the full name of a node such as "/ns/cam", got {shown(text)}'
    for key, text in stated.parameters.items():
        parameter = read_parameter(key, text)
        if isinstance(parameter, str):
            yield ("ros2", "parameters", key), parameter
        elif parameter.thread not in spec.threads:
            yield ("ros2", "parameters", key), f"there is no thread {shown(parameter.thread)}"
        elif parameter.field not in (*FIELDS, *spec.threads[parameter.thread].parameters):
            yield ("ros2", "parameters", key), f"{EXPECTED}: it has no parameter {shown(parameter.field)}"
    yield from _groups(spec, stated)


def _share(spec: Spec, first: str, second: str) -> bool:
    """Whether two names are threads of one process, which may be those of one node in it."""
    both = [spec.threads[name].process for name in (first, second) if name in spec.threads]
    return len(both) == 2 and both[0] is not None and both[0] == both[1]


def _groups(spec: Spec, stated: Ros2) -> Iterator[tuple[tuple[PathPart, ...], str]]:
    for name, text in stated.callback_groups.items():
        path = ("ros2", "callback_groups", name)
        if name not in spec.executors and name not in spec.threads:
            yield path, f"there is no executor or thread {shown(name)}"
        if not text.startswith("/") or "@" not in text:
            yield path, f'expected an id such as "/cam@Timer({{grab}})", got {shown(text)}'
        for thread in HOLE.findall(text):
            if thread not in spec.threads:
                yield path, f"there is no thread {shown(thread)}, whose period would stand there"


__all__ = ["HOLE", "Parameter", "mistakes", "read_parameter"]
