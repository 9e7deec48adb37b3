"""Threads that may run on processors with different numbers of cores, against looking at every design."""

from __future__ import annotations

from itertools import product

import pytest

from dse.analysis.evaluate import Evaluator
from dse.search.front import search_front
from tests.helpers.effort import LONG
from tests.helpers.support import brute_front, space_of

TEXT = """
dse: 1
name: unequal cores
deadlines: all
{processing}
processor_types:
  wide: {{cores: 3, price: 30 EUR}}
  narrow: {{cores: {narrow}, price: 10 EUR}}
processors:
  many: {{type: [wide, narrow]}}
  one: {{type: narrow, optional: true}}
threads:
  fast: {{processor: [many, one], period: [4 ms, 8 ms], compute_execution_time: 2 ms{core}}}
  slow: {{processor: [one, many], period: 12 ms, compute_execution_time: {{wide: 7 ms, narrow: 5 ms}}}}
  heavy: {{processor: [many, one], period: 10 ms, compute_execution_time: {{wide: 6 ms, narrow: 7 ms}}}}
connections:
  a: {{from: fast, to: slow}}
  b: {{from: slow, to: heavy}}
flows: {{f: {{path: [fast, slow, heavy]}}}}
objectives: [minimise price, minimise latency of f]
"""


CASES = list(product(["", ", core: 2", ", core: [1, 3]", ", core: 1"], ["", "processing: response_time"], [1, 2]))
SOME = [case for at, case in enumerate(CASES) if LONG or at % 4 in (0, 3)]
"""All of them where there is time, else each core with each number of cores and each way of processing."""


@pytest.mark.parametrize(("core", "processing", "narrow"), SOME)
def test_a_core_that_only_some_processors_have(core: str, processing: str, narrow: int) -> None:
    evaluator = Evaluator(space_of(TEXT.format(core=core, processing=processing, narrow=narrow)))
    search = search_front(evaluator)
    assert search.is_complete
    expected = brute_front(evaluator)
    assert set(search.points) == set(expected)
    assert expected
