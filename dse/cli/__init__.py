"""The command line: options, streams, exit codes.

Read `main.py` first, then `commands/check.py` as an example of a command.

* `entry.py`, `main.py`, `interrupts.py`: the program; its commands, imported when called; Ctrl-C.
* `commands/`: one file for each command.
* `options.py`, `common.py`: options of a question and a ranking; options, files and the console of all commands.
* `progress.py`: the line that moves on a terminal, and acknowledges Ctrl-C.
* `grouping.py`, `completion.py`: options in groups; what a shell offers to complete.
* `printing.py`: text that leaves the program, with control characters escaped.
* `pages.py`, `study_files.py`: an answer on the terminal, as a page, in files; files of studies.
* `postponed.py`: imports of libraries that most commands never need.

Not allowed here: computing. A command reads options, calls `questions`, and prints or writes the answer. Only `cli` and
`report` know the terminal, and only `cli` knows click.
"""
