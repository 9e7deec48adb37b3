"""What is remarked of designs and problems whose figures contradict each other."""

from __future__ import annotations

import pytest

import dse

TWO = """
dse: 1
name: minima above maxima
profile: PROFILE
worst_case: deadline
processor_types: {c: {}}
processors: {p: {type: c}}
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: [5 ms .. 8 ms, 1 ms], deadline: 3 ms}
  b: {figures_of: p, period: 20 ms, compute_execution_time: 5 ms .. 8 ms}
connections: {w: {from: a, to: b}}
flows: {f: {path: [a, b]}}
"""
DEADLINE = "a at least 5 ms (processing time), at most 3 ms (deadline)"
NOTHING = "b at least 5 ms (processing time), at most 0 ns (no latency)"


@pytest.mark.parametrize(
    ("profile", "named"), [("osate-2.2", f"{DEADLINE}; {NOTHING}"), ("osate-2.19", DEADLINE), ("dse", "")]
)
def test_a_minimum_above_its_maximum_is_remarked_on(profile: str, named: str) -> None:
    problem = dse.loads(TWO.replace("PROFILE", profile))
    head = f"the maximum and the jitter of f are too small: by profile {profile} (worst case by deadline) it counts for"
    expected = [f"{head} {named}"] if named else []
    assert [text for text in dse.check(problem).remarks if "too small" in text] == expected
    analysis = dse.analyse(problem, {"a.compute_execution_time": "5 ms .. 8 ms"})
    assert [text for text in analysis.warnings if "too small" in text] == expected
    [flow] = analysis.flows
    assert any(row.min_ns > row.max_ns for row in flow.rows) == bool(named)


def test_an_equality_of_utilisation_looks_at_the_sum_alone() -> None:
    """70 % on each of two cores keeps == 70 % and so do 100 % and 40 %; nobody should read more into it."""
    text = TWO.replace("PROFILE", "dse") + "requirements: [utilisation of p == 70 %, utilisation of p >= 1 %]\n"
    found = [remark for remark in dse.check(dse.loads(text)).remarks if "compares the sum" in remark]
    said = "compares the sum over all cores, not each thread and core: `utilisation of p <= 70 %` limits these too"
    assert found == [f"utilisation of p == 70 % {said}"]


IDLE = """
dse: 1
name: idle parts
totals: {mass: g}
processor_types: {small: {price: 10 EUR, power: 9 W}, big: {price: 20 EUR}}
bus_types: {cable: {price: 3 EUR}, air: {}}
processors: {main: {type: small}, spare: {type: [small, big]}, extra: {type: small, optional: true}}
buses: {line: {type: cable}, ether: {type: air}}
devices: {lamp: {totals: {mass: 1 g}, period: 1 s}, sign: {period: 1 s}, used: {price: 1 EUR, period: 1 s}}
threads: {t: {processor: main, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}}
connections: {w: {from: used, to: t}}
"""


def test_what_no_design_uses_but_every_design_pays_for_is_remarked_on() -> None:
    assert [text for text in dse.check(dse.loads(IDLE)).remarks if "every design has it" in text] == [
        "nothing runs on spare, but every design has it and its price and power",
        "nothing goes over line, but every design has it and its price",
        "no connection or flow uses lamp, but every design has it and its mass",
    ]


LOADED = """
dse: 1
name: one loaded bus
bus_types: {cable: {exclusive: true, bandwidth: 1 Mbit/s, transmission_time: {fixed: 10 us, per_byte: 10 us}}}
buses: {line: {type: cable}}
devices: {a: {period: 1 s}, b: {period: 1 s}}
connections: {w: {from: a, to: b, data_size: 1 B, bus: line}}
requirements: [REQUIREMENT]
"""


@pytest.mark.parametrize(
    ("requirement", "is_limited"),
    [
        ("load of line <= 50 %", True),
        ("busy of line <= 50 %", True),
        ("max(busy) < 50 %", True),
        ("load of line >= 10 %", False),
        ("price <= 1 EUR", False),
    ],
)
def test_an_upper_limit_on_the_busy_time_limits_a_bus(requirement: str, is_limited: bool) -> None:
    remarks = dse.check(dse.loads(LOADED.replace("REQUIREMENT", requirement))).remarks
    assert any("no limit on the load of line is stated" in text for text in remarks) is not is_limited


def test_a_stated_response_time_below_the_execution_time_is_remarked_on_too() -> None:
    text = TWO.replace("PROFILE", "dse").replace("deadline: 3 ms", "response_time: 2 ms .. 4 ms")
    found = [remark for remark in dse.check(dse.loads(text)).remarks if "too small" in remark]
    assert len(found) == 1
    assert found[0].endswith("it counts for a at least 5 ms (processing time), at most 4 ms (response time)")


def test_threads_without_an_execution_time_are_told() -> None:
    """They count as taking none: of a problem with any such design, of a design with that one."""
    text = """{dse: 1, name: x, processor_types: {t: {}}, processors: {p: {type: t}},
        thread_types: {quick: {}, timed: {compute_execution_time: 1 ms}},
        threads: {a: {processor: p, period: 10 ms, type: [timed, quick]},
                  b: {processor: p, period: 10 ms, type: timed}, c: {period: 10 ms}}}"""
    words = "no execution time is stated for a: without `compute_execution_time` a thread counts as 0 ms"
    problem = dse.load(text)
    assert words in dse.check(problem).remarks
    assert words not in dse.analyse(problem, {"a.type": "timed"}).warnings
    assert words in dse.analyse(problem, {"a.type": "quick"}).warnings


CLOCKED = """
dse: 1
name: x
processor_types: {t: {}}
processors: {p: {type: t}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms .. 2 ms, offset: 3 ms}
  b: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 1 ms .. 2 ms, offset: any}
  c: {processor: p, period: 10 ms, compute_execution_time: 1 ms .. 2 ms, offset: LAST}
connections: {w: {from: a, to: b}, x: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
offset_grid: 5 ms
"""


def test_an_offset_of_a_whole_period_and_more_is_told_and_counts_as_what_is_left_of_it() -> None:
    late, early = (dse.loads(CLOCKED.replace("LAST", text)) for text in ("25 ms", "5 ms"))
    words = "c has a period of 10 ms: its offset of 25 ms counts as 5 ms"
    assert words in dse.check(late).remarks
    assert not any("its offset" in text for text in dse.check(early).remarks)
    design = {"b.period": "20 ms", "b.offset": "15 ms"}
    assert dse.analyse(late, design).metrics == dse.analyse(early, design).metrics


def test_what_is_offered_is_told_where_something_else_was_chosen() -> None:
    found = dse.analyse(dse.loads(CLOCKED.replace("LAST", "0 ms")), {"b.period": "10 ms", "b.offset": "15 ms"})
    assert found.breaches == ("b.offset: 15 ms is not offered with the other choices (offered: 0 ns, 5 ms)",)


LISTS = """
dse: 1
name: lists
processor_types: {small: {context_switch: [1 us, 2 us]}, large: {}}
processors: {p: {type: [small, large]}}
bus_types: {can: {bandwidth: 1 Mbit/s, latency: [1 ms, 2 ms], transmission_time: {fixed: [0.5 ns, 2 us]}}}
buses: {can0: {type: can}}
thread_types: {A: {compute_execution_time: [3 ms, 4 ms]}}
devices: {s: {period: 20 ms, compute_execution_time: [9 ms, 1 ms], latency: [1 ms .. 2 ms, 3 ms .. 4 ms]}}
threads:
  a: {processor: p, period: [20 ms, 40 ms], compute_execution_time: {small: [1 ms, 9 ms], large: 1 ms}}
  b: {processor: p, period: 20 ms, type: A, deadline: [10 ms, 20 ms]}
  c: {processor: p, period: 20 ms, response_time: [1 ms, 5 ms, 9 ms]}
connections: {w: {from: s, to: a, bus: can0, data_size: [1 B, 9 B]}}
flows: {f: {path: [s, a]}}
"""


def test_a_list_of_two_ascending_demands_may_be_meant_as_a_range() -> None:
    def said(text: str) -> list[str]:
        return [item for item in dse.check(dse.loads(text)).remarks if "two options" in item]

    takes = "two options, of which the search takes one"
    larger = "where it may be either, state the larger alone:"
    assert said(LISTS) == [
        f"p.context_switch: {takes}; {larger} `2 us`",
        f"can0.transmission_time.fixed: {takes}; a range is written `0.5 ns .. 2 us`",
        f"can0.latency: {takes}; a range is written `1 ms .. 2 ms`",
        f"a.compute_execution_time: {takes}; a range is written `1 ms .. 9 ms`",
        f"b.compute_execution_time: {takes}; a range is written `3 ms .. 4 ms`",
        f"w.data_size: {takes}; {larger} `9 B`",
    ]
    assert said(LISTS.replace("[1 ms, 9 ms]", "1 ms .. 9 ms")) == [
        item for item in said(LISTS) if not item.startswith("a.")
    ]
    rule = "rules: [a.compute_execution_time == 9 ms implies a.period == 40 ms]"
    meant = f"{LISTS}{rule}\nbaseline: {{w: {{data_size: 9 B}}}}\n"
    assert not [item for item in said(meant) if item.startswith(("a.", "w."))]


@pytest.mark.parametrize(
    ("ends", "bus", "is_told"),
    [
        ("processor: p", "lan", True),
        ("processor: [p, q]", "lan", False),
        ("processor: q", "lan", False),
        ("processor: p", "dds", False),
        ("processor: p", "[local, lan]", True),
    ],
)
def test_what_is_never_sent_over_its_bus_is_remarked_on(ends: str, bus: str, is_told: bool) -> None:
    problem = dse.loads(f"""
dse: 1
name: local
processor_types: {{c: {{}}}}
bus_types: {{eth: {{bandwidth: 1 Mbit/s, transmission_time: from bandwidth}}, ros: {{virtual: true, latency: 1 ms}}}}
processors: {{p: {{type: c}}, q: {{type: c}}}}
buses: {{lan: {{type: eth}}, dds: {{type: ros}}}}
threads:
  a: {{processor: p, period: 20 ms}}
  b: {{{ends}, dispatch_protocol: aperiodic}}
connections: {{w: {{from: a, to: b, data_size: 10 B, bus: {bus}}}}}
""")
    told = [text for text in dse.check(problem).remarks if "not sent over" in text]
    assert [text.partition(" (")[0] for text in told] == (
        ["not sent over lan, for sender and receiver share a processor or process: w"] if is_told else []
    )
