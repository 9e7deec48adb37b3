"""Launch files in Python, read and never run: what their syntax tree says of the actions that they describe.

A small part of Python is followed: assignments, lists, dictionaries, functions of the file, branches and loops whose
conditions are known. The actions and substitutions are those of launch and launch_ros; everything else is unknown, and
what depends on it is told as not static.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from dse.importers.allowance import at, spend, spend_text
from dse.importers.ros2.launch.actions import ACTIONS, Unknown, as_text
from dse.importers.ros2.launch.builtins import FUNCTIONS
from dse.importers.ros2.launch.entities import Entity, problem, text_of
from dse.importers.ros2.launch.operations import (
    METHODS,
    assigned,
    compared,
    copied,
    counted,
    entry_of,
    has_actions,
    is_open,
    leaves,
    part_of,
    quoted,
    reckoned,
    sum_of,
)
from dse.importers.ros2.launch.substitutions import Context, NotStaticError, resolve, utf8
from dse.importers.ros2.launch.texts import FILE, OF_PATHS, PARTS, by_percent, method_of_text, path_of, with_format

START = "generate_launch_description"
DEEPEST = 20
"""The greatest depth of calls between functions of the file."""
SIGNS = 8
"""The number of characters of a shown expression that count as one piece of the allowance."""


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
        entity = reader.start()
    if not isinstance(entity, Entity):
        hint = "it returns LaunchDescription([...])"
        raise problem(path, f"{START} returns no launch description that can be read", reader.line, hint=hint)
    return entity


class _Returned(Exception):
    def __init__(self, value: Any) -> None:
        self.value = value


class _Left(Exception):
    """A loop is left, or goes on with its next round."""

    def __init__(self, is_last: bool) -> None:
        self.is_last = is_last


class _Reader:
    """Follows one file."""

    def __init__(self, path: Path, tree: ast.Module) -> None:
        self.path, self.tree = path, tree
        self.aliases: dict[str, str] = {}
        self.functions: dict[str, ast.FunctionDef] = {}
        self.scopes: dict[ast.FunctionDef, Mapping[str, Any]] = {}
        self.context: Context | None = None
        self.depth = 0
        self.open: list[Entity] = []
        self.said: dict[ast.expr, str] = {}
        self.line = 1

    def start(self) -> Any:
        """The result of the function that launch calls."""
        names: dict[str, Any] = {"__file__": FILE, "__name__": "launch"}
        with suppress(_Left, _Returned):  # outside of loops and functions they are mistakes
            self._run(self.tree.body, names)
        function = self.functions.get(START)
        if function is None:
            raise problem(self.path, f"it has no function {START}", hint="launch files in Python have one")
        self.line = function.lineno
        description = self.call(function, [], {})
        if isinstance(description, Entity):
            description.children += self._left_open()
        return description

    def _left_open(self) -> list[Entity]:
        """Branches and loops that were not followed, as actions with a remark."""
        entities, self.open = self.open, []
        return entities

    def call(self, function: ast.FunctionDef, values: Sequence[Any], named: Mapping[str, Any]) -> Any:
        """The result of a function of the file."""
        if self.depth > DEEPEST:
            return Unknown(f"{function.name}")
        arguments = function.args
        names: dict[str, Any] = copied(self.scopes[function])
        places = [item.arg for item in (*arguments.posonlyargs, *arguments.args)]
        for item, default in zip(reversed(places), reversed(arguments.defaults), strict=False):
            names[item] = self.value(default, names)
        for keyword, preset in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=False):
            names[keyword.arg] = self.value(preset, names) if preset is not None else Unknown(keyword.arg)
        names |= dict(zip(places, values, strict=False))
        own = {*places, *(item.arg for item in arguments.kwonlyargs)}
        names |= {key: value for key, value in named.items() if key in own}
        if arguments.vararg is not None:
            names[arguments.vararg.arg] = list(values[len(places) :])
        if arguments.kwarg is not None:
            names[arguments.kwarg.arg] = {key: value for key, value in named.items() if key not in own}
        for item in places:
            names.setdefault(item, Unknown(item))
        self.depth += 1
        try:
            self._run(function.body, names)
        except _Returned as returned:
            return returned.value
        except _Left:
            return None
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
                self.scopes[item] = names
            case ast.ImportFrom(names=aliases):
                self.aliases |= {one.asname: one.name for one in aliases if one.asname}
            case ast.Assign(targets=targets, value=value):
                result = self.value(value, names)
                for target in targets:
                    self._assign(target, result, names)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, self.value(value, names), names)
            case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
                result = self._operated(op, names.get(name, Unknown(name)), self.value(value, names))
                names[name] = Unknown(name) if result is NotImplemented else result
            case ast.With(body=body) | ast.Try(body=body):
                self._run(body, names)
            case _:
                self._flow(item, names)

    def _flow(self, item: ast.stmt, names: dict[str, Any]) -> None:
        """A statement that calls, decides or goes elsewhere."""
        match item:
            case ast.Expr(value=value):
                self.value(value, names)
            case ast.Return(value=value):
                raise _Returned(self.value(value, names) if value is not None else None)
            case ast.If() | ast.For():
                self._branch(item, names)
            case ast.Break() | ast.Continue():
                raise _Left(isinstance(item, ast.Break))
            case ast.While(test=why) | ast.Match(subject=why):
                self._skip(item, why, names)

    def _branch(self, item: ast.If | ast.For, names: dict[str, Any]) -> None:
        if isinstance(item, ast.If):
            test = self.truth(item.test, names)
            if test is not NotImplemented:
                self._run(item.body if test else item.orelse, names)
            elif leaves(item.body):
                self._skip(item, item.test, names)
            else:
                self._assume(item, names)
            return
        values = self.value(item.iter, names)
        if isinstance(values, list | tuple):
            for value in values:
                spend()
                self._assign(item.target, value, names)
                try:
                    self._run(item.body, names)
                except _Left as left:
                    if left.is_last:
                        return
            self._run(item.orelse, names)
            return
        self._skip(item, item.iter, names)

    def _assume(self, item: ast.If, names: dict[str, Any]) -> None:
        """Follow a branch whose condition is not known: its nodes count, with a remark; values that it sets do not."""
        self.open.append(Entity("assumed", item.lineno, {"name": str(Unknown(self._words(item.test)))}))
        self._run(item.body, names)
        for name in assigned([item]):
            if not has_actions(names.get(name)):
                names[name] = Unknown(name)

    def _skip(self, item: ast.stmt, why: ast.expr, names: dict[str, Any]) -> None:
        """Do not follow a branch or loop: what it changes is unknown."""
        for name in assigned([item]):
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
        result = self._value(node, names)
        return Unknown(self._words(node)) if result is NotImplemented else result

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
            case ast.BinOp(left=left, op=op, right=right):
                return self._operated(op, self.value(left, names), self.value(right, names))
            case ast.Call():
                return self._call(node, names)
        part = self._part_of(node, names)
        return self._logic(node, names) if part is NotImplemented else part

    def _part_of(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        """An entry, a slice or an attribute of something."""
        match node:
            case ast.Subscript(value=ast.Attribute(attr="environ"), slice=key):
                return f"$(env {as_text(self.value(key, names))})"
            case ast.Subscript(value=ast.Attribute(attr="launch_configurations"), slice=key):
                return self._performed(f"$(var {as_text(self.value(key, names))})")
            case ast.Subscript(value=ast.Attribute(value=path, attr="parents"), slice=key):
                return self._parents(self.value(path, names), self.value(key, names))
            case ast.Subscript(value=owner, slice=ast.Slice(lower=lower, upper=upper, step=None)):
                ends = (None if end is None else self.value(end, names) for end in (lower, upper))
                return part_of(self.value(owner, names), *ends)
            case ast.Subscript(value=owner, slice=key):
                return entry_of(self.value(owner, names), self.value(key, names))
            case ast.Attribute(value=owner, attr=name) if name in PARTS:
                path = self.value(owner, names)
                return PARTS[name](path) if isinstance(path, str) else NotImplemented
        return NotImplemented

    def _logic(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        match node:
            case ast.Compare(left=left, ops=ops, comparators=rights):
                return self._compared(ops, [left, *rights], names)
            case ast.UnaryOp(op=ast.Not()):
                return self.truth(node, names)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
                return -number
            case ast.BoolOp(op=op, values=items):
                return self._first(items, isinstance(op, ast.Or), names)
            case ast.IfExp(test=test, body=body, orelse=other):
                truth = self.truth(test, names)
                return truth if truth is NotImplemented else self.value(body if truth else other, names)
            case ast.ListComp(elt=element, generators=[one]) | ast.GeneratorExp(elt=element, generators=[one]):
                return self._rounds(one, names, lambda inner: self.value(element, inner))
            case ast.DictComp(key=key, value=value, generators=[one]):
                pairs = self._rounds(one, names, lambda inner: (self.value(key, inner), self.value(value, inner)))
                return pairs if pairs is NotImplemented else {as_text(name): item for name, item in pairs}
        return NotImplemented

    def _rounds(self, one: ast.comprehension, names: Mapping[str, Any], act: Callable[[Any], Any]) -> Any:
        """The values of a comprehension; NotImplemented where that is not known."""
        items = self.value(one.iter, names)
        if not isinstance(items, list | tuple):
            return NotImplemented
        values = []
        for item in items:
            inner = copied(names)
            self._assign(one.target, item, inner)
            tests = [self.truth(test, inner) for test in one.ifs]
            if NotImplemented in tests:
                return NotImplemented
            if all(tests):
                values.append(act(inner))
        return values

    def _first(self, items: Sequence[ast.expr], is_or: bool, names: Mapping[str, Any]) -> Any:
        """``a or b``, ``a and b``: the value that decides; what comes after it is not looked at."""
        value: Any = None
        for item in items:
            value = self.value(item, names)
            if is_open(value):
                return NotImplemented
            if bool(value) is is_or:
                break
        return value

    def truth(self, node: ast.expr, names: Mapping[str, Any]) -> Any:
        """Whether a condition holds, also where only a part of it is known; else NotImplemented."""
        match node:
            case ast.BoolOp(op=op, values=items):
                is_or, is_known = isinstance(op, ast.Or), True
                for item in items:
                    is_true = self.truth(item, names)
                    if is_true is is_or:
                        return is_true
                    is_known = is_known and is_true is not NotImplemented
                return (not is_or) if is_known else NotImplemented
            case ast.UnaryOp(op=ast.Not(), operand=item):
                is_true = self.truth(item, names)
                return is_true if is_true is NotImplemented else not is_true
        value = self.value(node, names)
        return NotImplemented if is_open(value) else bool(value)

    def _operated(self, op: ast.operator, left: Any, right: Any) -> Any:
        if isinstance(op, ast.Add):
            return sum_of(left, right)
        if isinstance(op, ast.Mod) and isinstance(left, str):
            return by_percent(left, right)
        result = reckoned(type(op), left, right)
        if result is NotImplemented and isinstance(op, ast.Div):
            return path_of([left, right])
        return result

    def _compared(self, ops: Sequence[ast.cmpop], items: Sequence[ast.expr], names: Mapping[str, Any]) -> Any:
        values = [self.value(item, names) for item in items]
        results = [compared(type(op), left, right) for op, left, right in zip(ops, values, values[1:], strict=False)]
        if False in results:
            return False
        return NotImplemented if NotImplemented in results else True

    def _parents(self, path: Any, number: Any) -> Any:
        if not isinstance(path, str) or not isinstance(number, int) or not 0 <= number < DEEPEST:
            return NotImplemented
        for _ in range(number + 1):
            path = PARTS["parent"](path) if isinstance(path, str) else path
        return path

    def _items(self, items: Sequence[ast.expr], names: Mapping[str, Any]) -> list[Any]:
        listed: list[Any] = []
        for item in items:
            if isinstance(item, ast.Starred):
                more = self.value(item.value, names)
                listed += counted(more) if isinstance(more, list | tuple) else [more]
            else:
                listed.append(self.value(item, names))
        return listed

    def _dictionary(
        self, keys: Sequence[ast.expr | None], values: Sequence[ast.expr], names: Mapping[str, Any]
    ) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        for key, item in zip(keys, values, strict=True):
            value = self.value(item, names)
            if key is not None:
                entries[as_text(self.value(key, names))] = value
            elif isinstance(value, dict):
                entries |= counted(value)
        return entries

    def _words(self, node: ast.expr) -> str:
        """The beginning of an expression."""
        if node not in self.said:
            text = ast.unparse(node)
            spend(len(text) // SIGNS)
            self.said[node] = text[:80]
        return self.said[node]

    def _part(self, item: ast.expr, names: Mapping[str, Any]) -> Any:
        if not isinstance(item, ast.FormattedValue):
            return self.value(item, names)
        form = "" if item.format_spec is None else as_text(self.value(item.format_spec, names))
        text = with_format(self.value(item.value, names), item.conversion, form)
        return Unknown(self._words(item.value)) if text is NotImplemented else text

    # --- calls

    def _call(self, node: ast.Call, names: Mapping[str, Any]) -> Any:
        values = self._items(node.args, names)
        named: dict[str, Any] = {}
        for item in node.keywords:
            value = self.value(item.value, names)
            if item.arg is not None:
                named[item.arg] = value
            elif isinstance(value, dict):
                named |= counted(value)
            else:
                self.open.append(Entity("unknown", node.lineno, {"name": str(Unknown(self._words(item.value)))}))
        if isinstance(node.func, ast.Name):
            return self._named_call(self.aliases.get(node.func.id, node.func.id), node, values, named)
        if isinstance(node.func, ast.Attribute):
            return self._method(node.func, node, values, named, names)
        return NotImplemented

    def _named_call(self, name: str, node: ast.Call, values: list[Any], named: Mapping[str, Any]) -> Any:
        if name in self.functions:
            return self.call(self.functions[name], values, named)
        if name == "OpaqueFunction":
            return self._opaque(node, values, named)
        if name in ("Path", "PurePath", "PosixPath"):
            return path_of(values)
        if name == "dict" and not values:
            return dict(named)
        if name in FUNCTIONS and not named:
            return FUNCTIONS[name](values)
        act = ACTIONS.get(name)
        return act(values, named, node.lineno) if act is not None else NotImplemented

    def _method(
        self, func: ast.Attribute, node: ast.Call, values: list[Any], named: Mapping[str, Any], names: Mapping[str, Any]
    ) -> Any:
        owner = self.value(func.value, names)
        act = METHODS.get(func.attr)
        if func.attr == "perform" and isinstance(owner, str):
            return self._performed(owner)
        if isinstance(owner, str):
            return method_of_text(func.attr, owner, values, named)
        if act is not None and not isinstance(owner, Unknown):
            return act(owner, values)
        if func.attr in OF_PATHS and self._words(func.value) in ("os.path", "path", "osp"):
            return OF_PATHS[func.attr](values)
        if func.attr == "get" and self._words(func.value).endswith(".launch_configurations"):
            return self._performed(f"$(var {' '.join(quoted(item) for item in values)})")
        if func.attr in ("get", "getenv") and self._words(func.value) in ("os.environ", "environ", "os"):
            return f"$(env {' '.join(quoted(item) for item in values)})"
        if isinstance(owner, Unknown):
            return self._named_call(func.attr, node, values, named)
        return NotImplemented

    def _performed(self, text: str) -> Any:
        """The value of a substitution in a function that launch calls."""
        if self.context is None:
            return text
        try:
            return resolve(text, self.context)
        except NotStaticError as error:
            return Unknown(text, error)

    def _opaque(self, node: ast.Call, values: list[Any], named: Mapping[str, Any]) -> Any:
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
                    entities = self.call(target, [Unknown("context"), *counted(more)], words)
            finally:
                self.context = None
            items = entities if isinstance(entities, list | tuple) else []
            return [*(item for item in items if isinstance(item, Entity)), *self._left_open()]

        return Entity("opaque", node.lineno, {"name": function.id}, [], later)
