"""Actions and substitutions of launch and launch_ros by their names in Python, as parts of a launch file's tree."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from dse.importers.allowance import TooMuchError, spend, spend_text
from dse.importers.ros2.launch.entities import Entity
from dse.importers.ros2.launch.substitutions import HIDDEN, NotStaticError

Given: TypeAlias = Sequence[Any]
Named: TypeAlias = Mapping[str, Any]


class Unknown:
    """A value that the file does not say: an expression, in words."""

    def __init__(self, text: str, error: NotStaticError | None = None) -> None:
        self.text, self.error = text, error

    def __str__(self) -> str:
        """The expression as a substitution that is not static."""
        return f"$(python {self.text[:80].translate(HIDDEN)})"


class Lazy(Unknown):
    """A condition: its text, and whether it is to hold."""

    def __init__(self, text: str, is_wanted: bool) -> None:
        super().__init__(text)
        self.is_wanted = is_wanted


def as_text(value: Any) -> str:
    """A value as a text with substitutions.

    >>> as_text(["$(var ns)", "/", "cam"]), as_text(True), as_text(20.0)
    ('$(var ns)/cam', 'True', '20.0')
    """
    if isinstance(value, str):
        return spend_text(value)
    if isinstance(value, list | tuple):
        return spend_text("".join(as_text(item) for item in value))
    if isinstance(value, Entity):
        return value.text("file", "from", "name")
    return "" if value is None else _written(value)


def _written(value: Any) -> str:
    """A value as Python writes it.

    >>> _written([1, {"a": "b"}, True])
    "[1, {'a': 'b'}, True]"
    """
    spend()
    if isinstance(value, list | tuple):
        return spend_text(f"[{', '.join(map(_written, value))}]")
    if isinstance(value, dict):
        return spend_text(f"{{{', '.join(f'{_written(key)}: {_written(item)}' for key, item in value.items())}}}")
    if isinstance(value, Entity):
        return repr(as_text(value))
    try:
        return repr(spend_text(value)) if isinstance(value, str) else str(value)
    except ValueError:  # a whole number of thousands of digits
        raise TooMuchError("a number of too many digits") from None


def _word(value: Any) -> str:
    text = as_text(value)
    return f'"{text}"' if not text or any(char.isspace() for char in text.split("$(")[0]) else text


def _get(values: Given, named: Named, number: int, *names: str) -> Any:
    for name in names:
        if name in named:
            return named[name]
    return values[number] if 0 <= number < len(values) else None


def _entity(kind: str, line: int, named: Named, **texts: Any) -> Entity:
    """A part with the texts that are there, and its condition."""
    entity = Entity(kind, line, {key: as_text(value) for key, value in texts.items() if value is not None})
    condition = named.get("condition")
    if isinstance(condition, Lazy):
        entity.texts["if" if condition.is_wanted else "unless"] = condition.text
    elif condition is not None:
        entity.texts["if"] = as_text(condition)
    return entity


def _parameters(values: Any, line: int) -> list[Entity]:
    parameters: list[Entity] = []
    for item in values if isinstance(values, list | tuple) else [] if values is None else [values]:
        if isinstance(item, Entity):
            parameters.append(item)
        elif isinstance(item, dict):
            parameters += [part for key, value in item.items() for part in _parameter(key, value, line)]
        else:
            parameters.append(Entity("param", line, {"from": as_text(item)}))
    return parameters


def _parameter(name: str, value: Any, line: int) -> list[Entity]:
    if isinstance(value, dict):
        return [part for key, inner in value.items() for part in _parameter(f"{name}.{key}", inner, line)]
    if isinstance(value, list | tuple) and len(value) != 1:
        value = as_text(value) if any("$(" in as_text(item) for item in value) else _written(value)
    return [Entity("param", line, {"name": name, "value": as_text(value)})]


def _remaps(values: Any, line: int) -> list[Entity]:
    pairs = values if isinstance(values, list | tuple) else [] if values is None else [values]
    return [
        Entity("remap", line, {"from": as_text(pair[0]), "to": as_text(pair[1])})
        if isinstance(pair, list | tuple) and len(pair) == 2
        else Entity("remap", line, {"from": as_text(pair), "to": as_text(pair)})
        for pair in pairs
    ]


def _node(kind: str) -> Callable[[Given, Named, int], Entity]:
    def made(values: Given, named: Named, line: int) -> Entity:
        texts = {
            "pkg": named.get("package"), "exec": named.get("executable", named.get("node_executable")),
            "plugin": named.get("plugin", named.get("node_plugin")), "name": named.get("name", named.get("node_name")),
            "namespace": named.get("namespace", named.get("node_namespace")),
        }  # fmt: skip
        entity = _entity(kind, line, named, **texts)
        words = named.get("arguments") or named.get("ros_arguments")
        if isinstance(words, list | tuple):
            entity.texts["args"] = " ".join(as_text(item) for item in words)
        entity.children += _parameters(named.get("parameters"), line)
        entity.children += _remaps(named.get("remappings"), line)
        entity.children += _actions(named.get("composable_node_descriptions"), line)
        return entity

    return made


def _actions(values: Any, line: int) -> list[Entity]:
    """The parts of a list; what is none that is known is a part with a remark."""
    items = values if isinstance(values, list | tuple) else [] if values is None else [values]
    actions: list[Entity] = []
    for item in items:
        spend()
        if isinstance(item, list | tuple):
            actions += _actions(item, line)
        elif isinstance(item, Entity):
            actions.append(item)
        elif isinstance(item, Unknown):
            actions.append(Entity("unknown", line, {"name": str(item)}))
    return actions


def _load(values: Given, named: Named, line: int) -> Entity:
    target = _get(values, named, -1, "target_container")
    if isinstance(target, Entity):
        target = f"{target.text('namespace')}/{target.text('name')}" if target.text("namespace") else target
    entity = _entity("load_composable_node", line, named, target=target)
    entity.children += _actions(_get(values, named, 0, "composable_node_descriptions"), line)
    return entity


def _include(values: Given, named: Named, line: int) -> Entity:
    entity = _entity("include", line, named, file=_get(values, named, 0, "launch_description_source"))
    pairs = named.get("launch_arguments") or []
    if isinstance(pairs, dict):
        pairs = [[key, value] for key, value in pairs.items()]
    for pair in pairs if isinstance(pairs, list | tuple) else []:
        if isinstance(pair, list | tuple) and len(pair) == 2:
            entity.children.append(Entity("arg", line, {"name": as_text(pair[0]), "value": as_text(pair[1])}))
    return entity


def _group(values: Given, named: Named, line: int) -> Entity:
    entity = _entity("group", line, named, scoped=named.get("scoped"))
    configurations = named.get("launch_configurations")
    for name, value in configurations.items() if isinstance(configurations, dict) else ():
        entity.children.append(Entity("let", line, {"name": name, "value": as_text(value)}))
    entity.children += _actions(_get(values, named, 0, "actions"), line)
    return entity


def _later(values: Given, named: Named, line: int) -> Entity:
    entity = _entity("timer", line, named)
    entity.children += _actions(_get(values, named, 1, "actions"), line)
    return entity


def _handled(*names: str) -> Callable[[Given, Named, int], Entity]:
    """An action that runs when another one ends or begins: it counts as running."""

    def made(values: Given, named: Named, line: int) -> Entity:
        entity = _entity("timer", line, named)
        for name in names:
            entity.children += _actions(named.get(name), line)
        return entity

    return made


def _handler(values: Given, named: Named, line: int) -> Any:
    return _get(values, named, 0, "event_handler")


def _description(values: Given, named: Named, line: int) -> Entity:
    return Entity("launch", line, {}, _actions(_get(values, named, 0, "initial_entities"), line))


def _made(kind: str, **places: tuple[int, str, str]) -> Callable[[Given, Named, int], Entity]:
    """An action of texts alone: for each its position and its names in Python."""

    def made(values: Given, named: Named, line: int) -> Entity:
        texts = {text: _get(values, named, number, *names) for text, (number, *names) in places.items()}
        return _entity(kind, line, named, **texts)

    return made


def _joined(values: Given, named: Named, line: int) -> str:
    parts = _get(values, named, 0, "substitutions")
    return "/".join(as_text(item) for item in parts) if isinstance(parts, list | tuple) else as_text(parts)


def _with_default(kind: str, *names: str) -> Callable[[Given, Named, int], str]:
    def made(values: Given, named: Named, line: int) -> str:
        default = _get(values, named, 1, "default", "default_value")
        words = [_word(_get(values, named, 0, *names)), *([] if default is None else [_word(default)])]
        return f"$({kind} {' '.join(words)})"

    return made


def _words(kind: str) -> Callable[[Given, Named, int], str]:
    def made(values: Given, named: Named, line: int) -> str:
        return f"$({kind} {' '.join(_word(item) for item in (*values, *named.values()))})"

    return made


def _first(values: Given, named: Named, line: int) -> Any:
    """The wrapped value: of a source of a launch description, or of a value with a type."""
    return _get(values, named, 0, *(name for name in named if name not in ("value_type", "convert_types")))


def _rewritten(values: Given, named: Named, line: int) -> Entity:
    """A parameter file that is written anew with other values; those of nav2_common may name a namespace."""
    texts = {"from": _get(values, named, 0, "source_file"), "root": named.get("root_key")}
    return Entity("param", line, {key: as_text(value) for key, value in texts.items() if value is not None})


def _file(values: Given, named: Named, line: int) -> Entity:
    inner = _get(values, named, 0, "param_file")
    return inner if isinstance(inner, Entity) else Entity("param", line, {"from": as_text(inner)})


def _condition(is_wanted: bool) -> Callable[[Given, Named, int], Lazy]:
    return lambda given, named, line: Lazy(as_text(_get(given, named, 0, "predicate_expression")), is_wanted)


def _is_argument(is_wanted: bool) -> Callable[[Given, Named, int], Lazy]:
    def made(values: Given, named: Named, line: int) -> Lazy:
        name = as_text(_get(values, named, 0, "launch_configuration_name"))
        return Lazy(f"$(equals $(var {name}) {_word(_get(values, named, 1, 'expected_value'))})", is_wanted)

    return made


def _nothing(values: Given, named: Named, line: int) -> Entity:
    return Entity("log", line)


def _expression(values: Given, named: Named, line: int) -> str:
    return f"$(eval {as_text(_get(values, named, 0, 'expression'))})"


SHARE = _words("find-pkg-share")
_NS = {"namespace": (0, "namespace", "ros_namespace")}
ACTIONS: Mapping[str, Callable[[Given, Named, int], Any]] = {
    "Node": _node("node"),
    "LifecycleNode": _node("node"),
    "ComposableNode": _node("composable_node"),
    "ComposableLifecycleNode": _node("composable_node"),
    "ComposableNodeContainer": _node("node_container"),
    "LoadComposableNodes": _load,
    "IncludeLaunchDescription": _include,
    "GroupAction": _group,
    "TimerAction": _later,
    "LaunchDescription": _description,
    "PushRosNamespace": _made("push_ros_namespace", **_NS),
    "PushROSNamespace": _made("push_ros_namespace", **_NS),
    "DeclareLaunchArgument": _made("arg", name=(0, "name", "name"), default=(1, "default_value", "default_value")),
    "SetLaunchConfiguration": _made("let", name=(0, "name", "name"), value=(1, "value", "value")),
    "SetParameter": _made("set_parameter", name=(0, "name", "name"), value=(1, "value", "value")),
    "SetParametersFromFile": _file,
    "SetRemap": lambda given, named, line: _entity(
        "set_remap", line, named, **{"from": _get(given, named, 0, "src"), "to": _get(given, named, 1, "dst")}
    ),
    "SetEnvironmentVariable": _made("set_env", name=(0, "name", "name"), value=(1, "value", "value")),
    "AppendEnvironmentVariable": _nothing,
    "PrependEnvironmentVariable": _nothing,
    "UnsetEnvironmentVariable": _nothing,
    "UnsetLaunchConfiguration": _nothing,
    "ExecuteProcess": _made("executable", cmd=(0, "cmd", "cmd")),
    "RegisterEventHandler": _handler,
    "OnProcessStart": _handled("on_start"),
    "OnProcessExit": _handled("on_exit"),
    "OnExecutionComplete": _handled("on_completion"),
    "OnStateTransition": _handled("entities"),
    "OnProcessIO": _nothing,
    "OnShutdown": _nothing,
    "EmitEvent": _nothing,
    "Shutdown": _nothing,
    "UnregisterEventHandler": _nothing,
    "LogInfo": _nothing,
    "ParameterFile": _file,
    "RewrittenYaml": _rewritten,
    "ReplaceString": _rewritten,
    "ParameterValue": _first,
    "PythonLaunchDescriptionSource": _first,
    "XMLLaunchDescriptionSource": _first,
    "FrontendLaunchDescriptionSource": _first,
    "YAMLLaunchDescriptionSource": _first,
    "AnyLaunchDescriptionSource": _first,
    "TextSubstitution": _first,
    "LaunchConfigAsBool": _with_default("var", "name"),
    "LaunchConfiguration": _with_default("var", "variable_name"),
    "EnvironmentVariable": _with_default("env", "name"),
    "FindPackageShare": SHARE,
    "get_package_share_directory": SHARE,
    "get_package_share_path": SHARE,
    "PathJoinSubstitution": _joined,
    "PathSubstitution": _first,
    "PythonExpression": _expression,
    "ThisLaunchFileDir": lambda given, named, line: "$(dirname)",
    "ThisLaunchFile": lambda given, named, line: "$(filename)",
    "EqualsSubstitution": _words("equals"),
    "NotEqualsSubstitution": _words("not-equals"),
    "NotSubstitution": _words("not"),
    "AndSubstitution": _words("and"),
    "OrSubstitution": _words("or"),
    "AnySubstitution": _words("or"),
    "AllSubstitution": _words("and"),
    "IfElseSubstitution": _words("if"),
    "IfCondition": _condition(True),
    "UnlessCondition": _condition(False),
    "LaunchConfigurationEquals": _is_argument(True),
    "LaunchConfigurationNotEquals": _is_argument(False),
}
