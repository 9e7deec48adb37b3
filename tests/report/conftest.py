"""One browser for all pages: to start it takes longer than most tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.report.browser import Browser


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A browser whose pages are opened from disk; what a page said is forgotten when the next one is opened."""
    opened = Browser()
    yield opened
    opened.close()
