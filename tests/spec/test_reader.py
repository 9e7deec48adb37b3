"""The YAML reader: 1.2 scalars, places, and what it refuses."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from dse.spec.loading import reader
from dse.spec.loading.reader import read_yaml
from dse.support.errors import ProblemError


def data(text: str) -> Any:
    return read_yaml(text, "f.yaml").to_data()


def error(text: str) -> str:
    with pytest.raises(ProblemError) as caught:
        read_yaml(text, "f.yaml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("no", "no"),
        ("yes", "yes"),
        ("off", "off"),
        ("12:30", "12:30"),
        ("2024-01-01", "2024-01-01"),
        ("1_000", "1_000"),
        ("true", True),
        ("False", False),
        ("~", None),
        ("null", None),
        ("", None),
        ("10", 10),
        ("-3", -3),
        ("010", 10),
        ("0o17", 15),
        ("0x1F", 31),
        ("1.5", 1.5),
        (".5", 0.5),
        ("1e3", 1000.0),
        (".inf", float("inf")),
        ("'10'", "10"),
        ('"true"', "true"),
        ("10 ms", "10 ms"),
        ("|\n  a\n  b\n", "a\nb\n"),
    ],
)
def test_scalars(text: str, value: object) -> None:
    found = data(f"key: {text}\n")["key"]
    assert found == value and type(found) is type(value)


def test_keys_are_text_as_written() -> None:
    assert data("{no: 1, 2080: 2, 'a b': 3, 1.50: 4}") == {"no": 1, "2080": 2, "a b": 3, "1.50": 4}


def test_aliases_share_values_and_later_anchors_win() -> None:
    assert data("a: &x {p: 1}\nb: *x\nc: &x [2]\nd: *x\n") == {"a": {"p": 1}, "b": {"p": 1}, "c": [2], "d": [2]}


def test_places() -> None:
    node = read_yaml("threads:\n  nav:\n    period: [10 ms, 20 ms]\n", "f.yaml")
    path: list[str | int] = ["threads", "nav", "period", 1]
    assert node.locate(path) == (3, 21)
    assert node.locate(path[:3]) == (3, 13)
    assert node.locate(path[:3], at_key=True) == (3, 5)
    assert node.locate([]) == (1, 1)
    assert node.locate(["threads", "nav", "perod"], at_key=True) == (2, 3)
    assert node.locate(["threads", " label ", "nav", "period", 7]) == (3, 13)
    assert node.known(["threads", " label ", "nav", "period", 7]) == ("threads", "nav", "period")


def test_all_duplicates_are_found_at_once() -> None:
    text = "a: 1\nb: {c: 1, c: 2}\na: 2\n<<: 3\n'': 4\n"
    assert error(text).splitlines() == [
        'f.yaml:2:11: b.c: the key "c" is there twice, first in line 2',
        'f.yaml:3:1: a: the key "a" is there twice, first in line 1',
        "f.yaml:4:1: merge keys (<<) are not supported (name a type instead, or repeat the fields)",
        "f.yaml:5:1: a key is missing",
    ]


def test_quoted_merge_key_is_a_name() -> None:
    assert data("'<<': 1") == {"<<": 1}


def test_numbers_without_end_are_refused() -> None:
    assert error("a: " + "9" * 10**5) == "f.yaml:1:4: number too long: at most 40 digits"


def test_the_pure_python_parser_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "a: &x [1, 'b', {c: ~}]\nd: *x\n"
    expected = read_yaml(text, "f.yaml")
    monkeypatch.setattr(reader, "_LOADER", yaml.SafeLoader)
    assert read_yaml(text, "f.yaml") == expected


def is_a_number_in_yaml_1_2(text: str) -> bool:
    """PyYAML writes YAML 1.1, where 0E0 and 0o7 are text and need no quotes."""
    return bool(reader._FLOAT.fullmatch(text) or reader._INTEGER.fullmatch(text))


texts = st.text(st.characters(codec="ascii"), max_size=10).filter(lambda text: not is_a_number_in_yaml_1_2(text))
values = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | texts,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text("abc xyz", min_size=1, max_size=5), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(st.dictionaries(st.text("abcdef", min_size=1), values, min_size=1))
def test_what_pyyaml_writes_reads_back(value: dict[str, Any]) -> None:
    assert data(yaml.safe_dump(value)) == value


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        read_yaml(text, "f.yaml")
    except ProblemError as problem:
        assert problem.diagnostics
