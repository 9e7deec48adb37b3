"""Plots of answers, drawn as SVG.

Read `canvas.py` first, then `charts.py`.

* `canvas.py`: the drawing board: scales, axes, legends, elements of SVG whose widths are shares.
* `charts.py`: the two kinds of plots that most are: bars in rows, and points and lines over two axes.
* `front.py`: scatter and parallel coordinates of a front.
* `design.py`, `deadlines.py`: latency waterfalls and use of processors and buses; response times against deadlines.
* `study.py`: sweeps, tornadoes, histograms.
* `fit.py`: samples, lines and residuals of a fit.

Not allowed here: a text that is not escaped, a colour that is not of the theme. Each plot shows figures that a table
has too.
"""
