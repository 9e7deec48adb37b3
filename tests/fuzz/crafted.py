"""Results, studies and stores that somebody has tampered with: a node of a JSON tree or a cell of a store is odd."""

from __future__ import annotations

import copy
import hashlib
import json
import random
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 7, 2**31, 2**63, -(2**63), 10**40, 0.5, -0.0, 1e308, float("nan"), float("inf"),
    "", " ", "x", "0", "-1", "1/0", "0/0", "1/3", "1e999999999", "1e-999999999", "nan", "inf", "\ud800", "\udfff x",
    "\0",
    "\u202e", "a" * 5000, "../../etc/passwd", "/dev/zero", "10 ms", "price", "<script>", "[bold]x[/bold]", "{}", "%s",
    [], {}, [None], [[]], [{}], {"": None}, {"\ud800": 1}, {"x": {"y": [1, 2]}}, [1, "2", None, {}],
)  # fmt: skip


@dataclass(frozen=True)
class Crafted:
    """A document with what was done to it."""

    what: str
    text: str


def crafted(data: Any, rng: random.Random) -> Crafted:
    """A document with one to three nodes changed; sometimes its text instead."""
    tree = copy.deepcopy(data)
    what = []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        path, change = rng.choice(list(_paths(tree))), rng.choice(CHANGES)
        done = change(tree, path, rng)
        if done:
            what.append(f"{'.'.join(map(str, path))}: {done}")
    text = json.dumps(tree, ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.03:
        cut = rng.randrange(len(text))
        text, done = rng.choice(
            ((text[:cut], "cut"), (text + "]", "longer"), ("[" * 100_000, "deep"), ("9" * 6000, "long"))
        )
        what.append(done)
    return Crafted("; ".join(what), text)


def _paths(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place but the root; of many alike the first ones."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree[:6]) if isinstance(tree, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from _paths(value, (*path, key))


def _at(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def _odd(tree: Any, path: tuple[Any, ...], rng: random.Random) -> str:
    value = rng.choice(ODD)
    _at(tree, path[:-1])[path[-1]] = value
    return f"= {str(value)[:30]!r}"


def _gone(tree: Any, path: tuple[Any, ...], rng: random.Random) -> str:
    del _at(tree, path[:-1])[path[-1]]
    return "gone"


def _twice(tree: Any, path: tuple[Any, ...], rng: random.Random) -> str:
    """An entry of a list again; a name of a mapping under another one."""
    holder = _at(tree, path[:-1])
    if isinstance(holder, list):
        holder.insert(rng.randrange(len(holder) + 1), copy.deepcopy(holder[path[-1]]))
        return "twice"
    holder[f"{path[-1]}{rng.choice(('', ' ', 'x'))}"] = copy.deepcopy(holder[path[-1]])
    return "under another name"


def _nudged(tree: Any, path: tuple[Any, ...], rng: random.Random) -> str:
    """A number or text that is a little different."""
    holder = _at(tree, path[:-1])
    value = holder[path[-1]]
    if isinstance(value, bool) or value is None:
        holder[path[-1]] = not value
    elif isinstance(value, int | float):
        holder[path[-1]] = rng.choice((value + 1, value - 1, -value, value * 10**9, value / 3, str(value)))
    elif isinstance(value, str):
        at = rng.randrange(len(value) + 1)
        holder[path[-1]] = value[:at] + rng.choice(("", "x", " ", "\ud800", "<", "0", "-", "/", "=")) + value[at + 1 :]
    elif isinstance(value, list):
        rng.shuffle(value)
    else:
        items = list(value.items())
        rng.shuffle(items)
        holder[path[-1]] = dict(items)
    return "nudged"


def _moved(tree: Any, path: tuple[Any, ...], rng: random.Random) -> str:
    """The value of another place."""
    other = rng.choice(list(_paths(tree)))
    if path[: len(other)] == other or other[: len(path)] == path:
        return ""
    _at(tree, path[:-1])[path[-1]] = copy.deepcopy(_at(tree, other))
    return f"that of {'.'.join(map(str, other))}"


CHANGES = (_odd, _odd, _odd, _gone, _twice, _nudged, _nudged, _moved)


def craft_store(path: Path, rng: random.Random) -> str:
    """Change a store in place; the digests of its entries are made to fit, as a forger would."""
    connection = sqlite3.connect(path)
    rows = connection.execute("SELECT key, semantics, outcome, digest FROM runs").fetchall()
    kind = rng.choice(("outcome", "outcome", "outcome", "outcome", "key", "cell", "table", "pragma", "bytes"))
    what = kind
    if kind == "outcome":
        key, _, outcome, _ = rng.choice(rows)
        made = crafted(json.loads(outcome), rng)
        text = made.text.encode("utf-8", "replace").decode()
        digest = hashlib.sha256(f"{key}\n{text}".encode()).hexdigest()
        connection.execute("UPDATE runs SET outcome = ?, digest = ? WHERE key = ?", (text, digest, key))
        what = f"outcome {made.what}"
    elif kind == "key":
        connection.execute("UPDATE runs SET key = ? WHERE key = ?", ("0" * 64, rng.choice(rows)[0]))
    elif kind == "cell":
        column = rng.choice(("semantics", "outcome", "digest"))
        value = rng.choice((b"\xff\xfe", 3, 1.5, "", "{}", b"", "\0"))
        connection.execute(f"UPDATE runs SET {column} = ?", (value,))
        what = f"{column} = {value!r}"
    elif kind == "table":
        what = rng.choice(
            (
                "DROP TABLE solves", "DROP TABLE runs", "ALTER TABLE runs RENAME COLUMN digest TO d",
                "ALTER TABLE runs ADD COLUMN more TEXT", "DELETE FROM runs", "CREATE VIEW v AS SELECT 1",
                "DROP TABLE solves; CREATE VIEW solves AS SELECT 1 AS number, '' AS key",
            )
        )  # fmt: skip
        connection.executescript(what)
    elif kind == "pragma":
        what = f"PRAGMA {rng.choice(('application_id', 'user_version'))} = {rng.choice((0, 1, 2, 77))}"
        connection.execute(what)
    connection.commit()
    connection.close()
    if kind == "bytes":
        data = bytearray(path.read_bytes())
        for _ in range(20):
            data[rng.randrange(len(data))] = rng.randrange(256)
        path.write_bytes(data)
    return what
