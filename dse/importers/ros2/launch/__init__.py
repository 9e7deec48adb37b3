"""The static parts of launch files (XML, YAML, Python) and parameter files of ROS 2.

Read `reading.py` first, then `running.py`.

* `reading.py`: launch and parameter files as documents of problems.
* `running.py`: the nodes and containers that a launch file starts, with names, remappings and parameters.
* `entities.py`: the tree of actions, and the XML and YAML front ends.
* `python.py`: the Python front end: it reads the syntax tree and runs nothing.
* `actions.py`: actions of launch and launch_ros.
* `operations.py`, `builtins.py`, `texts.py`: operators, functions, and methods of texts and paths, on partly unknown
  values.
* `substitutions.py`: texts such as ``$(var name)``.
* `parameters.py`: parameter files and the periods of timers in them.

Not allowed here: executing a launch file, and reading an environment variable of this machine. A value that only the
launch decides is left out and named in a remark.
"""
