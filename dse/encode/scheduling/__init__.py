"""Shared cores, response times and clocks in the CP-SAT model: rows from the start, clauses learned later.

Read `contention.py` first. `clock_reads.py`, `contention.py`, `core_symmetry.py` and `waiting.py` have namesakes in
`verification/scheduling`, which treat the subject with code of their own.

* `contention.py`, `core_limits.py`: limits on response times; limits of each core.
* `places.py`, `combined.py`: literals of the core, rate and time of a thread; literals of several threads.
* `schedulability.py`, `core_demand.py`: rows of the level form; the times at which they are tested.
* `waiting_forms.py`, `waiting.py`: response times as linear forms; waiting as a variable.
* `delays/`: rows of what delays chains and threads in executors, of release jitter, and of further jobs.
* `reasons.py`, `orders.py`: causes of a late thread as clauses; sets of threads without a feasible order.
* `clock_reads.py`: reads on a common clock.
* `core_symmetry.py`: numbering of interchangeable cores.
* `pooled_cores.py`, `roomy.py`: variants of the model for the heuristics of `search/solver`.

Not allowed here: a row or clause that removes a design which the referee accepts, except for the numbers of
interchangeable cores. Rows are necessary conditions; the referee refuses the rest, and the model learns from it.
"""
