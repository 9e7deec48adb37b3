"""The store: what is kept is found again, by its content only; damage and foreign files are reported."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from dse.questions.sweep import store as module
from dse.questions.sweep.store import Store, run_key
from dse.questions.sweep.sweep import sweep
from dse.support.errors import UsageError
from tests.questions.studies import written


def price_path(file: Path) -> str:
    from dse.questions.problem import load
    from dse.questions.sweep.inputs_of_file import Inputs, merged_data

    return next(path for path in Inputs(merged_data(load(file))).groups if path.endswith(".price"))


def test_what_is_kept_is_not_solved_again(tmp_path: Path) -> None:
    file, store = written(tmp_path, "starter"), tmp_path / "s"
    vary = f"{price_path(file)}=10 EUR,20 EUR,30 EUR"
    first = sweep(file, vary, store=store)
    again = sweep(file, vary, store=store)
    assert (first.solved, first.found, again.solved, again.found) == (3, 0, 0, 3)
    assert first.to_json() == again.to_json()
    wider = sweep(file, f"{price_path(file)}=10 EUR..40 EUR step 10 EUR", store=store)
    assert (wider.solved, wider.found) == (1, 3)
    with Store(store) as opened:
        assert opened.solved() == opened.kept() == 4


def test_what_changes_the_answer_changes_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, store = written(tmp_path, "starter"), tmp_path / "s"
    vary = f"{price_path(file)}=10 EUR"
    sweep(file, vary, store=store)
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("20 ms", "19 ms", 1), encoding="utf-8")
    assert sweep(file, vary, store=store).solved == 1
    file.write_text(text + "\n# a remark changes nothing\n", encoding="utf-8")
    assert sweep(file, vary, store=store).found == 1

    assert sweep(file, vary, store=store, max_price="900 EUR").solved == 1
    module.semantics_version.cache_clear()
    monkeypatch.setattr(module, "SEMANTICS", 99)
    try:
        assert sweep(file, vary, store=store).solved == 1
    finally:
        module.semantics_version.cache_clear()


def test_included_catalogues_are_part_of_the_key(tmp_path: Path) -> None:
    file, store = written(tmp_path, "inmark_chapter3"), tmp_path / "s"
    vary = "bus_types.can_125k.price=20 EUR"
    sweep(file, vary, store=store)
    catalogue = tmp_path / "catalogues" / "buses.yaml"
    catalogue.write_text(catalogue.read_text(encoding="utf-8").replace("35 EUR", "36 EUR"), encoding="utf-8")
    assert sweep(file, vary, store=store).solved == 1


def kept(path: Path) -> None:
    with Store(path) as store:
        for number in range(50):
            store.keep(run_key(str(number)), "x" * 500)


def test_a_foreign_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("these are notes, not a database, and long enough to be looked at as one " * 20)
    other = tmp_path / "other.sqlite"
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE runs (key TEXT)")
    connection.close()
    for path in (text, other):
        before = path.read_bytes()
        with pytest.raises(UsageError, match="cannot be used as a store"):
            Store(path)
        assert path.read_bytes() == before


def test_another_form_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s"
    kept(path)
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(UsageError, match="another version of dse"):
        Store(path)


def test_a_store_without_its_table_says_which(tmp_path: Path) -> None:
    path = tmp_path / "s"
    kept(path)
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TABLE runs")
    connection.close()
    with pytest.raises(UsageError, match="it is damaged: it has no table runs"):
        Store(path)


@pytest.mark.parametrize("offset", [20, 4096, 4096 * 3 + 100, -3000])
def test_damage_is_reported(tmp_path: Path, offset: int) -> None:
    """Overwritten anywhere: the file is refused when it is opened or read, or what is read is what was kept."""
    path = tmp_path / "s"
    kept(path)
    data = bytearray(path.read_bytes())
    place = offset % len(data)
    data[place : place + 400] = b"\xff" * 400
    path.write_bytes(bytes(data))
    keys = [run_key(str(number)) for number in range(50)]
    try:
        with Store(path) as store:
            assert set(store.find(keys).values()) <= {"x" * 500}
    except UsageError as error:
        assert "cannot be used as a store" in str(error)


def test_an_entry_that_was_edited_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "s"
    kept(path)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE runs SET outcome = 'y' WHERE key = ?", (run_key("7"),))
    connection.close()
    with Store(path) as store, pytest.raises(UsageError, match="is damaged"):
        store.find([run_key("7")])


def test_a_setting_that_is_stated_though_it_is_the_default_asks_the_same(tmp_path: Path) -> None:
    file, store = written(tmp_path, "starter"), tmp_path / "s"
    vary = f"{price_path(file)}=10 EUR,20 EUR"
    assert sweep(file, vary, store=store).solved == 2
    assert sweep(file, vary, store=store, processing="execution_time", overload="forbidden").found == 2
    stated = tmp_path / "stated.yaml"
    stated.write_text(file.read_text(encoding="utf-8") + "\ndeadlines: stated\n", encoding="utf-8")
    assert sweep(stated, vary, store=store).found == 2
    assert sweep(file, vary, store=store, overload="allowed").found == 0


def test_studies_carry_their_problem(tmp_path: Path) -> None:
    file = written(tmp_path, "starter")
    data = sweep(file, f"{price_path(file)}=10 EUR", store=None).to_dict()
    assert data["files"][file.name] == file.read_text(encoding="utf-8")
