"""Sizes of ROS messages as a page."""

from __future__ import annotations

from collections.abc import Iterator

from dse.questions.verbs.sizes import Sizes
from dse.report.page import Block, Page, Section, Table, texts

RULE = "rule: each array is one element, a string 8 bytes, a header 24 (the report's); least: serialised, all empty."


def sizes_page(sizes: Sizes) -> Page:
    """Types, then topics.

    A table of message types with their sizes in bytes, and one of topics, each where the answer has some.
    """
    sections = []
    if sizes.types:
        sections.append(Section("types", "Types of messages", tuple(_types(sizes))))
    if sizes.topics:
        sections.append(Section("topics", "Topics", (_topics(sizes),)))
    return Page("Sizes of ROS messages", "", tuple(sections))


def _topics(sizes: Sizes) -> Table:
    rows = []
    for topic in sizes.topics:
        gaps = (topic.mean_ns, topic.shortest_ns, topic.longest_ns)
        rows.append(
            (
                *(topic.name, topic.type, str(topic.count)),
                *(f"{topic.least} B", f"{topic.mean:.6g} B", f"{topic.most} B"),
                *("-" if gap is None else f"{gap / 1e6:.4g} ms" for gap in gaps),
            )
        )
    headings = ("topic", "type", "messages", "least", "mean", "most", "every", "shortest", "longest")
    return Table("", headings, tuple(rows), tuple(range(2, len(headings))))


def _types(sizes: Sizes) -> Iterator[Block]:
    has_stated = any(item.stated is not None for item in sizes.types)
    headings = ("type", "rule", "least", *(["with stated lengths"] if has_stated else []), "most")
    rows = []
    for item in sizes.types:
        stated = ["-" if item.stated is None else f"{item.stated} B"] if has_stated else []
        most = "unbounded" if item.most is None else f"{item.most} B"
        rows.append((item.name, f"{item.rule} B", f"{item.least} B", *stated, most))
    yield Table("", headings, tuple(rows), tuple(range(1, len(headings))))
    how = "ROS 1" if sizes.distribution.startswith("ros1") else "CDR, with its header of 4 bytes"
    yield from texts(f"{RULE} Serialised as {how}.")
