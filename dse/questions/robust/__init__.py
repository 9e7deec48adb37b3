"""`dse solve --robust`: the front of the designs that hold for all stated values of their inputs.

Read `robust.py` first.

* `robust.py`: the nominal and the robust front.
* `corner_demands.py`: requirements at corners of the box of inputs, as demands of the search.
* `worst_case.py`: the worst place of a requirement over the box, proved for one design.

Not allowed here: sampling as a proof. A design is robust only where exact interval arithmetic shows it
(`questions/sensitivity/intervals.py`).
"""
