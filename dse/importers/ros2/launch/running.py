"""Nodes and containers that a launch file would start, with their names, remappings and parameters.

The rules are those of launch and launch_ros: a group keeps to itself what is set in it, an included file does not; an
argument counts as the user or the including file gives it, else by its default. What only the launch decides is left
out and told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dse.importers.allowance import TooMuchError, spend, too_much
from dse.importers.ros2.launch.entities import Entity, problem, read_xml, read_yaml
from dse.importers.ros2.launch.parameters import NodeParameter, ParameterFile
from dse.importers.ros2.launch.substitutions import IN_PYTHON, SHOWN, Context, NotStaticError, is_so, resolve
from dse.importers.ros2.packages import Packages
from dse.support.errors import Diagnostic, ProblemError, did_you_mean
from dse.support.files.reading import obstacle, real

MOST_INCLUDES = 5000
"""The greatest number of includes, be it one file many times."""
DEEPEST = 80
"""The greatest depth of groups and included files within each other."""
MOST_NODES = 10_000
NAMES = 8
"""The number of arguments kept by a group that count as one piece of the allowance."""
PIECES = 20
"""The share of the allowance that a node takes, besides its remappings and parameters."""
_PYTHON = re.compile(r"\$\(python ([^()]*)\)?")
NODES = ("node", "lifecycle_node", "node_container", "composable_node")
REFUSED = "not static, left out"
TELLING = ("name", "exec", "plugin", "file", "namespace", "target")
"""The attributes that tell one action of a kind from others."""


@dataclass
class Started:
    """A node: `container` is the full name of that in which it is, "" where it is a process of its own.

    Names are absolute, with namespaces applied; `remaps` are pairs (from, to).
    """

    name: str
    file: Path
    line: int
    package: str
    executable: str
    remaps: list[tuple[str, str]]
    parameters: list[NodeParameter]
    container: str = ""
    arguments: str = ""


@dataclass(frozen=True)
class Scope:
    """The scope of an action: its namespace, and what was set for all nodes before it."""

    namespace: str = "/"
    remaps: tuple[tuple[str, str], ...] = ()
    parameters: tuple[NodeParameter, ...] = ()


@dataclass
class Launch:
    """Goes through launch files and notes what they start.

    Files are read, nothing is executed; what depends on the running system is left out with a remark.
    """

    packages: Packages
    nodes: list[Started] = field(default_factory=list)
    containers: dict[str, Started] = field(default_factory=dict)
    told: dict[Diagnostic, None] = field(default_factory=dict)
    opened: int = 0
    depth: int = 0
    files: dict[Path, Entity] = field(default_factory=dict)
    parameter_files: dict[Path, ParameterFile | None] = field(default_factory=dict)
    including: list[Path] = field(default_factory=list)
    declared: dict[str, None] = field(default_factory=dict)

    def run(self, file: Path, arguments: Mapping[str, str]) -> None:
        """Everything that a file starts.

        Raises
        ------
        ProblemError
            when it, or a file that it includes, is no launch file.
        """
        context = Context(file, dict(arguments), self.packages)
        self._file(file, context, Scope())
        for name in arguments:
            if name not in self.declared and name not in context.asked:
                near = did_you_mean(name, list(self.declared)) or f"declared: {', '.join(self.declared) or 'none'}"
                self.tell(
                    context, 1, f"--arguments {name[:80]}: no file that was read has such a launch argument", near
                )

    def tell(self, context: Context, line: int, message: str, hint: str = "") -> None:
        """Note what is left out, once.

        A warning with file and line; equal remarks count once.
        """
        message = _PYTHON.sub(r"\1", message).translate(SHOWN)
        remark = Diagnostic(message, "", str(context.file), line, 0, hint, severity="warning")
        self.told.setdefault(remark)

    def _file(self, file: Path, context: Context, scope: Scope) -> Scope:
        self.opened += 1
        if self.opened > MOST_INCLUDES:
            raise problem(file, f"more than {MOST_INCLUDES:,} times a file is included")
        if file not in self.files:
            self.files[file] = _read_launch(file)
        before, context.file = context.file, file
        self.including.append(file)
        scope = self._actions(self.files[file].children, context, scope)
        self.including.pop()
        context.file = before
        return scope

    def _actions(self, actions: Sequence[Entity], context: Context, scope: Scope) -> Scope:
        if actions and self.depth > DEEPEST:
            raise problem(context.file, f"more than {DEEPEST} levels of groups and files", actions[0].line)
        self.depth += 1
        for action in actions:
            try:
                spend()
                if self._starts(action, context):
                    scope = self._action(action, context, scope)
            except (TooMuchError, RecursionError) as error:
                raise too_much(context.file, action.line, error) from None
            except NotStaticError as error:
                what = ", ".join(action.texts[key] for key in TELLING if key in action.texts)
                what = f"{action.kind} {what}".strip()[:120] + ": " if action.kind != "unknown" else ""
                self.tell(context, action.line, f"{REFUSED}: {what}{error}", HINTS.get(_reason(error), ""))
        self.depth -= 1
        return scope

    def _holds(self, action: Entity, context: Context) -> bool:
        if "if" in action.texts and not is_so(action.texts["if"], context):
            return False
        return "unless" not in action.texts or not is_so(action.texts["unless"], context)

    def _starts(self, action: Entity, context: Context) -> bool:
        """Whether the condition of an action holds; nodes count where that is an expression that is not followed."""
        try:
            return self._holds(action, context)
        except NotStaticError as error:
            if action.kind not in (*NODES, "group") or IN_PYTHON not in str(error):
                raise
            name = action.text("name", "exec", "plugin")[:80]
            words = f"{action.kind} {name}".strip() + f" counts as started: its condition is not followed: {error}"
            self.tell(context, action.line, words)
            return True

    def _action(self, action: Entity, context: Context, scope: Scope) -> Scope:
        if action.kind == "group":
            return self._group(action, context, scope)
        act = ACTIONS.get(action.kind)
        if act is not None:
            return act(self, action, context, scope) or scope
        if action.kind not in UNSEEN:
            self.tell(context, action.line, f"left out: what <{action.kind[:40]}> does is not known here")
        return scope

    def _group(self, action: Entity, context: Context, scope: Scope) -> Scope:
        is_scoped = resolve(action.texts.get("scoped", "true"), context).strip().lower() in ("true", "1")
        spend((len(context.arguments) + len(context.environment)) // NAMES)
        before, environment = dict(context.arguments), dict(context.environment)
        inside = self._actions(action.children, context, scope)
        if not is_scoped:
            return inside
        context.arguments, context.environment = before, environment
        return scope

    # --- what is set

    def declare(self, action: Entity, context: Context, scope: Scope) -> None:
        """An argument of the file: as given, else its default.

        An argument without a value and default makes texts that use it *not static*.
        """
        name = action.text("name")
        self.declared[name] = None
        if "value" in action.texts:
            self.assign(action, context, scope)
        elif name not in context.arguments:
            try:
                context.arguments[name] = resolve(action.texts["default"], context)
            except KeyError:
                context.arguments[name] = NotStaticError(f"the launch argument {name} is not given")
            except NotStaticError as error:
                context.arguments[name] = error

    def assign(self, action: Entity, context: Context, scope: Scope) -> None:
        """A variable (``let``)."""
        try:
            context.arguments[action.text("name")] = resolve(action.text("value"), context)
        except NotStaticError as error:
            context.arguments[action.text("name")] = error

    def push(self, action: Entity, context: Context, scope: Scope) -> Scope:
        """A namespace for what follows."""
        return replace(scope, namespace=joined(scope.namespace, resolve(action.text("namespace"), context)))

    def _remap_all(self, action: Entity, context: Context, scope: Scope) -> Scope:
        """A remapping for all nodes that follow."""
        pair = (resolve(action.text("from"), context), resolve(action.text("to"), context))
        spend(len(scope.remaps))
        return replace(scope, remaps=(*scope.remaps, pair))

    def _set_for_all(self, action: Entity, context: Context, scope: Scope) -> Scope:
        """A parameter for all nodes that follow."""
        spend(len(scope.parameters))
        return replace(scope, parameters=(*scope.parameters, *self._parameters([action], context, "")))

    def apart(self, action: Entity, context: Context, scope: Scope) -> Scope:
        """Actions that come some time later, or that a function gives."""
        items = action.later(context) if action.later is not None else action.children
        return self._actions(items, context, scope)

    def _leave_out(self, action: Entity, context: Context, scope: Scope) -> None:
        """Leave out an action that is no node."""
        words = resolve(action.text("cmd", "name", "value"), context)[:80]
        self.tell(context, action.line, f"left out: {action.kind} {words}: nothing says how often it runs")

    def unknown(self, action: Entity, context: Context, scope: Scope) -> None:
        """Raise `NotStaticError` where the name of an action in a Python file is not static."""
        resolve(action.text("name"), context)

    def assumed(self, action: Entity, context: Context, scope: Scope) -> None:
        """A branch of a Python file that is followed although its condition is not known: with a remark."""
        try:
            resolve(action.text("name"), context)
        except NotStaticError as error:
            self.tell(context, action.line, f"a branch counts as taken: its condition is not followed: {error}")

    def _set_environment(self, action: Entity, context: Context, scope: Scope) -> None:
        """An environment variable that the file sets."""
        context.environment[resolve(action.text("name"), context)] = resolve(action.text("value"), context)

    def include(self, action: Entity, context: Context, scope: Scope) -> Scope:
        """Another launch file, with its arguments.

        A missing file is a remark; a file that includes itself raises `ProblemError`.
        """
        for argument in action.of("arg", "let"):
            self.assign(argument, context, scope)
        file = real(resolve(action.text("file"), context))
        if file in self.including:
            raise problem(context.file, f"{file.name} includes itself", action.line)
        if obstacle(file) is not None:
            self.tell(context, action.line, f"left out: there is no file {_shown(file)}", HINTS["package"])
            return scope
        return self._file(file, context, scope)

    # --- what is started

    def node(self, action: Entity, context: Context, scope: Scope) -> None:
        """A process with a node."""
        self._start(self._started(action, context, scope))

    def container(self, action: Entity, context: Context, scope: Scope) -> None:
        """A process for several nodes."""
        started = self._started(action, context, scope)
        self.containers[started.name] = started
        self._composed(action, context, scope, started.name)

    def load(self, action: Entity, context: Context, scope: Scope) -> None:
        """Nodes for a container that is started elsewhere.

        ``LoadComposableNodes``: the container may be in another launch file.
        """
        target = resolve(action.text("target"), context)
        self._composed(action, context, scope, joined("/", target))  # launch_ros looks for it from the root

    def _composed(self, action: Entity, context: Context, scope: Scope, container: str) -> None:
        for item in action.of("composable_node", "unknown"):
            try:
                if item.kind == "unknown":
                    self.unknown(item, context, scope)
                elif self._starts(item, context):
                    started = self._started(item, context, scope)
                    started.container = container
                    self._start(started)
            except NotStaticError as error:
                words = f"{REFUSED}: composable_node {item.text('name', 'plugin')[:80]}: {error}"
                self.tell(context, item.line, words, HINTS.get(_reason(error), ""))

    def _start(self, node: Started) -> None:
        if len(self.nodes) >= MOST_NODES:
            raise problem(node.file, f"more than {MOST_NODES:,} nodes are started", node.line)
        spend(PIECES + len(node.remaps) + len(node.parameters))
        self.nodes.append(node)

    def _started(self, action: Entity, context: Context, scope: Scope) -> Started:
        kind = self._known(action, context, "what it runs", "exec", "executable", "plugin")
        package = self._known(action, context, "its package", "pkg", "package")
        title = self._known(action, context, "its name", "name").strip()
        if not title and not kind:
            raise NotStaticError("its name is not known")
        if not title:
            title = _title(kind)
            hint = "the node may call itself otherwise: state its `name`"
            self.tell(context, action.line, f"{kind or package} has no name: it is taken for {title}", hint)
        space = self._known(action, context, "its namespace", "namespace", "ns")
        name = joined(joined(scope.namespace, space), title)
        remaps = [*scope.remaps]
        for item in action.of("remap"):
            try:
                remaps.append((resolve(item.text("from"), context), resolve(item.text("to"), context)))
            except NotStaticError as error:
                self.tell(context, item.line, f"{REFUSED}: a remapping of {name}: {error}")
        own = self._parameters(list(action.of("param")), context, name)
        arguments = self._known(action, context, "its arguments", "args")
        return Started(
            name, context.file, action.line, package, kind, remaps, [*scope.parameters, *own], arguments=arguments
        )

    def _known(self, action: Entity, context: Context, what: str, *names: str) -> str:
        """A text without which a node is still one; "" where it is not static, with a remark."""
        try:
            return resolve(action.text(*names), context)
        except NotStaticError as error:
            words = f"{REFUSED}: {what} ({action.kind} {action.text('name')[:80]}): {error}"
            self.tell(context, action.line, words, HINTS.get(_reason(error), ""))
            return ""

    def _parameters(
        self, items: Sequence[Entity], context: Context, node: str, prefix: str = ""
    ) -> list[NodeParameter]:
        """Parameters in the order in which they count; those of files as far as they concern the node."""
        parameters: list[NodeParameter] = []
        for item in items:
            try:
                parameters += self._parameter(item, context, node, prefix)
            except NotStaticError as error:
                what = item.text("name", "from")[:80]
                words = f"{REFUSED}: parameter {what} of {node or 'all nodes'}: {error}"
                self.tell(context, item.line, words, HINTS.get(_reason(error), ""))
        return parameters

    def _parameter(self, item: Entity, context: Context, node: str, prefix: str) -> list[NodeParameter]:
        if not self._holds(item, context):
            return []
        if "from" in item.texts:
            path = Path(resolve(item.text("from"), context))
            file = self._parameter_file(path, context, item.line)
            root = resolve(item.text("root"), context).strip("/")
            return file.of(node.removeprefix(f"/{root}") if root else node) if file is not None else []
        name = f"{prefix}{resolve(item.text('name'), context)}"
        nested = list(item.of("param"))
        if nested:
            return self._parameters(nested, context, node, f"{name}.")
        return [NodeParameter(name, resolve(item.text("value"), context).strip(), str(context.file), item.line)]

    def _parameter_file(self, path: Path, context: Context, line: int) -> ParameterFile | None:
        if path not in self.parameter_files:
            if obstacle(path) is not None:
                words = f"left out: there is no parameter file {_shown(path)}"
                self.tell(context, line, words, HINTS["package"])
                self.parameter_files[path] = None
                return None
            try:
                self.parameter_files[path] = ParameterFile(path)
            except ProblemError as error:
                [first, *_] = error.diagnostics
                self.told.setdefault(replace(first, message=f"left out: {first.message}", severity="warning"))
                self.parameter_files[path] = None
        return self.parameter_files[path]


Act = Callable[[Launch, Entity, Context, Scope], Scope | None]
ACTIONS: Mapping[str, Act] = {
    "arg": Launch.declare,
    "let": Launch.assign,
    "push_ros_namespace": Launch.push,
    "set_remap": Launch._remap_all,
    "set_parameter": Launch._set_for_all,
    "set_env": Launch._set_environment,
    "set_environment": Launch._set_environment,
    "include": Launch.include,
    "timer": Launch.apart,
    "opaque": Launch.apart,
    "unknown": Launch.unknown,
    "assumed": Launch.assumed,
    "executable": Launch._leave_out,
    "node": Launch.node,
    "lifecycle_node": Launch.node,
    "node_container": Launch.container,
    "load_composable_node": Launch.load,
}
UNSEEN = ("log", "env", "unset_env", "shutdown", "reset", "unset", "set_use_sim_time", "choice")
"""Actions of which nothing becomes a thread."""
HINTS = {
    "argument": "give it: --arguments 'name:=value'",
    "package": "the folder with the packages: --workspace FOLDER",
}


def _reason(error: NotStaticError) -> str:
    return "argument" if "argument" in str(error) else "package" if "package" in str(error) else ""


def _title(kind: str) -> str:
    """The name that a node probably has, of its executable or class.

    >>> _title("cam_node"), _title("nav2::ControllerServer")
    ('cam_node', 'ControllerServer')
    """
    return kind.rpartition("::")[2].rpartition("/")[2] or "node"


def _shown(path: Path) -> str:
    return str(path)[:300]


def joined(namespace: str, name: str) -> str:
    """A name within a namespace; a full one stays.

    >>> joined("/front", "cam"), joined("/front", "/cam"), joined("/", ""), joined("/a", "b/")
    ('/front/cam', '/cam', '/', '/a/b')
    """
    whole = name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"
    return "/" + "/".join(part for part in whole.split("/") if part)


def _read_launch(path: Path) -> Entity:
    """The actions of a launch file, by its suffix. Errors as for `read_xml`."""
    name = path.name.lower()
    if name.endswith(".py"):
        from dse.importers.ros2.launch.python import read_python

        return read_python(path)
    if name.endswith((".yaml", ".yml")):
        return read_yaml(path)
    return read_xml(path)
