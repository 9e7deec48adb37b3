"""The commands of `dse`: one file for each, with its options and its help.

Read `check.py` first: the shortest command. A file has a function `command`, which `cli/main.py` imports when called;
`robust.py` serves `solve.py`.

* `solve.py`, `robust.py`: the front; its option ``--robust``.
* `check.py`, `analyse.py`, `simulate.py`, `explain.py`, `verify.py`: a problem; a design; a result.
* `compare.py`, `report.py`: results and designs side by side; results as reports.
* `sweep.py`, `sensitivity.py`: studies.
* `files/`: problem files to start from, imports and exports, JSON schemas, measurements, sizes of ROS messages.

Not allowed here: computing. A command claims its output files before its work; the page of its answer is made in
`report`.
"""
