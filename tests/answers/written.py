"""Files of every format, as the commands write them: small problems that bring out every field."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dse.cli.main import run
from tests.helpers.small import without_waiting

SHARED = """
dse: 1
include: more.yaml
name: shared
processor_types: {cpu: {cores: 2, price: 5 EUR}, big: {cores: 2, price: 9 EUR}}
bus_types: {wire: {transmission_time: {fixed: 1 ms}}, mute: {}}
buses: {w: {type: wire}, x: {type: mute}}
processors: {p: {type: [cpu, big]}, spare: {type: cpu, optional: true}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {cpu: 1 ms .. 6 ms, big: 1 ms .. 2 ms}}
  b: {processor: p, period: 20 ms, compute_execution_time: {cpu: 6 ms, big: 2 ms}, deadline: 19 ms}
  c: {processor: [p, spare], period: 40 ms, core: 2, compute_execution_time: {cpu: 12 ms, big: 3 ms}}
connections: {ab: {from: a, to: b, data_size: 8 B, bus: w}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
requirements: [latency of f <= 85 ms, utilisation of p <= 60 %, latency of f >= 1 ms]
objectives: [minimise latency of f, minimise price]
baseline: {p: {type: big}, spare: {type: none}, c: {processor: p}}
"""
BASELINE = """
baseline:
  computer: {type: small}
  can0: {type: can_250k}
  filter: {dispatch_protocol: aperiodic}
  control: {period: 10 ms}
"""
PUMP = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8") + BASELINE
UNCERTAIN = (
    PUMP
    + """
uncertainty:
  threads.control.compute_execution_time: {factor: 0.7 .. 6}
  devices.sensor.compute_execution_time.max: {range: 1 us .. 3 ms}
"""
)
ROUNDED = """
dse: 1
name: Cameras
bus_types: {eth: {bandwidth: 10 Mbit/s}}
buses: {eth0: {type: eth}}
devices: {fast: {period: [16.667 ms, 33.333 ms]}, slow: {period: 33.333 ms}, sink: {}}
connections:
  fast_image: {from: fast, to: sink, data_size: 1 KB, bus: eth0}
  slow_image: {from: slow, to: sink, data_size: 1 KB, bus: eth0}
objectives: [maximise load of eth0]
"""
NODE = """
dse: 1
name: node
processing: response_time
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
reservations: {share: {processor: p, budget: 9 ms, period: 10 ms}}
executors: {node: {kind: fifo, reservation: share}}
threads:
  timer: {executor: node, period: 10 ms, compute_execution_time: 1 ms}
  other: {executor: node, period: 20 ms, compute_execution_time: 2 ms}
"""
OVERLOADED = """
dse: 1
name: overloaded
processing: response_time
overload: allowed
processor_types: {one: {price: 10 EUR}, two: {price: 30 EUR}}
processors: {cpu: {type: [one, two]}}
threads:
  a: {processor: cpu, period: 10 ms, priority: 3, compute_execution_time: 6 ms}
  b: {processor: cpu, period: [10 ms, 12 ms], priority: 2, compute_execution_time: 6 ms}
connections: {w: {from: a, to: b}}
flows: {f: {path: [a, b]}}
requirements: [response time of b <= 100 ms, price <= 20 EUR]
objectives: [minimise price]
"""
OSATE = """
dse: 1
name: osate
profile: osate-2.19
bus_types: {w: {transmission_time: {fixed: 1 ms}, latency: 1 ms}}
buses: {b: {type: w, budget: 1 KB/s}}
processor_types: {pc: {speed: 1 MIPS}}
processors: {p: {type: pc}}
threads: {work: {processor: p, period: 10 ms, compute_execution_time: 1 ms}}
budgets: {work: {speed: 50 KIPS}}
devices: {s: {period: 10 ms}, t: {}}
connections: {c: {from: s, to: t, data_size: 8 B, bus: b}}
flows: {f: {path: [s, t], latency: 0 ms .. 1 us}}
unread: {g: {reason: it leads nowhere, latency: 0 ms .. 5 ms}}
"""
FRAMED = """
dse: 1
name: framed
bus_types: {can: {bandwidth: 125 kbit/s, frame: can}}
buses: {b: {type: can}}
devices: {s: {period: 10 ms}, t: {}}
connections: {c: {from: s, to: t, data_size: 8 B, bus: b}}
"""
LOADED = """
dse: 1
name: loaded
bus_types: {can: {bandwidth: 5 kbit/s}}
buses: {b: {type: can}}
devices: {s: {period: 10 ms}, t: {}}
connections: {c: {from: s, to: t, data_size: 8 B, bus: b}}
objectives: [minimise price]
"""
MISSED = """
dse: 1
name: missed
processor_types: {cpu: {}}
processors: {p: {type: cpu}}
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms .. 3500 us, offset: 0 ms}
  b: {processor: p, period: 20 ms, compute_execution_time: 1 ms, offset: 0 ms}
devices: {z: {period: 30 ms}}
connections: {c: {from: a, to: b}, d: {from: z, to: b}}
flows: {f: {path: [a, b]}, g: {path: [z, b]}}
"""
LATE_MESSAGE = """
dse: 1
name: late message
bus_types: {can: {bandwidth: 250 kbit/s, frame: can, fault_interval: 1 s, price: 1 EUR}}
buses: {b: {type: can}}
devices: {sink: {}, d0: {period: 5 ms}, d1: {period: 5 ms}, d2: {period: 5 ms}, d3: {period: 5 ms}}
connections:
  m0: {from: d0, to: sink, port: data, bus: b, data_size: 8 B, identifier: 16}
  m1: {from: d1, to: sink, port: data, bus: b, data_size: 8 B, identifier: 18}
  m2: {from: d2, to: sink, port: data, bus: b, data_size: 8 B, identifier: 20}
  m3: {from: d3, to: sink, port: data, bus: b, data_size: 7 B, identifier: 22, deadline: 2 ms}
  m4: {from: d3, to: sink, port: data, data_size: 1 B, carried_in: m3}
objectives: [minimise price]
"""
NUMBERED = """
dse: 1
name: numbered
bus_types:
  slow: {bandwidth: 250 kbit/s, frame: can, price: 1 EUR}
  fast: {bandwidth: 500 kbit/s, frame: can, price: 1 EUR}
buses: {b: {type: [slow, fast]}}
devices: {sink: {}, d: {period: 5 ms}}
connections: {m: {from: d, to: sink, port: data, bus: b, data_size: 8 B, identifier: any}}
objectives: [minimise price]
"""
LATE_ON_LINK = """
dse: 1
name: late on a link
bus_types: {eth: {bandwidth: 10 Mbit/s, frame: {protocol: ethernet, vlan: true}, arbitration: priority, price: 1 EUR}}
buses: {b: {type: eth}}
devices: {sink: {}, d0: {period: 5 ms}, d1: {period: 20 ms}}
connections:
  m0: {from: d0, to: sink, port: data, bus: b, data_size: 100 B, priority: 1, deadline: 2 ms}
  m1: {from: d1, to: sink, port: data, bus: b, data_size: 4 KB, priority: 1}
objectives: [minimise price]
"""
CONTENDED = """
dse: 1
name: contended
processing: response_time
deadlines: all
processor_types: {cpu: {}, gpu: {serves: fifo}}
processors: {p: {type: cpu}, q: {type: cpu}, g: {type: gpu}}
devices: {sensor: {period: 20 ms}}
threads:
  fast: {processor: p, period: 10 ms, compute_execution_time: 4 ms}
  nav: {processor: p, period: 20 ms, compute_execution_time: 5 ms}
  log: {processor: p, period: 100 ms, compute_execution_time: 2 ms, non_preemptive: 2 ms}
  heavy: {processor: q, period: 10 ms, compute_execution_time: 6 ms}
  more: {processor: q, period: 20 ms, compute_execution_time: 9 ms}
  long: {processor: p, period: 200 ms, segments: [{compute_execution_time: 1 ms},
         {processor: g, compute_execution_time: 50 ms}]}
  short: {processor: p, period: 33 ms, segments: [{compute_execution_time: 1 ms},
          {processor: g, compute_execution_time: 1 ms}]}
connections: {s: {from: sensor, to: nav}}
flows: {f: {path: [sensor, nav]}}
requirements: [latency of f <= 27 ms]
objectives: [minimise price]
"""
LATER = """
dse: 1
name: later
processor_types: {cpu: {price: 10 EUR}, gpu: {serves: fifo}}
processors: {p: {type: cpu}, q: {type: cpu}, g: {type: gpu}}
threads:
  a: {processor: p, period: 70 ms, compute_execution_time: 26 ms}
  b: {processor: p, period: 100 ms, compute_execution_time: 62 ms, deadline: 1 s}
  c: {processor: q, period: 100 ms, compute_execution_time: 62 ms}
  d: {processor: q, period: 500 ms, segments: [{compute_execution_time: 1 ms},
      {processor: g, compute_execution_time: 2 ms},
      {compute_execution_time: 1 ms}]}
objectives: [minimise price]
"""
"""The fifth job of b responds last; both processors are used by more than half; d has pieces."""
WAITING = """
dse: 1
name: waiting
bus_types:
  wire: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 1 ms}, arbitration: priority}
  full: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 60 ms}, arbitration: fifo}
  noisy: {bandwidth: 1 Mbit/s, frame: can, fault_interval: 1 s}
  eth: {bandwidth: 10 Mbit/s, frame: {protocol: ethernet, vlan: true}, arbitration: priority}
buses: {v: {type: eth}, w: {type: wire}, x: {type: full}, y: {type: noisy}, z: {type: wire}}
devices: {a: {period: 2500 us}, b: {period: 3500 us}, c: {period: 3500 us}, d: {period: 50 ms}, relay: {}, t: {}}
connections:
  first: {from: a, to: t, data_size: 8 B, bus: w, identifier: 1}
  second: {from: b, to: t, data_size: 8 B, bus: w, identifier: 2, deadline: 3 ms}
  third: {from: c, to: t, data_size: 8 B, bus: w, identifier: 3, deadline: 3 ms}
  sorted: {from: a, to: t, data_size: 8 B, bus: v, priority: 5}
  hit: {from: a, to: t, data_size: 8 B, bus: y, identifier: 1}
  more: {from: a, to: t, port: data, data_size: 1 B, carried_in: first}
  late: {from: d, to: relay, data_size: 8 B, bus: x}
  later: {from: relay, to: t, data_size: 8 B, bus: z, identifier: 4}
flows: {f: {path: [a, first, t]}}
"""
"""The second job of the third message responds last; the fourth has no bound, for what it follows has none."""
PROBLEMS = {
    "waiting": WAITING,
    "later": LATER,
    "contended": CONTENDED,
    "late_message": LATE_MESSAGE,
    "late_on_link": LATE_ON_LINK,
    "numbered": NUMBERED,
    "pump": PUMP,
    "node": NODE,
    "shared": SHARED,
    "uncertain": UNCERTAIN,
    "rounded": ROUNDED,
    "overloaded": OVERLOADED,
    "framed": FRAMED,
    "loaded": LOADED,
    "osate": OSATE,
    "missed": MISSED,
    "huge": PUMP.replace("price: 60 EUR", "price: 99999999999999 EUR"),
}
COMMANDS = (
    "solve pump.yaml --further 2 --within 20% --json pump.json",
    "solve pump.yaml --max-jitter 7ms --json tight.json",
    "solve pump.yaml --max-jitter 5ms --json never.json",
    "solve pump.yaml --max-jitter 5ms --max-price 100EUR --max-load 1% --json nothing.json",
    "solve shared.yaml --further 1 --within 50% --json shared.json",
    "solve numbered.yaml --further 1 --json numbered.json",
    "solve uncertain.yaml --robust --json robust.json",
    "solve rounded.yaml --json rounded.json",
    "solve overloaded.yaml --json overloaded.json",
    "solve overloaded.yaml --overload forbidden --json too_much.json",
    "solve loaded.yaml --json loaded.json",
    "solve pump.yaml --fix 'filter.period = 20 ms' --json fixed.json",
    "solve shared.yaml --insist --json insist.json",
    "report pump.json -o reports",
    "check pump.yaml --json check.json",
    "check osate.yaml --json unread.json",
    "check huge.yaml --json too_large.json",
    "check shared.yaml --require 'latency of f >= 9 s' --json most.json",
    "check pump.yaml --max-jitter 1us --max-price 1EUR --json impossible.json",
    "analyse pump.yaml --json analysis.json",
    "analyse shared.yaml --response-times --json busy.json",
    "analyse shared.yaml --design 'p.type = cpu' --json broken.json",
    "analyse framed.yaml --json framed.json",
    "analyse contended.yaml --response-times --json contended.json",
    "explain contended.yaml --all --json why_contended.json",
    "explain contended.yaml --json least.json",
    "explain late_message.yaml --json late_message.json",
    "explain late_on_link.yaml --json late_on_link.json",
    "analyse osate.yaml --json osate.json",
    "analyse node.yaml --json node.json",
    "analyse missed.yaml --json missed.json",
    "explain pump.yaml --max-jitter 5ms --json explanation.json",
    "explain pump.yaml --max-jitter 5ms --max-price 50EUR --json together.json",
    "analyse later.yaml --response-times --json later.json",
    "analyse waiting.yaml --json messages.json",
    "explain later.yaml --max-utilisation 50% --json stated_once.json",
    "explain pump.yaml --json feasible.json",
    (
        "explain shared.yaml --require 'response time of b <= 3 ms' --fix p.type=big --fix a.core=1 --fix b.core=1 "
        "--json why.json"
    ),
    "explain missed.yaml --max-latency f=5ms --json missing.json",
    "explain node.yaml --require 'response time of timer <= 2 ms' --json short.json",
    "explain shared.yaml --max-utilisation 0.1% --json once.json",
    "explain shared.yaml --max-latency 10ms --offer 'b.period += 10 ms' --json offer.json",
    "sweep pump.yaml --vary 'jitter of sensor_to_valve=1ms..40ms' --no-store --json breaks.json",
    (
        "sweep pump.yaml --vary 'price=50EUR,100EUR' --vary 'devices.sensor.period=20ms,30ms' --max-jitter 30ms "
        "--require 'price <= 900 EUR' --minimise price --minimise 'jitter of sensor_to_valve' "
        "--fix 'can0.type = can_250k' --profile osate-2.2 --worst-case deadline --processing response-time "
        "--deadlines stated --overload allowed --workers 1 --no-store --json grid.json"
    ),
    "sweep pump.yaml --vary 'devices.sensor.period=20ms,30ms' --time-limit 0.000001s --no-store --json open.json",
    "sweep pump.yaml --vary 'devices.sensor.period=20ms,0ms' --workers 1 --no-store --json wrong.json",
    "sweep shared.yaml --vary 'price=5EUR,9EUR' --workers 1 --no-store --json kept.json",
    "sweep shared.yaml --vary 'latency of f=70ms..84ms' --no-store --json late.json",
    "sensitivity pump.yaml --json margins.json",
    "sensitivity uncertain.yaml --samples 16 --json uncertain.json",
    "simulate pump.yaml --runs 2 --json simulation.json",
    "simulate shared.yaml --contention --runs 2 --json waiting.json",
    "simulate missed.yaml --runs 2 --json meeting.json",
    "simulate waiting.yaml --runs 2 --json sent.json",
    "compare pump.json tight.json --json results.json",
    "compare pump.yaml --measured seen.csv --json seen.json",
    "compare pump.json#1 pump.json#2 --json designs.json",
    "verify pump.json --json verdict.json",
    "verify forged.json --json rejected.json",
    "fit sizes.csv --method quantile --extremes 1000 --without '9 B .. 11 B' --json sizes.json",
    "fit threads.csv --extremes 1000 --json threads.json",
    "sizes geometry_msgs/PoseArray --length poses=3 --bag bag.bag --json sizes.json",
)


def write_bag(path: Path) -> None:
    """A bag of ROS 1 with three messages."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    text = store.types["std_msgs/msg/String"]
    with Writer(path) as writer:
        connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for number, stamp_ns in enumerate((0, 10_000_000, 30_000_000)):
            data = store.serialize_ros1(text("x" * number), "std_msgs/msg/String")
            writer.write(connection, 10**18 + stamp_ns, data)


def written_files(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each command with the data that it wrote."""
    import shlex

    (folder / "more.yaml").write_text("device_types: {lidar: {price: 99 EUR}}\n", encoding="utf-8")
    delays = [f"{size},{40 + 3 * size + number % 61 + number % 7}" for size in (1, 2, 4, 9) for number in range(420)]
    (folder / "sizes.csv").write_text("\n".join(["size_bytes,delay_us", *delays]), encoding="utf-8")
    (folder / "threads.csv").write_text("\n".join(["thread,duration_us", *delays]), encoding="utf-8")
    for name, text in PROBLEMS.items():
        (folder / f"{name}.yaml").write_text(without_waiting(text), encoding="utf-8")
    write_bag(folder / "bag.bag")
    seen = "metric,sample\nlatency of sensor_to_valve,3 ms\nexecution time of control,3 ms\n"
    (folder / "seen.csv").write_text(seen, encoding="utf-8")
    with contextlib.chdir(folder):
        for command in COMMANDS:
            if "forged" in command:
                data = json.loads(Path("pump.json").read_text(encoding="utf-8"))
                data["front"][0]["objectives"]["price"] += 1
                Path("forged.json").write_text(json.dumps(data), encoding="utf-8")
            code = run([*shlex.split(command)])
            assert code in (0, 3, 4, 5), (command, code)
            target = "reports/pump.json" if command.startswith("report") else command.split()[-1]
            yield command, json.loads(Path(target).read_text(encoding="utf-8"))
