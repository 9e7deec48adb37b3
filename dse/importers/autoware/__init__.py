"""Autoware's system design files: nodes with their processes, modules, and systems of them on compute units.

Read `reading.py` first. Format: the instructions and schemas of github.com/autowarefoundation/autoware_system_designer
(`autoware_system_design_format`, up to 0.3).

* `entities.py`: files by the names of what they define, with `base`, `remove`, `override` and modes.
* `tree.py`: the instances of a system, and which port leads to which, wildcards included.
* `processes.py`: processes as threads, by the ways in which they start.
* `reading.py`: the document of a problem.

Not allowed here: parameters, which say nothing of time; services, of which nothing says how often they are called.
"""
