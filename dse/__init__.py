"""Exact design-space exploration for robot and embedded architectures.

``dse.load`` reads a problem file, ``dse.solve`` returns its proven Pareto front, ``dse.analyse`` every figure of one
design, ``dse.check`` a description of the space. Everything is imported on first use.
"""

from __future__ import annotations

from importlib import import_module

from dse.version import __version__

TYPE_CHECKING = False  # as that of `typing`, which is not imported here: Ctrl-C is heeded from `dse.cli.entry` on
if TYPE_CHECKING:
    from typing import Any

    from dse.api.analyse import analyse as analyse
    from dse.api.check import Description as Description
    from dse.api.check import check as check
    from dse.api.compare import compare as compare
    from dse.api.explain import explain as explain
    from dse.api.export import export as export
    from dse.api.fit import fit as fit
    from dse.api.further import with_further_designs as with_further_designs
    from dse.api.importing import ImportedFile as ImportedFile
    from dse.api.importing import import_file as import_file
    from dse.api.problem import Model as Model
    from dse.api.problem import Problem as Problem
    from dse.api.problem import load as load
    from dse.api.problem import loads as loads
    from dse.api.read import read as read
    from dse.api.reopen import reopen as reopen
    from dse.api.simulate import simulate as simulate
    from dse.api.sizes import Sizes as Sizes
    from dse.api.sizes import sizes as sizes
    from dse.api.solve import solve as solve
    from dse.errors import Diagnostic as Diagnostic
    from dse.errors import DseError as DseError
    from dse.errors import ProblemError as ProblemError
    from dse.errors import UsageError as UsageError
    from dse.examples import example_path as example_path
    from dse.fitting.fit import Fit as Fit
    from dse.generator import random_problem as random_problem
    from dse.report.figures import write_figures as write_figures
    from dse.report.widget import widget as widget
    from dse.report.writing import write_report as write_report
    from dse.results.analyse import Analysis as Analysis
    from dse.results.explain import Explanation as Explanation
    from dse.results.forms.registry import schema as schema
    from dse.results.graph import architecture_graph as architecture_graph
    from dse.results.order import ranked_by as ranked_by
    from dse.results.robust import RobustResult as RobustResult
    from dse.results.sensitivity import SensitivityResult as SensitivityResult
    from dse.results.simulate import Simulation as Simulation
    from dse.results.solve import Result as Result
    from dse.results.sweep import SweepResult as SweepResult
    from dse.results.verify import Verification as Verification
    from dse.study.insist import insist as insist
    from dse.study.measured import compare_measured as compare_measured
    from dse.study.resume import reopen_robust as reopen_robust
    from dse.study.resume import resume as resume
    from dse.study.robust import solve_robust as solve_robust
    from dse.study.sensitivity import sensitivity as sensitivity
    from dse.study.sweep import sweep as sweep
    from dse.study.verify import verify as verify

_HOMES = {
    "analyse": "dse.api.analyse",
    "Description": "dse.api.check",
    "check": "dse.api.check",
    "compare": "dse.api.compare",
    "explain": "dse.api.explain",
    "export": "dse.api.export",
    "compare_measured": "dse.study.measured",
    "fit": "dse.api.fit",
    "sizes": "dse.api.sizes",
    "import_file": "dse.api.importing",
    "ImportedFile": "dse.api.importing",
    "Model": "dse.api.problem",
    "Problem": "dse.api.problem",
    "load": "dse.api.problem",
    "loads": "dse.api.problem",
    "read": "dse.api.read",
    "reopen": "dse.api.reopen",
    "with_further_designs": "dse.api.further",
    "insist": "dse.study.insist",
    "reopen_robust": "dse.study.resume",
    "resume": "dse.study.resume",
    "simulate": "dse.api.simulate",
    "solve": "dse.api.solve",
    "verify": "dse.study.verify",
    "Diagnostic": "dse.errors",
    "DseError": "dse.errors",
    "ProblemError": "dse.errors",
    "UsageError": "dse.errors",
    "write_report": "dse.report.writing",
    "write_figures": "dse.report.figures",
    "widget": "dse.report.widget",
    "Analysis": "dse.results.analyse",
    "Explanation": "dse.results.explain",
    "architecture_graph": "dse.results.graph",
    "ranked_by": "dse.results.order",
    "Fit": "dse.fitting.fit",
    "Sizes": "dse.api.sizes",
    "Result": "dse.results.solve",
    "Simulation": "dse.results.simulate",
    "RobustResult": "dse.results.robust",
    "SensitivityResult": "dse.results.sensitivity",
    "SweepResult": "dse.results.sweep",
    "solve_robust": "dse.study.robust",
    "sensitivity": "dse.study.sensitivity",
    "sweep": "dse.study.sweep",
    "Verification": "dse.results.verify",
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
