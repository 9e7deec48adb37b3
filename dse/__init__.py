"""Exact design-space exploration for robot and embedded architectures.

``dse.load`` reads a problem file, ``dse.solve`` returns its proven Pareto front, ``dse.analyse`` every figure of one
design, ``dse.check`` a description of the space. Everything is imported on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dse.version import __version__

if TYPE_CHECKING:
    from dse.api.analysing import analyse as analyse
    from dse.api.checking import Description as Description
    from dse.api.checking import check as check
    from dse.api.comparing import compare as compare
    from dse.api.explaining import explain as explain
    from dse.api.exporting import export as export
    from dse.api.problem import Problem as Problem
    from dse.api.problem import load as load
    from dse.api.problem import loads as loads
    from dse.api.reopening import reopen as reopen
    from dse.api.siblings import with_others as with_others
    from dse.api.simulating import simulate as simulate
    from dse.api.solving import solve as solve
    from dse.errors import Diagnostic as Diagnostic
    from dse.errors import DseError as DseError
    from dse.errors import ProblemError as ProblemError
    from dse.errors import UsageError as UsageError
    from dse.examples import example_path as example_path
    from dse.generator import random_problem as random_problem
    from dse.report.writing import write_report as write_report
    from dse.results.analysis import Analysis as Analysis
    from dse.results.explanation import Explanation as Explanation
    from dse.results.forms.registry import schema as schema
    from dse.results.graph import architecture_graph as architecture_graph
    from dse.results.order import ranked_by as ranked_by
    from dse.results.result import Result as Result
    from dse.results.robust import RobustResult as RobustResult
    from dse.results.sensitivity import SensitivityResult as SensitivityResult
    from dse.results.simulation import Simulation as Simulation
    from dse.results.sweep import SweepResult as SweepResult
    from dse.results.verification import Verification as Verification
    from dse.study.resuming import resume as resume
    from dse.study.robust import solve_robust as solve_robust
    from dse.study.sensitivity import sensitivity as sensitivity
    from dse.study.sweep import sweep as sweep
    from dse.study.verifying import verify as verify

_HOMES = {
    "analyse": "dse.api.analysing",
    "Description": "dse.api.checking",
    "check": "dse.api.checking",
    "compare": "dse.api.comparing",
    "explain": "dse.api.explaining",
    "export": "dse.api.exporting",
    "Problem": "dse.api.problem",
    "load": "dse.api.problem",
    "loads": "dse.api.problem",
    "reopen": "dse.api.reopening",
    "with_others": "dse.api.siblings",
    "resume": "dse.study.resuming",
    "simulate": "dse.api.simulating",
    "solve": "dse.api.solving",
    "verify": "dse.study.verifying",
    "Diagnostic": "dse.errors",
    "DseError": "dse.errors",
    "ProblemError": "dse.errors",
    "UsageError": "dse.errors",
    "write_report": "dse.report.writing",
    "Analysis": "dse.results.analysis",
    "Explanation": "dse.results.explanation",
    "architecture_graph": "dse.results.graph",
    "ranked_by": "dse.results.order",
    "Result": "dse.results.result",
    "Simulation": "dse.results.simulation",
    "RobustResult": "dse.results.robust",
    "SensitivityResult": "dse.results.sensitivity",
    "SweepResult": "dse.results.sweep",
    "solve_robust": "dse.study.robust",
    "sensitivity": "dse.study.sensitivity",
    "sweep": "dse.study.sweep",
    "Verification": "dse.results.verification",
    "example_path": "dse.examples",
    "random_problem": "dse.generator",
    "schema": "dse.results.forms.registry",
}

__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'dse' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
