"""`dse.sweep`: fronts as a function of an input or a limit, run by run.

Read `sweep.py` first.

* `sweep.py`, `axes.py`: the plan of all runs; the values of ``--vary``.
* `inputs_of_file.py`: the quantities of a problem file as text, by paths.
* `break_points.py`: the exact limits at which a front changes.
* `runs.py`, `fronts.py`: one run as text in and text out; fronts as plain data.
* `store.py`: finished runs in one SQLite file.
* `workers.py`, `cluster.py`: processes of this machine; a Dask cluster.

Not allowed here: a model or an object shipped to a worker; only text is. A run that is stored is found by its content
and the version of the meaning, so anything that changes an answer must change its key.
"""
