"""What docs/ shows is what happens; its links lead somewhere; its semantics and the docstrings cite each other."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from documents import ROOT, run

DOCS = ROOT / "docs"
SHOWING = ("semantics.md", "tutorial.md")
"""Documents that show files, commands or figures."""
LINK = re.compile(r"\]\((?!https?:)(?P<path>[^)#]+)(#[^)]*)?\)")
CITED = re.compile(r"docs/semantics\.md,\s+section\s+(?P<section>\d+(?:\.\d+)?)")
HEADING = re.compile(r"^#{2,3} (?P<section>\d+(?:\.\d+)?)\.? ", re.M)


@pytest.mark.parametrize("name", SHOWING)
def test_what_a_document_shows_is_what_happens(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    assert run(DOCS / name) > 0


@pytest.mark.parametrize("path", [ROOT / "README.md", *DOCS.rglob("*.md")], ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    links = {found["path"] for found in LINK.finditer(path.read_text(encoding="utf-8"))}
    assert [link for link in links if not (path.parent / link).exists()] == []


def test_every_document_is_reached_from_the_site_and_the_readme_or_another_document() -> None:
    texts = {path: path.read_text(encoding="utf-8") for path in [ROOT / "README.md", *DOCS.rglob("*.md")]}
    linked = {(path.parent / found["path"]).resolve() for path, text in texts.items() for found in LINK.finditer(text)}
    index = (DOCS / "index.md").read_text(encoding="utf-8").split()
    reached = {path.name for path in DOCS.glob("*.md") if path.resolve() in linked or path.stem in index}
    assert {path.name for path in DOCS.glob("*.md")} - reached == {"index.md"}


def test_docstrings_cite_sections_that_there_are_and_every_rule_has_its_code() -> None:
    sections = set(HEADING.findall((DOCS / "semantics.md").read_text(encoding="utf-8")))
    sources = {path: path.read_text(encoding="utf-8") for path in (ROOT / "dse").rglob("*.py")}
    cited = {section for text in sources.values() for section in CITED.findall(text)}
    assert cited <= sections
    rules = {section for section in sections if not any(other.startswith(f"{section}.") for other in sections)}
    prose = {"3.5", "8"}  # a worked example, and what there is no code for
    assert rules - prose <= cited
    assert not [path for path, text in sources.items() if re.search(r"\(semantics, section", text)]


def test_the_picture_of_the_layers_is_the_import_contract() -> None:
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(item["layers"] for item in contract if item["type"] == "layers")
    picture = re.search(r"<!-- layers -->\n```text\n(.*?)```", (DOCS / "architecture.md").read_text("utf-8"), re.S)
    assert picture is not None
    assert [re.split(r"\s{2,}", line)[0] for line in picture[1].splitlines()] == layers
