"""Delays of threads and chains as rows of the CP-SAT model, beside the rows of single threads (`waiting.py`).

Read `chains.py` first.

* `chains.py`: how long threads in a row wait together, a variable for each chain and each part of it.
* `jobs.py`: further jobs of others, counted within a wait where a solution is too low.
* `jitters.py`: release jitter of threads that others release.
* `hosted.py`: waiting for others in one executor.

Not allowed here: a row that removes a design which the referee accepts. Rows are necessary conditions.
"""
