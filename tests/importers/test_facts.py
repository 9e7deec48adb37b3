"""A trace beside an architecture file: what was seen counts, and where the file says otherwise that is told.

The first system is that of CARET's own sample: of two callbacks of a node the one publishes what the other received.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from tests.helpers.effort import cases
from tests.importers.test_trace import MS, text

Event = tuple[int, int, str, dict[str, Any]]
Parts = Sequence[tuple[str, str, int]]
"""Callbacks: their node, their topic ("" for a timer), and the period of the timer in ms."""


def architecture(parts: Parts, published: dict[str, str], path: Sequence[tuple[str, str, str]] = ()) -> str:
    """CARET's file: for each topic, by node, the callback that is said to publish it (by number, or UNDEFINED)."""
    nodes: dict[str, list[dict[str, Any]]] = {}
    for number, (node, topic, period_ms) in enumerate(parts):
        kind = {"callback_type": "subscription_callback", "topic_name": topic}
        timer = {"callback_type": "timer_callback", "period_ns": period_ms * MS}
        nodes.setdefault(node, []).append({"callback_name": f"c{number}", **(kind if topic else timer)})
    publishes: dict[str, list[dict[str, Any]]] = {}
    for key, name in published.items():
        node, topic = key.split(" ")
        publishes.setdefault(node, []).append({"topic_name": topic, "callback_names": [name]})
    chain = [{"node_name": node, "subscribe_topic_name": into, "publish_topic_name": out} for into, node, out in path]
    listed = [
        {"node_name": node, "callbacks": callbacks, "publishes": publishes.get(node, [])}
        for node, callbacks in nodes.items()
    ]
    named = [{"path_name": "target", "node_chain": chain}] if path else []
    return yaml.safe_dump({"named_paths": named, "executors": [], "nodes": listed})


def events(parts: Parts, published: dict[str, int], times_ms: Sequence[int], cpu: int = 0) -> Iterator[Event]:
    """A trace in which each callback runs three times, and publishes: by node and topic, which callback it is."""
    names = list(dict.fromkeys(node for node, _, _ in parts))
    for node in names:
        handle = {"node_handle": names.index(node), "node_name": node[1:], "namespace": "/"}
        yield 0, 1, "rcl_node_init", {**handle, "cpu_id": cpu}
    for number, key in enumerate(published):
        node, topic = key.split(" ")
        yield (
            0,
            1,
            "rcl_publisher_init",
            {"publisher_handle": number, "node_handle": names.index(node), "topic_name": topic},
        )
    for number, (node, topic, period_ms) in enumerate(parts):
        own, at = 100 + number, {"node_handle": names.index(node)}
        if topic:
            yield 0, 1, "rcl_subscription_init", {"subscription_handle": own, "topic_name": topic, **at}
            yield 0, 1, "rclcpp_subscription_init", {"subscription_handle": own, "subscription": own + 1000}
            yield 0, 1, "rclcpp_subscription_callback_added", {"subscription": own + 1000, "callback": own + 2000}
        else:
            yield 0, 1, "rcl_timer_init", {"timer_handle": own, "period": period_ms * MS}
            yield 0, 1, "rclcpp_timer_callback_added", {"timer_handle": own, "callback": own + 2000}
            yield 0, 1, "rclcpp_timer_link_node", {"timer_handle": own, **at}
    for turn in range(3):
        for number, (_, _, period_ms) in enumerate(parts):
            begin = ((turn * period_ms or turn * 1000) + number * 20) * MS + turn * 10**10
            callback = {"callback": 2100 + number}
            yield begin, 10 + number, "callback_start", callback
            for place, by in enumerate(published.values()):
                if by == number:
                    yield begin + 1, 10 + number, "rcl_publish", {"publisher_handle": place}
            yield begin + times_ms[number] * MS, 10 + number, "callback_end", callback


def put(folder: Path, name: str, content: str) -> Path:
    (folder / name).write_text(content, encoding="utf-8")
    return folder / name


SAMPLE: Parts = (
    ("/sensor", "", 50),
    ("/filter", "/topic1", 0),
    ("/message_driven", "/topic2", 0),
    ("/message_driven", "/drive", 0),
    ("/timer_driven", "/topic3", 0),
    ("/timer_driven", "", 150),
    ("/actuator", "/topic4", 0),
    ("/drive_node", "", 200),
)
SAID = {
    **{"/sensor /topic1": "c0", "/filter /topic2": "c1", "/message_driven /topic3": "UNDEFINED"},
    **{"/timer_driven /topic4": "UNDEFINED", "/drive_node /drive": "c7"},
}
SEEN = {
    **{"/sensor /topic1": 0, "/filter /topic2": 1, "/message_driven /topic3": 3},
    **{"/timer_driven /topic4": 5, "/drive_node /drive": 7},
}
PATH = [
    ("UNDEFINED", "/sensor", "/topic1"),
    ("/topic1", "/filter", "/topic2"),
    ("/topic2", "/message_driven", "/topic3"),
    ("/topic3", "/timer_driven", "/topic4"),
    ("/topic4", "/actuator", "UNDEFINED"),
]
TIMES_MS = [1, 2, 3, 4, 5, 6, 7, 8]


@pytest.mark.parametrize("form", ["beside", "times", "before"])
@pytest.mark.parametrize("said", ["UNDEFINED", "c2"])
def test_who_publishes_is_what_the_trace_shows(form: str, said: str, tmp_path: Path) -> None:
    """The path waits for /drive, 200 ms, and for the timer, 150 ms; by the file the callback of /topic2 sends /topic3.

    In all 1 + 2 + 3 ms to the stored /topic2, 200 ms and the 4 ms of the callback that sends it on, 5 ms to the stored
    /topic3, 150 ms and 6 ms, and 7 ms: 378 ms.
    """
    file = put(tmp_path, "arch.yaml", architecture(SAMPLE, {**SAID, "/message_driven /topic3": said}, PATH))
    trace = put(tmp_path, "trace.txt", text(sorted(events(SAMPLE, SEEN, TIMES_MS), key=lambda item: item[0])))
    files = {"beside": [file, trace], "before": [trace, file], "times": [file]}[form]
    found = dse.import_file(files, times=[trace] if form == "times" else ())
    [flow] = dse.analyse(dse.loads(found.text), processing="execution_time").flows
    assert flow.max_ns == 378 * MS
    told = [str(item) for item in found.remarks if "by the trace" in str(item)]
    assert len(told) == (3 if said == "c2" else 2)
    for item, topic in zip(told[-2:], ("/topic3", "/topic4"), strict=True):
        assert "is taken to leave its data for" in item and f"which publishes {topic} by the trace" in item
    if said == "c2":
        assert "/message_driven/c2 publishes /topic3 by this file, /message_driven/c3 by the trace" in told[0]
    alone = dse.import_file(file)
    assert "flows" not in yaml.safe_load(alone.text)
    assert any("the path is left out: nothing leads through /timer_driven" in str(item) for item in alone.remarks)


def test_the_period_and_the_cores_are_those_of_the_trace(tmp_path: Path) -> None:
    parts: Parts = (("/cam", "", 20), ("/cam", "/stop", 0))
    file = put(tmp_path, "arch.yaml", architecture((("/cam", "", 50), *parts[1:]), {}))
    trace = put(tmp_path, "trace.txt", text(events(parts, {}, [1, 1])).replace("cpu_id = 0", "cpu_id = 5"))
    for files, times in (([file, trace], ()), ([file], [trace])):
        found = dse.import_file(files, times=times)
        data = yaml.safe_load(found.text)
        assert data["threads"]["cam.c0"]["period"] == "20 ms"
        [kind] = data["processor_types"].values()
        assert kind["cores"] == 6 and "1 seen, CPUs up to number 5, counted from 0" in kind["source"]
        [told] = [str(item) for item in found.remarks if "the trace counts" in str(item)]
        assert "threads.cam.c0.period: 50 ms (arch.yaml:" in told and "but 20 ms (trace.txt" in told
        assert "compute_execution_time" in data["threads"]["cam.c0"]
    one = yaml.safe_load(dse.import_file([file, trace], cores="2").text)
    assert one["processor_types"]["computer_type"]["cores"] == 2


def test_a_launch_file_learns_who_publishes(tmp_path: Path) -> None:
    remaps = "".join(f'<remap from="input/{end}" to="/{end}"/>' for end in "ab")
    file = put(
        tmp_path,
        "a.launch.xml",
        f"""<launch>
<node pkg="p" exec="e" name="mix">{remaps}<remap from="output/c" to="/c"/></node>
<node pkg="p" exec="e" name="last"><remap from="input/c" to="/c"/></node></launch>""",
    )
    parts: Parts = (("/mix", "/a", 0), ("/mix", "/b", 0), ("/last", "/c", 0))
    trace = put(tmp_path, "trace.txt", text(events(parts, {"/mix /c": 1}, [1, 1, 1])))
    wires = {
        files: yaml.safe_load(dse.import_file(list(files)).text)["connections"] for files in ((file,), (file, trace))
    }
    assert [item["c"]["from"] for item in wires.values()] == ["mix.on.a", "mix.on.b"]


def test_the_own_file_counts_more_than_a_trace(tmp_path: Path) -> None:
    parts: Parts = (("/cam", "", 20),)
    own = put(
        tmp_path,
        "own.yaml",
        """dse: 1
name: own
processor_types: {computer_type: {cores: 2}}
processors: {computer: {type: computer_type}}
threads: {t: {process: cam, processor: computer, period: 50 ms}}
ros2: {nodes: {cam: /cam}}
""",
    )
    trace = put(tmp_path, "trace.txt", text(events(parts, {}, [1])).replace("cpu_id = 0", "cpu_id = 5"))
    found = dse.import_file([own, trace])
    data = yaml.safe_load(found.text)
    assert data["threads"]["t"]["period"] == "50 ms" and data["processor_types"]["computer_type"]["cores"] == 2
    told = [str(item) for item in found.remarks if "the file that is named first counts" in str(item)]
    assert len(told) == 2


@pytest.mark.parametrize("seed", cases(12))
def test_drawn_systems_have_the_publishers_of_the_trace(seed: int, tmp_path: Path) -> None:
    """Nodes with several callbacks: whatever the file says of who publishes, the connections are those of the trace."""
    rng = random.Random(f"facts/{seed}")
    parts: list[tuple[str, str, int]] = []
    seen: dict[str, int] = {}
    said: dict[str, str] = {}
    topics: list[str] = []
    for node in range(rng.randint(2, 4)):
        first = len(parts)
        parts += [(f"/n{node}", "", 10 * (number + 1) + node) for number in range(rng.randint(1, 2))]
        parts += [(f"/n{node}", topic, 0) for topic in rng.sample(topics, min(len(topics), rng.randint(0, 2)))]
        for number in range(rng.randint(1, 2)):
            topic = f"/t{node}_{number}"
            topics.append(topic)
            seen[f"/n{node} {topic}"] = rng.randrange(first, len(parts))
            said[f"/n{node} {topic}"] = rng.choice(["UNDEFINED", f"c{rng.randrange(first, len(parts))}"])
    file = put(tmp_path, "arch.yaml", architecture(parts, said))
    trace = put(tmp_path, "trace.txt", text(sorted(events(parts, seen, [1] * len(parts)), key=lambda item: item[0])))
    wanted = {
        (f"n{parts[by][0][2:]}.c{by}", f"n{node[2:]}.c{number}")
        for number, (node, topic, _) in enumerate(parts)
        for key, by in seen.items()
        if topic and key.endswith(f" {topic}")
    }
    for files, times in (([file, trace], ()), ([file], [trace])):
        found = dse.import_file(files, times=times)
        wires = yaml.safe_load(found.text).get("connections", {}).values()
        assert {(body.get("from"), body["to"]) for body in wires} == wanted
        wrong = [key for key, name in said.items() if name not in ("UNDEFINED", f"c{seen[key]}")]
        assert sum("by the trace: the trace counts" in str(item) for item in found.remarks) == len(wrong)
