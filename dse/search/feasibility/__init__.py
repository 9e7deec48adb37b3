"""Infeasible problems: minimal conflicts, smallest corrections, exact relaxations.

Read `oracle.py` first: whether some demands hold together.

* `oracle.py`: a design for a set of requirements, rules and fixed decisions, or a proof of none.
* `guarded_model.py`: one model whose demands are switched on and off.
* `conflicts.py`: minimal conflicts and the smallest correction (MARCO).
* `relaxations.py`: the closest limit at which a requirement holds with the others.
* `other_cores.py`: cores on which designs of a front hold when threads wait.

Not allowed here: a conflict that the solver merely claims. Each one is proved again, with a design for each member
left out.
"""
