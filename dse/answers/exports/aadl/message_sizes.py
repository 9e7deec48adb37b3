"""Ports whose messages have another size: by a data type of their own, which is where OSATE's latency looks for it.

The type is an implementation of the port's data type, which may go to whatever takes that. So the component that sends
becomes one whose port is refined, and so do the components around it, up to the root.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from dse.answers.exports.aadl.names import identifier, size_in_units
from dse.importers.aadl.instance.connections import ConnectionInstance, Leaf
from dse.importers.aadl.instance.inheritance import Flat
from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.syntax.tree import Classifier

SUBSTITUTION = "{Classifier_Substitution_Rule => Type_Extension;}"


@dataclass
class _Refined:
    """A component on the way to a port: its own ports, with the lines that refine them, and what is within it."""

    ports: dict[str, str] = field(default_factory=dict)
    inner: dict[Instance, _Refined] = field(default_factory=dict)


class ResizedPorts:
    """Collects the ports of a model that send messages of another size, and declares what they need."""

    def __init__(self, model: InstanceModel, taken: set[str]) -> None:
        self.model = model
        self.taken = taken
        self.withs: dict[str, None] = {}
        self.renamed: dict[str, str] = {}
        self.types: dict[str, list[str]] = {}
        self.root = _Refined()

    def add(self, wire: ConnectionInstance, size_bytes: int) -> bool:
        """Note the size of what a connection carries; whether AADL can say it by a type of the sending port.

        `size_bytes` is the size in the design. False where the port has no data type, or a component on the way cannot
        be refined; the size is then stated in another way.
        """
        component = wire.source
        if component is None or len(wire.source_path) != 1:
            return False
        way = [component, *component.around()][-2::-1]
        leaf = self.model.features.leaf(component, wire.source_path)
        data = None if leaf is None else self._data_type(leaf)
        if leaf is None or data is None or any(not _is_plain(item) for item in way):
            return False
        called = self._sized(data, size_in_units(size_bytes))
        item = leaf.member.item
        line = f"{item.name} : refined to {item.direction} {item.kind} {called};"
        here = self.root
        for one in way:
            here = here.inner.setdefault(one, _Refined())
        return here.ports.setdefault(item.name, line) == line

    def _data_type(self, leaf: Leaf) -> Classifier | None:
        """The data type of a port; None where it has none, or an implementation, of which there can be no other."""
        if leaf.member.item.classifier is None or leaf.member.item.dimensions:
            return None
        flat = self.model.flattener.resolve(leaf.member.item.classifier, leaf.member.package, leaf.around)
        classifier = None if flat is None else flat.classifier
        return (
            None if classifier is None or classifier.is_implementation or classifier.category != "data" else classifier
        )

    def _sized(self, data: Classifier, size: str) -> str:
        """The implementation of a data type that has a size, which is declared where it is not yet."""
        title = f"{data.package}::{data.name}"
        if title not in self.renamed:
            self.withs[data.package] = None
            self.renamed[title] = identifier(data.name, self.taken)
        name = f"{self.renamed[title]}.{'_'.join(reversed(size.lower().split()))}"
        declared = [f"  data implementation {name}", "    properties", f"      Data_Size => {size};"]
        self.types[name] = [*declared, f"  end {name};", ""]
        return name

    @property
    def components(self) -> set[Instance]:
        """The subcomponents of the root that become others."""
        return set(self.root.inner)

    def refined(self) -> Iterator[str]:
        """The subcomponents of the root, refined; what they need is in `declarations` then.

        Lines such as ``sensor : refined to process ...;``, one for each subcomponent with a changed port.
        """
        for component, there in self.root.inner.items():
            yield self._line(component, there)

    def declarations(self) -> list[str]:
        """The lines of the package before its system: data types, then components, those within others first.

        Lines of AADL, to be written after `refined` was consumed.
        """
        aliases = [f"  {alias} renames data {title};" for title, alias in self.renamed.items()]
        lines = [line for declared in self.types.values() for line in declared]
        return [*aliases, *([""] if aliases else []), *lines]

    def _line(self, component: Instance, there: _Refined) -> str:
        name = self._declared(component, there)
        return f"{component.name} : refined to {component.category} {name} {SUBSTITUTION};"

    def _declared(self, component: Instance, there: _Refined) -> str:
        """The name of a classifier that extends that of a component, with refined ports and subcomponents."""
        flat = component.flat
        assert flat is not None
        inner = [self._line(one, node) for one, node in there.inner.items()]
        own, base = flat.classifier, _type_of(flat)
        name = identifier(f"{base.name}_{component.name}", self.taken)
        self.withs |= dict.fromkeys((base.package, own.package))
        ports = ["    features", *(f"      {line}" for line in there.ports.values())] if there.ports else []
        lines = [f"  {own.category} {name} extends {base.package}::{base.name}", *ports, f"  end {name};", ""]
        title = name
        if own.is_implementation:
            title = f"{name}.chosen"
            lines += [f"  {own.category} implementation {title} extends {own.package}::{own.name}"]
            lines += ["    subcomponents", *(f"      {line}" for line in inner)] if inner else []
            lines += [f"  end {title};", ""]
        self.types[title] = lines
        return title


def _type_of(flat: Flat) -> Classifier:
    return next(item for item in flat.chain if not item.is_implementation)


def _is_plain(component: Instance) -> bool:
    """Whether a component is no element of an array, and no prototype decides what it is."""
    return component.flat is not None and not component.index and not component.flat.environment
