"""Answers are written as the library's own writer would, only sooner."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from dse.answers.base import json_text

plain = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
nested = st.recursive(
    plain,
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.lists(inner).map(tuple),
    max_leaves=30,
)


@given(st.dictionaries(st.text() | st.integers() | st.booleans() | st.none(), nested))
def test_the_text_is_that_of_the_library(data: dict[Any, Any]) -> None:
    assert json_text(data) == json.dumps(data, ensure_ascii=False, indent=1) + "\n"
