"""The order of a front, and the reasons for each of its designs.

Read `ranking.py` first.

* `ranking.py`, `order.py`: ranks and scores by a stated method; a result in another order.
* `reasons.py`: changes, gains, losses, margins and dominant contributions of a design.
* `kinds.py`: designs that are built alike, and the decisions that tell kinds apart.
* `changes.py`, `variants.py`: differences between two designs; near-identical designs.
* `core_numbering.py`: designs that differ in the numbers of equal cores only.
* `optimality_gap.py`: bounds on missing designs of a stopped search.

Not allowed here: leaving a point out, and ranking by rounded scores. Scores are exact; sentences are in `report/words`.
"""
