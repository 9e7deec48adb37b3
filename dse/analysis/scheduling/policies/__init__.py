"""Policies of resources: what goes before a job, and so how long it takes from its release to its end.

Each policy has a `window_of(resource, position, tasks, ...)` that gives what decides the response time of a stage: an
object with `response_ns()` and `parts()`. Read `preemptive.py` first.

* `preemptive.py`: fixed priorities on a core.
* `executors.py`, `executor_work.py`: OS threads that run one job at a time; the busy period of one.
* `successions.py`, `chains.py`: chains whose threads never wait for each other; one busy window for a chain on a core.
* `coupled.py`: threads that others on their stated core release, and how often they come in a busy window.
* `reservations.py`: budgets of a core in each period, as supply for their threads and as load for the others.
* `buses.py`, `transmit_queues.py`: messages that wait for each other: CAN, first come first served, round-robin;
  senders that queue messages as they come.
* `faults.py`: faults of a CAN wire, after which a frame is sent again.
* `segments.py`, `accelerators.py`: threads that run, wait on an accelerator, and run on; what an accelerator serves.

Not allowed here: a look at the space or at decisions, and bounds below the worst case. Each policy cites its source.
"""
