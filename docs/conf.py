"""The documentation site: `python -m sphinx -W --keep-going docs build/site`, from these files and the docstrings."""

from __future__ import annotations

import tempfile
from pathlib import Path

import dse
from dse.report.content.front.document import Document
from dse.report.html import html_report
from dse.support.version import __version__

project = "dse"
author = "the authors of dse"
project_copyright = "the authors of dse"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns: list[str] = []
nitpicky = False

autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
default_role = "code"

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "dse"
html_copy_source = False
html_show_sphinx = False

# The sample report as a page, which the repository does not hold.
_pages = Path(tempfile.mkdtemp(prefix="dse-docs-"))
_sample = dse.solve(Path(__file__).parents[1] / "problems" / "inmark.yaml", max_jitter="20 ms")
(_pages / "sample").mkdir()
(_pages / "sample" / "inmark.html").write_text(html_report(Document(_sample)), encoding="utf-8")
html_extra_path = [str(_pages)]
