"""The house: sizes of files and folders, entrances, the picture of the layers, no circles, nothing left over."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Container, Iterator
from pathlib import Path

import networkx

from tests.conftest import FILES, QUICK
from tests.helpers.documents import ROOT

DOCS = ROOT / "docs"
DSE = ROOT / "dse"
IMPORT = re.compile(r"^ *from (dse[\w.]*) import (\([^)]*\)|.*)", re.M)


def test_the_picture_of_the_layers_is_the_import_contract() -> None:
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(item["layers"] for item in contract if item["type"] == "layers")
    picture = re.search(r"<!-- layers -->\n```text\n(.*?)```", (DOCS / "architecture.md").read_text("utf-8"), re.S)
    assert picture is not None
    assert [re.split(r"\s{2,}", line)[0] for line in picture[1].splitlines()] == layers


def test_a_module_says_one_thing() -> None:
    """A module has at most 500 lines, a folder at most 15 modules."""
    paths = list(DSE.rglob("*.py"))
    lines = {str(path.relative_to(ROOT)): path.read_text("utf-8").count("\n") for path in paths}
    assert {name: count for name, count in lines.items() if count > 500} == {}
    crowd = Counter(str(path.parent.relative_to(ROOT)) for path in paths if path.name != "__init__.py")
    assert {name: count for name, count in crowd.items() if count > 15} == {}


def test_each_folder_has_an_entrance() -> None:
    """The docstring of `__init__` names each module and folder beside it, in at most 20 lines."""
    for path in DSE.rglob("__init__.py"):
        said = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
        assert said.count("\n") < 20, path
        if path.parent == DSE:
            continue
        for item in path.parent.iterdir():
            if item.suffix == ".py" or (item / "__init__.py").exists():
                assert item.stem == "__init__" or re.search(rf"\b{item.stem}\b", said), item


def test_files_import_each_other_in_no_circle() -> None:
    """Imports inside of functions and for type checkers count: who changes a file reads what it names."""
    files = {_module(path): path for path in DSE.rglob("*.py")}
    imports = networkx.DiGraph((name, other) for name, path in files.items() for other in _imports(path, files))
    circles = [sorted(found) for found in networkx.strongly_connected_components(imports) if len(found) > 1]
    assert circles == []


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _imports(path: Path, files: Container[str]) -> Iterator[str]:
    """The files that a file imports, wherever in it."""
    for module, names in IMPORT.findall(path.read_text("utf-8")):
        for name in re.findall(r"\w+", names):
            yield f"{module}.{name}" if f"{module}.{name}" in files else module


def test_a_quick_run_looks_into_every_folder() -> None:
    rooms = {path.parent.name for path in DSE.glob("*/__init__.py")}
    assert set(QUICK) == {"every room", *rooms}
    assert [path for path in FILES if not path.exists()] == []
    single = [name.split("::") for names in QUICK.values() for name in names if "::" in name]
    assert [test for file, test in single if f"def {test}" not in (ROOT / file).read_text("utf-8")] == []


HOOKS = {"_add_pre_pep8_methods", "on_broken_pipe", "get_command", "list_commands", "format_commands", "format_options",
         "_repr_svg_"}  # fmt: skip
"""What others call by its name; so are the handlers of events (`dse/importers/ros2/trace.py`)."""


def test_what_nothing_uses_is_gone() -> None:
    """A function or class is named a second time, in the program or in what is told of it; tests alone are no use."""
    texts = [path.read_text("utf-8") for path in DSE.rglob("*") if path.suffix in (".py", ".j2", ".js")]
    texts += [path.read_text("utf-8") for path in (*ROOT.glob("*.md"), *DOCS.glob("*.md"), ROOT / "docs" / "conf.py")]
    named = Counter(word for text in texts for word in re.findall(r"\w+", text))
    handlers = (DSE / "importers" / "ros2" / "trace.py").read_text("utf-8")
    defined = {word for text in texts for word in re.findall(r"^ *(?:def|class) (\w+)", text, re.M)}
    assert not {
        word
        for word in defined - HOOKS
        if named[word] < 2 and not word.startswith("__") and f"def {word}(" not in handlers
    }
