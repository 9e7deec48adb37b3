"""Problems that combine kinds of decisions as drawn ones do rarely: each once lost a design or ended in an error.

Every front is compared with looking at all designs, and both second proofs accept it.
"""

from __future__ import annotations

from itertools import product

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.answers.ranking.core_numbering import numbered_like
from dse.encode.tuning import CoreLimitClauses
from dse.questions.problem import Problem
from dse.support.units import is_unbounded
from tests.helpers.tuned import tune

LACKING_THE_FIRST = """
dse: 1
name: a type lacks the core that is offered first
processor_types: {A: {cores: 2, price: 20 EUR}, B: {cores: 1, price: 10 EUR}}
processors: {p0: {type: [A, B]}}
threads:
  t0: {processor: p0, core: [2, 1], period: [8 ms, 9 ms], compute_execution_time: 1 ms}
  t1: {processor: p0, core: [2, 1], period: [8 ms, 9 ms], compute_execution_time: 1 ms}
  t2: {processor: p0, core: [2, 1], period: 8 ms, compute_execution_time: 2 ms}
objectives: [minimise price, minimise response time of t2]
"""
NOT_COUNTED = """
dse: 1
name: a list of cores that a type with one core has not, where it does not count
processor_types: {A: {cores: 3, price: 10 EUR}, B: {cores: 1, price: 20 EUR}}
processors: {p0: {type: [A, B]}}
threads:
  t0: {processor: p0, core: [2, 3], period: [10 ms, 11 ms, 9 ms], compute_execution_time: {A: 6 ms, B: 2 ms}}
  t1: {processor: p0, core: [2, 3], period: [10 ms, 11 ms, 9 ms], compute_execution_time: {A: 6 ms, B: 2 ms}}
  t2: {processor: p0, core: [2, 3], period: [10 ms, 11 ms, 9 ms], compute_execution_time: {A: 6 ms, B: 2 ms}}
objectives: [minimise price, minimise utilisation of p0]
"""
ON_ANOTHER = """
dse: 1
name: a list of cores that one of two processors has not
processor_types: {A: {cores: 4, price: 10 EUR}, B: {cores: 2, price: 20 EUR}}
processors: {p0: {type: A}, p1: {type: B}}
threads:
  t0: {processor: [p0, p1], core: [3, 4], period: 10 ms, compute_execution_time: 6 ms}
  t1: {processor: [p1, p0], period: [10 ms, 11 ms, 9 ms], compute_execution_time: 6 ms}
  t2: {processor: [p1, p0], period: [10 ms, 11 ms, 9 ms], compute_execution_time: 6 ms}
  t3: {processor: [p1, p0], period: [10 ms, 11 ms, 9 ms], compute_execution_time: 6 ms}
objectives: [maximise utilisation of p1, minimise utilisation of p0]
"""
NOBODY_IN_IT = """
dse: 1
name: an executor that nobody is in, whose processor is a decision
processor_types: {A: {price: 10 EUR}, B: {price: 10 EUR}}
processors: {p0: {type: A}, p1: {type: B}, p2: {type: A}}
executors:
  E1: {processor: [p0, p1], kind: fifo}
  E2: {processor: p2, kind: fifo}
threads:
  t1: {executor: [E1, E2], period: 10 ms, compute_execution_time: {A: 3 ms, B: 3 ms}}
flows: {f: {path: [t1]}}
objectives: [minimise latency of f, maximise utilisation of p2]
"""
PLAIN_BESIDE = """
dse: 1
name: plain threads on one processor, executors that are chosen on another
processor_types: {A: {cores: 2, price: 10 EUR}}
processors: {p0: {type: A}, p1: {type: A}}
executors: {E1: {processor: p1, kind: fifo}, E2: {processor: p1, kind: fifo}}
threads:
  t0: {executor: [E1, E2], period: 10 ms, compute_execution_time: 2 ms}
  t1: {executor: [E2, E1], period: 10 ms, compute_execution_time: 2 ms}
  t2: {processor: p0, period: [10 ms, 20 ms], compute_execution_time: 2 ms}
  t3: {processor: p0, period: 10 ms, compute_execution_time: 3 ms}
objectives: [minimise price]
deadlines: all
"""
FRONTS = {
    "lacking the first": LACKING_THE_FIRST,
    "lacking the first, deadlines": LACKING_THE_FIRST.replace(", minimise response time of t2]", "]\ndeadlines: all"),
    "not counted": NOT_COUNTED,
    "on another": ON_ANOTHER,
    "nobody in it": NOBODY_IN_IT,
    "plain beside": PLAIN_BESIDE,
}


def front_of_all(problem: Problem) -> set[tuple[int, ...]]:
    """The non-dominated objectives of all designs, each looked at by the analysis, to be minimised."""
    evaluator = Evaluator(problem.space)
    signs = [1 if item.sense == "minimise" else -1 for item in problem.space.objectives]
    found = (
        evaluator.evaluate(raw) for raw in product(*(range(len(item.options)) for item in problem.space.decisions))
    )
    vectors = {
        tuple(sign * value for sign, value in zip(signs, item.objectives, strict=True))
        for item in found
        if item.is_feasible
    }
    return {
        one
        for one in vectors
        if not any(other != one and all(a <= b for a, b in zip(other, one, strict=True)) for other in vectors)
    }


@pytest.mark.parametrize("clauses", [0, CoreLimitClauses.most])
@pytest.mark.parametrize("name", FRONTS)
def test_the_front_is_that_of_all_designs(name: str, clauses: int, monkeypatch: pytest.MonkeyPatch) -> None:
    tune(monkeypatch, core_limit_clauses={"most": clauses})
    problem = dse.loads(FRONTS[name])
    found = dse.solve(problem)
    signs = [1 if item.sense == "minimise" else -1 for item in problem.space.objectives]
    vectors = {
        tuple(sign * value for sign, value in zip(signs, point.objectives.values(), strict=True))
        for point in found.front
    }
    assert vectors == front_of_all(problem)
    assert vectors
    assert dse.verify(found, problem=problem, method="exhaustion").status == "verified"
    assert dse.verify(found, problem=problem, method="model").status == "verified"


BEST_ORDER = """
dse: 1
name: both have the priority that is best for them
processor_types: {A: {}}
processors: {p0: {type: A}}
threads:
  t0: {processor: p0, period: 15 ms, priority: any}
  t1: {processor: p0, priority: any}
deadlines: all
objectives: [minimise utilisation of p0]
"""


def test_a_priority_is_insisted_on_where_the_best_order_is_asked_for() -> None:
    problem = dse.loads(BEST_ORDER)
    found = dse.insist(dse.solve(problem))
    assert dse.verify(found, problem=problem, method="exhaustion").status == "verified"


NO_BOUND = """
dse: 1
name: segments without a bound
processor_types: {A: {cores: 3}, H: {serves: fifo}}
processors: {p0: {type: A}, p1: {type: A}, g: {type: H}}
executors: {E3: {processor: p0, kind: callback_group}}
threads:
  t0: {processor: p0}
  t1: {executor: E3, period: [4 ms, 6 ms], priority: [2, 1]}
  t2:
    processor: p1
    segments:
      - {compute_execution_time: 1 ms .. 1 ms}
      - {compute_execution_time: {H: 2 ms .. 3 ms}, processor: g}
      - {compute_execution_time: 1 ms .. 1 ms}
      - {compute_execution_time: {H: 1 ms .. 2 ms}, processor: g}
connections: {w1: {from: t0, to: t1}, w2: {from: t1, to: t2}}
flows: {f: {path: [t1, t2]}}
processing: response_time
objectives: [minimise latency of f]
"""


def test_a_latency_without_a_bound_is_the_same_for_search_and_analysis() -> None:
    problem = dse.loads(NO_BOUND)
    found = dse.solve(problem)
    [point] = found.front
    assert is_unbounded(point.objectives["latency of f"])
    assert dse.verify(found, problem=problem).status == "verified"


FIXED_CORE = """
dse: 1
name: a core that is fixed where the type has groups of them
processor_types: {A: {cores: {big: 1, little: 3}}}
processors: {p0: {type: A}}
executors: {E2: {processor: p0, kind: callback_group}}
reservations: {R1: {processor: p0, budget: 7 ms, period: 8 ms}}
threads:
  t0: {executor: E2, compute_execution_time: 3 ms, period: [10 ms, 20 ms]}
  t1: {executor: E2, compute_execution_time: {A: 1 ms .. 4 ms, A/little: 5 ms}}
  t2: {reservation: R1, compute_execution_time: {A: 2 ms .. 6 ms}, period: [12 ms, 6 ms], deadline: 26 ms}
  t3: {executor: E2, compute_execution_time: {A: 2 ms .. 3 ms}, period: 15 ms}
  t4: {executor: E2, compute_execution_time: {A: 1 ms .. 2 ms, A/little: 3 ms}, period: [4 ms, 12 ms]}
connections: {w1: {from: t0, to: t1}}
objectives: [minimise response time of t4]
requirements: [utilisation of core 4 of p0 <= 80 %, response time of t1 >= 3 ms]
"""


def test_a_conflict_with_a_fixed_core_keeps_that_core() -> None:
    problem = dse.loads(FIXED_CORE).ask(fix=["'E2.core' = 4"])
    found = dse.solve(problem)
    assert found.status == "infeasible"
    assert not front_of_all(problem)
    assert dse.verify(found, problem=dse.loads(FIXED_CORE)).status == "verified"


CHOSEN = """
dse: 1
name: two executors, two cores
deadlines: all
processor_types: {A: {cores: 2, price: 10 EUR}}
processors: {p0: {type: A}}
executors: {E1: {processor: p0, kind: fifo}, E2: {processor: p0, kind: fifo}}
threads:
  t0: {executor: [E1, E2], period: 10 ms, compute_execution_time: 6 ms}
  t1: {executor: [E2, E1], period: 10 ms, compute_execution_time: 6 ms}
objectives: [minimise response time of t0]
"""


def test_cores_keep_their_numbers_where_executors_are_chosen() -> None:
    space = dse.loads(CHOSEN).space
    designs = list(product(*(range(len(item.options)) for item in space.decisions)))
    evaluator = Evaluator(space)
    for design in designs:
        for other in designs:
            if evaluator.evaluate(design).is_feasible:
                assert evaluator.evaluate(numbered_like(space, design, other)).is_feasible
