"""An AADL package as text, from the parts that it declares."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from dse.importers.aadl.property_set import OURS


@dataclass
class ComponentDraft:
    """A component under construction: its type's features and flows, and what its implementation has.

    Lists hold lines of AADL without indentation, in the order in which they were added; `package_text` puts them
    together.
    """

    name: str
    category: str
    own: str
    parent: str = ""
    features: list[str] = field(default_factory=list)
    flows: list[str] = field(default_factory=list)
    properties: list[str] = field(default_factory=list)
    subcomponents: list[str] = field(default_factory=list)
    connections: list[str] = field(default_factory=list)
    flow_implementations: list[str] = field(default_factory=list)


def kind_of(entry: str, leaving: str) -> str:
    """The kind of a flow specification, with its ends.

    ``path A -> B`` with both ends, ``sink A`` or ``source B`` with one.
    """
    if entry and leaving:
        return f"path {entry} -> {leaving}"
    return f"sink {entry}" if entry else f"source {leaving}"


def section_lines(name: str, lines: Iterable[str]) -> list[str]:
    """A section of a declaration; nothing where it would be empty.

    Indented lines below the name of the section, such as ``features``.
    """
    section = [f"      {line}" for line in lines]
    return [f"    {name}", *section] if section else []


def package_text(
    package: str, types: Iterable[str], parts: Iterable[ComponentDraft], wholes: Sequence[ComponentDraft]
) -> str:
    """The package of `types`, then `parts`, then those with an implementation, of which the last is the system.

    AADL source with ``with SEI`` and dse's own property set. Every draft of `wholes` gets an implementation ``NAME.i``.
    """
    lines = [f"package {package}", "public", f"  with SEI, {OURS};", "", *types]
    for part in parts:
        lines += [f"  {part.category} {part.name}", *section_lines("features", part.features)]
        lines += [*section_lines("flows", part.flows), *section_lines("properties", part.properties)]
        lines += [f"  end {part.name};", ""]
    for part in wholes:
        name = part.name if part is not wholes[-1] else f"{package}_system"
        lines += [f"  {part.category} {name}", *section_lines("features", part.features)]
        lines += [*section_lines("flows", part.flows), f"  end {name};", ""]
        lines += [f"  {part.category} implementation {name}.i", *section_lines("subcomponents", part.subcomponents)]
        lines += section_lines("connections", part.connections)
        lines += section_lines("flows", part.flow_implementations)
        lines += [*section_lines("properties", part.properties), f"  end {name}.i;", ""]
    return "\n".join([*lines, f"end {package};"]) + "\n"
