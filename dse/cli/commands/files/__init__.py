"""The commands that write problem files and other files: one file for each, as in the folder above.

Read `schema.py` first: the shortest one here.

* `new.py`, `schema.py`: a problem file to start from; JSON schemas.
* `importing.py`, `export.py`: other formats as problem files; problems and results in other formats.
* `fit.py`, `sizes.py`: measurements as figures of a problem file; sizes of ROS messages.

Not allowed here: what is not allowed in the folder above.
"""
