"""Amalthea models: tasks, runnables, labels, event chains and limits, with figures by hand; and what is none.

The form of the elements is that of APP4MC's published models; the model is our own.
"""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run
from tests.helpers.effort import cases

MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<am:Amalthea xmi:version="2.0" xmlns:xmi="http://www.omg.org/XMI" xmlns:am="http://app4mc.eclipse.org/amalthea/0.9.7"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<swModel>
<tasks name="Sense" stimuli="T5?type=PeriodicStimulus"><activityGraph><items xsi:type="am:Group">
 <items xsi:type="am:RunnableCall" runnable="r_sense?type=Runnable"/>
 <items xsi:type="am:RunnableCall" runnable="r_check?type=Runnable"/></items></activityGraph></tasks>
<tasks name="Act" stimuli="T10?type=PeriodicStimulus"><activityGraph>
 <items xsi:type="am:RunnableCall" runnable="r_act?type=Runnable"/></activityGraph></tasks>
<isrs name="Pulse" stimuli="Now?type=RelativePeriodicStimulus"/>
<runnables name="r_sense"><activityGraph>
 <items xsi:type="am:Ticks"><default xsi:type="am:DiscreteValueConstant" value="20000"/></items>
 <items xsi:type="am:LabelAccess" data="speed?type=Label" access="write"/>
 <items xsi:type="am:LabelAccess" data="flag?type=Label" access="write"/></activityGraph></runnables>
<runnables name="r_check"><activityGraph>
 <items xsi:type="am:Ticks">
  <default xsi:type="am:DiscreteValueWeibullEstimatorsDistribution" lowerBound="1000" upperBound="30000" average="9.0"/>
 </items></activityGraph></runnables>
<runnables name="r_act"><activityGraph>
 <items xsi:type="am:LabelAccess" data="speed?type=Label" access="read"/>
 <items xsi:type="am:LabelAccess" data="flag?type=Label" access="read"/>
 <items xsi:type="am:Ticks"><default xsi:type="am:DiscreteValueConstant" value="40000"/>
  <extended key="fast?type=ProcessingUnitDefinition">
   <value xsi:type="am:DiscreteValueConstant" value="10000"/></extended>
 </items></activityGraph></runnables>
<labels name="speed"><size value="4" unit="B"/></labels>
<labels name="flag"><size value="1" unit="bit"/></labels>
</swModel>
<hwModel>
<definitions xsi:type="am:ProcessingUnitDefinition" name="plain"/><definitions name="fast"/>
<structures name="ecu">
<modules xsi:type="am:ProcessingUnit" name="core0" frequencyDomain="d?type=FrequencyDomain" definition="plain?type=X"/>
<modules xsi:type="am:ProcessingUnit" name="core1" frequencyDomain="d?type=FrequencyDomain" definition="fast?type=X"/>
</structures>
<domains xsi:type="am:FrequencyDomain" name="d"><defaultValue value="2.0E1" unit="MHz"/></domains>
</hwModel>
<stimuliModel>
<stimuli xsi:type="am:PeriodicStimulus" name="T5"><offset value="0" unit="ms"/>
<recurrence value="5" unit="ms"/></stimuli>
<stimuli xsi:type="am:PeriodicStimulus" name="T10"><recurrence value="10000" unit="us"/></stimuli>
<stimuli xsi:type="am:RelativePeriodicStimulus" name="Now"><nextOccurrence xsi:type="am:TimeUniformDistribution">
<lowerBound value="700" unit="us"/><upperBound value="800" unit="us"/></nextOccurrence></stimuli>
</stimuliModel>
<eventModel>
<events xsi:type="am:ProcessEvent" name="e1" entity="Sense?type=Task"/>
<events xsi:type="am:RunnableEvent" name="e2" entity="r_check?type=Runnable"/>
<events xsi:type="am:ProcessEvent" name="e3" entity="Act?type=Task"/>
</eventModel>
<constraintsModel>
<eventChains name="chain" stimulus="e1?type=ProcessEvent" response="e3?type=ProcessEvent">
<segments xsi:type="am:EventChainContainer"><eventChain stimulus="e1?type=P" response="e2?type=P"/></segments>
<segments xsi:type="am:EventChainContainer"><eventChain stimulus="e2?type=P" response="e3?type=P"/></segments>
</eventChains>
<eventChains name="back" stimulus="e3?type=ProcessEvent" response="e1?type=ProcessEvent"/>
<timingConstraints xsi:type="am:EventChainLatencyConstraint" scope="chain?type=EventChain" type="Age">
<maximum value="30" unit="ms"/></timingConstraints>
</constraintsModel>
<mappingModel>
<schedulerAllocation scheduler="s?type=TaskScheduler" responsibility="core0?type=ProcessingUnit"/>
<taskAllocation task="Sense?type=Task" scheduler="s?type=TaskScheduler">
<schedulingParameters priority="3"/></taskAllocation>
<taskAllocation task="Act?type=Task" affinity="core0?type=U core1?type=U"/>
</mappingModel>
</am:Amalthea>
"""


WAYS = ("write", "read")


def put(folder: Path, text: str, name: str = "car.amxmi") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_a_model_is_a_problem(tmp_path: Path) -> None:
    """At 20 MHz 20,000 and 1,000 to 30,000 ticks are 1.05 to 2.5 ms; 33 bits are 5 bytes."""
    found = dse.import_file(put(tmp_path, MODEL))
    data = yaml.safe_load(found.text)
    assert {key: (body["processor"], body.get("period")) for key, body in data["threads"].items()} == {
        "Sense": ("core0", "5 ms"),
        "Act": (["core0", "core1"], "10 ms"),
        "Pulse": (["core0", "core1"], "700 us"),
    }
    assert [body["dispatch_protocol"] for body in data["threads"].values()] == ["periodic", "periodic", "sporadic"]
    assert data["threads"]["Sense"]["compute_execution_time"] == "1.05 ms .. 2.5 ms"
    assert data["threads"]["Act"]["compute_execution_time"] == {"plain": "2 ms", "fast": "500 us"}
    assert data["connections"]["Sense.to.Act"].items() >= {"port": "data", "data_size": "5 B"}.items()
    assert data["flows"]["chain"]["path"] == ["Sense", "Sense.to.Act", "Act"]
    assert data["requirements"] == ["data age of chain <= 30 ms"]
    told = "\n".join(map(str, found.remarks))
    for words in ("the event chain back is left out: no label or trigger leads from Act to Sense",
                  "priorities are left out",
                  "1 task is mapped to no processing unit: each may be on any (Pulse)"):  # fmt: skip
        assert words in told, told
    [flow] = dse.analyse(dse.loads(found.text), {"Act.processor": "core1", "Pulse.processor": "core0"}).flows
    assert flow.max_ns == 13_000_000  # 2.5 ms, up to 10 ms to the next Act, 0.5 ms


INSIDE = """<runnables name="outer"><activityGraph>
 <items xsi:type="am:RunnableCall" runnable="r_check?type=Runnable"/>
 <items xsi:type="am:RunnableCall" runnable="outer?type=Runnable"/>
 <items xsi:type="am:RunnableCall" runnable="gone?type=Runnable"/>
 <items xsi:type="am:ProbabilitySwitch">
  <entries><items xsi:type="am:Ticks"><default xsi:type="am:DiscreteValueConstant" value="2000"/></items></entries>
  <entries><items xsi:type="am:RunnableCall" runnable="r_sense?type=Runnable"/></entries></items>
 <items xsi:type="am:ModeSwitch"><entries>
  <items xsi:type="am:Ticks"><default xsi:type="am:DiscreteValueConstant" value="4000"/></items></entries></items>
 <items xsi:type="am:InterProcessTrigger" stimulus="Go?type=InterProcessStimulus"/>
</activityGraph></runnables>
"""


def test_calls_within_runnables_count_and_one_branch_of_a_switch(tmp_path: Path) -> None:
    """Of 20 MHz: 1,000 .. 30,000 and 2,000 or 20,000 and 0 or 4,000 ticks, and 1,000 of the task itself."""
    text = MODEL.replace('runnable="r_check?type=Runnable"/></items>', 'runnable="outer?type=Runnable"/></items>')
    own = '<items xsi:type="am:Ticks"><default xsi:type="am:DiscreteValueConstant" value="1000"/></items>'
    text = text.replace(' <items xsi:type="am:RunnableCall" runnable="r_sense?type=Runnable"/>', own, 1)
    text = text.replace('<runnables name="r_sense">', INSIDE + '<runnables name="r_sense">', 1)
    found = dse.import_file(put(tmp_path, text))
    data = yaml.safe_load(found.text)
    assert data["threads"]["Sense"]["compute_execution_time"] == "200 us .. 2.75 ms"
    assert data["connections"]["Sense.to.Act"]["data_size"] == "5 B"  # written within a call
    told = [item.message for item in found.remarks]
    assert "the runnable outer calls itself: the call is left out" in told
    assert told.count("there is no runnable gone: the call is left out") == 1


def test_a_task_that_another_one_triggers(tmp_path: Path) -> None:
    """It is dispatched by that task: 2.5 ms and then 2 ms, without a wait for its own timer."""
    text = MODEL.replace('<runnables name="r_sense">', INSIDE + '<runnables name="r_sense">', 1)
    text = text.replace('runnable="r_check?type=Runnable"/></items>', 'runnable="outer?type=Runnable"/></items>')
    text = text.replace('name="Act" stimuli="T10?type=PeriodicStimulus"', 'name="Act" stimuli="Go?type=X"')
    text = text.replace("<stimuliModel>", '<stimuliModel><stimuli xsi:type="am:InterProcessStimulus" name="Go"/>')
    limits = '<requirements xsi:type="am:ProcessRequirement" name="a"/><requirements xsi:type="am:ProcessRequirement"/>'
    text = text.replace("</constraintsModel>", limits + "</constraintsModel>")
    found = dse.import_file(put(tmp_path, text))
    data = yaml.safe_load(found.text)
    assert data["threads"]["Act"]["dispatch_protocol"] == "aperiodic" and "period" not in data["threads"]["Act"]
    wire = data["connections"]["Sense.triggers.Act"]
    assert (wire["from"], wire["to"], wire["port"]) == ("Sense", "Act", "event")
    assert data["flows"]["chain"]["path"] == ["Sense", "Sense.triggers.Act", "Act"]
    told = [item.message for item in found.remarks]
    assert "limits of the kind ProcessRequirement are left out: 2" in told
    assert not any("how often Act runs" in text for text in told)
    asked = dse.loads(found.text).ask(processing="execution_time")
    [flow] = dse.analyse(asked, {"Act.processor": "core0", "Pulse.processor": "core0"}).flows
    # 20,000 and 30,000 and 20,000 and 4,000 ticks of Sense, 40,000 of Act
    assert flow.max_ns == 5_700_000
    timed = dse.import_file(put(tmp_path, text.replace('"Go?type=X"', '"T10?type=X Go?type=X"')))
    assert "Act runs by its period: that Sense triggers it is not counted" in [item.message for item in timed.remarks]


def test_the_frequency_is_asked_for(tmp_path: Path) -> None:
    path = put(tmp_path, MODEL.replace('unit="MHz"', 'unit="none"'))
    found = dse.import_file(path)
    assert "compute_execution_time" not in yaml.safe_load(found.text)["threads"]["Sense"]
    assert any("no frequency of plain is stated" in str(item) and "--frequency" in item.hint for item in found.remarks)
    data = yaml.safe_load(dse.import_file(path, frequency="10 MHz").text)
    assert data["threads"]["Sense"]["compute_execution_time"] == "2.1 ms .. 5 ms"


BAD = {
    "empty": ("", "car.amxmi:1"),
    "cut off": (MODEL[:900], "car.amxmi:13:2: not XML: unclosed token"),
    "other root": ("<a/>", "car.amxmi:1: expected <am:Amalthea>, got <a>"),
    "no tasks": (MODEL[: MODEL.index("<swModel>")] + "</am:Amalthea>", "car.amxmi:1: the model has no tasks"),
    "a document type": ("<!DOCTYPE a [<!ENTITY b 'c'>]><a/>", "car.amxmi:1"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_none_is_told(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, message = BAD[name]
    assert run(["import", str(put(tmp_path, text)), "-o", str(tmp_path / "o.yaml")]) == 3
    said = capsys.readouterr().err
    assert message in said, said
    assert run(["import", str(put(tmp_path, MODEL)), "--frequency", "fast"]) == 2


@pytest.mark.parametrize("seed", cases(20))
def test_drawn_models_have_what_was_drawn(seed: int, tmp_path: Path) -> None:
    """Tasks with runnables and labels: periods, times at the drawn frequency, and who leaves data for whom."""
    rng = random.Random(f"amalthea/{seed}")
    mhz = rng.choice([1, 80, 200, 333])
    tasks = [f"t{number}" for number in range(rng.randint(1, 5))]
    periods = {task: rng.randint(1, 100) for task in tasks}
    ticks: dict[str, list[tuple[int, int]]] = {task: [] for task in tasks}
    for task in tasks:
        for low in [rng.randint(0, 9999) for _ in range(rng.randint(1, 3))]:
            ticks[task].append((low, low + rng.randint(1, 9999)))
    drawn = range(rng.randint(0, 9))
    labels = {f"l{number}": (rng.choice(tasks), rng.choice(tasks), rng.randint(1, 64)) for number in drawn}
    parts, stimuli = [], []
    call = '<items xsi:type="am:RunnableCall" runnable="{}r{}?type=R"/>'
    access = '<items xsi:type="am:LabelAccess" data="{}?type=L" access="{}"/>'
    size = '<labels name="{}"><size value="{}" unit="bit"/></labels>'
    for task in tasks:
        calls = "".join(call.format(task, number) for number in range(len(ticks[task])))
        parts.append(f'<tasks name="{task}" stimuli="s{task}?type=S"><activityGraph>{calls}</activityGraph></tasks>')
        every = f'<recurrence value="{periods[task]}" unit="ms"/>'
        stimuli.append(f'<stimuli xsi:type="am:PeriodicStimulus" name="s{task}">{every}</stimuli>')
        ends = [(label, way, of) for label, item in labels.items() for way, of in zip(WAYS, item[:2], strict=True)]
        inside = "".join(access.format(label, way) for label, way, of in ends if of == task)
        for number, (low, high) in enumerate(ticks[task]):
            need = f'<items xsi:type="am:Ticks"><default lowerBound="{low}" upperBound="{high}"/></items>'
            own = inside if number == 0 else ""
            parts.append(f'<runnables name="{task}r{number}"><activityGraph>{own}{need}</activityGraph></runnables>')
    parts += [size.format(label, bits) for label, (_, _, bits) in labels.items()]
    head, _, _ = MODEL.partition("<swModel>")
    unit = '<modules xsi:type="am:ProcessingUnit" name="c" frequencyDomain="d?type=D"/>'
    domain = f'<domains name="d"><defaultValue value="{mhz}" unit="MHz"/></domains>'
    hardware = f"<hwModel><structures>{unit}</structures>{domain}</hwModel>"
    model = f"<swModel>{''.join(parts)}</swModel>{hardware}<stimuliModel>{''.join(stimuli)}</stimuliModel>"
    text = f"{head}{model}</am:Amalthea>"
    found = dse.import_file(put(tmp_path, text))
    space = dse.load(found.text).space
    by_name = {item.name: item for item in space.components}
    for task in tasks:
        assert by_name[task].period_ns == periods[task] * 10**6
        least, most = (sum(pair[end] for pair in ticks[task]) * Fraction(1000, mhz) for end in (0, 1))
        assert by_name[task].execution_ns == (int(least), -int(-most // 1))
    wanted: dict[tuple[str, str], int] = {}
    for source, target, bits in labels.values():
        if source != target:
            wanted[source, target] = wanted.get((source, target), 0) + bits
    names = [item.name for item in space.components]
    found_sizes = {
        (names[item.source], names[item.target]): item.size_bytes
        for item in space.connections
        if item.source is not None and item.target is not None
    }
    assert found_sizes == {ends: -(-bits // 8) for ends, bits in wanted.items()}
