"""Response times of threads and callbacks under fixed-priority preemptive scheduling.

Read `response_time.py` first (theory over plain tasks), then `scheduling.py` (a whole design).

* `response_time.py`, `busy_period.py`: the level-i busy period; its pieces, for a Gantt chart.
* `tasks.py`, `priorities.py`, `turns.py`: tasks of a thread; its priority; the order of the tasks on a core.
* `releases.py`, `overheads.py`: release jitter of a task; blocking sections, context switches, interrupts.
* `responding.py`: the response time of one task, on the resource where it runs.
* `holistic.py`, `growth.py`: the fixed point of response times and jitter; linear growth in one step.
* `scheduling.py`: the response times of a design, by core and priority.
* `waiting.py`, `parts.py`: the parts of a response time: own work, interference, blocking.
* `subsets.py`: remembered response times of groups of threads.
* `servers/`: executors, reservations, accelerators.

Not allowed here: offsets between threads used to advantage, and bounds below the worst case. A response time is exact
or a safe bound, in ns; None where it has no bound.
"""
