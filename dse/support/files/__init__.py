"""Files in and out: bounded reading of regular files, guarded writing in one step.

Read `guard.py` first: it notes the inputs of a run and claims its outputs, so that no output overwrites an input or
another output.

* `guard.py`: the inputs and outputs of one run.
* `reading.py`: bytes and text of a regular file, up to a size.
* `writing.py`: files and folders, each file whole or not at all.
* `plain_json.py`, `xml.py`: strict reading of JSON; XML with the lines of its elements.
* `foreign.py`: errors of a library as a mistake in the file that it reads.

Not allowed here: the content of a format, JSON and XML aside. Inputs and outputs of a run pass through this folder;
only the store of sweeps is an SQLite file of its own.
"""
