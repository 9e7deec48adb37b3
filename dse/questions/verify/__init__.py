"""`dse.verify`: a result checked against its problem, and its completeness proved a second time.

Read `verify.py` first.

* `verify.py`: the check of a whole result, robust or not.
* `points.py`: the stated figures, evaluated again by `analysis`.
* `completeness.py`, `conflicts.py`: refuted regions and conflicts, proved again by `verification`.
* `alternatives.py`, `insisting.py`: further designs; fronts with an option fixed.
* `contention.py`, `contention_claims.py`: verdicts with CPU contention, on cores that are chosen; and their proof.

Not allowed here: an import of `encode` or `search`. The result file is not trusted: figures are recomputed, and claims
about all designs are proved again.
"""
