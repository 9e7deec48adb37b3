"""Published response times of executors and reservations, value by value (tests/golden/executor_responses.csv)."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from dse.analysis.scheduling.busy_window import Task, periodic
from dse.analysis.scheduling.policies.executors import Fellow
from dse.analysis.scheduling.policies.reservations import supply_gaps
from tests.helpers.windows import queued_response_ns

TABLE = Path(__file__).parents[1] / "golden" / "executor_responses.csv"


def rows() -> list[dict[str, str]]:
    lines = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def task_of(text: str) -> Task:
    worst, separation, jitter = map(int, text.split("/"))
    return periodic(text, worst, separation, jitter)


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row['test']} {row['task']}")
def test_published_response_times(row: dict[str, str]) -> None:
    higher = [supply_gaps("it", *map(int, row["supply"].split("/")))] if row["supply"] else []
    fellows = [Fellow(task_of(item[1:]), item[0] == "+") for item in row["others"].split()]
    found = queued_response_ns(row["kind"], task_of(row["task"]), fellows, higher, int(row["blocked"]))  # type: ignore[arg-type]
    assert found == (int(row["response"]) + int(row["finer"]) if row["response"] else None)
