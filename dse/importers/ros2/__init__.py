"""Descriptions, traces and messages of ROS 2 systems as problem files.

Read `system.py` first: every description becomes a `System` of callbacks, groups and messages, which is written as
one document.

* `system.py`: a ROS 2 system, and the problem file that it makes.
* `caret.py`, `cie.py`: architecture files of CARET; configurations of the callback-isolated executor.
* `events.py`, `trace.py`: events of ros2_tracing; callbacks, timers and execution times from them.
* `launch/`: launch files and parameter files.
* `bags.py`, `messages.py`: sizes and rates of recorded messages; sizes of message types, by rosbags.
* `packages.py`: packages of a workspace by their names.
* `serialised.py`, `idl.py`: the serialised size of a message type; expressions of IDL that are refused.
* `matching.py`, `merging.py`: equal callbacks of two descriptions; several sources merged into one document.
* `yaml_places.py`: YAML of other tools with line numbers.

Not allowed here: a silent guess. A part that is left out or assumed becomes a remark with its place.
"""
