"""Exact design-space exploration for robot and embedded architectures.

``dse.load`` reads a problem file, ``dse.solve`` returns its proven Pareto front, ``dse.analyse`` every figure of one
design, ``dse.check`` a description of the space. Everything is imported on first use.

The folders, from top to bottom; a folder imports only from the lines below its own, and each has an entrance in its
``__init__.py``. Read ``questions/verbs/solve.py`` first: it leads from a problem to an answer.

* ``cli``: commands, options, exit codes.
* ``report``: pages, plots, terminal output.
* ``questions``: one function for each verb (solve, explain, verify, sweep, ...).
* ``search``, ``verification``, ``fitting``: the Pareto front; the second proof of it; measurements to figures.
* ``encode``, ``answers``, ``examples``: the CP-SAT model; results as data; shipped and random problems.
* ``analysis``, ``simulation``: the formulas and the referee; the discrete-event simulation.
* ``space``: the design space, with names resolved and integer quantities.
* ``spec``: the problem file and its schema.
* ``importers``: AADL, CAN databases and ROS 2 descriptions as problem files.
* ``support``: errors, files, time limits, units.
"""

from __future__ import annotations

from importlib import import_module

from dse.support.version import __version__

TYPE_CHECKING = False  # as that of `typing`, which is not imported here: Ctrl-C is heeded from `dse.cli.entry` on
if TYPE_CHECKING:
    from dse.analysis.limits import Verdict as Verdict
    from dse.answers.analysis import Analysis as Analysis
    from dse.answers.analysis import FlowTable as FlowTable
    from dse.answers.analysis import Usage as Usage
    from dse.answers.base import Answer as Answer
    from dse.answers.base import DataAnswer as DataAnswer
    from dse.answers.comparison import DesignComparison as DesignComparison
    from dse.answers.comparison import ResultComparison as ResultComparison
    from dse.answers.contention_verdicts import Contended as Contended
    from dse.answers.designs import FurtherDesign as FurtherDesign
    from dse.answers.designs import FurtherDesigns as FurtherDesigns
    from dse.answers.designs import Insisting as Insisting
    from dse.answers.designs import ListedDesigns as ListedDesigns
    from dse.answers.designs import ListedPoint as ListedPoint
    from dse.answers.designs import Point as Point
    from dse.answers.explanation import Explanation as Explanation
    from dse.answers.forms.registry import schema as schema
    from dse.answers.measured import MeasuredComparison as MeasuredComparison
    from dse.answers.question_data import Origin as Origin
    from dse.answers.ranking.order import ranked_by as ranked_by
    from dse.answers.result import Clash as Clash
    from dse.answers.result import Conflict as Conflict
    from dse.answers.result import ObjectiveInfo as ObjectiveInfo
    from dse.answers.result import Result as Result
    from dse.answers.result import Search as Search
    from dse.answers.robust import RobustResult as RobustResult
    from dse.answers.simulation import Simulation as Simulation
    from dse.answers.studies.sensitivity import Margin as Margin
    from dse.answers.studies.sensitivity import SensitivityResult as SensitivityResult
    from dse.answers.studies.sweep import SweepResult as SweepResult
    from dse.answers.studies.sweep import SweepRun as SweepRun
    from dse.answers.studies.sweep import VariedAxis as VariedAxis
    from dse.answers.tables.graph import architecture_graph as architecture_graph
    from dse.answers.verification import Finding as Finding
    from dse.answers.verification import Verification as Verification
    from dse.examples.random import random_problem as random_problem
    from dse.examples.shipped import example_path as example_path
    from dse.fitting.fitted import Fit as Fit
    from dse.questions.builder import Builder as Builder
    from dse.questions.explain.explain import explain as explain
    from dse.questions.problem import Model as Model
    from dse.questions.problem import Problem as Problem
    from dse.questions.problem import Source as Source
    from dse.questions.problem import load as load
    from dse.questions.problem import loads as loads
    from dse.questions.question import Decided as Decided
    from dse.questions.question import Question as Question
    from dse.questions.reopen import read as read
    from dse.questions.reopen import reopen as reopen
    from dse.questions.resume import reopen_robust as reopen_robust
    from dse.questions.resume import resume as resume
    from dse.questions.robust.robust import solve_robust as solve_robust
    from dse.questions.sensitivity.sensitivity import sensitivity as sensitivity
    from dse.questions.sweep.sweep import SweepProgress as SweepProgress
    from dse.questions.sweep.sweep import sweep as sweep
    from dse.questions.verbs.alternatives import with_further_designs as with_further_designs
    from dse.questions.verbs.analyse import analyse as analyse
    from dse.questions.verbs.check import Description as Description
    from dse.questions.verbs.check import check as check
    from dse.questions.verbs.compare import Side as Side
    from dse.questions.verbs.compare import compare as compare
    from dse.questions.verbs.compare_measured import compare_measured as compare_measured
    from dse.questions.verbs.export import export as export
    from dse.questions.verbs.fit import fit as fit
    from dse.questions.verbs.import_file import ImportedFile as ImportedFile
    from dse.questions.verbs.import_file import import_file as import_file
    from dse.questions.verbs.insist import insist as insist
    from dse.questions.verbs.simulate import simulate as simulate
    from dse.questions.verbs.sizes import Sizes as Sizes
    from dse.questions.verbs.sizes import sizes as sizes
    from dse.questions.verbs.solve import solve as solve
    from dse.questions.verify.verify import verify as verify
    from dse.report.dispatch import Told as Told
    from dse.report.output import write_figures as write_figures
    from dse.report.output import write_report as write_report
    from dse.report.picture import Picture as Picture
    from dse.report.picture import plot as plot
    from dse.report.widget import widget as widget
    from dse.search.front import Progress as Progress
    from dse.space.model.space import Decision as Decision
    from dse.space.model.space import Design as Design
    from dse.space.model.space import Space as Space
    from dse.spec.loading.load import LoadedSpec as LoadedSpec
    from dse.support.arguments import Span as Span
    from dse.support.errors import Diagnostic as Diagnostic
    from dse.support.errors import DseError as DseError
    from dse.support.errors import ProblemError as ProblemError
    from dse.support.errors import UsageError as UsageError

_HOMES = {
    "analyse": "dse.questions.verbs.analyse",
    "Description": "dse.questions.verbs.check",
    "check": "dse.questions.verbs.check",
    "compare": "dse.questions.verbs.compare",
    "explain": "dse.questions.explain.explain",
    "export": "dse.questions.verbs.export",
    "compare_measured": "dse.questions.verbs.compare_measured",
    "fit": "dse.questions.verbs.fit",
    "sizes": "dse.questions.verbs.sizes",
    "import_file": "dse.questions.verbs.import_file",
    "ImportedFile": "dse.questions.verbs.import_file",
    "Model": "dse.questions.problem",
    "Problem": "dse.questions.problem",
    "load": "dse.questions.problem",
    "loads": "dse.questions.problem",
    "read": "dse.questions.reopen",
    "reopen": "dse.questions.reopen",
    "with_further_designs": "dse.questions.verbs.alternatives",
    "insist": "dse.questions.verbs.insist",
    "reopen_robust": "dse.questions.resume",
    "resume": "dse.questions.resume",
    "simulate": "dse.questions.verbs.simulate",
    "solve": "dse.questions.verbs.solve",
    "verify": "dse.questions.verify.verify",
    "Diagnostic": "dse.support.errors",
    "DseError": "dse.support.errors",
    "ProblemError": "dse.support.errors",
    "UsageError": "dse.support.errors",
    "write_report": "dse.report.output",
    "write_figures": "dse.report.output",
    "widget": "dse.report.widget",
    "plot": "dse.report.picture",
    "Builder": "dse.questions.builder",
    "Analysis": "dse.answers.analysis",
    "Explanation": "dse.answers.explanation",
    "architecture_graph": "dse.answers.tables.graph",
    "ranked_by": "dse.answers.ranking.order",
    "Fit": "dse.fitting.fitted",
    "Sizes": "dse.questions.verbs.sizes",
    "Result": "dse.answers.result",
    "Simulation": "dse.answers.simulation",
    "RobustResult": "dse.answers.robust",
    "SensitivityResult": "dse.answers.studies.sensitivity",
    "SweepResult": "dse.answers.studies.sweep",
    "solve_robust": "dse.questions.robust.robust",
    "sensitivity": "dse.questions.sensitivity.sensitivity",
    "sweep": "dse.questions.sweep.sweep",
    "Verification": "dse.answers.verification",
    "example_path": "dse.examples.shipped",
    "random_problem": "dse.examples.random",
    "schema": "dse.answers.forms.registry",
}

_TYPES = {
    "Answer": "dse.answers.base",
    "Clash": "dse.answers.result",
    "Conflict": "dse.answers.result",
    "Contended": "dse.answers.contention_verdicts",
    "DataAnswer": "dse.answers.base",
    "Decided": "dse.questions.question",
    "Decision": "dse.space.model.space",
    "Design": "dse.space.model.space",
    "DesignComparison": "dse.answers.comparison",
    "Finding": "dse.answers.verification",
    "FlowTable": "dse.answers.analysis",
    "FurtherDesign": "dse.answers.designs",
    "FurtherDesigns": "dse.answers.designs",
    "Insisting": "dse.answers.designs",
    "ListedDesigns": "dse.answers.designs",
    "ListedPoint": "dse.answers.designs",
    "LoadedSpec": "dse.spec.loading.load",
    "Margin": "dse.answers.studies.sensitivity",
    "MeasuredComparison": "dse.answers.measured",
    "ObjectiveInfo": "dse.answers.result",
    "Origin": "dse.answers.question_data",
    "Picture": "dse.report.picture",
    "Point": "dse.answers.designs",
    "Progress": "dse.search.front",
    "Question": "dse.questions.question",
    "ResultComparison": "dse.answers.comparison",
    "Search": "dse.answers.result",
    "Side": "dse.questions.verbs.compare",
    "Source": "dse.questions.problem",
    "Space": "dse.space.model.space",
    "Span": "dse.support.arguments",
    "SweepProgress": "dse.questions.sweep.sweep",
    "SweepRun": "dse.answers.studies.sweep",
    "Told": "dse.report.dispatch",
    "Usage": "dse.answers.analysis",
    "VariedAxis": "dse.answers.studies.sweep",
    "Verdict": "dse.analysis.limits",
}
"""Types of what verbs take and return, for annotations."""

__all__ = ["__version__", *_HOMES, *_TYPES]


if not TYPE_CHECKING:  # a type checker knows the names above, and no others

    def __getattr__(name: str) -> object:
        home = _HOMES.get(name) or _TYPES.get(name)
        if home is None:
            raise AttributeError(f"module 'dse' has no attribute {name!r}{_nearest(name)}")
        return getattr(import_module(home), name)


def _nearest(name: str) -> str:
    """The public name that may be meant; "" for names that Python itself asks for."""
    from difflib import get_close_matches

    close = [] if name.startswith("_") else get_close_matches(name, __all__, 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def __dir__() -> list[str]:
    return sorted(__all__)
