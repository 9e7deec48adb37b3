"""Completions for a shell: names of examples, methods of ranking, decisions and options of the problem file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from dse.support.errors import DseError


def _beginning(words: Iterable[str], text: str) -> list[CompletionItem]:
    """The words that begin with a text."""
    return [CompletionItem(word) for word in words if word.startswith(text)]


def examples(ctx: click.Context, param: click.Parameter, text: str) -> list[CompletionItem]:
    """The names of the examples."""
    from dse.examples.shipped import example_files

    return _beginning([path.stem for path in example_files()], text)


def rankings(ctx: click.Context, param: click.Parameter, text: str) -> list[CompletionItem]:
    """Methods of ranking; those with parameters with the objectives of the problem file, where one is named already.

    At most the words that begin with `text`; a file that cannot be read gives the methods alone.
    """
    from dse.answers.ranking.ranking import METHODS

    problem = _problem(ctx)
    names = [item.metric.name for item in problem.space.objectives] if problem is not None else []
    quoted = [f"'{name}'" if " " in name else name for name in names]
    words = [method for method in METHODS if method not in ("weights", "order")]
    words += [f"weights:{name}=" for name in quoted] + [f"order:{name}" for name in quoted]
    return _beginning(words, text)


def fixes(ctx: click.Context, param: click.Parameter, text: str) -> list[CompletionItem]:
    """``DECISION = OPTION`` for each option of each open decision of the problem file.

    Texts for ``--fix``; nothing before a problem file is named.
    """
    problem = _problem(ctx)
    if problem is None:
        return []
    items = [
        f"{decision.name} = {option}"
        for decision in problem.space.decisions
        if decision.is_open
        for option in decision.options
    ]
    return _beginning(items, text)


def _problem(ctx: click.Context) -> Any:
    """The problem of the file that stands on the command line already; None where none can be read."""
    from dse.questions.problem import load

    for path in (ctx.params.get("file"), *ctx.args):
        if path is not None and Path(str(path)).is_file():
            try:
                return load(str(path))
            except (DseError, OSError):
                return None
    return None
