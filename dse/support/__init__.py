"""Errors, files, time limits and units: tools that know nothing of problems and designs.

Read `errors.py` first: every mistake of a user is a `Diagnostic` with its place, or an exception with an exit code.

* `errors.py`: diagnostics, exceptions, exit codes.
* `units/`: text with a unit to exact numbers, and back.
* `files/`: bounded reading and guarded writing of files.
* `timelimit.py`: the time limit of a command, which the loops of formulas look at.
* `arguments.py`: arguments of the Python verbs, checked as the options of the command line are.
* `json_fields.py`: the words in which a class says what is written of it as JSON.
* `extras.py`: libraries of optional extras, and the message where one is not installed.
* `graphs.py`: cycles in directed graphs.
* `theme.py`: colours by name, for pages and drawings.
* `plugins.py`: what other packages add by entry points.
* `version.py`: the version of the program, and the version of the meaning of its figures.

Not allowed here: an import of any other folder of `dse`, a word about threads, buses or designs, printing.
"""
