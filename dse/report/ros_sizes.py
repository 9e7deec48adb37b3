"""Sizes of ROS messages as text for a terminal."""

from __future__ import annotations

from rich.console import Console

from dse.api.ros_sizes import Sizes
from dse.report.plain import plain, plain_table

RULE = "rule: each array is one element, a string 8 bytes, a header 24 (the report's); least: serialised, all empty."


def print_sizes(console: Console, found: Sizes) -> None:
    """Types, then topics."""
    if found.types:
        _print_types(console, found)
    if found.topics:
        table = plain_table(console)
        for name in ("topic", "type", "messages", "least", "mean", "most", "every", "shortest", "longest"):
            table.add_column(name, overflow="fold", justify="left" if name in ("topic", "type") else "right")
        for topic in found.topics:
            gaps = (topic.mean_ns, topic.shortest_ns, topic.longest_ns)
            table.add_row(
                *(plain(topic.name), plain(topic.type), str(topic.count)),
                *(f"{topic.least} B", f"{topic.mean:.6g} B", f"{topic.most} B"),
                *("-" if gap is None else f"{gap / 1e6:.4g} ms" for gap in gaps),
            )
        console.print(table)


def _print_types(console: Console, found: Sizes) -> None:
    table = plain_table(console)
    has_stated = any(item.stated is not None for item in found.types)
    columns = ["type", "rule", "least", *(["with stated lengths"] if has_stated else []), "most"]
    for name in columns:
        table.add_column(name, overflow="fold", justify="left" if name == "type" else "right")
    for item in found.types:
        stated = ["-" if item.stated is None else f"{item.stated} B"] if has_stated else []
        most = "unbounded" if item.most is None else f"{item.most} B"
        table.add_row(plain(item.name), f"{item.rule} B", f"{item.least} B", *stated, most)
    console.print(table)
    how = "ROS 1" if found.distribution.startswith("ros1") else "CDR, with its header of 4 bytes"
    console.print(f"{RULE} Serialised as {how}.", markup=False)
