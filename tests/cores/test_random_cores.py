"""Threads that fill the cores of a processor: the search, both second proofs and robust fronts against exhaustion."""

from __future__ import annotations

import random
import re
from collections.abc import Collection
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import HOLDS, keeps_cores, too_many
from dse.analysis.views import View
from dse.questions.verify.insisting import open_options
from dse.search.front import SearchLimits, search_front
from dse.search.insist import Insistence
from dse.space.model.trees import at
from tests.helpers.effort import cases
from tests.helpers.tuned import tune
from tests.oracle import evaluator as oracle
from tests.properties.pair import Pair
from tests.properties.test_against_oracle import figures_agree, fronts_agree

PERIODS = ("8 ms", "10 ms", "12 ms", "15 ms", "20 ms", "24 ms")


def crowded(seed: int, *, limit: str = "", objectives: str = "minimise utilisation of p, minimise price") -> str:
    """Four to six threads on two or three cores, which they fill; some have their core, or a choice of cores, or none.

    In every other problem all cores are open.
    """
    rng = random.Random(seed)
    stated = ["", "", "", ", core: 1", ", core: 2", ", core: [1, 2]"] if seed % 2 else [""]
    lines = [
        "dse: 1",
        f"name: crowded {seed}",
        "processing: execution_time",
        "processor_types: {duo: {cores: 2, price: 10 EUR}, trio: {cores: 3, price: 20 EUR}}",
        f"processors: {{p: {{type: {rng.choice(['[duo, trio]', 'duo', 'trio'])}}}}}",
        "threads:",
    ]
    names = [f"t{number}" for number in range(rng.randint(4, 6))]
    for name in names:
        periods = rng.sample(PERIODS, rng.choice([1, 2, 2, 3]))
        core = rng.choice(stated)
        worst = f"{rng.randint(15, 75) / 10} ms"
        lines.append(
            f"  {name}: {{processor: p, period: [{', '.join(periods)}], compute_execution_time: {worst}{core}}}"
        )
    lines += [
        f"flows: {{f: {{path: [{names[0]}]}}}}",
        f"requirements: ['utilisation of p {limit or rng.choice(['<= 100 %', '< 100 %', '<= 90 %', '<= 83.3 %'])}']",
        f"objectives: [{objectives}]",
    ]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", cases(50))
def test_the_front_is_that_of_exhaustion(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether the search learns of full cores by clauses, by rows, or by one after the other."""
    tune(monkeypatch, core_limit_clauses={"most": (0, 2, 16)[seed // 2 % 3]})
    pair = Pair(crowded(seed))
    figures_agree(pair)
    found = search_front(pair.evaluator)
    assert found.is_complete
    fronts_agree(pair, found.points)
    assert found.points == pair.own_front()


@pytest.mark.parametrize("seed", cases(50, 5000))
def test_threads_that_are_too_many_have_no_partition_and_each_fewer_have_one(seed: int) -> None:
    """Against every way to put them on cores, all of which are open."""
    pair = Pair(crowded(2 * seed))
    limit = pair.evaluator.limits[0]
    assert limit.cores is not None
    holds, most = HOLDS[limit.requirement.operator], limit.cores.most
    for design in (item.design for item in pair.valid[:: max(1, len(pair.valid) // 40)]):
        view = View(design)
        if keeps_cores(limit, view):
            continue
        shares = {name: sum(term.value(view) for term in terms) for name, terms in limit.alone.items()}
        cores = range(int(at(limit.cores.space.processors[0].cores, view)))

        def fits(names: Collection[str], shares: Any = shares, cores: range = cores) -> bool:
            ways = (dict(zip(names, way, strict=True)) for way in product(cores, repeat=len(names)))
            loads = ([sum(shares[name] for name in names if way[name] == core) for core in cores] for way in ways)
            return any(all(holds(load, most) for load in each) for each in loads)

        found = too_many(limit, view)
        assert not fits(found)
        assert all(fits([other for other in found if other != name]) for name in found)


@pytest.mark.parametrize("seed", cases(12, 1000))
def test_both_second_proofs_confirm_it(seed: int) -> None:
    problem = dse.loads(crowded(seed))
    result = dse.solve(problem)
    for method in ("exhaustion", "model"):
        assert dse.verify(result, problem=problem, method=method).status == "verified"


def with_decided_cores(seed: int) -> str:
    """Two to three threads whose cores matter, two of them to be decided, on cores that need not be equal."""
    rng = random.Random(seed)
    duo, uni = "{cores: 2, price: 20 EUR}", "{cores: 1, price: 10 EUR}"
    soc = "{cores: {big: 1, little: 1}, price: 30 EUR}"
    kinds = rng.choice(["duo", "soc", "[duo, uni]", "[soc, uni]", "[duo, soc]"])
    lines = [
        f"dse: 1\nname: Decided {seed}\nprocessing: execution_time",
        f"processor_types: {{duo: {duo}, uni: {uni}, soc: {soc}}}",
    ]
    lines += [f"processors: {{p: {{type: {kinds}}}}}", "threads:"]
    for name in ["a", "b", "c"][: rng.randint(2, 3)]:
        periods = rng.sample(["5 ms", "8 ms", "10 ms", "15 ms"], rng.randint(1, 2))
        least = rng.randint(1, 3)
        times = f"{{duo: {least} ms, uni: {least} ms, soc/big: {least} ms, soc/little: {least + 1} ms}}"
        core = ", core: [1, 2]" if rng.random() < 0.7 else ""
        lines.append(
            f"  {name}: {{processor: p, period: [{', '.join(periods)}], compute_execution_time: {times}{core}}}"
        )
    of_cores = [f"minimise utilisation of core {core} of p" for core in (1, 2)]
    metrics = ["minimise price", "minimise latency of f", *of_cores, "minimise utilisation of each core of p"]
    if kinds not in ("duo", "soc", "[duo, soc]"):
        metrics.remove(of_cores[1])
    wanted = rng.sample(metrics[:-1], 2) if rng.random() < 0.5 else ["minimise latency of f", metrics[-1]]
    return "\n".join([*lines, "flows: {f: {path: [a]}}", f"objectives: [{', '.join(wanted)}]"]) + "\n"


@pytest.mark.parametrize("seed", cases(50, 3000))
def test_each_front_with_an_option_is_that_with_it_fixed(seed: int) -> None:
    """A fixed core changes what figures there may be: what the whole front tells is read in those of the fixed one."""
    space = dse.loads(with_decided_cores(seed)).ask().space
    evaluator = Evaluator(space)
    insistence = Insistence(evaluator, search_front(evaluator))
    for decision, option in open_options(space):
        fixed = search_front(Evaluator(replace(space, fixed={**space.fixed, decision: option})))
        found = insistence.front(decision, option, SearchLimits())
        assert found.is_complete and found.points == fixed.points, (decision, option)


@pytest.mark.parametrize("seed", cases(25, 2000))
def test_the_closest_limit_is_that_of_exhaustion(seed: int) -> None:
    text = crowded(seed, limit="<= 5 %")
    pair = Pair(text)
    assert not pair.feasible
    (advice,) = dse.explain(pair.product).relaxations
    needed = min(oracle.needed_limit(pair.oracle, item.figures, "utilisation of p <= 5 %") for item in pair.valid)
    assert advice.closest == needed * 10**6
    assert dse.verify(dse.solve(pair.product), problem=pair.product).status == "verified"
    assert bool(advice.overload) is (needed > 1)
    mended = dse.loads(text.replace("utilisation of p <= 5 %", advice.text))
    assert dse.solve(mended, overload="allowed" if advice.overload else "forbidden").status == "complete"


@pytest.mark.parametrize("seed", cases(12, 3000))
def test_break_points_of_the_limit_are_those_of_exhaustion(seed: int) -> None:
    text = crowded(seed, limit="<= 100 %", objectives="minimise price, maximise latency")
    pair = Pair(text)
    sweep = dse.sweep(pair.product, "utilisation of p=1 %..100 %")
    outcome = sweep.runs[0].outcome
    assert outcome is not None
    stretches = outcome["stretches"] if outcome["status"] == "complete" else []
    needs = {
        id(item): oracle.needed_limit(pair.oracle, item.figures, "utilisation of p <= 100 %") for item in pair.feasible
    }
    for stretch in stretches:
        limit = Fraction(stretch["from"]) / 10**6
        admitted = oracle.non_dominated({item.vector for item in pair.feasible if needs[id(item)] <= limit})
        assert len(stretch["front"]) == len(admitted)
    least = min(needs.values(), default=None)
    assert (least is None) == (not stretches)
    if least is not None:
        assert Fraction(stretches[0]["from"]) == max(least * 10**6, 10_000)


@pytest.mark.parametrize("seed", cases(12, 4000))
def test_a_robust_front_is_that_of_the_longest_times(seed: int) -> None:
    """With every execution time up to a tenth longer, the robust front is the front with a tenth more everywhere."""
    text = crowded(seed, limit="<= 100 %", objectives="minimise price, maximise min latency of f")
    stated = "".join(
        f"  threads.{name}.compute_execution_time: {{factor: 1 .. 1.1}}\n"
        for name in dse.loads(text).loaded.spec.threads
    )
    robust = dse.solve_robust(f"{text}uncertainty:\n{stated}").robust
    longer = dse.solve(dse.loads(with_tenth(text)))
    assert [point.decisions for point in robust.front] == [point.decisions for point in longer.front]


def with_tenth(text: str) -> str:
    """The problem with every longest execution time a tenth longer."""

    def more(found: re.Match[str]) -> str:
        value = Fraction(found[1])
        return f"compute_execution_time: {found[1]} ms .. {float(value * 11 / 10):.2f} ms"

    return re.sub(r"compute_execution_time: ([\d.]+) ms", more, text)
