"""Shared cores, response times and clocks in the CP-SAT model: rows from the start, clauses learned later.

Read `contention.py` first. What `verification/scheduling` has, too, has the same file name there, and shares no code.

* `contention.py`, `core_limits.py`: limits on response times; limits of each core.
* `threads.py`: literals of the core, rate and time of each thread.
* `schedulability.py`, `pooled_cores.py`: rows of the level form, of each core and of interchangeable cores together.
* `core_symmetry.py`: numbering of interchangeable cores.
* `waiting.py`, `clock_reads.py`: waiting as a variable; reads on a common clock.
* `reasons.py`, `orders.py`: causes of a late thread as clauses; sets of threads without a feasible order.

Here alone: `combined.py` (literals of several threads), `core_demand.py` (times at which rows are tested) and
`delays/` (rows of chains, further jobs, executors and release jitter), of which the second proof has the part that it
needs in `waiting.py` and `schedulability.py`; it learns executors and release jitter. `waiting_forms.py` (response
times as linear forms), which are sums of diagrams there. `roomy.py` (a model for `search/solver`).

Not allowed here: a row or clause that removes a design which the referee accepts, except for the numbers of
interchangeable cores. Rows are necessary conditions; the referee refuses the rest, and the model learns from it.
"""
