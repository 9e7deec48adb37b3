"""Which flows a declared end-to-end flow stands for, and what becomes of those that cannot be followed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.support.errors import UncheckedError
from tests.importers.test_osate_figures import latencies
from tests.importers.test_reading import document, written

TWO_WAYS = """
package m public
  device sensor features o : out event data port; flows f : flow source o {Latency => 1 ms .. 1 ms;}; end sensor;
  device actuator features i : in event data port; flows f : flow sink i {Latency => 1 ms .. 1 ms;}; end actuator;
  system part features i : in event data port; o : out event data port; flows p : flow path i -> o; end part;
  system slow extends part flows p : refined to flow path {Latency => 100 ms .. 100 ms;}; end slow;
  system quick extends part flows p : refined to flow path {Latency => 2 ms .. 2 ms;}; end quick;
  system implementation part.i
    subcomponents a : system slow; b : system quick;
    connections ia : port i -> a.i; ao : port a.o -> o; ib : port i -> b.i; bo : port b.o -> o;
    flows p : flow path i -> ia -> a.p -> ao -> o%s; p : flow path i -> ib -> b.p -> bo -> o%s;
    %s
  end part.i;
  system top end top;
  system implementation top.i
    subcomponents s : device sensor; n : system part.i; z : device actuator;
    connections c : port s.o -> n.i; d : port n.o -> z.i;
    flows e : end to end flow s.f -> c -> n.p -> d -> z.f {Latency => 0 ms .. 50 ms;};
  end top.i;
end m;
"""
MODES = "modes m1 : initial mode; m2 : mode;"


def test_each_implementation_of_a_flow_specification_gives_a_flow(tmp_path: Path) -> None:
    text = TWO_WAYS % ("", "", "")
    assert latencies(tmp_path, text) == {"e_1": (102, 102), "e_2": (4, 4)}
    found = dse.analyse(dse.Model(written(tmp_path, text)))
    assert [(item.requirement.text, item.holds) for item in found.verdicts] == [
        ("latency of e_1 <= 50 ms", False),
        ("latency of e_2 <= 50 ms", True),
    ]


def test_a_flow_over_an_array_is_told_to_follow_its_first_element(tmp_path: Path) -> None:
    """OSATE finds the first element of an array where a flow names the array."""
    text = TWO_WAYS % ("", "", "")
    text = text.replace("s : device sensor;", "s : device sensor[2];").replace(
        "s.o -> n.i;", "s.o -> n.i {Connection_Pattern => ((One_To_All));};"
    )
    told = [item.message for item in dse.load(written(tmp_path, text)).loaded.told]
    assert "the flow e names s, an array: its first element alone, s[1], is followed, as by OSATE" in told
    assert not any(
        "an array" in item.message for item in dse.load(written(tmp_path, TWO_WAYS % ("", "", ""))).loaded.told
    )


@pytest.mark.parametrize(("mode", "expected"), [(None, (102, 102)), ("n.m1", (102, 102)), ("n.m2", (4, 4))])
def test_an_implementation_of_the_mode_counts(mode: str | None, expected: tuple[int, int], tmp_path: Path) -> None:
    text = TWO_WAYS % (" in modes (m1)", " in modes (m2)", MODES)
    assert latencies(tmp_path, text, mode=mode) == {"e": expected}


def test_no_implementation_of_the_mode_leaves_the_flow_out(tmp_path: Path) -> None:
    text = TWO_WAYS % (" in modes (m2)", " in modes (m2)", MODES)
    problem = dse.load(dse.Model(written(tmp_path, text)))
    assert not problem.space.flows and not problem.space.unread
    assert any("the flow e is not there in this mode (flow p of n)" in item.message for item in problem.loaded.told)


def test_implementations_of_an_extended_implementation_stay(tmp_path: Path) -> None:
    more = """
  system implementation part.j extends part.i
    subcomponents g : system quick;
    connections ig : port i -> g.i; go : port g.o -> o;
    flows p : flow path i -> ig -> g.p -> go -> o;
  end part.j;
  system top end top;"""
    text = (
        (TWO_WAYS % ("", "", ""))
        .replace("\n  system top end top;", more)
        .replace("n : system part.i", "n : system part.j")
    )
    assert latencies(tmp_path, text) == {"e_1": (4, 4), "e_2": (102, 102), "e_3": (4, 4)}


GROUPED = """
package m public
  data small properties Data_Size => 1 Bytes; end small;
  data big properties Data_Size => 100 Bytes; end big;
  bus wire properties Transmission_Time => [Fixed => 0 ms .. 0 ms; PerByte => 1 ms .. 1 ms;]; end wire;
  feature group pair features a : out data port small; x : out data port big; end pair;
  device sensor features o : feature group pair; flows f : flow source o {Latency => 1 ms .. 1 ms;}; end sensor;
  device implementation sensor.one flows f : flow source o.x; end sensor.one;
  device actuator features i : feature group inverse of pair; flows f : flow sink i {Latency => 1 ms .. 1 ms;};
  end actuator;
  system top end top;
  system implementation top.i
    subcomponents s : device %s; z : device actuator; w : bus wire;
    connections c : feature group s.o -> z.i {Actual_Connection_Binding => (reference (w));};
    flows e : end to end flow s.f -> c -> z.f {Latency => 0 ms .. 50 ms;};
  end top.i;
end m;
"""


def test_a_flow_over_a_feature_group_is_one_for_each_of_its_features(tmp_path: Path) -> None:
    # 1 + 1 byte or 100 bytes + 1; at most each waits for the other one on the bus, where that is counted
    text = GROUPED % "sensor"
    assert latencies(tmp_path, text, "AS-MF-DL-EQ-DQL") == {"e_1": (3, 3), "e_2": (102, 102)}
    assert latencies(tmp_path, text) == {"e_1": (3, 103), "e_2": (102, 103)}


def test_a_flow_implementation_may_name_one_feature_of_a_group(tmp_path: Path) -> None:
    assert latencies(tmp_path, GROUPED % "sensor.one", "AS-MF-DL-EQ-DQL") == {"e": (102, 102)}


def test_a_flow_over_data_access_is_one_for_each_component_that_is_accessed(tmp_path: Path) -> None:
    text = """
package m public
  data store end store;
  system writer features a : requires data access store; flows f : flow source a {Latency => 1 ms .. 1 ms;}; end writer;
  system reader features a : requires data access store; flows f : flow sink a {Latency => 2 ms .. 2 ms;}; end reader;
  system inner features a : requires data access store; end inner;
  system implementation inner.i
    subcomponents w : system writer; r : system reader;
    connections c : data access w.a -> a; d : data access a -> r.a;
    flows e : end to end flow w.f -> c -> a -> d -> r.f;
  end inner.i;
  system top end top;
  system implementation top.i
    subcomponents one : data store; two : data store; n : system inner.i;
    connections c : data access one <-> n.a; d : data access two <-> n.a;
  end top.i;
end m;
"""
    flows = document(tmp_path, text)["flows"]
    assert {name: flow["path"][2] for name, flow in flows.items()} == {"n.e_1": "one", "n.e_2": "two"}


def test_flows_of_a_flow_of_several_are_composed_of_each(tmp_path: Path) -> None:
    text = (TWO_WAYS % ("", "", "")).replace(
        "flows e : end to end flow s.f -> c -> n.p -> d -> z.f",
        "flows inner : end to end flow n.p -> d -> z.f; e : end to end flow s.f -> c -> inner",
    )
    flows = document(tmp_path, text)["flows"]
    assert {name: flow["path"][-1] for name, flow in flows.items() if name.startswith("e")} == {
        "e_1": "inner_1",
        "e_2": "inner_2",
    }


HOLLOW = """
package m public
  device sensor features o : out event data port; flows f : flow source o {Latency => 1 ms .. 2 ms;}; end sensor;
  process soft features i : in event data port; end soft;
  system home features i : in event data port; flows k : flow sink i {Latency => 5 ms .. 6 ms;}; end home;
  system implementation home.i
    subcomponents p : process soft;
    connections r : port i -> p.i;
    %s
  end home.i;
  system top end top;
  system implementation top.i
    subcomponents s : device sensor; h : system home.i; t : device sensor; z : system home;
    connections c : port s.o -> h.i; d : port t.o -> z.i;
    flows e : end to end flow s.f -> c -> h.k {Latency => 0 ms .. 100 ms;};
      g : end to end flow t.f -> d -> z.k {Latency => 0 ms .. 10 ms;};
  end top.i;
end m;
"""
REASON = (
    "Cannot create end to end flow 'e' because component 'h' has subcomponents but no flow implementation for flow 'k'"
)


def test_a_flow_that_cannot_be_followed_is_no_requirement_that_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(written(tmp_path, HOLLOW % ""))
    assert run(["analyse", path, "--json", str(tmp_path / "a.json")]) == 4
    said = capsys.readouterr()
    assert "UNKNOWN  1 of 2 requirements cannot be checked: latency of e <= 100 ms." in said.out
    assert "meets every requirement" not in said.out and REASON in said.out and REASON in said.err
    found = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert not found["feasible"] and found["flows"]["g"]["max_ns"] == 8_000_000
    assert [(item["requirement"], item["reason"]) for item in found["unread"]] == [("latency of e <= 100 ms", REASON)]


@pytest.mark.parametrize(
    "command",
    [
        ["solve", "--minimise", "price"],
        ["explain"],
        ["sweep", "--vary", "latency of g=8ms,9ms", "--minimise", "price"],
        ["check"],
        ["sensitivity"],
    ],
)
def test_nothing_is_proved_without_such_a_requirement(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verb, *options = command
    assert run([verb, str(written(tmp_path, HOLLOW % "")), *options]) == 3
    said = capsys.readouterr()
    assert f"latency of e <= 100 ms cannot be checked: {REASON}" in said.err
    assert ", proved" not in said.out


def test_the_flow_may_be_stated_or_left_out_on_purpose(tmp_path: Path) -> None:
    name = written(tmp_path, HOLLOW % "").name
    asked = {"dse": 1, "name": "q", "of": name, "objectives": ["minimise price"]}

    def solved(**more: object) -> list[str]:
        file = tmp_path / "q.yaml"
        file.write_text(json.dumps({**asked, **more}), encoding="utf-8")
        return [item.text for item in dse.solve(file).space.requirements]

    with pytest.raises(UncheckedError):
        solved()
    assert solved(unread={}) == ["latency of g <= 10 ms"]
    stated = {"e": {"path": ["s", "h.p"], "latency": "0 ms .. 100 ms"}}
    assert solved(flows=stated) == ["latency of g <= 10 ms", "latency of e <= 100 ms"]


def test_a_written_import_keeps_what_could_not_be_followed(tmp_path: Path) -> None:
    path, target = written(tmp_path, HOLLOW % ""), tmp_path / "out.yaml"
    assert run(["import", str(path), "-o", str(target)]) == 0
    assert [(item.requirement, item.reason) for item in dse.analyse(target).unread] == [
        ("latency of e <= 100 ms", REASON)
    ]


def test_one_way_that_cannot_be_followed_is_told_beside_the_others(tmp_path: Path) -> None:
    text = (TWO_WAYS % ("", "", "")).replace("ib -> b.p -> bo -> o", "ia -> b.p -> bo -> o")
    found = dse.analyse(dse.Model(written(tmp_path, text)))
    assert [flow.name for flow in found.flows] == ["e"]
    assert [item.name for item in found.unread] == ["e"] and not found.is_feasible


def test_the_flow_of_a_thread_through_what_it_calls_is_the_thread(tmp_path: Path) -> None:
    text = """
package m public
  data d end d;
  device sensor features o : out data port d; flows f : flow source o {Latency => 1 ms .. 1 ms;}; end sensor;
  subprogram work features i : in parameter d; o : out parameter d; flows p : flow path i -> o; end work;
  thread t
    features i : in data port d; o : out data port d;
    flows p : flow path i -> o {Latency => 5 ms .. 5 ms;};
  end t;
  thread implementation t.i
    subcomponents w : subprogram work;
    calls main : {call : subprogram w;};
    connections a : parameter i -> call.i; b : parameter call.o -> o;
    flows p : flow path i -> a -> w.p -> b -> o;
  end t.i;
  device actuator features i : in data port d; flows f : flow sink i {Latency => 1 ms .. 1 ms;}; end actuator;
  system top end top;
  system implementation top.i
    subcomponents s : device sensor; t : thread t.i; z : device actuator;
    connections c : port s.o -> t.i; d : port t.o -> z.i;
    flows e : end to end flow s.f -> c -> t.p -> d -> z.f;
  end top.i;
end m;
"""
    assert latencies(tmp_path, text) == {"e": (7, 7)}


# --- properties of connections ------------------------------------------------------------------------------------

NESTED = """
package m public
  bus quick properties Latency => 10 ms .. 10 ms; end quick;
  bus slow properties Latency => 50 ms .. 50 ms; end slow;
  device sensor features o : out event data port; flows f : flow source o {Latency => 1 ms .. 1 ms;}; end sensor;
  device actuator features i : in event data port; flows f : flow sink i {Latency => 1 ms .. 1 ms;}; end actuator;
  system box features o : out event data port; flows f : flow source o; end box;
  system implementation box.i
    subcomponents s : device sensor;
    connections inner : port s.o -> o;
    flows f : flow source s.f -> inner -> o;
    %s
  end box.i;
  system top end top;
  system implementation top.i
    subcomponents x : system box.i; z : device actuator; q : bus quick; w : bus slow;
    connections outer : port x.o -> z.i;
    flows e : end to end flow x.f -> outer -> z.f {Latency => 0 ms .. 13 ms;};
    properties
      %s
  end top.i;
end m;
"""
ON = "Actual_Connection_Binding => (reference (%s))%s;"


@pytest.mark.parametrize(
    ("properties", "expected", "told"),
    [
        (ON % ("q", " applies to outer"), 12, False),
        (ON % ("q", " applies to outer") + ON % ("w", " applies to x.inner"), 52, True),
        (ON % ("w", " applies to outer") + ON % ("q", " applies to x.inner"), 12, True),
        (ON % ("q", " applies to outer, x.inner"), 12, False),
        # stated at the implementation, it is inherited by the connections in it
        (ON % ("q", ""), 12, False),
        (ON % ("q", "") + ON % ("w", " applies to outer"), 12, True),
        (ON % ("q", "") + ON % ("w", " applies to x"), 52, True),
    ],
)
def test_the_binding_nearest_to_the_source_counts(properties: str, expected: int, told: bool, tmp_path: Path) -> None:
    text = NESTED % ("", properties)
    assert latencies(tmp_path, text) == {"e": (expected, expected)}
    remarks = [item.message for item in dse.load(written(tmp_path, text)).loaded.told]
    said = [text for text in remarks if "Actual_Connection_Binding not consistent along connection" in text]
    assert bool(said) is told


def test_the_name_of_a_model_may_have_braces(tmp_path: Path) -> None:
    """The remark names the file, which is no pattern."""
    path = tmp_path / "m{1}.aadl"
    path.write_text(NESTED % ("", ON % ("q", "") + ON % ("w", " applies to outer")), encoding="utf-8")
    remarks = [item.message for item in dse.load(path).loaded.told]
    assert any("m{1}.aadl" in text for text in remarks if "not consistent" in text)
