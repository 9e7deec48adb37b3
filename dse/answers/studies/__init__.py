"""Answers of studies: how fronts and designs change with an input.

Read `sweep.py` first.

* `sweep.py`, `run_data.py`: fronts over a varied input or limit; a run of a sweep as plain data.
* `sensitivity.py`: margins, tornado bars, probabilities of requirements.

Not allowed here: what is not allowed in the folder above.
"""
