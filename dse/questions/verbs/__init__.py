"""The verbs that fit in one file each.

Read `solve.py` first: the pattern of all others (keywords, changed problem, computation, answer).

* `solve.py`, `alternatives.py`, `insist.py`, `feasible_designs.py`: the ranked front; further designs near its points;
  the price of each option; all feasible designs of a small problem.
* `check.py`, `analyse.py`, `simulate.py`: a description of the space; one design; one design played out in time.
* `compare.py`, `compare_measured.py`: results or designs side by side; a design against measurements.
* `export.py`: a design in another format.
* `import_file.py`, `import_times.py`: another format as a problem file; measured times put into it.
* `fit.py`, `sizes.py`: measurements to figures; sizes of ROS messages.

Not allowed here: printing, and a formula. A verb returns its answer as data.
"""
