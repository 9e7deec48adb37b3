"""A problem whose every name tries to be something else than text."""

from __future__ import annotations

import json

import dse
from dse.answers.result import Result

SCRIPT = "<script>alert('x')</script>"
NAMES = {
    "cpu": f'{SCRIPT} "cpu" & co',
    "small": "=HYPERLINK(\"http://x.invalid\",'small')",
    "large": "größer </style><img src=x onerror=alert(1)>",
    "wire bus": "+bus|`*_[link](http://x.invalid)",
    "can": "@SUM(A1) can -- ]]>",
    "worker": '-worker\'s "night" shift: {x} #1',
    "sensor": "sénsor <b>bold</b> \\N \\l",
    "link": "a --> b; c <-- d",
    "flow": "flow <of> \"things\" & 'more'",
}
PROBLEM = f"""
dse: 1
name: {json.dumps(f"Robot {SCRIPT} & $formula$ <!-- ")}
assumptions: [{json.dumps(f"assume {SCRIPT}")}]
processor_types:
  {json.dumps(NAMES["small"])}: {{price: 10 EUR}}
  {json.dumps(NAMES["large"], ensure_ascii=False)}: {{price: 20 EUR}}
bus_types:
  {json.dumps(NAMES["can"])}: {{bandwidth: 125 kbit/s, transmission_time: {{fixed: 1 ms, per_byte: 10 us}}}}
processors:
  {json.dumps(NAMES["cpu"])}: {{type: [{json.dumps(NAMES["small"])}, {json.dumps(NAMES["large"], ensure_ascii=False)}]}}
buses: {{{json.dumps(NAMES["wire bus"])}: {{type: {json.dumps(NAMES["can"])}}}}}
devices: {{{json.dumps(NAMES["sensor"], ensure_ascii=False)}: {{period: 10 ms}}}}
threads:
  {json.dumps(NAMES["worker"])}:   # a comment to keep
    processor: {json.dumps(NAMES["cpu"])}
    dispatch_protocol: [periodic, aperiodic]
    period:        # as the plant allows
      - 5 ms       # fast
      - 10 ms      # slow
    compute_execution_time:
      {json.dumps(NAMES["small"])}: 1 ms .. 3 ms
      {json.dumps(NAMES["large"], ensure_ascii=False)}: 1 ms .. 2 ms
connections:
  {json.dumps(NAMES["link"])}:
    from: {json.dumps(NAMES["sensor"], ensure_ascii=False)}
    to: {json.dumps(NAMES["worker"])}
    data_size: 8 B
    bus: {json.dumps(NAMES["wire bus"])}
flows:
  {json.dumps(NAMES["flow"])}:
    path: [{json.dumps(NAMES["sensor"], ensure_ascii=False)}, {json.dumps(NAMES["worker"])}]
requirements: [utilisation <= 90 %, load <= 50 %]
objectives: [minimise jitter, minimise price, minimise utilisation]
baseline:
  {json.dumps(NAMES["cpu"])}: {{type: {json.dumps(NAMES["small"])}}}
  {json.dumps(NAMES["worker"])}: {{dispatch_protocol: periodic, period: 10 ms}}
"""


def hostile_result() -> Result:
    """Its front."""
    return dse.solve(dse.loads(PROBLEM))
