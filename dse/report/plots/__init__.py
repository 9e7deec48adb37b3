"""Plots of answers as Vega-Lite specifications.

Read `front.py` first.

* `front.py`: scatter and parallel coordinates of a front.
* `design.py`, `deadlines.py`: latency waterfalls and use of processors and buses; response times against deadlines.
* `study.py`: sweeps, tornadoes, histograms.
* `fit.py`: samples, lines and residuals of a fit.

Not allowed here: a name of the problem as a field or in an expression of a Vega-Lite specification; names are data and
titles only. Each plot shows figures that a table has too.
"""
