"""A design in other formats: problem file, ROS 2, CSV, CAN databases, Graphviz, GraphML, AADL.

Read `formats.py` first.

* `formats.py`: ROS 2 parameters, CSV of cores and priorities, Graphviz, GraphML.
* `problem_file.py`, `yaml_editing.py`: the problem file with its decisions fixed; edits that keep comments.
* `dbc.py`: the messages of a CAN bus as a database.
* `cie.py`: a configuration of the callback-isolated executor.
* `aadl/`: AADL models.

Not allowed here: a figure of its own. An exported problem file or AADL model must give the figures of its design
again; `questions/verbs/export.py` checks that before it is handed out.
"""
