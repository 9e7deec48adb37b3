"""Numbers of cores as inputs: those of groups are none, and no number is below a core that the design has."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.questions.problem import with_stated_cores
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.margins import domain
from dse.questions.sensitivity.sensitivity import chosen_design, sensitivity
from dse.support.errors import ProblemError, UsageError

GROUPS = """
dse: 1
name: groups
processor_types: {soc: {cores: {big: 2, little: 2}}}
processors: {pc: {type: soc}}
threads: {fast: {processor: pc, period: 5 ms, compute_execution_time: {soc/big: 1 ms, soc/little: 2 ms}}}
requirements: [utilisation of pc <= 90 %]
objectives: [minimise utilisation of pc]
"""
EQUAL = """
dse: 1
name: equal
processor_types: {cpu: {cores: 4}}
processors: {p: {type: cpu}}
threads: {a: {processor: p, core: 4, period: 10 ms, compute_execution_time: 2 ms}}
requirements: [utilisation of p <= 90 %]
objectives: [minimise utilisation of p]
"""


@pytest.mark.parametrize(("core", "group"), [(1, "big"), (4, "little")])
def test_times_of_a_group_are_inputs(core: int, group: str) -> None:
    found = sensitivity(dse.loads(GROUPS), [f"fast.core = {core}"])
    reach = [item.path for item in found.margins]
    assert f"threads.fast.compute_execution_time.soc/{group}" in reach
    assert len([path for path in reach if "compute_execution_time" in path]) == 1
    assert not any("cores" in path for path in reach)


def test_how_many_cores_a_group_has_cannot_be_uncertain() -> None:
    text = GROUPS + "uncertainty: {processor_types.soc.cores.big: {range: 1 .. 3}}\n"
    with pytest.raises((ProblemError, UsageError), match=r"processor_types\.soc\.cores\.big"):
        sensitivity(dse.loads(text), ["fast.core = 1"])


def test_a_stated_core_stays_on_its_processor() -> None:
    assert fewest(EQUAL) == 4
    assert fewest(EQUAL.replace("core: 4", "core: [2, 3]"), "a.core = 3") == 3
    assert fewest(EQUAL.replace("core: 4, ", "")) == 1


def fewest(text: str, *texts: str) -> Fraction:
    """Down to which number of cores the processor type is looked at."""
    problem = with_stated_cores(dse.loads(text), texts)
    inputs = InputSpace(problem)
    function = DesignFunction(inputs, chosen_design(inputs.problem.space, texts))
    [cores] = inputs.matching("processor_types.cpu.cores")
    return domain(function, cores)[0]


def test_a_processor_of_one_core_may_get_another_where_a_limit_names_a_core() -> None:
    """What has chosen no core, for there was one, stays on it."""
    found = dse.sensitivity(
        {
            "dse": 1,
            "name": "one core or two",
            "processor_types": {"one": {"cores": 1, "price": "3 EUR"}, "two": {"cores": 2, "price": "4 EUR"}},
            "processors": {"p": {"type": ["one", "two"]}},
            "threads": {"a": {"period": "10 ms", "compute_execution_time": "1 ms", "processor": "p"}},
            "objectives": ["minimise price"],
            "requirements": ["utilisation of core 1 of p <= 60 %"],
        },
        {"p.type": "one"},
    )
    [cores] = [item for item in found.margins if item.path == "processor_types.one.cores"]
    assert (cores.below, cores.above) == (None, None)
