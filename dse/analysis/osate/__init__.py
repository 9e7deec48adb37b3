"""Latency, load and resource budgets by the rules of OSATE (profiles `osate-2.2` and `osate-2.19`).

Read `latency.py` first (docs/semantics.md, section 3.7).

* `latency.py`, `components.py`, `media.py`: rows of a flow, of a component in it, of a message on each medium.
* `findings.py`: the specified column and OSATE's verdicts on a flow.
* `load.py`: bus load against budgets.
* `resources.py`: budgets of processors and memories.
* `quirks.py`: places where a known quirk of OSATE changes a figure.

Not allowed here: improvements. OSATE's quirks are copied, so that the figures agree with OSATE; `quirks.py` names the
places where they act.
"""
