"""Edits to a YAML text that leave everything else, comments above all, as it stands.

A `YamlDocument` holds the text with the marks of its nodes. Edits are collected, must not overlap, and are
applied together.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from dse.spec.loading.writing import yaml_text


class YamlDocument:
    """A YAML document under revision; paths are keys and positions from the root.

    Positions of nodes come from PyYAML's marks. Edits are collected and applied together by `result`.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.root: Any = yaml.compose(text, Loader=yaml.SafeLoader)
        self._edits: list[tuple[int, int, str]] = []
        self._tail: list[str] = []
        self._uses: dict[int, int] = {}
        self._count(self.root, set())

    def _count(self, node: Any, above: set[int]) -> None:
        """How often each collection is met: more than once where aliases lead to it."""
        self._uses[id(node)] = self._uses.get(id(node), 0) + 1
        if self._uses[id(node)] > 1 or id(node) in above:
            return
        children = [part for pair in node.value for part in pair] if isinstance(node, yaml.MappingNode) else []
        if isinstance(node, yaml.SequenceNode):
            children = node.value
        for child in children:
            self._count(child, above | {id(node)})

    def find(self, path: Sequence[str | int]) -> Any:
        """The node at a path, or None.

        A node of PyYAML with its marks; None where a key or position of the path is missing.
        """
        node = self.root
        for part in path:
            if isinstance(node, yaml.MappingNode):
                node = next((value for key, value in node.value if key.value == part), None)
            elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
                node = node.value[part]
            else:
                return None
        return node

    def is_shared(self, path: Sequence[str | int]) -> bool:
        """Whether the node at the path, or one above it, is there more than once by an alias.

        Editing such a node would change every place that refers to it.
        """
        return any(self._uses.get(id(self.find(path[:depth])), 0) > 1 for depth in range(1, len(path) + 1))

    def choose(self, sequence: Any, position: int) -> None:
        """Put one item in the place of a list; comments inside the list stay.

        `sequence` is a node of PyYAML; the item at `position` becomes the value of its key.
        """
        start, end = sequence.start_mark.index, self._end(sequence)
        kept = sequence.value[position]
        item = self.text[kept.start_mark.index : kept.end_mark.index]
        inside = [self._gap(sequence, number) for number in range(len(sequence.value) + 1)]
        if not any("#" in gap for gap in inside):
            self._edits.append((start, end, item if sequence.flow_style else f"  {item}"))
            return
        parts = []
        for number, gap in enumerate(inside):
            parts.append(_without_delimiters(gap))
            if number == position:
                parts.append(item)
        lines = "".join(parts).splitlines()
        self._edits.append((start, end, "\n".join(line.rstrip() for line in lines if line.strip() or line is lines[0])))

    def replace(self, path: Sequence[str | int], text: str) -> None:
        """Put `text` in the place of a scalar.

        `path` must lead to a scalar; `text` is YAML that fits in one line.
        """
        node = self.find(path)
        self._edits.append((node.start_mark.index, node.end_mark.index, text))

    def append_items(self, key: str, items: Sequence[str]) -> None:
        """Further items, each YAML that fits in one line, at the end of a list of the root; made if it is not there.

        Block lists get lines with the list's own indentation, flow lists get items in the line.
        """
        node = self.find([key])
        if node is None or not node.value:
            flow = "[" + ", ".join(items) + "]"
            self.set_section(key, [f"{key}:", *(f"  - {item}" for item in items)], flow, "empty:")
        elif node.flow_style:
            place = node.value[-1].end_mark.index
            self._edits.append((place, place, "".join(f", {item}" for item in items)))
        else:
            indent = " " * node.start_mark.column
            place = self._line_end(self._end(node))
            self._edits.append((place, place, "".join(f"\n{indent}- {item}" for item in items)))

    def add_entry(self, path: Sequence[str | int], key: str, value: str) -> None:
        """A further entry of the mapping at the path; `key` and `value` are YAML that fits in one line.

        The entry gets the indentation of its neighbours, or goes in front of the closing brace.
        """
        node = self.find(path)
        entry = f"{key}: {value}"
        if node.flow_style or not node.value:
            place = self.text.rindex("}", node.start_mark.index, node.end_mark.index)
            before = self.text[node.start_mark.index + 1 : place].split("#")[0].rstrip()
            self._edits.append((place, place, f"{', ' if node.value and not before.endswith(',') else ''}{entry}"))
            return
        indent = " " * node.value[0][0].start_mark.column
        last = node.value[-1][1]
        place = self._line_end(self._end(last))
        self._edits.append((place, place, f"\n{indent}{entry}"))

    def set_section(self, key: str, lines: Sequence[str], flow: str, reason: str) -> None:
        """A new value for a key of the root: what was there becomes a comment, the new lines go to the end.

        `flow` is the value in one line, for a document that is one flow mapping.
        """
        if self.root.flow_style:
            if self.find([key]) is None:
                self.add_entry([], key, flow)
            else:
                node = self.find([key])
                self._edits.append((node.start_mark.index, self._end(node), flow))
            return
        self.drop_section(key, reason)
        if lines:
            self._tail += ["", *lines]

    def drop_section(self, key: str, reason: str) -> None:
        """Turn a key of the root with its value into comments.

        `reason` is written above the comment. Nothing happens where the key does not exist; a document in flow style
        keeps the key with an empty value.
        """
        pair = next((pair for pair in self.root.value if pair[0].value == key), None)
        if pair is None:
            return
        if self.root.flow_style:
            node = pair[1]
            self._edits.append(
                (node.start_mark.index, self._end(node), "[]" if isinstance(node, yaml.SequenceNode) else "{}")
            )
            return
        self._comment_out(pair[0].start_mark.index, self._end(pair[1]), reason)

    def drop_item(self, path: Sequence[str | int], reason: str) -> None:
        """Turn an item of a list into a comment, or take it out of a list in one line.

        `path` leads to the item, `reason` is written above the comment.
        """
        *above, position = path
        sequence = self.find(above)
        item = sequence.value[position]
        if sequence.flow_style:
            start, end = item.start_mark.index, item.end_mark.index
            after = re.match(r"\s*,", self.text[end:])
            self._edits.append((start, end + (after.end() if after else 0), ""))
            return
        start = self.text.rindex("-", 0, item.start_mark.index)
        self._comment_out(start, self._end(item), reason)

    def result(self) -> str:
        """The text with every edit applied.

        Edits are applied from the end of the text to its beginning, so that positions stay valid.
        """
        text = self.text
        for start, end, new in sorted(self._edits, reverse=True):
            text = text[:start] + new + text[end:]
        if self._tail:
            text = text.rstrip("\n") + "\n" + "\n".join(self._tail) + "\n"
        return text

    def _comment_out(self, start: int, end: int, reason: str) -> None:
        first = self.text.rfind("\n", 0, start) + 1
        last = self._line_end(end)
        lines = self.text[first:last].split("\n")
        said = "\n".join(f"# {line}" if line.strip() else "#" for line in lines)
        self._edits.append((first, last, f"# {reason}\n{said}"))

    def _line_end(self, place: int) -> int:
        end = self.text.find("\n", place)
        return len(self.text) if end < 0 else end

    def _end(self, node: Any) -> int:
        """The end of a node's own text: a block collection ends with its last item, not where the next key begins."""
        if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
            return int(node.end_mark.index)
        last = node.value[-1]
        return self._end(last[1] if isinstance(last, tuple) else last)

    def _gap(self, sequence: Any, number: int) -> str:
        """The text before item `number` of a list, since the one before it; after the last item, up to the end."""
        items = sequence.value
        start = items[number - 1].end_mark.index if number else sequence.start_mark.index
        end = items[number].start_mark.index if number < len(items) else self._end(sequence)
        if number == len(items) and not sequence.flow_style:
            return ""
        return self.text[start:end]


def _without_delimiters(gap: str) -> str:
    """The text between two items without brackets, commas and dashes; comments stay."""
    lines = []
    for line in gap.split("\n"):
        code, mark, comment = line.partition("#")
        lines.append(re.sub(r"[\[\],]|-(?=\s|$)", " ", code) + mark + comment)
    return "\n".join(lines)


def flow_mapping(entries: Mapping[str, str]) -> str:
    """``{a: 1, b: 2}`` of texts.

    YAML text in one line, keys and values quoted where needed.
    """
    return "{" + ", ".join(f"{yaml_text(key)}: {yaml_text(value)}" for key, value in entries.items()) + "}"
