"""Answers as JSON: one codec writes, reads and describes them, from the annotations of their classes.

Read `codec.py` first, and beside it `dse.support.json_fields`, in whose words a class says what is written of it.
CONTRIBUTING.md adds a field to an answer.

* `codec.py`: an object as plain data, plain data as an object, and the model that checks data.
* `registry.py`: every format by name: its schema, and checks of data.
* `consistency.py`: checks across the parts of a file.

Not allowed here: accepting an unknown field, and computing a figure while it is written.
"""
