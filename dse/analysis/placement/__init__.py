"""Threads on cores: partitions, first-fit, and priority orders that meet limits.

Read `partition.py` first, then `heuristics.py`.

* `partition.py`, `bin_packing.py`: a partition that keeps every core within its capacity, or a proof of none; the
  complete search behind it.
* `subset_sum.py`: nearly full cores, filled one after the other.
* `first_fit.py`: the core of each thread: stated, else first-fit by decreasing utilisation.
* `admission.py`: whether a core may take one more thread, by response times.
* `priority_assignment.py`: the best priority order of a core (Audsley).
* `heuristics.py`: other cores and priorities for a design, quickly.
* `lexicographic.py`: the first cores in the order of the file that meet all limits.

Not allowed here: impossibility claimed by a heuristic. First-fit, `subset_sum.py` and `heuristics.py` that end without
cores prove nothing; `partition.py` says of each answer whether it is a proof or an end of effort.
"""
