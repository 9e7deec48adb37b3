"""The formulas of every metric, and the referee that applies them to one design.

Read `evaluate.py` first (the referee), then `terms.py` and `measures.py` (a metric as a sum of terms).

* `evaluate.py`: every figure and verdict of one design, without a solver.
* `measures.py`, `terms.py`, `timescale.py`: metrics as sums; their summands; the common denominator of their times.
* `limits.py`, `validity.py`: requirements as exact comparisons; combinations of options that are designs.
* `views.py`, `memo.py`: a (partial) design as formulas see it, tables over decisions; remembered results.
* `rates.py`, `usage.py`, `binding.py`: activation rates; load and utilisation; processors and buses that are used.
* `bounds.py`: requirements that no design can meet, shown by bounds alone.
* `latency/`, `scheduling/`, `placement/`: end-to-end latency; response times; threads on cores.
* `messages/`: messages that wait for their bus.
* `diagnosis/`, `osate/`: causes of broken requirements; the rules of OSATE.

Not allowed here: a solver, a float as a figure, a second copy of a formula. A formula has one home, reads a design
only through its view, and cites its source. `encode` tabulates it, `report` prints its terms.
"""
