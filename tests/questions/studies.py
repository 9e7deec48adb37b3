"""What the tests of studies share: problems with edits made as text, and whether the long versions run."""

from __future__ import annotations

from pathlib import Path

from dse.examples.shipped import example_path
from dse.questions.problem import Problem, load, loads
from dse.questions.sweep.inputs_of_file import Inputs, copied, effective_text, merged_data, needed_data
from tests.helpers.effort import LONG, long_test
from tests.helpers.small import quick, without_waiting
from tests.helpers.support import ENUMERABLE

__all__ = ["ALL", "LONG", "NAMES", "QUICK", "edited", "example", "long_test", "written"]
ALL = [path.stem for path in ENUMERABLE]
QUICK = ["starter", "inmark_chapter2", "inmark_chapter3"]
NAMES = ALL if LONG else QUICK


def example(name: str) -> Problem:
    """A shipped problem, `quick`."""
    return quick(load(example_path(name)))


def edited(problem: Problem, **texts: str) -> Problem:
    """The problem with values set by path (given as keyword arguments by ``**{path: text}``), read again from text."""
    data = needed_data(merged_data(problem), problem.space)
    inputs = Inputs(data)
    changed = copied(data)
    for path, text in texts.items():
        inputs.set(changed, path, text)
    changed["processing"] = problem.space.processing
    return loads(effective_text(changed), "edited")


def written(folder: Path, name: str, more: str = "") -> Path:
    """An example as one file in a folder, with more text at its end."""
    path = folder / f"{name}.yaml"
    source = example_path(name).read_text(encoding="utf-8")
    for catalogue in (example_path(name).parent / "catalogues").glob("*.yaml"):
        (folder / "catalogues").mkdir(exist_ok=True)
        (folder / "catalogues" / catalogue.name).write_text(catalogue.read_text(encoding="utf-8"), encoding="utf-8")
    path.write_text(without_waiting(source) if "processing:" not in more else source, encoding="utf-8")
    with path.open("a", encoding="utf-8") as file:
        file.write(more)
    return path
