"""The reference of every field in docs/formats.md: `python -m tests.helpers.formats` writes it anew."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from dse.answers.forms.registry import FORMS, form_schema

PAGE = Path(__file__).parents[2] / "docs" / "formats.md"
MARK = "<!-- the rest of this page is made of the schemas: python -m tests.helpers.formats -->\n"
EXACT = "exact number"


def page(text: str) -> str:
    """The page with its reference as the schemas say."""
    head, mark, _ = text.partition(MARK)
    assert mark, f"{PAGE.name} has lost its mark"
    return head + mark + "".join(map(_format, FORMS))


def _format(name: str) -> str:
    schema = form_schema(name)
    parts = schema["$defs"]
    found = f"\n## dse-{name}/1\n\n{schema['description']}\n"
    found += f"`dse schema --of {name}` prints its JSON Schema.\n"
    order: list[str] = []
    for part in [schema] if "properties" in schema else schema["anyOf"]:
        _collect(part, parts, order)
    if "properties" in schema:
        found += _table(schema)
    return found + "".join(
        f"\n**{part}**: {_line(parts[part]['description'])}\n{_table(parts[part])}" for part in order
    )


def _collect(part: Any, parts: dict[str, Any], order: list[str]) -> None:
    """The parts that a part names, and those that these name, in the order in which a reader meets them."""
    names = re.findall(r"'#/\$defs/(\w+)'", str(part))
    new = [name for name in dict.fromkeys(names) if name not in order]
    order += new
    for name in new:
        _collect(parts[name], parts, order)


def _table(part: dict[str, Any]) -> str:
    required = part.get("required", ())
    rows = [
        f"| `{key}` | {_kind(item)}{'' if key in required else ', may be missing'} | {_line(item['description'])} |\n"
        for key, item in part["properties"].items()
    ]
    return "\n| field | holds | meaning |\n|---|---|---|\n" + "".join(rows)


def _line(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())


def _kind(item: dict[str, Any]) -> str:
    if "$ref" in item:
        return str(item["$ref"].rpartition("/")[2])
    if "const" in item:
        return f"`{_plain(item['const'])}`"
    if "enum" in item:
        return " or ".join(f"`{_plain(value)}`" for value in item["enum"])
    if "anyOf" in item:
        kinds = [_kind(one) for one in item["anyOf"]]
        if kinds[:2] == ["integer", "text"]:
            kinds[:2] = [EXACT]
        return " or ".join(kinds)
    if item["type"] == "array":
        return f"list of {_kind(item['items'])}"
    if item["type"] == "object":
        return f"name → {_kind(item['additionalProperties'])}"
    return {"string": "text", "boolean": "true or false"}.get(item["type"], str(item["type"]))


def _plain(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
