"""Response times: what a design's threads wait for on the resources that serve them.

Read `model.py` first (the plain data), then `fixed_point.py` (the theory), then `resolve.py` (how data are read).

* `model.py`, `resolve.py`, `order.py`: stages, releases and resources; reading them from a design; who goes first.
* `tasks.py`, `priorities.py`, `overheads.py`: what a job takes by itself; priorities; sections, switches, interrupts.
* `event_models.py`, `busy_window.py`: what releases a stage, with its jitter; the busy window and the worst job in it.
* `policies/`: how cores, executors, reservations, accelerators and buses serve jobs.
* `fixed_point.py`, `growth.py`: all response times together; linear growth followed in one step.
* `responses.py`, `subsets.py`: the response times of a design or of groups of threads, remembered.
* `chained.py`: how long threads in a row take together.
* `parts.py`, `waits.py`: what a response time is made of.

Not allowed here: a look at the space or the decisions outside of resolving and asking (`responses.py`, `chained.py`),
which an import contract holds; offsets between threads used to advantage; bounds below the worst case. A response time
is exact or a safe bound, in ns; None without a bound.
"""
