"""Equal cores may change places: only what is no renumbering counts as a change."""

from __future__ import annotations

import io
import random
from itertools import permutations, product

import pytest
from rich.console import Console

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.answers.analysis import analyse_design
from dse.answers.comparison import compare_designs
from dse.answers.ranking.changes import changes_between
from dse.answers.ranking.core_numbering import numbered_like
from dse.answers.ranking.reasons import Reasoner
from dse.report.content.compare import comparison_page
from dse.report.terminal import print_page
from dse.space.model.space import Design, Space

TEXT = """
dse: 1
name: cores
deadlines: all
processor_types: {board: {cores: 3}, small: {cores: 2}}
processors: {main: {type: [board, small]}, side: {type: small}}
threads:
  a: {processor: main, period: 10 ms, compute_execution_time: 1 ms}
  b: {processor: [main, side], period: 20 ms, compute_execution_time: 2 ms}
  c: {processor: main, period: 30 ms, compute_execution_time: 3 ms}
  d: {processor: side, period: 30 ms, compute_execution_time: 3 ms}
  e: {processor: main, period: 30 ms, compute_execution_time: 3 ms}
objectives: [minimise utilisation of main]
"""


def cores(space: Space, design: Design) -> dict[str, str]:
    return {
        item.name.removesuffix(".core"): item.options[option]
        for item, option in zip(space.decisions, design, strict=True)
        if item.field == "core" and option >= 0
    }


def drawn(space: Space, source: random.Random) -> Design:
    evaluator = Evaluator(space)
    while True:
        design = tuple(source.randrange(len(item.options)) for item in space.decisions)
        if not evaluator.evaluate(design).breaches:
            return canonical(space, design)


@pytest.mark.parametrize("seed", range(30))
def test_a_renumbered_design_is_the_same_and_no_further_away(seed: int) -> None:
    source = random.Random(seed)
    space = dse.loads(TEXT).space
    evaluator = Evaluator(space)
    one, other = drawn(space, source), drawn(space, source)
    found = numbered_like(space, one, other)
    assert evaluator.metric_values(found) == evaluator.metric_values(one)
    assert [option for item, option in zip(space.decisions, found, strict=True) if item.field != "core"] == [
        option for item, option in zip(space.decisions, one, strict=True) if item.field != "core"
    ]
    before, after = cores(space, one), cores(space, found)
    assert before.keys() == after.keys()
    for name, peer in product(before.keys() - {"b", "d"}, repeat=2):  # b and d may be elsewhere
        assert (before[name] == before[peer]) == (after[name] == after[peer])
    assert numbered_like(space, found, other) == found
    kept = [sum(a == b for a, b in zip(design, other, strict=True)) for design in (one, found)]
    assert kept[0] <= kept[1]


def placed(space: Space, **chosen: int) -> Design:
    """Everything on the board but d, threads on the cores that are given."""
    design = [0] * len(space.decisions)
    for name, core in chosen.items():
        number = space.decision_index(f"{name}.core")
        assert number is not None
        design[number] = core - 1
    return canonical(space, tuple(design))


def test_only_who_shares_a_core_counts() -> None:
    space = dse.loads(TEXT).space
    base = placed(space, a=1, b=1, c=2, e=3, d=1)
    for first, second, third in permutations((1, 2, 3)):
        for side in (1, 2):
            other = placed(space, a=first, b=first, c=second, e=third, d=side)
            assert changes_between(space, base, other) == ()
            assert changes_between(space, other, base) == ()
    [change] = changes_between(space, base, placed(space, a=3, b=3, c=3, e=1, d=2))
    assert (change.name, change.before, change.after) == ("c.core", "2", "3")


SHARED = """
dse: 1
name: who shares with whom
deadlines: all
processor_types: {cheap: {cores: 2, price: 10 EUR, power: 2 W}, frugal: {cores: 2, price: 20 EUR, power: 1 W}}
processors: {main: {type: [cheap, frugal]}}
threads:
  a: {processor: main, period: 10 ms, compute_execution_time: 4 ms}
  b: {processor: main, period: 10 ms, compute_execution_time: {cheap: 8 ms, frugal: 4 ms}}
  c: {processor: main, period: 10 ms, compute_execution_time: {cheap: 4 ms, frugal: 8 ms}}
objectives: [minimise price, minimise power]
"""


def test_a_point_keeps_the_numbers_of_its_cores_in_all_that_is_said_of_it() -> None:
    result = dse.solve(dse.loads(SHARED))
    reasoner, better = Reasoner(result), 0
    for position, point in enumerate(result.front):
        reasons = reasoner.reasons(position)
        for said in [item.changes for item in reasons.improvements]:
            better += bool(said)
            assert {item.name: point.decisions[item.name] for item in said} == {item.name: item.before for item in said}
        assert reasons.neighbour is not None
        now = {item.name: item.after for item in reasons.neighbour.changes}
        assert now == {name: point.decisions[name] for name in now}
    assert better == 2


@pytest.mark.parametrize(
    "named", ["rules: [a.core == 1 implies c.core == 2]", "baseline: {a: {core: 1}, b: {processor: main}}"]
)
def test_named_cores_keep_their_numbers(named: str) -> None:
    space = dse.loads(TEXT + named).space
    one = drawn(space, random.Random(1))
    assert numbered_like(space, one, drawn(space, random.Random(2))) == one


def test_a_comparison_tells_renumbered_cores_from_changed_ones() -> None:
    space = dse.loads(TEXT).space
    designs = [placed(space, a=1, b=1, c=2, e=3, d=1), placed(space, a=2, b=2, c=2, e=1, d=2)]
    analyses = [analyse_design(Evaluator(space), design) for design in designs]
    found = compare_designs(("one", "other"), analyses[0], analyses[1])
    assert {line.name: (line.one, line.renumbered) for line in found.decisions if line.renumbered} == {
        "a.core": ("1", "1"), "b.core": ("1", "1"), "c.core": ("2", "1"), "e.core": ("3", "3"), "d.core": ("1", "1")
    }  # fmt: skip
    assert [line.name for line in found.decisions if line.differs] == ["c.core"]
    assert found.to_dict()["decisions"]["a.core"] == ["1", "2"]
    printed = io.StringIO()
    print_page(Console(file=printed, width=120), comparison_page(found))
    assert "1 of 7 decisions differs." in printed.getvalue()
    assert "Cores of B are numbered here like those of A" in printed.getvalue()


def test_only_cores_that_one_thread_may_have_change_places() -> None:
    """Before, c was to have a core that it may not have."""
    threads = {name: {"processor": "p", "period": "10 ms", "compute_execution_time": "1 ms"} for name in "abc"}
    threads["c"]["core"] = [1, 2]  # type: ignore[assignment] # a list is a decision
    problem = {"dse": 1, "name": "few", "processor_types": {"t": {"cores": 3}}, "deadlines": "all"}
    space = dse.load({**problem, "processors": {"p": {"type": "t"}}, "threads": threads}).space
    assert [item.name for item in space.decisions] == ["p.type", "a.core", "b.core", "c.core"]
    assert numbered_like(space, (0, 0, 0, 0), (0, 2, 2, 1)) == (0, 1, 1, 1)
