"""CARET's architecture files: nodes, callbacks, callback groups, executors, and paths through them.

Format: the documentation of CARET (tier4.github.io/caret_doc, "Architecture file").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.importers.registry import PUBLISHERS, Imported
from dse.importers.ros2.system import CALL_HINT, Callback, Group, Message, System, SystemWriter, seen_among
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue

UNDEFINED = "UNDEFINED"
WHAT = "an architecture file of CARET"
SAME_STAMP = "inherit_unique_stamp"
"""The context of a message that has the stamp of one that was subscribed to."""


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the problem that an architecture file describes.

    Raises
    ------
    ProblemError
        with every mistake and its line.
    UsageError
        when an option is wrong.
    """
    file = LocatedFile(path, WHAT)
    reader = _Reader(file, options.get(PUBLISHERS, {}))
    system = reader.system()
    file.check()
    return SystemWriter(file, system, options, "CARET architecture").imported()


class _Reader:
    """Reads one architecture file; `seen` are callbacks that a trace shows to publish a topic (`PUBLISHERS`)."""

    def __init__(self, file: LocatedFile, seen: Mapping[tuple[str, str], Sequence[str]]) -> None:
        self.file, self.seen = file, seen
        self.callbacks: dict[tuple[str, str], Callback] = {}
        self.groups: dict[str, Group] = {}
        self.subscribed: dict[tuple[str, str], list[Callback]] = {}
        self.published: dict[tuple[str, str], list[Callback]] = {}
        self.publishes: dict[tuple[str, str], LocatedValue] = {}
        self.kept: dict[tuple[int, int], Message] = {}
        self.left_out: set[tuple[str, str]] = set()
        self.found = System()

    def system(self) -> System:
        """All of it; mistakes are noted in the file."""
        nodes = list(self.file.root["nodes"])
        if not nodes:
            self.file.wrong(self.file.root["nodes"], f"expected `nodes`, as {self.file.what} has them")
            return self.found
        for node in nodes:
            self._node(node)
        self.file.check()
        for node in nodes:
            self._passings(node)
        for node in nodes:
            self._publishers(node)
        self._executors()
        self._topics()
        for node in nodes:
            self._contexts(node)
        for path in self.file.root["named_paths"]:
            self._named_path(path)
        return self.found

    # --- nodes

    def _node(self, node: LocatedValue) -> None:
        name = self.file.needed(node, "node_name")
        for item in node["callbacks"]:
            self._callback(name, item)
        grouped: set[int] = set()
        for item in node["callback_groups"]:
            group = Group(self.file.needed(item, "callback_group_name"), [], item)
            group.is_reentrant = item["callback_group_type"].text == "reentrant"
            for member in item["callback_names"]:
                one = self.callbacks.get((name, member.text))
                if one is None and member.text != UNDEFINED and (name, member.text) not in self.left_out:
                    self.file.wrong(member, f"{name} has no callback {member.text!r}")
                elif one is not None:
                    group.callbacks.append(one)
                    grouped.add(id(one))
            self.groups[group.name] = group
            if group.callbacks:
                self.found.groups.append(group)
        for (of, title), one in self.callbacks.items():
            if of == name and id(one) not in grouped:
                self.found.groups.append(Group(title, [one], one.place))

    def _callback(self, node: str, item: LocatedValue) -> None:
        name = self.file.needed(item, "callback_name")
        kind = (item["callback_type"].text or item["type"].text).removesuffix("_callback")
        if kind not in ("timer", "subscription"):
            if kind != "service":
                self.file.wrong(item, f"expected timer_callback or subscription_callback, got {kind[:40]!r}")
            self.left_out.add((node, name))
            text = f"{name} of {node} is left out: nothing says who calls a service, and how often"
            self.file.remark(item, text, CALL_HINT)
            return
        full = name if name.startswith("/") else f"{node}/{name}"
        if (node, name) in self.callbacks:
            full = f"{full}_{item['construction_order'].text or 'again'}"
        one = Callback(full, node, item)
        if kind == "timer":
            one.period_ns = self.file.whole(item, "period_ns", 1)
        else:
            one.topic = self.file.needed(item, "topic_name")
            self.subscribed.setdefault((node, one.topic), []).append(one)
        key = (node, name) if (node, name) not in self.callbacks else (node, full)
        self.callbacks[key] = one

    def _passings(self, node: LocatedValue) -> None:
        name = node["node_name"].text
        for item in node["variable_passings"]:
            ends = [item[key].text for key in ("callback_name_write", "callback_name_read")]
            if UNDEFINED in ends or not all(ends):
                continue
            missing = [end for end in ends if (name, end) not in self.callbacks]
            for end in missing:
                self.file.wrong(item, f"{name} has no callback {end!r}")
            if not missing:
                write, read = (self.callbacks[name, end] for end in ends)
                self._keep(write, read, item, "variable passing")

    def _keep(self, write: Callback, read: Callback, place: LocatedValue, words: str) -> Message:
        """Add the data that one callback of a node leaves for another to read."""
        key = (id(write), id(read))
        if key not in self.kept:
            self.kept[key] = Message(f"{write.name}/to/{read.name.rpartition('/')[2]}", place, write, read, True, words)
            self.found.wires.append(self.kept[key])
        return self.kept[key]

    # --- who publishes what

    def _publishers(self, node: LocatedValue) -> None:
        name = node["node_name"].text
        for item in node["publishes"]:
            topic = self.file.needed(item, "topic_name")
            self.publishes[name, topic] = item
            names = [member.text for member in item["callback_names"] if member.text != UNDEFINED]
            stated = [self.callbacks[name, one] for one in names if (name, one) in self.callbacks]
            for one in names:
                if (name, one) not in self.callbacks and (name, one) not in self.left_out:
                    self.file.wrong(item, f"{name} has no callback {one!r}")
            own = [one for (of, _), one in self.callbacks.items() if of == name]
            seen = seen_among(own, self.seen.get((name, topic), ()))
            if seen and stated and {*map(id, seen)} != {*map(id, stated)}:
                ours, theirs = (", ".join(one.name for one in of) for of in (stated, seen))
                self.file.remark(
                    item, f"{ours} publishes {topic} by this file, {theirs} by the trace: the trace counts"
                )
            self.published[name, topic] = seen or stated or self._guessed(node, topic, item)

    def _guessed(self, node: LocatedValue, topic: str, item: LocatedValue) -> list[Callback]:
        """Who publishes a topic of which the file does not say it.

        The only callback, the only timer, or that of the topic from which a path or a message context leads to it.
        """
        name = node["node_name"].text
        own = [one for (of, _), one in self.callbacks.items() if of == name]
        timers = [one for one in own if one.period_ns is not None]
        if not own:
            return []
        guessed = own if len(own) == 1 else timers if len(timers) == 1 else []
        for path in self.file.root["named_paths"]:
            for step in path["node_chain"]:
                if not guessed and step["node_name"].text == name and step["publish_topic_name"].text == topic:
                    guessed = self.subscribed.get((name, step["subscribe_topic_name"].text), [])
        for context in node["message_contexts"]:
            if not guessed and context["publisher_topic_name"].text == topic:
                guessed = self.subscribed.get((name, context["subscription_topic_name"].text), [])
        if not guessed:
            self.file.remark(item, f"nothing says which callback of {name} publishes {topic}: it is left out")
        elif len(own) > 1:
            hint = "state it under callback_names"
            self.file.remark(item, f"{guessed[0].name} is taken for what publishes {topic}", hint)
        return guessed[:1]

    # --- executors, topics

    def _executors(self) -> None:
        used: set[str] = set()
        for item in self.file.root["executors"]:
            name = self.file.needed(item, "executor_name")
            kind = item["executor_type"].text.removesuffix("_executor")
            groups = []
            for member in item["callback_group_names"]:
                if member.text not in self.groups:
                    self.file.wrong(member, f"there is no callback group {member.text!r}")
                elif member.text in used:
                    self.file.wrong(member, f"{member.text!r} is of two executors")
                else:
                    used.add(member.text)
                    groups.append(self.groups[member.text])
            groups = [group for group in groups if group.callbacks]
            if kind == "single_threaded" and groups:
                self.found.executors.append((name, groups))
                continue
            if kind == "multi_threaded":
                self.file.remark(
                    item, f"{name} has several threads: it counts as if it had one for each of its callback groups"
                )
            elif kind not in ("callback_isolated", "single_threaded"):
                self.file.remark(item, f"{name}: {kind[:40]!r} counts as a thread for each of its callback groups")
            for group in groups:
                group.is_isolated = kind == "callback_isolated" and not group.is_reentrant
                if group.is_reentrant:
                    self.file.remark(
                        group.place, f"{group.name} is reentrant: each of its callbacks counts as a thread"
                    )
                else:
                    self.found.executors.append((group.name, [group]))

    def _topics(self) -> None:
        """A connection from each callback that publishes a topic to each that it runs."""
        sources: dict[str, list[Callback]] = {}
        for (_, topic), callbacks in self.published.items():
            sources.setdefault(topic, []).extend(callbacks)
        for (node, topic), targets in self.subscribed.items():
            several = sum(of == topic for _, of in self.subscribed) * max(1, len(sources.get(topic, []))) > 1
            for target in targets:
                known: list[Callback | None] = [*sources.get(topic, [])]
                for source in known or [None]:
                    ends = f"{source.node if source is not None else ''}{node}" if several else ""
                    self.found.wires.append(
                        Message(f"{topic}{ends}", target.place, source, target, words=f"topic {topic}")
                    )
                if not sources.get(topic):
                    hint = "state the `rate` of that connection, or give --rate"
                    self.file.remark(target.place, f"nothing in the file publishes {topic}", hint)

    def _contexts(self, node: LocatedValue) -> None:
        """What a message context connects: the callback of a topic leaves its data for that which publishes another.

        Where what is published has the stamps of messages of several topics, one of each, they wait for each other.
        """
        name = node["node_name"].text
        together: dict[str, list[str]] = {}
        for item in node["message_contexts"]:
            if item["context_type"].text == SAME_STAMP:
                topics = together.setdefault(item["publisher_topic_name"].text, [])
                topics.append(item["subscription_topic_name"].text)
        for item in node["message_contexts"]:
            topics = [item[key].text for key in ("subscription_topic_name", "publisher_topic_name")]
            if item["context_type"].text in ("", UNDEFINED) or not all(topics):
                continue
            for read in self.published.get((name, topics[1]), []):
                joined = dict.fromkeys(together.get(topics[1], ()))
                joins = len(joined) > 1 and (read.period_ns is not None or read.topic in joined)
                if joins and not read.joins:
                    read.joins = True
                    words = f"{read.name} waits for a message of each of {', '.join(joined)}, whose stamps it passes on"
                    self.file.remark(item, words, "leave `join` out where any of them is enough")
                for write in self.subscribed.get((name, topics[0]), []):
                    if write is read:
                        continue
                    way = self._leads(write, read)
                    wire = (
                        way[-1]
                        if way
                        else self._keep(write, read, item, f"message context {item['context_type'].text}")
                    )
                    wire.dispatches = wire.dispatches or (joins and topics[0] in joined)

    def _leads(self, write: Callback, read: Callback) -> list[Message]:
        """The variable passings that lead from one callback to another of its node; none where nothing does."""
        ways: list[tuple[Callback, list[Message]]] = [(write, [])]
        seen = {id(write)}
        while ways:
            at, way = ways.pop(0)
            for wire in self.kept.values():
                if wire.source is at and id(wire.target) not in seen:
                    if wire.target is read:
                        return [*way, wire]
                    seen.add(id(wire.target))
                    ways.append((wire.target, [*way, wire]))
        return []

    # --- paths

    def _named_path(self, path: LocatedValue) -> None:
        name = self.file.needed(path, "path_name")
        steps = list(path["node_chain"])
        parts: list[Callback | Message] = []
        before = ""
        for number, step in enumerate(steps):
            part = self._step(step, parts, before, is_last=number == len(steps) - 1)
            if part is None:
                return
            parts += part
            before = step["publish_topic_name"].text
        if len([item for item in parts if isinstance(item, Callback)]) < 2:
            self.file.remark(path, f"the path {name} is left out: it has fewer than two callbacks")
            return
        self.found.flows[name] = (path, parts)

    def _step(
        self, step: LocatedValue, so_far: list[Callback | Message], before: str, *, is_last: bool
    ) -> list[Callback | Message] | None:
        """The callbacks and connections of a path in one node; None where it leads nowhere, with a remark."""
        node, topic = step["node_name"].text, step["publish_topic_name"].text
        leaving = self.published.get((node, topic), []) if topic not in ("", UNDEFINED) else []
        if not is_last and not leaving:
            self._lost(step, f"nothing says which callback of {node} publishes {topic or 'its topic'}")
            return None
        if not so_far:
            return list(leaving[:1])
        last = so_far[-1]
        for wire in self.found.wires:
            if wire.source is last and not wire.is_kept and wire.target.node == node and wire.target.topic == before:
                arriving = wire.target
                if not leaving or arriving in leaving:
                    return [wire, arriving]
                way = next((way_on for one in leaving if (way_on := self._leads(arriving, one))), [])
                if not way and (node, topic) in self.seen:
                    words = f"{arriving.name} is taken to leave its data for {leaving[0].name}, which publishes {topic}"
                    self.file.remark(step, f"{words} by the trace: a path leads through both")
                    way = [self._keep(arriving, leaving[0], step, "by a path and the trace")]
                if way:
                    return [wire, arriving, *(part for hop in way for part in (hop, hop.target))]
        ends = f"{before or 'the node before'} to {topic or 'its end'}"
        self._lost(step, f"nothing leads through {node} from {ends}")
        return None

    def _lost(self, step: LocatedValue, words: str) -> None:
        self.file.remark(step, f"the path is left out: {words}", "a message context, or a variable passing, may say it")
