"""Shared cores, response times and clocks in the second proof.

Read `contention.py` first. What `encode/scheduling` has, too, has the same file name there, and shares no code.

* `contention.py`, `core_limits.py`: limits on response times, learned from refused solutions; limits of each core.
* `threads.py`: diagrams of the execution time, separation, priority and core of each thread.
* `schedulability.py`, `pooled_cores.py`: deadlines as demand of each core, and of interchangeable cores together.
* `core_symmetry.py`: numbering of interchangeable cores.
* `waiting.py`, `clock_reads.py`: waiting as a variable; reads on a common clock with response times.
* `reasons.py`, `orders.py`: lessons from a late thread; from cores without a feasible order.

Here alone: `sampling.py` (waits on clocks, release by release, for which the search asks the analysis),
`first_designs.py` and `by_type.py` (ways to ask: for an earlier design of equal objectives, and by types of
processors; in the first proof the search has them, not the encoder).

Not allowed here: an import of `encode` or `search`. The clock formulas are written again on purpose.
"""
