"""What docs/ shows is what happens; its links lead somewhere; its semantics and the docstrings cite each other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import dse
from tests.helpers import commands
from tests.helpers.documents import ROOT, run
from tests.helpers.formats import page

DOCS = ROOT / "docs"
SHOWING = ("semantics.md", "tutorial.md", "classic-problems.md", "ranking.md", "measurements.md")
"""Documents that show files, commands or figures."""
LINK = re.compile(r"\]\((?!https?:)(?P<path>[^)#]+)(#[^)]*)?\)")
CITED = re.compile(r"docs/semantics\.md,\s+section\s+(?P<section>\d+(?:\.\d+)?)")
NAMED_FILE = re.compile(r"`((?:dse|tests|docs)/[\w/]+(?:\.\w+)?)`")
NAMED_OBJECT = re.compile(r"`(dse(?:\.\w+)+)`")
ENTRY_POINTS = ("dse.metrics", "dse.aadl")
"""A group of entry points, and the file of an AADL property set."""
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
    assert {section.partition(".")[0] for section in sections} <= sections
    rules = {section for section in sections if not any(other.startswith(f"{section}.") for other in sections)}
    prose = {"3.4", "3.5", "8"}  # a list of settings, a worked example, and what there is no code for
    assert rules - prose <= cited
    assert not [path for path, text in sources.items() if re.search(r"\(semantics, section", text)]


def test_files_and_modules_that_texts_name_exist() -> None:
    """``dse/…`` in backticks is a file or folder, ``dse.….name`` a name that its module has."""
    paths = [*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *(ROOT / "dse").rglob("*.py")]
    missing = set()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        missing |= {(path.name, name) for name in NAMED_FILE.findall(text) if not (ROOT / name).exists()}
        missing |= {(path.name, name) for name in NAMED_OBJECT.findall(text) if not _is_there(name)}
    assert {item for item in missing if item[1] not in ENTRY_POINTS} == set()


def _is_there(name: str) -> bool:
    """Whether a dotted name is that of a module, or of something that its module names."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        place = ROOT.joinpath(*parts[:count])
        module = next((one for one in (place.with_suffix(".py"), place / "__init__.py") if one.exists()), None)
        if module is not None:
            rest = parts[count : count + 1]
            return all(re.search(rf"\b{word}\b", module.read_text(encoding="utf-8")) for word in rest)
    return False


def test_the_reference_of_formats_is_what_the_schemas_say() -> None:
    text = (DOCS / "formats.md").read_text(encoding="utf-8")
    assert text == page(text), "python -m tests.helpers.formats"


def test_the_reference_of_commands_is_what_they_say() -> None:
    text = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert text == commands.page(text), "python -m tests.helpers.commands"


@pytest.mark.parametrize("name", ["solve", "sweep", "sensitivity", "explain"])
def test_every_column_of_a_csv_file_is_documented(name: str) -> None:
    """Whatever is no metric, decision or axis by name."""
    told = re.search(rf"\*\*`dse {name} --csv`\*\*.*?\n\n(.*?)\n\n", (DOCS / "formats.md").read_text("utf-8"), re.S)
    assert told is not None
    known = [word for line in told[1].splitlines()[2:] for word in re.findall(r"`([^`]+)`", line.split("|")[1])]
    problem = dse.load(ROOT / "tests" / "fuzz" / "pump.yaml").ask(processing="execution_time")  # with every column
    if name == "solve":
        found = dse.solve(problem)
        columns, named = found.columns, [*found.units, *found.open_decisions]
    elif name == "sweep":
        vary = ["jitter of sensor_to_valve=1ms..40ms", "devices.sensor.period=20ms,30ms"]
        swept = dse.sweep(problem, vary, store=None)
        row = next(run for run in swept.runs if run.front)
        assert row.outcome is not None
        columns = swept.columns
        named = [vary[1].partition("=")[0], *row.outcome["units"], *(item.name for item in problem.space.decisions)]
    elif name == "explain":
        columns, named = dse.explain(problem, max_jitter="5 ms").to_csv().partition("\n")[0].split(","), []
    else:
        design = ["computer.type = small", "can0.type = can_250k", "filter.dispatch_protocol = aperiodic"]
        margins = dse.sensitivity(problem, [*design, "control.period = 20 ms"])
        columns, named = margins.to_csv().partition("\n")[0].split(","), []
    assert [column for column in columns if column not in named] == [word for word in known if word == word.lower()]
