"""Measurements to figures of a problem file: transmission times and execution times, with their quality.

Read `fit.py` first.

* `fit.py`, `fitted.py`: transports and executions of all files; the answer, a catalogue that problem files include.
* `measurements.py`, `columns.py`, `observed.py`: CSV of samples; roles and units of columns; CSV of observed metrics.
* `lines.py`: straight lines through minima and maxima of message sizes.
* `extremes.py`: extreme-value fits beside a sample maximum.
* `judging.py`: goodness of fit, and remarks on odd measurements.

Not allowed here: an extrapolation called a bound, and a figure rounded inwards. Statistics may compute with floats.
"""
