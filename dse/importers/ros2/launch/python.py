"""Launch files in Python, read and never run: what their syntax tree says of the actions that they describe.

A small part of Python is followed: assignments, lists, dictionaries, functions of the file, branches and loops whose
conditions are known. The actions and substitutions are those of launch and launch_ros; everything else is unknown, and
what depends on it is told as not static.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.importers.allowance import at, spend, spend_text
from dse.importers.ros2.launch.actions import ACTIONS, Unknown, as_text
from dse.importers.ros2.launch.entities import Entity, problem, text_of
from dse.importers.ros2.launch.operations import METHODS, counted, entry_of, equal, is_open, quoted, sum_of
from dse.importers.ros2.launch.substitutions import Context, NotStaticError, resolve, utf8

START = "generate_launch_description"
DEEPEST = 20
"""So deep functions of the file may call each other."""
NAMES = 8
"""So many names that are copied count as one piece of the allowance."""


def read_python(path: Path) -> Entity:
    """The actions of a Python launch file.

    Raises
    ------
    ProblemError
        when it is none.
    """
    text = text_of(path)
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        line, column = error.lineno or 1, error.offset or 0
        raise problem(path, f"not Python: {error.msg}", line, column, "is it cut off?") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise problem(path, f"not Python: {' '.join(str(error).split())[:200]}") from None
    reader = _Reader(path, tree)
    with at(path, 1):
        found = reader.start()
    if not isinstance(found, Entity):
        hint = "it returns LaunchDescription([...])"
        raise problem(path, f"{START} returns no launch description that can be read", reader.line, hint=hint)
    return found


class _Returned(Exception):
    def __init__(self, value: Any) -> None:
        self.value = value


class _Reader:
    """Follows one file."""

    def __init__(self, path: Path, tree: ast.Module) -> None:
        self.path, self.tree = path, tree
        self.aliases: dict[str, str] = {}
        self.functions: dict[str, ast.FunctionDef] = {}
        self.context: Context | None = None
        self.depth = 0
        self.open: list[Entity] = []
        self.said: dict[ast.expr, str] = {}
        self.line = 1

    def start(self) -> Any:
        """What the function returns that launch calls."""
        names: dict[str, Any] = {}
        self._run(self.tree.body, names)
        self.top = names
        function = self.functions.get(START)
        if function is None:
            raise problem(self.path, f"it has no function {START}", hint="launch files in Python have one")
        self.line = function.lineno
        found = self.call(function, [], {})
        if isinstance(found, Entity):
            found.children += self._left_open()
        return found

    def _left_open(self) -> list[Entity]:
        """Branches and loops that were not followed, as actions that are told."""
        found, self.open = self.open, []
        return found

    def call(self, function: ast.FunctionDef, given: Sequence[Any], named: Mapping[str, Any]) -> Any:
        """What a function of the file returns."""
        if self.depth > DEEPEST:
            return Unknown(f"{function.name}")
        arguments = function.args
        names: dict[str, Any] = _copied(self.top)
        places = [item.arg for item in (*arguments.posonlyargs, *arguments.args)]
        for item, default in zip(reversed(places), reversed(arguments.defaults), strict=False):
            names[item] = self.value(default, names)
        for keyword, preset in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=False):
            names[keyword.arg] = self.value(preset, names) if preset is not None else Unknown(keyword.arg)
        names |= dict(zip(places, given, strict=False))
        names |= {key: value for key, value in named.items() if key}
        for item in places:
            names.setdefault(item, Unknown(item))
        self.depth += 1
        try:
            self._run(function.body, names)
        except _Returned as returned:
            return returned.value
        finally:
            self.depth -= 1
        return None

    # --- statements

    def _run(self, body: Sequence[ast.stmt], names: dict[str, Any]) -> None:
        for item in body:
            with at(self.path, item.lineno):
                spend()
                self._statement(item, names)

    def _statement(self, item: ast.stmt, names: dict[str, Any]) -> None:
        match item:
            case ast.FunctionDef():
                self.functions[item.name] = item
            case ast.ImportFrom(names=aliases):
                self.aliases |= {one.asname: one.name for one in aliases if one.asname}
            case ast.Assign(targets=targets, value=value):
                found = self.value(value, names)
                for target in targets:
                    self._assign(target, found, names)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, self.value(value, names), names)
            case ast.AugAssign(target=ast.Name(id=name), op=ast.Add(), value=value):
                names[name] = sum_of(names.get(name, Unknown(name)), self.value(value, names))
            case ast.Expr(value=value):
                self.value(value, names)
            case ast.Return(value=value):
                raise _Returned(self.value(value, names) if value is not None else None)
            case ast.With(body=body) | ast.Try(body=body):
                self._run(body, names)
            case ast.If() | ast.For():
                self._branch(item, names)

    def _branch(self, item: ast.If | ast.For, names: dict[str, Any]) -> None:
        if isinstance(item, ast.If):
            test = self.value(item.test, names)
            if not is_open(test):
                self._run(item.body if test else item.orelse, names)
                return
            self._skip(item, item.test, names)
            return
        values = self.value(item.iter, names)
        if isinstance(values, list | tuple):
            for value in values:
                spend()
                self._assign(item.target, value, names)
                self._run(item.body, names)
            return
        self._skip(item, item.iter, names)

    def _skip(self, item: ast.If | ast.For, why: ast.expr, names: dict[str, Any]) -> None:
        """Do not follow a branch or loop: what it changes is unknown."""
        for name in _assigned([*item.body, *item.orelse]):
            names[name] = Unknown(name)
        self.open.append(Entity("unknown", item.lineno, {"name": str(Unknown(self._words(why)))}))

    def _assign(self, target: ast.expr, value: Any, names: dict[str, Any]) -> None:
        match target:
            case ast.Name(id=name):
                names[name] = value
            case ast.Tuple(elts=parts) | ast.List(elts=parts):
                values = value if isinstance(value, list | tuple) and len(value) == len(parts) else None
                for number, part in enumerate(parts):
                    self._assign(part, Unknown(self._words(part)) if values is None else values[number], names)
            case ast.Subscript(value=ast.Name(id=name), slice=key):
                owner, index = names.get(name), self.value(key, names)
                if isinstance(owner, dict) and isinstance(index, str):
                    owner[index] = value

    # --- values

    def value(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        """The value of an expression, as far as it is known."""
        spend()
        found = self._value(node, names)
        return Unknown(self._words(node)) if found is NotImplemented else found

    def _value(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        match node:
            case ast.Constant(value=str() as text):
                return spend_text(utf8(text))
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name):
                return names.get(name, NotImplemented)
            case ast.List(elts=items) | ast.Tuple(elts=items):
                return self._items(items, names)
            case ast.Dict(keys=keys, values=values):
                return self._dictionary(keys, values, names)
            case ast.JoinedStr(values=values):
                return as_text([self._part(item, names) for item in values])
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return sum_of(self.value(left, names), self.value(right, names))
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return as_text([self.value(left, names), "/", self.value(right, names)])
            case ast.Call():
                return self._call(node, names)
        return self._logic(node, names)

    def _logic(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        match node:
            case ast.Subscript(value=ast.Attribute(attr="environ"), slice=key):
                return f"$(env {as_text(self.value(key, names))})"
            case ast.Subscript(value=owner, slice=key):
                return entry_of(self.value(owner, names), self.value(key, names))
            case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq() as op], comparators=[right]):
                return equal(self.value(left, names), self.value(right, names), isinstance(op, ast.Eq))
            case ast.UnaryOp(op=ast.Not(), operand=item):
                value = self.value(item, names)
                return NotImplemented if is_open(value) else not value
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
                return -number
            case ast.BoolOp(op=op, values=items):
                values = [self.value(item, names) for item in items]
                if any(map(is_open, values)):
                    return NotImplemented
                return all(values) if isinstance(op, ast.And) else any(values)
            case ast.IfExp(test=test, body=body, orelse=other):
                value = self.value(test, names)
                return NotImplemented if is_open(value) else self.value(body if value else other, names)
            case ast.ListComp(elt=element, generators=[ast.comprehension(target=target, iter=items, ifs=[])]):
                return self._comprehension(element, target, self.value(items, names), names)
        return NotImplemented

    def _comprehension(self, element: ast.expr, target: ast.expr, items: Any, names: Mapping[str, Any]) -> Any:
        if not isinstance(items, list | tuple):
            return NotImplemented
        found = []
        for item in items:
            inner = _copied(names)
            self._assign(target, item, inner)
            found.append(self.value(element, inner))
        return found

    def _items(self, items: Sequence[ast.expr], names: Mapping[str, Any]) -> list[Any]:
        found: list[Any] = []
        for item in items:
            if isinstance(item, ast.Starred):
                more = self.value(item.value, names)
                found += counted(more) if isinstance(more, list | tuple) else [more]
            else:
                found.append(self.value(item, names))
        return found

    def _dictionary(
        self, keys: Sequence[ast.expr | None], values: Sequence[ast.expr], names: Mapping[str, Any]
    ) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, item in zip(keys, values, strict=True):
            value = self.value(item, names)
            if key is not None:
                found[as_text(self.value(key, names))] = value
            elif isinstance(value, dict):
                found |= counted(value)
        return found

    def _words(self, node: ast.expr) -> str:
        """The beginning of an expression."""
        if node not in self.said:
            text = ast.unparse(node)
            spend(len(text) // NAMES)
            self.said[node] = text[:80]
        return self.said[node]

    def _part(self, item: ast.expr, names: Mapping[str, Any]) -> Any:
        return self.value(item.value if isinstance(item, ast.FormattedValue) else item, names)

    # --- calls

    def _call(self, node: ast.Call, names: Mapping[str, Any]) -> Any:
        given = self._items(node.args, names)
        named: dict[str, Any] = {}
        for item in node.keywords:
            value = self.value(item.value, names)
            if item.arg is not None:
                named[item.arg] = value
            elif isinstance(value, dict):
                named |= counted(value)
        if isinstance(node.func, ast.Name):
            return self._named_call(self.aliases.get(node.func.id, node.func.id), node, given, named)
        if isinstance(node.func, ast.Attribute):
            return self._method(node.func, node, given, named, names)
        return NotImplemented

    def _named_call(self, name: str, node: ast.Call, given: list[Any], named: Mapping[str, Any]) -> Any:
        if name in self.functions:
            return self.call(self.functions[name], given, named)
        if name == "OpaqueFunction":
            return self._opaque(node, given, named)
        if name in ("str", "Path"):
            return as_text(given[0]) if given else ""
        if name in ("list", "tuple", "dict"):
            return given[0] if given else dict(named) if name == "dict" else []
        act = ACTIONS.get(name)
        return act(given, named, node.lineno) if act is not None else NotImplemented

    def _method(
        self, func: ast.Attribute, node: ast.Call, given: list[Any], named: Mapping[str, Any], names: Mapping[str, Any]
    ) -> Any:
        owner = self.value(func.value, names)
        act = METHODS.get(func.attr)
        if func.attr == "perform" and isinstance(owner, str):
            return self._performed(owner)
        if act is not None and not isinstance(owner, Unknown):
            return act(owner, given)
        if func.attr == "join" and self._words(func.value) in ("os.path", "path"):
            return spend_text("/".join(as_text(item) for item in given))
        if func.attr in ("get", "getenv") and self._words(func.value) in ("os.environ", "environ", "os"):
            return f"$(env {' '.join(quoted(item) for item in given)})"
        if isinstance(owner, Unknown):
            return self._named_call(func.attr, node, given, named)
        return NotImplemented

    def _performed(self, text: str) -> Any:
        """The value of a substitution in a function that launch calls."""
        if self.context is None:
            return text
        try:
            return resolve(text, self.context)
        except NotStaticError as error:
            return Unknown(text, error)

    def _opaque(self, node: ast.Call, given: list[Any], named: Mapping[str, Any]) -> Any:
        """A function that launch calls when it comes to it."""
        named_function = next((item.value for item in node.keywords if item.arg == "function"), None)
        function = named_function or (node.args[0] if node.args else None)
        if not isinstance(function, ast.Name) or function.id not in self.functions:
            return NotImplemented
        target = self.functions[function.id]
        more, words = named.get("args", []), named.get("kwargs", {})
        if not isinstance(more, list | tuple) or not isinstance(words, dict):
            return NotImplemented

        def later(context: Context) -> list[Entity]:
            self.context = context
            try:
                with at(self.path, node.lineno):
                    found = self.call(target, [Unknown("context"), *counted(more)], words)
            finally:
                self.context = None
            items = found if isinstance(found, list | tuple) else []
            return [*(item for item in items if isinstance(item, Entity)), *self._left_open()]

        return Entity("opaque", node.lineno, {"name": function.id}, [], later)


def _assigned(body: Sequence[ast.stmt]) -> list[str]:
    """The names that statements may change."""
    found = []
    for part in body:
        for item in ast.walk(part):
            spend()
            if isinstance(item, ast.Name) and _is_stored(item):
                found.append(item.id)
    return found


def _copied(names: Mapping[str, Any]) -> dict[str, Any]:
    """The names of a scope, for one that begins as they are."""
    spend(1 + len(names) // NAMES)
    return dict(names)


def _is_stored(item: ast.Name) -> bool:
    return isinstance(item.ctx, ast.Store)
