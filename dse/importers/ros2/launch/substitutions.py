"""Texts of launch files with their substitutions, ``$(var name)``, as far as they are static.

The substitutions are those of launch and launch_ros. Nothing is run, and nothing of this machine counts: environment
variables have the default that the file states.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dse.importers.allowance import CHARACTERS, MOST_TEXT, spend, spend_text

DEEPEST = 60
"""The greatest depth of substitutions and parentheses within each other."""
HIDDEN = {ord("("): "\ue000", ord(")"): "\ue001"}
"""The placeholders of parentheses of an expression within a substitution."""
SHOWN = {ord(hidden): chr(code) for code, hidden in HIDDEN.items()}
IN_PYTHON = "in Python is only known at the launch"
TRUE, FALSE = ("true", "1"), ("false", "0")


class NotStaticError(Exception):
    """The value of a text is only known when the system is launched; the message says why.

    The action that needs the text is left out with a remark.
    """


@dataclass
class Context:
    """The scope of substitutions: launch arguments by name, packages by name, the file that holds the text.

    An argument whose value is not static holds the reason; `asked` are the names of those that texts use.
    """

    file: Path
    arguments: dict[str, str | NotStaticError]
    package: Callable[[str], Path | None]
    environment: dict[str, str] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set)

    def argument(self, name: str) -> str:
        """The value of a launch argument.

        Raises
        ------
        NotStaticError
            when it has none that is known.
        """
        self.asked.add(name)
        value = self.arguments.get(name)
        if value is None:
            raise NotStaticError(f"the launch argument {name} is not given")
        if isinstance(value, NotStaticError):
            raise value
        return value


def resolve(text: str, context: Context) -> str:
    """A text with its substitutions done.

    Raises
    ------
    NotStaticError
        when one of them is not static.

    Examples
    --------
    >>> resolve("$(var a)/x", Context(Path("f"), {"a": "/cam"}, lambda name: None))
    '/cam/x'
    """
    done, position = "", 0
    while (begin := text.find("$(", position)) >= 0:
        end = _end(text, begin)
        done += text[position:begin] + _substituted(text[begin + 2 : end], context)
        position = end + 1
        if len(done) > MOST_TEXT:
            raise NotStaticError("the text is too long")
    return spend_text(done + text[position:])


def utf8(text: str) -> str:
    r"""A text without halves of characters, which Python has and files have not.

    >>> utf8("a\ud800")
    'a?'
    """
    return text.encode("utf-8", "replace").decode()


def _end(text: str, begin: int) -> int:
    """Where the substitution that begins there ends."""
    depth = 0
    for position in range(begin + 1, len(text)):
        depth += {"(": 1, ")": -1}.get(text[position], 0)
        if depth == 0:
            spend((position - begin) // CHARACTERS)
            return position
        if depth > DEEPEST:
            raise NotStaticError(f"more than {DEEPEST} parentheses are within each other")
    raise NotStaticError(f"{text[begin : begin + 60]!r} does not end")


def _words(text: str) -> list[str]:
    """The arguments of a substitution: at blanks outside of parentheses and quotes."""
    words, word, depth, quote = [], "", 0, ""
    for char in text:
        if not quote and depth == 0 and char in "\"'":
            quote = char
        elif quote and char == quote:
            quote = ""
        elif char.isspace() and depth == 0 and not quote:
            words.append(word)
            word = ""
        else:
            depth += {"(": 1, ")": -1}.get(char, 0)
            word += char
    return [item for item in [*words, word] if item]


def _substituted(inside: str, context: Context) -> str:
    name, _, rest = inside.strip().partition(" ")
    name = name.replace("_", "-")
    if name in ("eval", "python-expression"):
        return _evaluated(resolve(_bare(rest.strip()), context))
    if name == "python":
        raise NotStaticError(f"what {rest[:100].translate(SHOWN)} gives {IN_PYTHON}")
    words = [resolve(word, context) for word in _words(rest)]
    act = SUBSTITUTIONS.get(name)
    if act is None:
        raise NotStaticError(f"$({inside.strip()[:80]}) is only known at the launch")
    return act(words, context)


def _bare(text: str) -> str:
    """A text without the quotes around all of it.

    >>> _bare("'a == b'"), _bare("'a' == 'b'")
    ('a == b', "'a' == 'b'")
    """
    quote = text[:1]
    is_quoted = len(text) > 1 and quote in ("'", '"') and text[-1] == quote and quote not in text[1:-1]
    return text[1:-1] if is_quoted else text


def _var(words: list[str], context: Context) -> str:
    if len(words) > 1 and words[0] not in context.arguments:
        return words[1]
    return context.argument(words[0] if words else "")


def _env(words: list[str], context: Context) -> str:
    name, *default = words or [""]
    if name in context.environment:
        return context.environment[name]
    if not default:
        raise NotStaticError(f"the environment variable {name} is only known at the launch")
    return default[0]


def _share(words: list[str], context: Context) -> str:
    name = words[0] if words else ""
    folder = context.package(name)
    if folder is None:
        raise NotStaticError(f"the package {name} is not found")
    return str(folder)


def _is_true(text: str) -> bool:
    if text.strip().lower() in TRUE:
        return True
    if text.strip().lower() in FALSE:
        return False
    raise NotStaticError(f"expected true or false, got {text[:60]!r}")


def _bool(value: object) -> str:
    return "true" if value else "false"


def _chosen(words: list[str], context: Context) -> str:
    condition, yes, no = (*words, "", "", "")[:3]
    return yes if _is_true(condition) else no


SUBSTITUTIONS: Mapping[str, Callable[[list[str], Context], str]] = {
    "var": _var,
    "arg": _var,
    "env": _env,
    "optenv": lambda words, context: _env([*words, ""], context),
    "find-pkg-share": _share,
    "find": _share,
    "dirname": lambda words, context: str(context.file.parent),
    "filename": lambda words, context: str(context.file),
    "anon": lambda words, context: words[0] if words else "",
    "equals": lambda words, context: _bool(len(set(words[:2])) == 1),
    "not-equals": lambda words, context: _bool(len(set(words[:2])) > 1),
    "not": lambda words, context: _bool(not _is_true(words[0] if words else "")),
    "and": lambda words, context: _bool(all(map(_is_true, words))),
    "or": lambda words, context: _bool(any(map(_is_true, words))),
    "if": _chosen,
}


def is_so(text: str, context: Context) -> bool:
    """Whether a condition holds.

    Raises
    ------
    NotStaticError
        when that is only known at the launch.
    """
    return _is_true(resolve(text, context))


def _evaluated(text: str) -> str:
    """The value of a Python expression of constants: comparisons, logic and sums; nothing is executed."""
    inner = text.strip()
    words = f"$(eval {inner[:80]}) is only known at the launch"
    try:
        return spend_text(utf8(str(_value(ast.parse(inner, mode="eval").body))))
    except (SyntaxError, ValueError, TypeError, ArithmeticError, MemoryError, RecursionError):
        raise NotStaticError(words) from None


_COMPARE: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_SUM: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: _number(a) * _number(b),
    ast.Div: lambda a, b: a / b,
}
NAMES = {"true": True, "false": False, "True": True, "False": False, "None": None}


def _number(value: Any) -> Any:
    if isinstance(value, int | float):
        return value
    raise ValueError(value)


def _value(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=value) if isinstance(value, str | int | float | bool | None):
            return value
        case ast.Name(id=name) if name in NAMES:
            return NAMES[name]
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return [_value(item) for item in items]
        case ast.BoolOp(op=op, values=items):
            values = [_value(item) for item in items]
            return all(values) if isinstance(op, ast.And) else any(values)
        case ast.UnaryOp(op=ast.Not(), operand=item):
            return not _value(item)
        case ast.UnaryOp(op=ast.USub(), operand=item):
            return -_number(_value(item))
        case ast.IfExp(test=test, body=body, orelse=other):
            return _value(body) if _value(test) else _value(other)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _SUM:
            return _SUM[type(op)](_value(left), _value(right))
        case ast.Compare(left=left, ops=ops, comparators=rights) if all(type(op) in _COMPARE for op in ops):
            values = [_value(item) for item in (left, *rights)]
            return all(_COMPARE[type(op)](a, b) for op, a, b in zip(ops, values, values[1:], strict=False))
    raise ValueError(ast.dump(node)[:60])
