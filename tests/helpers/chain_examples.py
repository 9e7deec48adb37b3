"""The examples of chains of threads (docs/semantics.md, section 4.9), as problem files: a head, and threads to it."""

from __future__ import annotations

HEAD = """
dse: 1
name: chain
processing: response_time
deadlines: none
processor_types: {p: {}}
processors: {p: {type: p}, q: {type: p}, z: {type: p}}
objectives: [minimise latency of f]
"""
FOUR = """
threads:
  t: {processor: p, period: 10 ms, compute_execution_time: TIMER}
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  c: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  d: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}, cd: {from: c, to: d}}
flows: {f: {path: [a, b, c, d]}}
"""
AWAY = """
threads:
  a: {processor: p, period: 40 ms, compute_execution_time: 6 ms, priority: 3}
  b: {processor: q, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  c: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: 1}
  o: {processor: p, period: 4 ms, compute_execution_time: 2 ms, priority: 2}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
"""
EARLY = """
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms .. 16 ms}
  b: {processor: q, dispatch_protocol: aperiodic, compute_execution_time: 8 ms, priority: 1}
  x: {processor: q, period: 20 ms, compute_execution_time: 4 ms, priority: 2}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
"""
SELDOM = """
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms .. 12 ms, priority: 1}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 2 ms, priority: 3}
  x: {processor: p, period: 20 ms, compute_execution_time: 5 ms, priority: 2}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [PATH]}}
"""
FORK = """
threads:
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: 1}
  c: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 3 ms, priority: 2}
connections: {ab: {from: a, to: b}, ac: {from: a, to: c}}
flows: {f: {path: [a, b]}}
"""
JOIN = """
threads:
  x: {processor: p, period: 10 ms, compute_execution_time: 2 ms}
  a: {processor: p, period: 20 ms, compute_execution_time: 1 ms}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  c: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
  y: {processor: q, period: 20 ms, compute_execution_time: 15 ms}
  j: {processor: z, dispatch_protocol: aperiodic, join: all, compute_execution_time: 1 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}, v: {from: c, to: j}, u: {from: y, to: j}}
flows: {f: {path: [a, b, c, v, j]}}
"""
AGAIN = """
threads:
  a: {processor: p, period: 30 ms, compute_execution_time: 1 ms, priority: 2}
  b: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 1 ms, priority: 2}
  y: {processor: p, period: 5 ms, compute_execution_time: 2 ms, priority: 1}
  k: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 2 ms, priority: 3}
connections: {ab: {from: a, to: b, latency: 2 ms}, yk: {from: y, to: k}}
flows: {f: {path: [a, b]}}
"""
"""Deferred work comes again while a chain is under way."""
TURNS = """
threads:
  t: {processor: p, period: 100 ms, compute_execution_time: 10 ms, priority: 4}
  u: {processor: p, period: 500 ms, compute_execution_time: 37 ms, priority: 8}
  y: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 9 ms, priority: 2}
  k: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 30 ms, priority: 7}
  s: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 20 ms, priority: 1}
  m: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 5 ms, priority: 6}
connections: {uy: {from: u, to: y}, yk: {from: y, to: k}, ks: {from: k, to: s}, sm: {from: s, to: m}}
flows: {f: {path: [t]}}
"""
"""Urgent threads behind two less urgent ones: only those behind one of these come in one busy window."""
IN_TURN = """
threads:
  other: {processor: p, period: 500 ms, compute_execution_time: 125 ms, priority: 5}
  first: {processor: p, period: 50 ms, compute_execution_time: 1 ms, priority: 1}
  second: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 16 ms, priority: 4}
  third: {processor: p, dispatch_protocol: aperiodic, compute_execution_time: 5 ms, priority: 3}
connections: {one: {from: first, to: second}, two: {from: second, to: third}}
flows: {f: {path: [first, second, third]}}
"""
"""A chain longer than its period."""
MEETING = """
threads:
  a: {processor: p, core: 1, priority: 1, period: 10 ms, compute_execution_time: 5 ms}
  b: {processor: p, core: 1, priority: 2, dispatch_protocol: aperiodic, compute_execution_time: 3 ms}
  x: {processor: p, core: 1, priority: 3, period: 30 ms, compute_execution_time: 3 ms}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a]}}
"""
THROUGH = """
threads:
  a: {processor: p, core: 1, priority: 1, period: 20 ms, compute_execution_time: 1 ms}
  b: {processor: q, dispatch_protocol: aperiodic, compute_execution_time: 0 ms .. 5 ms}
  c: {processor: p, core: 1, priority: 3, dispatch_protocol: aperiodic, compute_execution_time: 4 ms}
  t: {processor: p, core: 1, priority: 2, period: 100 ms, compute_execution_time: 8 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [t]}}
"""
TWO_WAYS = """
threads:
  u: {processor: p, core: 1, priority: 9, period: 40 ms, compute_execution_time: 8 ms}
  a: {processor: p, core: 1, priority: 1, period: 10 ms, compute_execution_time: 1 ms}
  b: {processor: p, core: 1, priority: 3, dispatch_protocol: aperiodic, compute_execution_time: 3 ms}
  c: {processor: p, core: 1, priority: 4, dispatch_protocol: aperiodic, compute_execution_time: 3 ms}
connections: {ab: {from: a, to: b, latency: 0 ms .. 1 ms}, bc: {from: b, to: c, latency: 0 ms .. 1 ms}}
flows: {f: {path: [a]}}
"""
PILED = """
threads:
  r: {processor: p, core: 1, priority: 3, period: 5 ms, compute_execution_time: 3 ms}
  t: {processor: p, core: 1, priority: 1, period: 13 ms, compute_execution_time: 1 ms}
  k: {processor: p, core: 1, priority: 2, dispatch_protocol: aperiodic, compute_execution_time: 4 ms}
connections: {tk: {from: t, to: k, latency: 4 ms}}
flows: {f: {path: [t]}}
"""
BESIDE = """
devices: {d: {period: 8 ms, latency: 0 ms .. 7 ms}}
threads:
  a: {processor: p, core: 1, priority: 3, dispatch_protocol: aperiodic, compute_execution_time: 0 ms .. 2 ms}
  b: {processor: p, core: 1, priority: 1, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
  c: {processor: p, core: 1, priority: 3, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections: {da: {from: d, to: a}, ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a]}}
"""
