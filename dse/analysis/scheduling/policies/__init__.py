"""Response times where something other than a core serves jobs: executors, reservations, accelerators.

Read `executors.py` first.

* `executors.py`, `executor_work.py`: OS threads that run one job at a time; the busy period of one.
* `succession.py`: chains of threads in an executor that never wait for each other.
* `reservations.py`: budgets of a core in each period, as supply for their threads and as load for the others.
* `segments.py`: threads that run, wait on an accelerator, and run on.
* `queues.py`: accelerators that serve in order of arrival.

Not allowed here: bounds below the worst case. Each policy cites its source in the docstring.
"""
