"""A second proof of a front or conflict: own tables, own enumeration, own CP-SAT model.

Read `prover.py` first, then `tables.py`.

* `prover.py`: one interface to both proofs, by exhaustion or by a second model.
* `diagrams.py`, `restricted_diagrams.py`: formulas as decision diagrams; diagrams over some of the options.
* `tables.py`, `sums.py`: a question as conditions and sums of diagrams.
* `exhaustion.py`: every design of a small question.
* `model.py`, `element_constraints.py`: the second model; diagrams in it.
* `reduced.py`: regions refuted on a smaller question.
* `plain_sums.py`: regions refuted by their relaxation, where all figures are plain sums.
* `cases.py`: several questions asked as one.
* `rounds.py`, `solver_calls.py`: a question asked again after a refused solution; settings of the solver.
* `geometry.py`: regions and points that leave nothing uncovered.
* `messages/`, `scheduling/`: messages that wait for buses; shared cores, response times and clocks.

Not allowed here: an import of `encode` or `search` (the contract forbids it): a mistake of the first proof must not be
repeated. `analysis` judges designs in both.
"""
