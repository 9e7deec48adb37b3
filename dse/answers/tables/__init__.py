"""Figures of answers in units that engineers read: cells, pandas frames, a networkx graph.

Read `display.py` first.

* `display.py`: an exact figure as text or cell, with its unit; unbounded figures.
* `frames.py`: tables as pandas frames, each column with its unit.
* `graph.py`: the architecture of a design as a networkx graph.

Not allowed here: a rounded figure that goes back into a computation. Rounding is for display only. pandas and networkx
are imported when a table or graph is asked for.
"""
