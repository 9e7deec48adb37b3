"""The forms of JSON: one class for each format, which gives its schema, its writer and its reader.

Read `base.py` first, then `result.py` as an example. CONTRIBUTING.md adds a field to an answer.

* `base.py`: strictness, exact figures, and fields with their descriptions.
* `result.py`, `design.py`: `dse solve`; one design or problem (analyse, check, simulate).
* `verdicts.py`, `late.py`: explanations, comparisons, verifications; causes of late threads.
* `studies.py`, `margins.py`: sweeps; sensitivity.
* `fit.py`, `sizes.py`: fits of measurements; sizes of ROS messages.
* `registry.py`: every format by name: its schema, and checks of data.
* `writing.py`, `from_data.py`: answers to plain data; plain data to answers.
* `consistency.py`: checks across the parts of a file.

Not allowed here: accepting an unknown field, and computing a figure while it is written.
"""
