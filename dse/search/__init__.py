"""The complete Pareto front of a space, with the regions that prove it complete.

Read `front.py` first, then `regions.py` and `referee.py`.

* `front.py`: the search of all non-dominated points.
* `regions.py`: the part of the objective space that may still hold a point.
* `lexicographic.py`: the best point of some regions.
* `referee.py`: every design of the solver, evaluated again by `analysis`.
* `canonical.py`: the one design that stands for a point.
* `certificate.py`: the points and refuted regions of a search; narrowed to a stricter question.
* `alternatives.py`, `insist.py`: further designs near a point; the front with one option fixed.
* `solver_answer.py`, `workers.py`: found, no such design, unfinished; solvers in parallel, Ctrl-C.
* `tuning.py`: the switch and the constants of each heuristic.
* `solver/`, `feasibility/`: one call and its heuristics; conflicts and relaxations of infeasible problems.

Not allowed here: a point whose design the referee has not accepted, and a region dropped without a proof. An
unfinished call keeps its region open. The points of a complete front depend on neither workers nor time.
"""
