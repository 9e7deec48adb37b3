"""The conflicts of an infeasible result: true ones are accepted, each with one thing wrong is rejected."""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import pytest

import dse
from dse.questions.verbs.solve import Watcher, solve_asked
from dse.search.front import SearchLimits
from tests.helpers.effort import LONG, count, few
from tests.helpers.small import quick
from tests.helpers.support import ENUMERABLE, SLOW
from tests.questions.explain.test_random_conflicts import infeasible
from tests.verification.shared import copied, question_once

COUNT = count(12)
OF_SHIPPED, OF_EACH = (1000, 1000) if LONG else (1, 1)
"""So many of the altered results of a shipped problem are verified, and so many of each kind of a random one."""
METHODS: tuple[Literal["exhaustion", "model"], ...] = ("exhaustion", "model")


def wrong(data: dict[str, Any], rng: random.Random) -> Iterator[tuple[str, dict[str, Any]]]:
    """(what is wrong, the result): a conflict that is too small, too large or moved, and limits that are not exact."""
    for at, conflict in enumerate(data["conflicts"]):
        texts = [*data["problem"]["effective"]["requirements"], *data["problem"]["effective"]["rules"]]
        listed = {item["text"] for item in conflict["members"]}
        for number, item in enumerate(conflict["members"]):
            changed = copied(data)
            del changed["conflicts"][at]["members"][number]
            yield f"member {number} of conflict {at} left out", changed
            for field, value in (("text", f"{item['text']} "), ("origin", "elsewhere:1"), ("unit", "furlong")):
                changed = copied(data)
                changed["conflicts"][at]["members"][number][field] = value
                yield f"{field} of member {number} of conflict {at} changed", changed
            for field in ("closest", "limit", "miss"):
                if item[field] is not None:
                    changed = copied(data)
                    step = rng.choice((-1, 1, Fraction(1, 3)))
                    changed["conflicts"][at]["members"][number][field] = str(Fraction(item[field]) + step)
                    yield f"{field} of member {number} of conflict {at} changed by {step}", changed
        for text in texts:
            if text not in listed:
                changed = copied(data)
                more = {"text": text, "origin": "command line", "limit": None, "closest": None, "miss": None}
                changed["conflicts"][at]["members"].append({**more, "unit": "", "thread": None})
                yield f"{text!r} added to conflict {at}", changed
                break
    yield from wrong_give_up(data, rng)


def wrong_give_up(data: dict[str, Any], rng: random.Random) -> Iterator[tuple[str, dict[str, Any]]]:
    """What is to be given up: too little, too much, or limits that are not exact."""
    for number, item in enumerate(data.get("give_up", [])):
        changed = copied(data)
        del changed["give_up"][number]
        if changed["give_up"]:
            yield f"member {number} need not be given up", changed
        for field in ("closest", "limit", "miss"):
            if item[field] is not None:
                changed = copied(data)
                changed["give_up"][number][field] = str(Fraction(item[field]) + rng.choice((-1, 1)))
                yield f"{field} of given up member {number} changed", changed
    listed = {item["text"] for item in data.get("give_up", [])}
    for text in [*data["problem"]["effective"]["requirements"], *data["problem"]["effective"]["rules"]]:
        clashing = {item["text"] for conflict in data["conflicts"] for item in conflict["members"]}
        if listed and text not in listed | clashing:
            changed = copied(data)
            more = {"text": text, "origin": "command line", "limit": None, "closest": None, "miss": None}
            changed["give_up"].append({**more, "unit": "", "thread": None})
            yield f"{text!r} given up too", changed
            break


@pytest.mark.parametrize("path", [path for path in ENUMERABLE if path.stem not in SLOW], ids=lambda path: path.stem)
def test_conflicts_of_shipped_problems(path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    question_once(monkeypatch)
    problem = quick(dse.load(path))
    flow = problem.space.flows[0].name
    limits = [f"latency of {flow} <= 2 us", f"jitter of {flow} <= 1 us", "price >= 1 EUR"]
    with_responses = problem.space.processing == "response_time"  # where each proof takes seconds
    cores = [item for item in problem.space.decisions if item.name.endswith(".core") and with_responses]
    problem = problem.ask(require=limits, fix=[f"{item.name} = {item.options[0]}" for item in cores])
    result = dse.solve(problem)
    assert result.status == "infeasible" and result.conflicts
    assert result.give_up and all(item.closest is not None for item in result.give_up if "<=" in item.text)
    check(result.to_dict(), problem, "model", random.Random(1), 1 if with_responses and not LONG else OF_SHIPPED)


def kind(name: str) -> str:
    """What is wrong, without the place where."""
    return re.sub(r"'.*'|-?\d+(/\d+)?", "", name)


@pytest.mark.parametrize("part", few(range(6), 3))
def test_conflicts_of_random_problems(part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    question_once(monkeypatch)
    seen = 0
    for seed in range(part, 10**6, 6):
        drawn = infeasible(seed)
        if drawn is None:
            continue
        asked, _ = drawn
        if not asked.space.objectives:
            continue
        result = solve_asked(asked, SearchLimits(), Watcher())
        assert result.status == "infeasible"
        data = result.to_dict()
        check(data, asked, METHODS[(part + seen) % 2], random.Random(seed), each=OF_EACH)
        seen += 1
        if seen >= COUNT // 6:
            return


def check(
    data: dict[str, Any], problem: Any, method: Any, rng: random.Random, most: int = 1000, each: int = 1000
) -> None:
    found = conflict_findings(data, problem, method)
    assert not found, (found, data["conflicts"])
    altered = list(wrong(data, rng))
    seen: Counter[str] = Counter()
    for name, changed in rng.sample(altered, min(most, len(altered))):
        seen[kind(name)] += 1
        assert seen[kind(name)] > each or conflict_findings(changed, problem, method), name
    assert most < len(altered) or {"member  of conflict  left out", "text of member  of conflict  changed"} <= set(seen)


def conflict_findings(data: dict[str, Any], problem: Any, method: Any) -> list[str]:
    """What is wrong, beyond differences to the file that the random questions have."""
    verification = dse.verify(data, problem=problem, method=method)
    return [str(item) for item in verification.findings if item.place.startswith(("conflicts", "give_up"))]


def test_an_explanation_that_was_cut_away_is_not_said_to_be_confirmed() -> None:
    """That there is no design is true all the same, and a search without time for more says no more."""
    path = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
    data = dse.solve(path, require=["price <= 1 EUR", "jitter of sensor_to_valve <= 1 ms"]).to_dict()
    whole = dse.verify(data)
    assert (whole.status, [text for text in whole.remarks if "conflict" in text]) == ("verified", [])
    cut = dse.verify({**data, "conflicts": [], "give_up": []})
    assert cut.status == "verified"
    assert any("why there is no design was not confirmed" in text for text in cut.remarks)
    assert not any("conflict" in text for text in cut.checked)
    assert data["give_up"], "no single change mends it"
    forged = dse.verify({**data, "conflicts": []})
    assert [item.place for item in forged.findings] == ["give_up"]
