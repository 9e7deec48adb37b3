"""What is measured: problems by name, and what is asked of them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from dse.generator import FAMILIES, random_problem

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Case:
    """A problem: of the generator, or a file of `problems/` with a further limit."""

    name: str
    family: str = ""
    threads: int = 0
    objectives: int = 0
    seed: int = 1
    file: str = ""
    max_jitter: str = ""
    periods: int = 0

    def text(self) -> str:
        """The problem file of a generated case; with `periods`, at most that many options of each period are left."""
        text = random_problem(self.threads, self.seed, self.objectives, self.family)
        return _with_fewer_periods(text, self.periods) if self.periods else text


def _with_fewer_periods(text: str, most: int) -> str:
    """Neighbours of the baseline's period only, which keeps the baseline a design."""
    head, baseline = text.split("\nbaseline:\n")
    kept = dict(re.findall(r"^  (\w+): \{.*?period: (\d+ ms)\}", baseline, re.MULTILINE))
    lines = []
    for line in head.split("\n"):
        found = re.search(r"period: \[([^\]]*)\]", line)
        if found:
            options = found.group(1).split(", ")
            mine = kept.get(line.split(":")[0].strip(), options[len(options) // 2])
            start = max(0, min(options.index(mine) - most // 2, len(options) - most))
            line = line.replace(found.group(1), ", ".join(options[start : start + most]))
        lines.append(line)
    return "\n".join(lines) + "\nbaseline:\n" + baseline


def generated(family: str, threads: int, objectives: int, seed: int = 1, periods: int = 0) -> Case:
    """A case of the generator, named after its arguments."""
    name = f"{family} N={threads} K={objectives} seed={seed}"
    return Case(f"{name} periods<={periods}" if periods else name, family, threads, objectives, seed, periods=periods)


INMARK = Case("inmark, jitter <= 20 ms", file="problems/inmark.yaml", max_jitter="20 ms")


MANY_POINTS = generated("many-buses", 100, 3, 15)
"""201 points of 100 threads: checkpoints that are made anew took eight times as long as the search."""


def fronts(*, quick: bool, seed: int) -> list[Case]:
    """Problems whose proven fronts are timed beside the peers'."""
    small = [generated(family, 6, 3, seed) for family in FAMILIES]
    if quick:
        return [INMARK, *small[:2], generated("event-driven", 30, 2, seed)]
    middle = [generated(family, 30, objectives, seed) for family in FAMILIES for objectives in (2, 3)]
    many = [generated(family, 10, 4, seed) for family in ("automotive", "many-buses")]
    large = [generated(family, 100, 3, seed) for family in ("many-buses", "automotive", "two-computers")]
    largest = [generated(family, 300, 2, seed) for family in ("event-driven", "two-computers", "robot")]
    return [INMARK, *small, *middle, *many, *large, *largest, generated("event-driven", 1000, 2, seed)]


def commands(*, quick: bool, seed: int) -> list[Case]:
    """Problems that are solved by the command itself: many points, so that what is kept of them is large."""
    if quick:
        return [INMARK, generated("many-buses", 10, 3, seed)]
    return [INMARK, *(generated("many-buses", threads, 3, seed) for threads in (30, 100)), MANY_POINTS]


def curves(*, quick: bool, seed: int) -> dict[str, list[tuple[float, Case]]]:
    """Series of cases by what grows in them, with its value."""
    threads = (10, 20) if quick else (10, 30, 100, 300, 1000)
    objectives = (2, 3) if quick else (2, 3, 4, 5)
    options = (2, 3) if quick else (2, 3, 4, 5, 6)
    return {
        "threads": [(n, generated("event-driven", n, 2, seed)) for n in threads],
        "objectives": [(k, generated("event-driven", 10, k, seed)) for k in objectives],
        "options of a period": [(m, generated("many-buses", 20, 2, seed, m)) for m in options],
    }
