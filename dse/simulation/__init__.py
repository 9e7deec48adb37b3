"""Discrete-event simulation of one design: a witness that shares no formula with `analysis`.

Read `plan.py` first (the design as tasks, links and routes), then `engine.py` (the events).

* `readings.py`: times, rates, bindings and cores of a design, read from the space.
* `plan.py`: tasks, links and the data that flows follow.
* `engine.py`: one run.
* `bus_turns.py`, `bus.py`: how messages take their turns, and a bus that they wait for.
* `core.py`: a core of a processor: running job, ready jobs, interrupts, throttling, reservations.
* `observing.py`: the settings of a run and its observations.
* `search.py`: worst and best case of a flow, searched over offsets.

Not allowed here: an import of any folder but `space` and `support`; the contract forbids `analysis`, so that a mistake
there is not repeated. Time is exact, in ns. An observation is not a bound.
"""
