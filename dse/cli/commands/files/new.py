"""``dse new``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import click

from dse.cli.common import ExistingPath, check_writable, write_text
from dse.cli.completion import examples
from dse.cli.grouping import GroupedCommand
from dse.cli.printing import in_a_line, say, tell
from dse.examples.shipped import example_files, example_path
from dse.support.errors import UsageError
from dse.support.files.reading import MOST_BYTES, beginning

SCHEMA_FILE = "dse-problem.schema.json"
SCHEMA_MARK = "urn:x-dse:problem:"
RANDOM_OPTIONS = ("threads", "seed", "objectives", "family")


@click.command("new", cls=GroupedCommand)
@click.argument("file", type=click.Path(dir_okay=False), required=False)
@click.option(
    "--example",
    default="starter",
    show_default=True,
    metavar="NAME",
    shell_complete=examples,
    help="Which example to copy.",
)
@click.option("--list", "list_only", is_flag=True, help="List the examples.")
@click.option("--force", is_flag=True, help="Overwrite files that exist.")
@click.option(
    "--random", "is_random", is_flag=True, help="Draw a problem instead, from published figures of real systems."
)
@click.option(
    "--threads",
    type=click.IntRange(min=1),
    default=30,
    show_default=True,
    help="Number of threads of a random problem.",
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of a random problem.")
@click.option(
    "--objectives",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Number of objectives of a random problem, 1 to 5.",
)
@click.option("--family", default="robot", show_default=True, metavar="NAME", help="Family of a random problem.")
@click.option(
    "--from",
    "model",
    type=ExistingPath(),
    metavar="MODEL",
    help="Write a file that decides over this AADL model (or folder) instead: periods, dispatch, classifiers.",
)
@click.option("--root", metavar="NAME", help="With --from: the system implementation, package::type.implementation.")
@click.option("--mode", metavar="MODE", help="With --from: the mode of the system, or PATH.MODE.")
@click.option(
    "--library", multiple=True, metavar="DIR", help="With --from: a folder with packages that the model imports."
)
@click.pass_context
def command(
    ctx: click.Context,
    file: str | None,
    example: str,
    list_only: bool,
    force: bool,
    is_random: bool,
    threads: int,
    seed: int,
    objectives: int,
    family: str,
    model: str | None,
    root: str | None,
    mode: str | None,
    library: tuple[str, ...],
) -> int:
    """Write a problem file to start from (FILE, or the example's own name here), with the catalogues that it includes.

    The file names its JSON Schema, which is written beside it, for editors with yaml-language-server. With --from it
    decides over a model: half and double of each stated period (assumptions), dispatch protocols, and the classifiers
    of processors and buses that the model has; the model's own values are the baseline.
    With --random the problem is drawn: the families are robot, two-computers, event-driven, many-buses and automotive.
    """
    if list_only:
        for path in example_files():
            say(path.stem)
        return 0
    if model is not None:
        if is_random or _is_given(ctx, "example"):
            raise click.UsageError("--from excludes --example and --random")
        from dse.questions.problem import Model

        return _write_deciding(Path(model), Model(model, root, mode, library).options, file, force)
    if root or mode or library:
        raise click.UsageError("--root, --mode and --library need --from")
    if is_random:
        if _is_given(ctx, "example"):
            raise click.UsageError("--example and --random exclude each other")
        from dse.examples.random import random_problem

        text = random_problem(threads, seed, objectives, family)
        return _write_new(text, file or f"{family}-{threads}-{seed}.yaml", force)
    meant = [name for name in RANDOM_OPTIONS if _is_given(ctx, name)]
    if meant:
        raise click.UsageError(f"--{meant[0]} needs --random")
    return _copy_example(example_path(example), file, force)


def _is_given(ctx: click.Context, option: str) -> bool:
    return ctx.get_parameter_source(option) is click.core.ParameterSource.COMMANDLINE


def _write_deciding(path: Path, options: Mapping[str, str], file: str | None, force: bool) -> int:
    from dse.examples.model_decisions import deciding_text

    target = file or f"{path.resolve().stem}-decisions.yaml"
    folder = Path() if target == "-" else Path(target).parent
    text, remarks = deciding_text(path, options, folder)
    for remark in remarks:
        tell(in_a_line(str(remark)))
    return _write_new(text, target, force)


def _write_new(text: str, file: str, force: bool) -> int:
    if file != "-" and Path(file).exists() and not force:
        raise UsageError(f"{file} exists already; --force overwrites it")
    _check_schema(Path(file))
    check_writable(file, replaces_problems=True)
    write_text(file, text if file == "-" else _explained(text))
    if file != "-":
        _write_schema(Path(file))
        say(f"wrote {file}")
        say(f"Next: dse check {file}; dse solve {file}")
    return 0


def _explained(text: str) -> str:
    """A problem file that names its schema, so that an editor with yaml-language-server completes and explains it."""
    return f"# yaml-language-server: $schema={SCHEMA_FILE}\n{text}"


def _check_schema(problem: Path) -> None:
    """A schema that is there already is renewed, if it was made by a dse."""
    path = problem.parent / SCHEMA_FILE
    if path.exists() and SCHEMA_MARK not in beginning(path, MOST_BYTES).decode("utf-8", "replace"):
        raise UsageError(f"{path} exists already, and is no schema of dse")


def _write_schema(problem: Path) -> None:
    """The schema that `_explained` names, beside the problem."""
    from dse.answers.forms.registry import schema

    path = problem.parent / SCHEMA_FILE
    check_writable(str(path), replaces_problems=True)
    write_text(str(path), json.dumps(schema(), ensure_ascii=False, separators=(",", ":")) + "\n")
    say(f"wrote {path}")


def _is_same(original: Path, copy: Path) -> bool:
    return copy.is_file() and copy.read_bytes() == original.read_bytes()


def _copy_example(source: Path, file: str | None, force: bool) -> int:
    target = Path(file) if file is not None else Path(source.name)
    from dse.spec.loading.load import load_spec

    included = [name for name, _ in load_spec(source).includes]
    copies = [(source, target)] + [(source.parent / name, target.parent / name) for name in included]
    copies = [pair for pair in copies if pair[1] is target or not _is_same(*pair)]  # examples share catalogues
    _check_schema(target)
    for _, copy in copies:
        if copy.exists() and not force:
            raise UsageError(f"{copy} exists already; --force overwrites it")
    for original, copy in copies:
        if copy is not target:
            copy.parent.mkdir(parents=True, exist_ok=True)
        check_writable(str(copy), replaces_problems=True)
        text = original.read_text(encoding="utf-8")
        write_text(str(copy), _explained(text) if copy is target and file != "-" else text)
        say(f"wrote {copy}")
    if file != "-":
        _write_schema(target)
    say(f"Next: dse check {target}; dse solve {target}")
    return 0
