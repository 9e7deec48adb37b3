"""Shared cores, response times and clocks in the second proof.

Read `contention.py` first. `clock_reads.py`, `contention.py`, `core_symmetry.py` and `waiting.py` have namesakes in
`encode/scheduling`, and share no code with them.

* `contention.py`: limits on response times, learned from refused solutions.
* `cores.py`, `core_symmetry.py`: limits of each core; interchangeable cores.
* `levels.py`: deadlines as demand of the threads of a core, level by level.
* `waiting.py`, `threads.py`: waiting as a variable; execution times, separations and priorities that it follows from.
* `messages.py`, `message_lessons.py`: rows of a bus on which messages wait; what a refused solution teaches of them.
* `message_waits.py`: how long messages wait, and behind whom.
* `sampling.py`, `clock_reads.py`: waits on clocks, release by release; reads on clocks with response times.
* `first_designs.py`: whether an earlier design has an equal objective vector.
* `by_type.py`: a hard question for each combination of types of processors.

Not allowed here: an import of `encode` or `search`. The clock formulas are written again on purpose.
"""
