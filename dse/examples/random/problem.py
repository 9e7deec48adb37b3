"""A random problem as the text of a problem file.

The system is drawn first, with a starting design that becomes the baseline. Then the analysis itself says what that
design uses where no thread waits for the CPU, and the limits are set just above: with `processing: execution_time`
every problem has at least one design, and its limits bind.
"""

from __future__ import annotations

import random
from math import ceil
from typing import Any

from dse.analysis.limits import build_limit, needed_share
from dse.analysis.measures import all_metrics, build_measure
from dse.analysis.views import View
from dse.examples.random.document import build_document, bus_names, processor_names
from dse.examples.random.draft import MOST_OF_ONE_CORE, Draft, draw_draft
from dse.examples.random.families import FAMILIES
from dse.examples.random.published import REFERENCE, WIRE_CLASSES
from dse.examples.random.text import to_yaml
from dse.examples.random.topology import draw_topology
from dse.space.build import build_space
from dse.space.model.space import Space
from dse.spec.loading.load import parse_spec
from dse.support import arguments

LEAST_THREADS = 5
MOST_THREADS = 5_000
"""Larger problems would not be read: a file is bounded."""
MOST_OBJECTIVES = 5
CORE_SHARE = 66
"""Percent of a processor that the starting design uses at most; of a bus, half."""


@arguments.checked(
    threads=arguments.Whole(LEAST_THREADS, MOST_THREADS),
    seed=arguments.Whole(0, 2**63),
    objectives=arguments.Whole(1, MOST_OBJECTIVES),
    family=arguments.Word(tuple(FAMILIES)),
)
def random_problem(threads: int, seed: int = 1, objectives: int = 2, family: str = "robot") -> str:
    """The text of a problem file: same arguments, same bytes.

    Parameters
    ----------
    threads
        5 to 5,000.
    seed
        of everything that is drawn.
    objectives
        1 to 5: the jitter of the first flow, the price, the jitter of the second flow, the power, and the utilisation
        of the first processor.
    family
        one of `FAMILIES`.

    Raises
    ------
    UsageError
        when an argument is out of range.

    Examples
    --------
    >>> random_problem(5).splitlines()[-1] == random_problem(5, seed=1).splitlines()[-1]
    True
    """
    rng = random.Random(f"{family} {threads} {seed}")
    draft = draw_draft(rng, FAMILIES[family], draw_topology(rng, threads))
    cores, wire_classes, used = 1, [0] * draft.buses, {}
    for _ in range(2):  # first to see what is used, then with processors and buses that bear it
        document = build_document(draft, cores, wire_classes)
        used = _starting_figures(document)
        wire_classes = [_wire_class(used[f"load of {name}"]) for name in bus_names(draft)]
        most = max(used[f"utilisation of {name}"] for name in processor_names(draft))
        cores = max(1, ceil(most / (CORE_SHARE * 10_000)))
    document = build_document(draft, cores, wire_classes)
    head = _head(draft, threads, seed, objectives)
    question = {
        "requirements": _requirements(rng, draft, document, cores, wire_classes),
        "objectives": _objectives(draft, objectives),
    }
    rules, baseline = document.pop("rules"), document.pop("baseline")
    return to_yaml({**head, **document, **question, **({"rules": rules} if rules else {}), "baseline": baseline})


def _starting_design(document: dict[str, Any], requirements: list[str]) -> tuple[Space, View]:
    question = {"objectives": ["minimise price"], "requirements": requirements}
    spare = {key: value for key, value in {**question, **document}.items() if value}
    head = {"dse": 1, "name": "draft", "processing": "execution_time", "overload": "allowed"}
    text = to_yaml({**head, **spare})
    space = build_space(parse_spec(text, "draft"))
    return space, View([space.baseline.get(number, 0) for number in range(len(space.decisions))])


def _starting_figures(document: dict[str, Any]) -> dict[str, int]:
    """Every metric of the starting design that is counted in whole units, as the analysis gives it.

    Busy times may be counted in parts of a ppm; all others are whole.
    """
    space, view = _starting_design(document, [])
    measures = [build_measure(space, metric) for metric in all_metrics(space) if metric.kind != "busy"]
    assert all(measure.scale == 1 for measure in measures)
    return {measure.metric.name: measure.integer(view) for measure in measures}


def _of_one_core(document: dict[str, Any], names: list[str]) -> dict[str, int]:
    """How much of the fullest core of each processor the starting design needs, in percent, rounded up."""
    space, view = _starting_design(document, [f"utilisation of {name} <= 100 %" for name in names])
    limits = [build_limit(space, requirement) for requirement in space.requirements]
    return {name: ceil(needed_share(limit, view)[0] * 100) for name, limit in zip(names, limits, strict=True)}


def _wire_class(load: int) -> int:
    """The first class of buses whose reference type is at most half full."""
    for number, wires in enumerate(WIRE_CLASSES):
        if load * 8 * 2 <= wires[REFERENCE].kbit_s * 1000:
            return number
    return len(WIRE_CLASSES) - 1


def _head(draft: Draft, threads: int, seed: int, objectives: int) -> dict[str, Any]:
    family = draft.family
    source = (
        "Kramer, Ziegenbein, Hamann, Real world automotive benchmarks for free, WATERS 2015 (periods, execution times)"
        if family.automotive
        else "Autoware reference system and ECE-TR-25 (execution times), common ROS 2 rates (periods)"
    )
    drawn = f"--family {family.name} --threads {threads} --seed {seed} --objectives {objectives}"
    return {
        "dse": 1,
        "name": f"{family.title}, {threads} threads, seed {seed}",
        "source": f'"dse new --random {drawn}"',
        "assumptions": [
            f'"Figures drawn from {source}; prices and powers are assumed."',
            '"Where flows meet at an event-driven thread, the first one dispatches it."',
        ],
    }


def _requirements(
    rng: random.Random, draft: Draft, document: dict[str, Any], cores: int, wire_classes: list[int]
) -> list[str]:
    """Limits just above what the starting design uses."""
    made, used = [], _starting_figures(document)
    needed = _of_one_core(document, processor_names(draft))
    for number in range(len(draft.flows)):
        flow, slack = f"flow_{number + 1}", rng.randint(100, 125)
        made.append(f"jitter of {flow} <= {_ms(used[f'jitter of {flow}'] * slack // 100)}")
        if rng.randrange(2):
            made.append(f"latency of {flow} <= {_ms(used[f'latency of {flow}'] * slack // 100)}")
    for name in processor_names(draft):
        share = -(-used[f"utilisation of {name}"] * rng.randint(101, 108) // (cores * 1_000_000))
        made.append(f"utilisation of {name} <= {max(MOST_OF_ONE_CORE + 5, share, needed[name])} %")
    for name, wires in zip(bus_names(draft), wire_classes, strict=True):
        bandwidth = WIRE_CLASSES[wires][REFERENCE].kbit_s * 1000
        share = -(-used[f"load of {name}"] * 8 * rng.randint(101, 115) // bandwidth)
        made.append(f"load of {name} <= {min(100, max(1, share))} %")
    return made


def _ms(value_ns: int) -> str:
    return f"{-(-value_ns // 1_000_000)} ms"


def _objectives(draft: Draft, count: int) -> list[str]:
    asked = ("jitter of flow_1", "price", "jitter of flow_2", "power", f"utilisation of {processor_names(draft)[0]}")
    return [f"minimise {metric}" for metric in asked[:count]]
