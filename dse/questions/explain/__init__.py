"""`dse.explain`: causes of infeasibility, relaxations, and offers of further options.

Read `explain.py` first.

* `explain.py`: conflicts, closest limits, the fewest demands to give up.
* `without_contention.py`: conflicts that hold even if no thread waits for the CPU.
* `examples.py`: the designs that an explanation names, with their broken requirements.
* `offers.py`: offers such as ``computer.type += Spectra``, cheapest first.
* `brief.py`: the conflicts of an infeasible problem in a result.
* `limits.py`: limits in the units of an explanation.

Not allowed here: a conflict without a proof from `search/feasibility`. An explanation cut short by time says so.
"""
