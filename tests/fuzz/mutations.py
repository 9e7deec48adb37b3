"""Texts with something wrong: bytes, tokens, lines, trees, and what is too deep, too long or too large."""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import Any

import yaml

MOST_PLACES = 20_000
"""Aliases make trees that have no end."""
MOST_CHARACTERS = 1_000_000
SCALARS: tuple[Any, ...] = (
    *(None, True, False, "", " ", "~", "null", [], {}, [[]], [None], {"": None}, {"a": {"b": []}}),
    *(0, 1, -1, 2**31, 2**53, 2**63, -(2**63), 2**64, 10**39, -(10**39), 0.1, -0.0, 1e-300, 1e308),
    *(float("inf"), float("-inf"), float("nan")),
    *("0 ms", "1 ns", "-1 ms", "10", "10ms", "10 ms", "1e300 s", "1e-9 ns", "1 ps", "1/3 ms", "1/0 ms", "0x10 ms"),
    *("9999999999 s", "99999999999999999999 s", "1 ns .. 9999999 s", "5 ms .. 1 ms", "1 ms ..", ".. 1 ms", "1 ms .. x"),
    *(
        "1 ms .. 2 ms .. 3 ms",
        "10 MS",
        "10 furlong",
        "\u0661\u0660 ms",
        "1_0 ms",
        "1,5 ms",
        "1.5.1 ms",
        "∞ ms",
        "1 µs",
        "1 μs",
    ),
    *(
        "0 B",
        "1 B",
        "1e30 B",
        "0.5 B",
        "1 bit",
        "1 kbit/s",
        "0 bit/s",
        "1e-30 bit/s",
        "1 EUR",
        "1 USD",
        "-5 EUR",
        "1 W",
    ),
    *(
        "1 kB",
        "1.5 kg",
        "90 g",
        "1 TOPS",
        "1e-30 kg",
        "1/3 kg",
        "1 µW",
        "2 TB/s",
        "1e30 TiB",
        "0 g",
        "-1 g",
        "200000 ppm",
    ),
    *(
        "from bandwidth",
        "any",
        "first_fit",
        "stated",
        "all",
        "response_time",
        {"factor": "0 .. 0"},
        {"factor": "1 .. 1e30"},
    ),
    *(
        {"samples": ["1", "1 ms"]},
        {"distribution": "normal", "mean": "1 ms", "deviation": "1e9 s"},
        {"samples": "pump.yaml"},
    ),
    *("50 %", "101 %", "1e9 %", "0 %", "1e-30 %", "70", "1 GB/s", "1 m/s", "1 h"),
    *("periodic", "aperiodic", "sporadic", "hybrid", "timed", "none", "yes", "on", "12:30", "0o17", "1e3", ".5", "=1"),
    *(
        "\x00",
        "a\x00b",
        "\x1b[31mred\x1b[0m",
        "‮abc",
        "💥",
        "é",
        "e\u0301",
        "￿",
        "\ud800",
        "\n",
        "a\nb",
        "\t",
        "x" * 500,
    ),
    *(
        "[red]x[/red]",
        "[/]",
        "{}",
        "%s%n",
        "{0}",
        "'",
        '"',
        "`",
        "\\",
        "<script>",
        "../../etc/passwd",
        "/dev/null",
        ".",
    ),
)
TOKENS = (
    *("- ", ": ", ":", "? ", "[", "]", "{", "}", ",", "#", "&a ", "*a", "*b", "!!int ", "!x ", "|", ">", "%", "@", "`"),
    *("<<: ", "---", "...", "\t", "\n", "\r", "\r\n", "\x00", "﻿", "\u2028", "\x85", '"', "'", "\\", "..", "//"),
    *("0", "1", "-", "+", ".", "e9", "1e999", "99999999999999999999", "ms", "ns", "us", "s", "%", "kB", "bit/s", "EUR"),
    *("<=", ">=", "==", "<", ">", "!=", "=", "+=", "(", ")", "and", "or", "not", "of", "is", "in", "if", "implies"),
    *(
        "require",
        "forbid",
        "minimise",
        "maximise",
        "max(",
        "min(",
        "changes",
        "cost_of_change",
        "a multiple of",
        "jitter",
        "latency",
        "utilisation",
        "load",
        "price",
    ),
    *(
        "response time",
        "response_time",
        "deadlines",
        "requirements",
        "rules",
        "objectives",
        "baseline",
        "include",
        "dse",
    ),
    *(
        "profile",
        "osate-2.2",
        "processing",
        "queue_size",
        "uncertainty",
        "optional",
        "none",
        "null",
        "true",
        "NaN",
        "\\u0000",
    ),
    *(
        "max(",
        "min(",
        "busy",
        "response time of",
        "core",
        "is in",
        "*",
        "/",
        " .. ",
        "1/3",
        "kg",
        "TOPS",
        "*1e30",
        "all of",
    ),
    *(
        "executor",
        "reservation",
        "segments",
        "budget",
        "fifo",
        "callback_group",
        "wait_set",
        "polling",
        "serves",
        "non_preemptive",
    ),
)
_PARTS = re.compile(r"\w+|\s+|[^\w\s]+")
Mutation = Callable[[str, random.Random, Sequence[str]], str]


def mutated(text: str, rng: random.Random, others: Sequence[str]) -> bytes:
    """The text with one to six mutations, sometimes many; `others` are texts from which parts may come."""
    plausible = rng.random() < 0.4
    for _ in range(rng.choice((1, 1, 2, 2, 5, 12) if plausible else (1, 1, 1, 2, 2, 3, 6, 25))):
        kind = changed_sense if plausible else rng.choices(_KINDS, _WEIGHTS)[0]
        text = kind(text, rng, others)
    if plausible:
        return text.encode("utf-8", "surrogatepass")
    data = text[:MOST_CHARACTERS].encode("utf-8", "surrogatepass")
    return changed_bytes(data, rng) if rng.random() < 0.15 else data


def changed_bytes(data: bytes, rng: random.Random) -> bytes:
    """A few bytes flipped, inserted or cut out, or the end cut off."""
    found = bytearray(data or b"\n")
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        at = rng.randrange(len(found) + 1)
        kind = rng.randrange(4)
        if kind == 0 and at < len(found):
            found[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            found[at:at] = rng.choice((b"\x00", b"\xff\xfe", b"\xc3", b"\xed\xa0\x80", b"\xef\xbb\xbf", b"\x7f", b"\r"))
        elif kind == 2:
            del found[at : at + rng.choice((1, 1, 10, 100))]
        else:
            found[at:at] = found[at : at + rng.choice((1, 10, 200))]
    return bytes(found[: rng.randrange(len(found) + 1)]) if rng.random() < 0.1 else bytes(found)


def changed_tokens(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """A token replaced, repeated, inserted or left out, or two swapped."""
    parts = _PARTS.findall(text) or [""]
    at, to = rng.randrange(len(parts)), rng.randrange(len(parts))
    kind = rng.randrange(6)
    if kind == 0:
        parts[at] = rng.choice(TOKENS)
    elif kind == 1:
        parts[at] = rng.choice(_PARTS.findall(rng.choice(others)) or [""])
    elif kind == 2:
        parts[at], parts[to] = parts[to], parts[at]
    elif kind == 3:
        parts[at] *= rng.choice((2, 3, 1000))
    elif kind == 4:
        parts.insert(at, rng.choice(TOKENS))
    else:
        del parts[at]
    return "".join(parts)


def changed_number(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """A number made another one, or given another unit."""
    found = list(re.finditer(r"-?\d+(?:\.\d+)?( ?[A-Za-zµ%]+(?:/s)?)?", text))
    if not found:
        return changed_tokens(text, rng, others)
    place = rng.choice(found)
    number = place.group().split()[0]
    new = rng.choice(
        (str(rng.randrange(1000)), "0", f"-{number}", f"{number}0", f"{number}000000", f"{number}.5", "1e18", "7" * 60)
    )
    new += rng.choice((place.group(1) or "", " ms", " ns", " %", "", " B", "s"))
    return text[: place.start()] + new + text[place.end() :]


def changed_sense(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """What may still be read: another number with its unit, a list of numbers, another name, an operator."""
    kind = rng.randrange(5)
    if kind == 4:
        return changed_timeliness(text, rng)
    if kind < 2:
        found = list(re.finditer(r"(?<![\w.])(\d+(?:\.\d+)?)( ?[A-Za-zµ%]+(?:/s)?)?(?![\w.])", text))
        number, unit = (rng.choice(found).groups() if found else ("1", " ms"))[:2]
        new = rng.choice(("0", "1", "2", "3", "7", f"{number}00", f"{number}.5", f"{number}0000000", "0.000001"))
        if kind:
            new, unit = f"[{new}{unit or ''}, {number}{unit or ''}, {rng.randrange(1, 99)}{unit or ''}]", ""
        old = number + (unit or "")
    elif kind == 2:
        names = re.findall(r"[A-Za-z_]\w*", text) or ["x"]
        old, new, unit = rng.choice(names), rng.choice(names), ""
    else:
        old, new = rng.sample(
            ("<=", ">=", "<", ">", "==", " and ", " or ", "require", "forbid", "minimise", "maximise", "max(", "min("),
            2,
        )
        unit = ""
    places = [place.start() for place in re.finditer(re.escape(old), text)]
    if not places:
        return changed_number(text, rng, others)
    at = rng.choice(places)
    return text[:at] + new + (unit or "") + text[at + len(old) :]


def changed_timeliness(text: str, rng: random.Random) -> str:
    """A deadline, a priority, a core or a section for whatever executes, or what the file says of all deadlines."""
    found = list(re.finditer(r"([ \t]*)compute_execution_time:", text))
    if not found or rng.random() < 0.3:
        said = rng.choice(("deadlines: all", "deadlines: none", "deadlines: stated", "processing: response_time"))
        key = said.split(":")[0]
        return re.sub(rf"(?m)^{key}:.*$", said, text) if f"\n{key}:" in text else f"{text.rstrip()}\n{said}\n"
    place = rng.choice(found)
    times = (f"{rng.randrange(1, 40)}{rng.choice(('', '.3', '00'))} {rng.choice(('ms', 'us'))}" for _ in range(2))
    one, two = times
    said = rng.choice(
        (
            f"deadline: {one}",
            f"deadline: [{one}, {two}]",
            f"priority: {rng.choice((0, 1, 3, '[1, 3]', 'any', 'deadline_monotonic'))}",
            "core: [1, 2]",
            f"non_preemptive: {one}",
        )
    )
    is_block = text[: place.start()].endswith("\n")
    begin = f"{place[1]}{said}\n" if is_block else f" {said},"
    return text[: place.start()] + begin + text[place.start() :]


def changed_lines(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """A line left out, repeated, moved, indented or taken from elsewhere."""
    lines = text.splitlines(keepends=True) or ["\n"]
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(6)
    if kind == 0:
        del lines[at : at + rng.choice((1, 1, 5))]
    elif kind == 1:
        lines.insert(to, lines[at])
    elif kind == 2:
        lines[at], lines[to] = lines[to], lines[at]
    elif kind == 3:
        lines[at] = " " * rng.randrange(9) + lines[at].lstrip()
    elif kind == 4:
        lines.insert(at, rng.choice(rng.choice(others).splitlines(keepends=True) or ["\n"]))
    else:
        lines[at] = lines[at].rstrip("\n") + rng.choice(TOKENS) + "\n"
    return "".join(lines)


def changed_tree(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """A value of the document made something else, written anew as YAML or JSON."""
    tree = parsed(text)
    places = list(islice(_places(tree), MOST_PLACES))
    if not 0 < len(places) < MOST_PLACES:
        return changed_tokens(text, rng, others)
    for _ in range(rng.choice((1, 1, 2, 4))):
        holder, key = rng.choice(places)
        if key in holder if isinstance(holder, dict) else key < len(holder):
            _change(holder, key, rng, others)
    return written(tree, rng, is_json=text.lstrip().startswith("{"))


def spliced(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """Sections of another document beside or in place of those of this one."""
    tree, other = parsed(text), parsed(rng.choice(others))
    if not isinstance(tree, dict) or not isinstance(other, dict) or not other:
        return changed_lines(text, rng, others)
    for key in rng.sample(sorted(other, key=str), min(len(other), rng.choice((1, 1, 2, 5)))):
        mine, theirs = tree.get(key), copy.deepcopy(other[key])
        if isinstance(mine, dict) and isinstance(theirs, dict) and rng.random() < 0.6:
            theirs = {**mine, **theirs}
        tree[key] = theirs
    return written(tree, rng, is_json=text.lstrip().startswith("{"))


def monstrous(text: str, rng: random.Random, others: Sequence[str]) -> str:
    """Too deep, too long, too many, or growing without end."""
    size = rng.choice((10, 100, 1000, 20_000))
    kind = rng.randrange(10)
    if kind < 3:
        opening, closing = rng.choice(
            (("[", "]"), ("{a: ", "}"), ('{"a": ', "}"), ("- ", ""), ("(", ")"), ("not ", ""))
        )
        inner = opening * size + rng.choice(("1", "", "10 ms")) + closing * rng.choice((size, size - 1))
        return _placed(text, inner, rng)
    if kind == 3:
        bomb = [f"a{n}: &a{n} [{', '.join(f'*a{n - 1}' for _ in range(9))}]" for n in range(1, 12)]
        return text + "\n" + "\n".join(["a0: &a0 [x]", *bomb]) + "\n"
    if kind == 4:
        return text + "".join(f"k{n}: {n} ms\n" for n in range(size))
    if kind == 5:
        return _placed(text, "[" + ", ".join(f"{n + 1} ms" for n in range(size)) + "]", rng)
    if kind == 6:
        return _placed(text, rng.choice(("x", "9", "é", " ", "\n", "a.", "'")) * size, rng)
    if kind == 7:
        return _placed(text, " and ".join(["jitter of f <= 10 ms"] * size), rng)
    if kind == 8:
        return text * min(size, 30)
    return rng.choice(others)[: rng.randrange(2000)] + text


_KINDS: tuple[Mutation, ...] = (changed_tree, changed_number, changed_tokens, changed_lines, spliced, monstrous)
_WEIGHTS = (8, 5, 6, 3, 2, 1)


def parsed(text: str) -> Any:
    """The document, where there is one that is not too deep for the parser."""
    try:
        return json.loads(text) if text.lstrip().startswith("{") else yaml.load(text, Loader=yaml.CBaseLoader)
    except (ValueError, yaml.YAMLError, RecursionError):
        return None


def written(tree: Any, rng: random.Random, *, is_json: bool) -> str:
    """The tree as text; a result stays JSON, a problem is mostly YAML, as is what JSON would expand without end."""
    is_endless = sum(1 for _ in islice(_places(tree), MOST_PLACES)) == MOST_PLACES
    try:
        if (is_json or rng.random() < 0.2) and not is_endless:
            return json.dumps(tree, ensure_ascii=rng.random() < 0.5, indent=rng.choice((None, 1)))
        style = rng.choice((None, True, False))
        return yaml.dump(tree, Dumper=yaml.CSafeDumper, allow_unicode=True, sort_keys=False, default_flow_style=style)
    except (ValueError, TypeError, yaml.YAMLError, RecursionError):
        return "" if is_endless else repr(tree)


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Every (holder, key) of the tree."""
    todo = [tree]
    while todo:
        holder = todo.pop()
        if isinstance(holder, dict):
            keys: list[Any] = list(holder)
        elif isinstance(holder, list):
            keys = list(range(len(holder)))
        else:
            continue
        for key in keys:
            yield holder, key
            todo.append(holder[key])


def _change(holder: Any, key: Any, rng: random.Random, others: Sequence[str]) -> None:
    value = holder[key]
    kind = rng.randrange(10)
    if kind < 3:
        holder[key] = copy.deepcopy(rng.choice(SCALARS))
    elif kind == 3:
        holder[key] = copy.deepcopy(_some_value(rng.choice(others), rng))
    elif kind == 4:
        del holder[key]
    elif kind == 5:
        holder[key] = [copy.deepcopy(value) for _ in range(rng.choice((1, 2, 3)))]
    elif kind == 6 and isinstance(holder, dict):
        holder[str(rng.choice((*holder, *SCALARS, *TOKENS)))] = holder.pop(key)
    elif kind == 7:
        siblings = list(holder.values()) if isinstance(holder, dict) else holder
        holder[key] = copy.deepcopy(rng.choice(siblings))
    elif kind == 8 and isinstance(value, list):
        rng.shuffle(value)
        value += copy.deepcopy(value[: rng.randrange(3)])
    elif isinstance(value, int) and not isinstance(value, bool):
        holder[key] = value + rng.choice((-1, 1, -value, 10**6, -(2**63), 2**70))
    elif isinstance(value, str):
        holder[key] = changed_number(value, rng, others) if rng.random() < 0.5 else changed_tokens(value, rng, others)
    else:
        holder[key] = {"a": copy.deepcopy(value)}


def _some_value(text: str, rng: random.Random) -> Any:
    places = list(islice(_places(parsed(text)), MOST_PLACES))
    if not 0 < len(places) < MOST_PLACES:
        return text[:100]
    holder, key = rng.choice(places)
    return holder[key]


def _placed(text: str, inner: str, rng: random.Random) -> str:
    """The inner text in place of a value, or at the end."""
    found = list(re.finditer(r"(?<=: )[^\n]+", text))
    if not found or rng.random() < 0.2:
        return f"{text}\nx: {inner}\n"
    place = rng.choice(found)
    return text[: place.start()] + inner + text[place.end() :]
