"""Which problem a result belongs to: its file, where that is there and still means the same, else what it carries."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from dse.importers.registry import is_model
from dse.questions.problem import Model, Problem, load, load_carried, model_of
from dse.spec.loading.document import differences
from dse.spec.loading.load import parse_spec
from dse.support.errors import ProblemError, UsageError
from dse.support.files.reading import read_text

MOST_DIFFERENCES = 3


@dataclass(frozen=True)
class Belonging:
    """The problem of a result.

    `is_carried`: it is the one that the result itself carries, for its file, or one that it names (`absent`), is not
    there. `is_same_text`: the very files that were solved. `differs` says where it means something else; empty where it
    means the same.
    """

    problem: Problem
    is_carried: bool = False
    absent: tuple[str, ...] = ()
    is_same_text: bool = True
    differs: tuple[str, ...] = ()


def problem_of(data: Mapping[str, Any], path: str | Path, stated: Problem | str | Path | None = None) -> Problem:
    """The problem of the result `data` that was read from `path`, as it was solved.

    Parameters
    ----------
    stated
        the problem or its file, where that is no longer where the result says.

    Raises
    ------
    UsageError
        when there is none, or it means something else than the problem that was solved.
    ProblemError
        when its file is there, but wrong.
    """
    origin = belonging(data, path, stated)
    if origin.differs:
        what = "; ".join(origin.differs)
        raise UsageError(f"{origin.problem.loaded.path} has changed since the result was written: {what}")
    return origin.problem


def belonging(data: Mapping[str, Any], path: str | Path, problem: Problem | str | Path | None = None) -> Belonging:
    """The problem of a result and how it compares with the one that was solved; see `problem_of`.

    It is looked for as given, where the result names it, and beside the result; of several files the first that has
    the very text, else the first that means the same, else the first.
    """
    stated = data.get("problem")
    if not isinstance(stated, dict) or not isinstance(stated.get("file"), str) or "\0" in stated["file"]:
        raise UsageError(f"{path}: is not a whole result: it does not name its problem file")
    candidates, mistakes = _candidates(Path(stated["file"]), Path(path).parent, problem, data)
    for item in candidates:
        if _is_same_text(item, data):
            return _belongs(item, data)
    if mistakes and not candidates:
        raise mistakes[0]
    carried = carried_problem(data, path)
    if not candidates:
        return Belonging(carried, is_carried=True)
    for item in candidates:
        if item.loaded.identity == carried.loaded.identity:
            return _belongs(item, data, is_same_text=False)
    differs = _differences(carried, candidates[0])
    return Belonging(candidates[0], is_same_text=False, differs=differs)


def _belongs(problem: Problem, data: Mapping[str, Any], *, is_same_text: bool = True) -> Belonging:
    """A problem that is there, perhaps without files that it names."""
    is_carried = problem.loaded.is_carried
    absent = _absent_beside(problem.loaded.path, data) if is_carried else ()
    return Belonging(problem, is_carried=is_carried, absent=absent, is_same_text=is_same_text)


def carried_problem(data: Mapping[str, Any], path: str | Path) -> Problem:
    """The problem that a result carries.

    Raises
    ------
    UsageError
        when what it carries is no problem.
    """
    texts = data.get("files")
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise UsageError(f"{path}: is not a whole result: files is not what `dse solve --json` writes")
    try:
        return load_carried(data["problem"]["file"], texts)
    except ProblemError as error:
        raise UsageError(f"{path}: the problem that it carries cannot be read: {error.diagnostics[0]}") from error


def carried_digests(problem: Problem) -> tuple[str, tuple[tuple[str, str], ...]]:
    """The hash of the main file of a problem and of what it includes, from their texts.

    SHA-256 in hexadecimal, then pairs of an included file's name and hash. A result carries these texts; the hashes
    show whether a file on disk still is what was solved.
    """
    loaded = problem.loaded
    names = [name for name, _ in loaded.includes]
    return _digest(loaded.texts[loaded.path.name]), tuple((name, _digest(loaded.texts[name])) for name in names)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _candidates(
    named: Path, folder: Path, stated: Problem | str | Path | None, data: Mapping[str, Any]
) -> tuple[list[Problem], list[ProblemError]]:
    """The problems that may be meant, and what is wrong with files that may be."""
    if isinstance(stated, Problem):
        return [stated], []
    if stated is not None:
        return [load(_as_model(Path(stated), data))], []
    problems: list[Problem] = []
    mistakes: list[ProblemError] = []
    for path in dict.fromkeys((named, folder / named, folder / named.name)):
        if not _is_file(path):
            continue
        try:
            problems.append(load(_as_model(path, data)))
        except ProblemError as error:
            completed = _completed(path, data)
            if completed is not None:
                problems.append(completed)
            else:
                mistakes.append(error)
    return problems, mistakes


def _absent_beside(path: Path, data: Mapping[str, Any]) -> tuple[str, ...]:
    """The files that a problem file named when it was solved, by a result that carries them, and that are not there."""
    texts = data.get("files")
    names = texts if isinstance(texts, dict) and not is_model(path) else {}
    return tuple(name for name in names if name != path.name and not _is_there(path.parent / name))


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _completed(path: Path, data: Mapping[str, Any]) -> Problem | None:
    """The problem at a path, where files that it names are not there with their texts as the result carries them.

    None where all are there, or that is no problem either.
    """
    absent = _absent_beside(path, data)
    if not absent:
        return None
    try:
        texts = {
            name: text if name in absent else read_text(path.parent / name) for name, text in data["files"].items()
        }
        return load_carried(path, texts)
    except (ProblemError, UsageError):
        return None


def _as_model(path: Path, data: Mapping[str, Any]) -> Path | Model:
    """The path, with the root and the mode that the result was made with where it is that of a model."""
    if not is_model(path):
        return path
    texts = data.get("files")
    text = texts.get(path.name) if isinstance(texts, dict) else None
    try:
        imported = parse_spec(text, path.name).spec.imported if isinstance(text, str) else None
    except ProblemError:
        imported = None
    return path if imported is None else model_of(path, imported)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file() or (path.is_dir() and is_model(path))
    except (OSError, ValueError):
        return False


def _is_same_text(problem: Problem, data: Mapping[str, Any]) -> bool:
    """Whether these are the very files: those that the result carries, or with the hashes that it states."""
    loaded, stated = problem.loaded, data["problem"]
    if isinstance(data.get("files"), dict):
        texts = dict(loaded.texts)
        main = texts.pop(loaded.path.name)
        solved = dict(data["files"])
        return bool(solved.pop(Path(stated["file"]).name, None) == main and solved == texts)
    includes = stated.get("includes")
    try:
        then = [stated.get("sha256"), *(item["sha256"] for item in includes or ())]
    except (TypeError, KeyError):
        return False
    return then == [loaded.sha256, *(digest for _, digest in loaded.includes)]


def _differences(carried: Problem, other: Problem) -> tuple[str, ...]:
    differing: Iterator[str] = differences(carried.loaded.document, other.loaded.document)
    first = tuple(islice(differing, MOST_DIFFERENCES))
    return (*first, "and more") if next(differing, None) is not None else first
