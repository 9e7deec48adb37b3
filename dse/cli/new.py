"""``dse new``."""

from __future__ import annotations

from pathlib import Path

import click

from dse.cli.common import check_writable, write_text
from dse.errors import UsageError
from dse.examples import example_files, example_path


@click.command("new")
@click.argument("file", type=click.Path(dir_okay=False), required=False)
@click.option("--example", default="starter", show_default=True, metavar="NAME", help="Which example to copy.")
@click.option("--list", "list_only", is_flag=True, help="List the examples.")
@click.option("--force", is_flag=True, help="Overwrite files that exist.")
def command(file: str | None, example: str, list_only: bool, force: bool) -> int:
    """Write a problem file to start from (FILE, or the example's own name here), with the catalogues that it includes."""
    if list_only:
        for path in example_files():
            click.echo(path.stem)
        return 0
    source = example_path(example)
    target = Path(file) if file is not None else Path(source.name)
    from dse.spec.load import load_spec

    included = [name for name, _ in load_spec(source).includes]
    copies = [(source, target)] + [(source.parent / name, target.parent / name) for name in included]
    for _, copy in copies:
        if copy.exists() and not force:
            raise UsageError(f"{copy} exists already; --force overwrites it")
    for original, copy in copies:
        if copy is not target:
            copy.parent.mkdir(parents=True, exist_ok=True)
        check_writable(str(copy))
        write_text(str(copy), original.read_text(encoding="utf-8"))
        click.echo(f"wrote {copy}")
    click.echo(f"Next: dse check {target}; dse solve {target}")
    return 0
