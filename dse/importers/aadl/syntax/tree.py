"""The syntax tree of AADL: what stands in the text, names as written, nothing looked up.

Names are compared in small letters (`key`). A path is a tuple of names, an array index kept with its name (``x[2]``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TypeAlias

from dse.importers.registry import Place

Path: TypeAlias = tuple[str, ...]
HERE = Place("", 0, 0)


@dataclass(frozen=True, slots=True)
class Reference:
    """A classifier by name: ``package::type.implementation``; `package` is "" where none is written."""

    package: str
    name: str
    place: Place

    def __str__(self) -> str:
        return f"{self.package}::{self.name}" if self.package else self.name


# --- property values ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Number:
    """A number with the name of its unit ("" without one)."""

    value: Fraction
    unit: str
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class StringLiteral:
    """A text in quotes, or ``true`` or ``false`` as it stands."""

    text: str
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Range:
    """``low .. high``."""

    low: Value
    high: Value
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Listed:
    """``(a, b)``."""

    items: tuple[Value, ...]
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Record:
    """``[name => value; …]``; the names in small letters."""

    fields: tuple[tuple[str, Value], ...]
    place: Place = HERE

    def get(self, name: str) -> Value | None:
        """The value of a field, or None."""
        return next((value for key, value in self.fields if key == name.lower()), None)


@dataclass(frozen=True, slots=True)
class Referred:
    """``reference (path)``."""

    path: Path
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Classified:
    """``classifier (name)``."""

    classifier: Reference
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Word:
    """A name: a literal of an enumeration, a constant or a property; `package` as in `Reference`."""

    package: str
    name: str
    negative: bool = False
    place: Place = HERE


@dataclass(frozen=True, slots=True)
class Computed:
    """An expression that is not evaluated: ``compute (f)``, ``a and b``."""

    text: str
    place: Place = HERE


Value: TypeAlias = Number | StringLiteral | Range | Listed | Record | Referred | Classified | Word | Computed


def without_places(value: Value) -> Value:
    """A value that is equal to another one of the same text elsewhere.

    For comparing what two files say.
    """
    match value:
        case Range(low, high):
            return Range(without_places(low), without_places(high))
        case Listed(items):
            return Listed(tuple(without_places(item) for item in items))
        case Record(fields):
            return Record(tuple((name, without_places(item)) for name, item in fields))
        case Classified(classifier):
            return Classified(replace(classifier, place=HERE))
    return replace(value, place=HERE)


@dataclass(frozen=True, slots=True)
class ModalValue:
    """A value, in the modes that it holds in (None: in all, or in those that no other value names)."""

    value: Value
    modes: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class Association:
    """``Set::Name => value applies to path in binding (…)``; `key` is the property's own name in small letters.

    One value for each mode; ``+=>`` appends to an inherited list.
    """

    package: str
    name: str
    key: str
    values: tuple[ModalValue, ...]
    applies: tuple[Path, ...]
    binding: tuple[Reference, ...]
    appends: bool
    place: Place


Properties: TypeAlias = tuple[Association, ...]


# --- declarations -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Prototype:
    """A prototype: what is bound to it must be of `category` ("" where it is a feature)."""

    name: str
    category: str
    constraint: Reference | None
    place: Place


@dataclass(frozen=True, slots=True)
class Binding:
    """``prototype => category classifier`` (or ``=> a feature group``); `classifier` None for what is not followed."""

    name: str
    classifier: Reference | None
    place: Place
    inner: tuple[Binding, ...] = ()


@dataclass(frozen=True, slots=True)
class Feature:
    """A feature; `kind` such as ``event data port``, `direction` ``in``, ``out``, ``in out``, or ""."""

    name: str
    kind: str
    direction: str
    classifier: Reference | None
    inverse: bool
    dimensions: tuple[Value | None, ...]
    properties: Properties
    refined: bool
    place: Place


@dataclass(frozen=True, slots=True)
class FlowSpec:
    """``name: flow source | sink | path``; `entry` and `exit` are paths of features, () where there is none."""

    name: str
    kind: str
    entry: Path
    exit: Path
    properties: Properties
    refined: bool
    modes: tuple[str, ...] | None
    place: Place


@dataclass(frozen=True, slots=True)
class Subcomponent:
    """A subcomponent; `classifier` None where it has none."""

    name: str
    category: str
    classifier: Reference | None
    bindings: tuple[Binding, ...]
    dimensions: tuple[Value | None, ...]
    properties: Properties
    refined: bool
    modes: tuple[str, ...] | None
    place: Place


@dataclass(frozen=True, slots=True)
class Connection:
    """A connection; the ends are () in a refinement that does not repeat them."""

    name: str
    kind: str
    source: Path
    target: Path
    both_ways: bool
    properties: Properties
    refined: bool
    modes: tuple[str, ...] | None
    place: Place


@dataclass(frozen=True, slots=True)
class Flow:
    """A flow implementation (`kind` source, sink, path) or an end-to-end flow (`kind` "end to end"), in elements."""

    name: str
    kind: str
    elements: tuple[Path, ...]
    properties: Properties
    refined: bool
    modes: tuple[str, ...] | None
    place: Place


@dataclass(frozen=True, slots=True)
class Mode:
    """A mode."""

    name: str
    initial: bool
    place: Place


@dataclass(slots=True, eq=False)
class Classifier:
    """A component type, a component implementation (its name has a dot) or a feature group type."""

    category: str
    name: str
    place: Place
    package: str = ""
    extends: Reference | None = None
    inverse_of: Reference | None = None
    bindings: tuple[Binding, ...] = ()
    prototypes: list[Prototype] = field(default_factory=list)
    features: list[Feature] = field(default_factory=list)
    specs: list[FlowSpec] = field(default_factory=list)
    subcomponents: list[Subcomponent] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    flows: list[Flow] = field(default_factory=list)
    modes: list[Mode] = field(default_factory=list)
    properties: list[Association] = field(default_factory=list)

    @property
    def is_implementation(self) -> bool:
        """Whether it is an implementation rather than a type."""
        return "." in self.name


@dataclass(frozen=True, slots=True)
class Rename:
    """``alias renames …``: what an alias stands for; `name` "" means a package, ``all`` everything in it."""

    alias: str
    package: str
    name: str


@dataclass(slots=True)
class Package:
    """A package: what it sees, and its classifiers by key."""

    name: str
    place: Place
    withs: list[tuple[str, Place]] = field(default_factory=list)
    renames: list[Rename] = field(default_factory=list)
    classifiers: dict[str, Classifier] = field(default_factory=dict)
    properties: list[Association] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Definition:
    """The definition of one name in a property set: a property, a constant or a type."""

    name: str
    kind: str
    inherit: bool
    value: Value | None
    place: Place


@dataclass(slots=True)
class PropertySet:
    """A property set, its definitions by key."""

    name: str
    place: Place
    definitions: dict[str, Definition] = field(default_factory=dict)


@dataclass(slots=True)
class Unit:
    """The packages and property sets of one file."""

    packages: list[Package] = field(default_factory=list)
    sets: list[PropertySet] = field(default_factory=list)
