"""Causes of broken requirements: late threads, long flows, overloaded cores and buses, remarks.

Read `lateness.py` first.

* `lateness.py`, `flow_delays.py`: the delays of a late thread; of a flow.
* `shortening.py`, `what_if.py`: single shorter times that would be enough, exactly; a system with one.
* `timelines.py`, `bus_timelines.py`: the busy period in which a job or a message responds last, for a Gantt chart.
* `reservation_budgets.py`: the least sufficient budget of a reservation.
* `overloads.py`, `overload_search.py`: users of an overloaded core or bus; a design with less overload, as an example.
* `unbounded.py`: response times without a bound, and the metrics that they may reach.
* `without_contention.py`: requirements as if no thread waited for the CPU.
* `front_verdicts.py`: verdicts with CPU contention on designs of a front that leaves it out.
* `remarks.py`, `join_remarks.py`: remarks on a design or a problem; those on threads that several inputs dispatch.

Not allowed here: formulas of response times. A shorter time that would be enough is found by asking
`analysis/scheduling` again.
"""
