"""MiniZinc with a free solver: the textbook loops on the plain model, written as MiniZinc text.

The model is translated mechanically from the plain CP-SAT model, constraint by constraint, so that nobody has to write
it a second time: a Boolean for each literal, clauses, sums of at most or exactly one, linear constraints, and
implications of those. Any other kind of constraint is refused. Each question of the loops is a `minizinc` process of
its own; an answer counts only with the solver's proof ("==========", "=====UNSATISFIABLE=====").

The solver is the first of `SOLVERS` that is there (measurements behind the order: `reports/benchmarks/README.md`).
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil, gcd
from pathlib import Path
from typing import Any

from .asking import OutOfTime, Vector

SOLVERS: dict[str, list[str]] = {"org.gecode.gecode": [], "org.chuffed.chuffed": ["-f"]}
"""Free solvers, best first, with their flags."""
SEARCH = "dom_w_deg, indomain_max"
"""How Booleans are tried: without saying so Gecode needs 20 s for a question that takes it 0.1 s."""
MOST = 2**30
"""The solvers count in 32 bits: larger sums are cut into parts, larger summands refused."""
GRACE_S = 10.0


class NotTranslatable(ValueError):
    """The model has something that is not translated."""


@dataclass(frozen=True)
class Solver:
    """A solver of the installed MiniZinc."""

    id: str
    text: str
    """Name and version."""
    minizinc: str
    """Version of MiniZinc."""


@cache
def installed() -> Solver | None:
    """The best free solver; None where MiniZinc or every known solver is missing."""
    if shutil.which("minizinc") is None:
        return None
    found = {item["id"]: item for item in json.loads(_output(["minizinc", "--solvers-json"]))}
    for name in SOLVERS:
        if name in found:
            version = re.search(r"version ([\d.]+)", _output(["minizinc", "--version"]))
            text = f"{found[name]['name']} {found[name]['version']}"
            return Solver(name, text, version[1] if version else "of unknown version")
    return None


def _output(command: list[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class MiniZinc:
    """What the loops ask: a process for each question."""

    def __init__(self, solver: Solver) -> None:
        self.command = ["minizinc", "--solver", solver.id, *SOLVERS[solver.id], "--statistics"]
        self.solver_s = 0.0
        """Seconds that the solver itself reports, without starting MiniZinc and flattening the text."""

    def __call__(self, model: Any, variables: Sequence[Any], left_s: float) -> Vector | None:
        """The variables' values in an optimum of the model."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "model.mzn"
            file.write_text(translated(model.proto, [variable.index for variable in variables]), encoding="utf-8")
            command = [*self.command, "--time-limit", str(ceil(left_s * 1000)), str(file)]
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=left_s + GRACE_S, check=False)
            except subprocess.TimeoutExpired as error:
                raise OutOfTime from error
        if done.returncode or "=====ERROR=====" in done.stdout:
            said = (done.stderr or done.stdout).strip().splitlines()
            raise RuntimeError(f"minizinc: {said[-1] if said else done.returncode}")
        self.solver_s += sum(map(float, re.findall(r"(?:init|solve)Time=([\d.e+-]+)", done.stdout)))
        return answer(done.stdout, len(variables))


def answer(text: str, count: int) -> Vector | None:
    """The proved optimum in MiniZinc's output, None where it is proved that there is no solution."""
    lines = text.split("\n")
    if "=====UNSATISFIABLE=====" in lines:
        return None
    if "==========" not in lines:
        raise OutOfTime
    points = [line for line in lines if line.startswith("point ")]
    values = tuple(int(value) for value in points[-1].split()[1:])
    assert len(values) == count, points[-1]
    return values


def translated(proto: Any, shown: Sequence[int]) -> str:
    """A CP-SAT model as MiniZinc text that prints the variables in `shown`."""
    text = Text(proto)
    for constraint in proto.constraints:
        text.add(constraint)
    goal = text.sum(proto.objective.vars, proto.objective.coeffs)
    literals = ", ".join(f"v{number}" for number, domain in enumerate(text.domains) if domain == [0, 1])
    text.lines.append(f"solve :: bool_search([{literals}], {SEARCH}, complete) minimize {goal};")
    values = "".join(f" \\(1*v{number})" for number in shown)
    text.lines.append(f'output ["point{values}\\n"];')
    return "\n".join(text.lines) + "\n"


class Text:
    """The lines of a model, which begin with its variables: v0, v1, ..., and p0, p1, ... for parts of large sums."""

    def __init__(self, proto: Any) -> None:
        self.domains = [list(variable.domain) for variable in proto.variables]
        self.lines = [_declaration(number, domain) for number, domain in enumerate(self.domains)]
        self.parts = 0

    def add(self, constraint: Any) -> None:
        """Translate a constraint."""
        guards = list(constraint.enforcement_literal)
        if constraint.has_bool_or():
            self._demand(_clause([*constraint.bool_or.literals, *map(_negated, guards)]))
        elif constraint.has_bool_and():
            for literal in constraint.bool_and.literals:
                self._demand(_clause([literal, *map(_negated, guards)]))
        elif constraint.has_exactly_one() and not guards:
            self._demand(f"{_count(constraint.exactly_one.literals)} = 1")
        elif constraint.has_at_most_one() and not guards:
            self._demand(f"{_count(constraint.at_most_one.literals)} <= 1")
        elif constraint.has_linear() and len(constraint.linear.domain) == 2:
            given = " /\\ ".join(map(_literal, guards))
            self._bound(f"{given} -> " if guards else "", constraint.linear)
        else:
            raise NotTranslatable(f"not translated: {' '.join(str(constraint).split())[:100]}")

    def _demand(self, text: str) -> None:
        self.lines.append(f"constraint {text};")

    def _bound(self, given: str, linear: Any) -> None:
        """Demand low <= sum <= high divided by what the coefficients share, without a side on which any sum will do."""
        low, high = linear.domain
        share = gcd(*linear.coeffs) or 1
        least, most = -(-low // share), high // share
        total = self.sum(linear.vars, [factor // share for factor in linear.coeffs])
        if least == most:
            self._demand(f"{given}{total} = {least}")
            return
        if low > -(2**63):
            self._demand(f"{given}{total} >= {least}")
        if high < 2**63 - 1:
            self._demand(f"{given}{total} <= {most}")

    def sum(self, numbers: Sequence[int], factors: Sequence[int]) -> str:
        """A sum, Booleans counted as 0 and 1; of variables for its parts where it can pass what solvers count to."""
        parts: list[tuple[int, int, list[str]]] = [(0, 0, [])]
        for number, factor in zip(numbers, factors, strict=True):
            term = f"{factor}*v{number}"
            least, most = sorted(factor * end for end in self.domains[number])
            if max(-least, most) > MOST:
                raise NotTranslatable(f"not translated: {term} up to {max(-least, most)}")
            low, high, terms = parts[-1]
            if max(high + most, -low - least) > MOST:
                parts.append((least, most, [term]))
            else:
                parts[-1] = (low + least, high + most, [*terms, term])
        if len(parts) == 1:
            return _total(parts[0][2])
        names = []
        for low, high, terms in parts:
            names.append(f"p{self.parts}")
            self.parts += 1
            self.lines.append(f"var {low}..{high}: {names[-1]};")
            self._demand(f"{_total([*terms, f'-{names[-1]}'])} = 0")
        return _total(names)


def _declaration(number: int, domain: list[int]) -> str:
    if len(domain) != 2 or max(map(abs, domain)) > MOST:
        raise NotTranslatable(f"not translated: a variable in {domain}")
    low, high = domain
    if not 0 <= low <= high <= 1:
        return f"var {low}..{high}: v{number};"
    return f"var bool: v{number};" if low < high else f"bool: v{number} = {'true' if low else 'false'};"


def _clause(literals: Sequence[int]) -> str:
    holds = ", ".join(f"v{literal}" for literal in literals if literal >= 0)
    fails = ", ".join(f"v{_negated(literal)}" for literal in literals if literal < 0)
    return f"clause([{holds}], [{fails}])"


def _negated(literal: int) -> int:
    return -1 - literal


def _literal(literal: int) -> str:
    return f"v{literal}" if literal >= 0 else f"not v{_negated(literal)}"


def _count(literals: Sequence[int]) -> str:
    return _total(list(map(_literal, literals)))


def _total(terms: list[str]) -> str:
    return f"sum([{', '.join(terms)}])"
