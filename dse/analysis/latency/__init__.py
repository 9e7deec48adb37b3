"""End-to-end latency and jitter of flows, by the rules of the profile `dse`.

Read `contributors.py` first: the contributor table of a flow, row by row (docs/semantics.md, section 3).

* `rows.py`, `processing.py`: a row of that table; that of what a job takes.
* `deliveries.py`: the rows of a connection: transmission, and waiting for its bus.
* `contributors.py`: the rules of latency, element by element.
* `metrics.py`: metrics of flows as terms.
* `element_waits.py`: which response times the terms of an element hold.
* `stored_inputs.py`: waits of data for the next dispatch of their reader.
* `skipping.py`: releases that a timer skips, and its own job, which data do not wait for twice.
* `joined_inputs.py`: waits of a message for those of all other triggers.
* `sampling.py`: waits between neighbours on one clock, in closed form.
* `clock_reads.py`: waits of a reader on a clock, with response times and offsets left open.
* `exact_chains.py`: the exact latency over the hyperperiod of flows whose timers share clocks.
* `offset_advice.py`: reads that just miss their data, and offsets that would shorten a flow.

Not allowed here: rules of OSATE (`analysis/osate`), response times (`analysis/scheduling`). Times are exact, in ns.
"""
