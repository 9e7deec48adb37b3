"""The quantities that a problem file states, by paths such as ``threads.nav.compute_execution_time``.

Read `quantities.py` first. Sweeps, margins and uncertainties vary these figures.

* `quantities.py`: every stated value with path, kind, nominal value and unit; a problem with other values.
* `totals.py`: figures of declared totals in their declared units.
* `rounding.py`: each figure that reading has rounded.

Not allowed here: floats. A value is the exact one of the file.
"""
