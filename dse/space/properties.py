"""From the options in the problem file to decisions and trees of figures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from pydantic import BaseModel

from dse.space.model.space import EMPTY, UNKNOWN_TYPE, Decision, Processor, Reference
from dse.space.model.trees import NOT_OFFERED, Choice, PerCore, PerProcessorType, Tree, graft
from dse.spec.loading.load import LoadedSpec
from dse.support.errors import Diagnostic, Suggestion, did_you_mean, in_order
from dse.support.timelimit import StepCounter
from dse.support.units import shown

Path: TypeAlias = tuple[str | int, ...]
Options: TypeAlias = tuple[Any, ...]
ByProcessorType: TypeAlias = Mapping[str, Options]

NAMED = (
    "processor_types", "bus_types", "device_types", "thread_types", "processors", "buses", "devices", "threads",
    "executors", "reservations", "connections", "flows", "baseline",
)  # fmt: skip

MOST_COMPARED = 300_000
"""The greatest number of names that the search for close ones compares, a second or two; what is beyond has no hint."""


@dataclass
class Owner:
    """The component or slot whose fields are being read: its own fields, or those of the types it may have.

    With `type_decision` a figure becomes a tree over the types; `own` figures take precedence.
    """

    name: str
    path: Path
    own: Any
    types: Sequence[tuple[str, Any]] = ()
    type_path: Path = ()
    type_decision: int | None = None


@dataclass
class Ledger:
    """The records of building a space: decisions, names that rules may refer to, and every mistake found.

    Names in doubt after a mistake are remembered, so that no further message follows from the first.
    """

    loaded: LoadedSpec
    decisions: list[Decision] = field(default_factory=list)
    decision_numbers: dict[str, int] = field(default_factory=dict)
    references: dict[str, Reference] = field(default_factory=dict)
    diagnostics: dict[Diagnostic, None] = field(default_factory=dict)  # each once; there may be very many
    failures: int = 0
    work: StepCounter = field(default_factory=StepCounter)
    _doubtful: set[str] = field(default_factory=set)
    _doubtful_words: set[str] = field(default_factory=set)
    _doubtful_metrics: set[str] = field(default_factory=set)
    _compared: int = 0

    def __post_init__(self) -> None:
        """Fields that were taken out of the problem are open from the start."""
        for name in self.loaded.remains.names:
            self.doubt(name)
            connection = self.loaded.spec.connections.get(name)
            if connection is not None:
                ends = {"from": connection.from_, "to": connection.to, "data_size": connection.data_size}
                self.doubt(*(f"{name}.{field_name}" for field_name, value in ends.items() if value is None))

    def error(
        self,
        path: Path,
        message: str,
        hint: str = "",
        *,
        at_key: bool = False,
        unknown: str = "",
        is_sure: bool = False,
    ) -> None:
        """Note a mistake at `path` of the problem file; one about a whole entry points at its name.

        `unknown` is the name that nothing has, where that is the mistake. One that `is_sure` follows from no other: who
        notes it has looked at what is open. Others are not noted where they may follow from what was taken out.
        """
        if not is_sure and self._may_follow(path, message, hint, unknown):
            return
        depth = max(len(source.node.known(path)) for source in self.loaded.sources)
        at_key = at_key or (depth == 2 and path[0] in NAMED)
        self.diagnostics[self.loaded.diagnostic(path, message, hint, at_key=at_key)] = None

    def _may_follow(self, path: Path, message: str, hint: str, unknown: str) -> bool:
        """Whether a mistake may come of what was taken out of the problem: of its place, or of what it names."""
        taken = self.loaded.remains
        if taken.is_whole:
            return False
        if path in taken.places:
            return True
        if unknown and path[0] != "rules":
            return any(_names(shown(unknown), name) for name in taken.gone)
        if unknown and unknown in self._types():
            return True  # a type that nothing has any more
        words = message if isinstance(hint, Suggestion) else f"{message} {hint}"
        text = self.loaded.source_of(path).text_at(path)
        return any(name in path[1:] or _names(words, name) or mentions(text, name) for name in taken.names)

    def _types(self) -> Iterable[str]:
        spec = self.loaded.spec
        return (*spec.processor_types, *spec.bus_types, *spec.device_types, *spec.thread_types)

    def sorted_diagnostics(self) -> list[Diagnostic]:
        """Every mistake noted, by file in the order of inclusion, line and column."""
        return in_order(self.diagnostics, [source.file for source in self.loaded.sources])

    def doubt(self, *names: str) -> None:
        """Remember what a mistake leaves open, so that nothing is reported that merely follows from it.

        Names are those of components and slots (nothing about them is sure), or ``COMPONENT.FIELD``.
        """
        self._doubtful.update(names)

    def doubt_types(self, names: Iterable[str]) -> None:
        """Remember that some type is misnamed: any of these may have been meant."""
        self._doubtful_words.update(names)

    def doubt_metric(self, name: str) -> None:
        """Remember that a derived metric could not be read."""
        self._doubtful_metrics.add(name)

    def is_doubtful(self, *names: str) -> bool:
        """Whether any of the names is open because of a mistake that is noted already.

        A check that needs these names is then skipped.
        """
        return not self._doubtful.isdisjoint(names)

    def mentions_doubt(self, path: Path, text: str) -> bool:
        """Whether an expression at `path` names something that a mistake leaves open.

        Used to leave out messages about rules and requirements that the first mistake explains.
        """
        words = self._doubtful_metrics
        if path[0] == "rules":
            words = self._doubtful | self._doubtful_words
        return any(mentions(text, word) for word in words)

    def origin(self, path: Path) -> str:
        """The position of `path` in the problem file, as ``file:line``.

        Text; shown with requirements, rules and objectives in every answer.
        """
        place = self.loaded.diagnostic(path, "")
        return f"{place.file}:{place.line}"

    def unknown(self, path: Path, what: str, name: str, known: Iterable[str], *, at_key: bool = False) -> None:
        """Note a name that is not known, with the closest one that is (as long as there are not very many).

        `what` is the noun of the message, `known` the names to suggest from.
        """
        names = list(known)
        self._compared += len(names)
        hint = closest(name, names) if self._compared <= MOST_COMPARED else ""
        self.error(path, f"unknown {what} {shown(name)}", hint, at_key=at_key, unknown=name)

    def decide(self, component: str, field_name: str, kind: str, values: Options, write: Callable[[Any], str]) -> int:
        """Add a decision and return its index; the caller sets its home when the tree is known.

        `values` are the options in base units, `write` makes their texts. Equal names refer to the decision that came
        first.
        """
        options = tuple(write(value) for value in values)
        name = f"{component}.{field_name}"
        self.decisions.append(Decision(name, component, field_name, kind, options, values))
        self.decision_numbers.setdefault(name, len(self.decisions) - 1)
        return len(self.decisions) - 1

    def settle(self, decision: int | None, home: Tree) -> None:
        """State in which tree `decision` is met when it is active.

        `home` is the tree whose evaluation meets the decision; where it is not met, the decision is inactive.
        """
        if decision is not None:
            self.decisions[decision] = replace(self.decisions[decision], home=home)

    def with_use(self, name: str, tree: Tree) -> Tree:
        """The tree of a figure, which becomes where its decision is met, and what rules mean by its name.

        `name` is that of the decision; a decision without effect in a design is inactive there.
        """
        self.settle(self.decision_numbers.get(name), tree)
        if name in self.references:
            self.references[name] = replace(self.references[name], tree=tree)
        return tree

    def narrow(self, name: str, only: Callable[[Tree], Tree]) -> None:
        """State that a figure is there in some designs only, in which a decision on it is active, and rules see it."""
        decision = self.decision_numbers.get(name)
        if decision is not None:
            self.settle(decision, only(self.decisions[decision].home))
        if name in self.references:
            self.references[name] = replace(self.references[name], tree=only(self.references[name].tree))

    def refer(self, name: str, kind: str, tree: Tree, texts: Mapping[Any, str]) -> None:
        """Make `name` known to rules, the baseline and ``--fix``.

        `texts` maps values to what the user may write; without any the name stays unknown.
        """
        if texts:
            self.references[name] = Reference(name, kind, tree, texts)


def _word(name: str) -> str:
    return rf"(?<!\w){re.escape(name)}(?!\w)"


def mentions(text: str, name: str) -> bool:
    """Whether a text has a name as a word of its own.

    A name is a word where no letter, digit or underscore touches it.
    """
    return name in text and re.search(_word(name), text) is not None


def _names(words: str, name: str) -> bool:
    """Whether a message names something: in quotes, with a field, of a metric, or in a cycle."""
    word = _word(name)
    return name in words and re.search(rf'"{word}"|{word}\.\w|\bof {word}|-> {word}|{word} ->', words) is not None


def closest(name: str, known: Iterable[str]) -> str:
    """A hint with the closest known name, or with all of them where they are few.

    Up to eight names are listed; else the closest one, if any is near.
    """
    names = [str(item) for item in known]
    return did_you_mean(name, names) or Suggestion("known: " + ", ".join(names) if 0 < len(names) <= 8 else "")


def type_choice(decision: int | None, branches: Sequence[Tree]) -> Tree:
    """A choice by type; with a single type there is nothing to choose.

    `branches` has one subtree for each type, in the order of the options.
    """
    if decision is None or len(branches) == 1:
        return branches[0]
    return Choice(decision, tuple(branches))


@dataclass(frozen=True)
class Unstated:
    """The default value of a field that a type does not state; it is no option of a decision.

    A default of the schema; a decision is only made of what the file states.
    """

    value: Any


def stated(model: Any, field_name: str, section: Any = None) -> Any:
    """The options that a model (or a `section` of it) states for a field, its default, or None.

    `Unstated` marks a default that the file does not mention, so that it becomes no option.
    """
    holder = model if section is None else section
    value = getattr(holder, field_name)
    fields = holder.model_fields_set if isinstance(holder, BaseModel) else ()
    return value if value is None or field_name in fields else Unstated(value[0])


def _tuples(options: Options | ByProcessorType | Unstated | None) -> list[Options]:
    if options is None or isinstance(options, Unstated):
        return []
    return list(options.values()) if isinstance(options, Mapping) else [options]


@dataclass(frozen=True)
class FieldReader:
    """Reads one field of one owner into a tree; `by_type` turns per-processor-type figures into a subtree.

    Only figures of the processor types in `machines` are read, where that is given: the others can never matter.
    """

    ledger: Ledger
    owner: Owner
    field_name: str
    kind: str
    write: Callable[[Any], str]
    by_type: Callable[[Mapping[str, Tree], Path], Tree] | None = None
    machines: frozenset[str] | None = None

    def read(self, given_by: Callable[[Any], Options | ByProcessorType | Unstated | None]) -> Tree:
        """The tree of the field; options anywhere in it become one decision of the owner.

        A type that does not state the field leaves nothing to decide, also where it counts with a default.
        """
        owner = self.owner
        own = given_by(owner.own) if owner.own is not None else None
        values = [own] if own is not None or not owner.types else [given_by(model) for _, model in owner.types]
        values = [self._reachable(item) for item in values]
        union = tuple(dict.fromkeys(value for item in values for options in _tuples(item) for value in options))
        is_decision = any(len(options) > 1 for item in values for options in _tuples(item))
        decision = (
            self.ledger.decide(owner.name, self.field_name, self.kind, union, self.write) if is_decision else None
        )
        paths = (
            [(*owner.path, self.field_name)]
            if len(values) == 1 and (own is not None or not owner.types)
            else [(*owner.type_path, name, self.field_name) for name, _ in owner.types]
        )
        branches = [self._tree(item, path, union, decision) for item, path in zip(values, paths, strict=True)]
        tree = type_choice(owner.type_decision if len(branches) > 1 else None, branches)
        self.ledger.settle(decision, graft(tree, lambda leaf: self._met(leaf, decision, union)))
        defaults = (item.value for item in values if isinstance(item, Unstated))
        texts = {value: self.write(value) for value in (*union, *defaults)}
        self.ledger.refer(f"{owner.name}.{self.field_name}", self.kind, tree, texts)
        return tree

    def _reachable(self, value: Any) -> Any:
        if self.machines is None or not isinstance(value, Mapping):
            return value
        return {name: options for name, options in value.items() if self.machines & {name, name.rpartition("/")[0]}}

    def _tree(self, value: Any, path: Path, union: Options, decision: int | None) -> Tree:
        if value is None or isinstance(value, Unstated):
            return None if value is None else value.value
        if isinstance(value, Mapping):
            subtrees = {name: self._leaf(options, union, decision) for name, options in value.items()}
            if self.by_type is None:
                self.ledger.error(path, "no figures per processor type here")
                return None
            return self.by_type(subtrees, path)
        return self._leaf(value, union, decision)

    @staticmethod
    def _met(leaf: Any, decision: int | None, union: Options) -> Tree:
        """Options per processor type of a virtual bus are decided wherever its type is chosen."""
        if decision is not None and isinstance(leaf, PerProcessorType):
            return Choice(decision, union)
        return leaf

    @staticmethod
    def _leaf(options: Options, union: Options, decision: int | None) -> Tree:
        if decision is None:
            return options[0]
        # equal figures of other owners stay theirs (see `dse.questions.sensitivity.traced_numbers`)
        own = dict(zip(options, options, strict=True))
        return Choice(decision, tuple(own.get(value, NOT_OFFERED) for value in union))


def by_machine(
    ledger: Ledger, processors: Sequence[Processor], name: str, processor: Tree
) -> Callable[[Mapping[str, Tree], Path], Tree]:
    """Figures per processor type for thread `name`, which runs on `processor`: a tree of processor indices, or None.

    The returned function takes figures by processor type (or ``TYPE/GROUP``) and the place in the file; types without a
    figure go to `ledger`.
    """

    def make(subtrees: Mapping[str, Tree], path: Path) -> Tree:
        missing: dict[str, str] = {}

        def figure(slot: Processor, type_name: str) -> Tree:
            if type_name == EMPTY:
                return NOT_OFFERED
            if type_name != UNKNOWN_TYPE and not subtrees.keys() & {
                type_name,
                *(f"{type_name}/{group}" for group, _ in slot.groups.get(type_name, ())),
            }:
                missing.setdefault(type_name, slot.name)
            parts = []
            for group, count in slot.groups.get(type_name, ()):
                key = f"{type_name}/{group}" if f"{type_name}/{group}" in subtrees else type_name
                if key not in subtrees:
                    missing.setdefault(f"{type_name}/{group}", slot.name)
                parts += [subtrees.get(key)] * count
            if not parts or all(part is parts[0] for part in parts):
                return parts[0] if parts else subtrees.get(type_name)
            return PerCore(tuple(parts))

        def on(index: int | None) -> Tree:
            if index is None:
                return None
            slot = processors[index]
            figures = [figure(slot, item) for item in slot.types]
            return type_choice(slot.type_decision, figures)

        tree = graft(processor, on)
        if processor is None and not ledger.is_doubtful(name, f"{name}.processor"):
            ledger.error(path, "figures per processor type need a `processor`")
        for type_name, slot_name in missing.items():
            ledger.error(path, f"no figure for processor type {shown(type_name)}, which {shown(slot_name)} may have")
        return tree

    return make


def per_processor_type(subtrees: Mapping[str, Tree], path: Path) -> Tree:
    """Figures per processor type of a virtual bus: who runs it is known for each connection only.

    Resolved by `PerProcessorType` when a connection is evaluated.
    """
    return PerProcessorType(dict(subtrees))
