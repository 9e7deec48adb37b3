"""Problem files to a `Spec`: reading, includes, validation, and every mistake with its place.

Read `load.py` first.

* `load.py`: the way from a path or text to a loaded problem.
* `reader.py`: YAML to a tree of nodes with line and column, bounded in size and depth.
* `sources.py`, `samples.py`, `messages.py`: files on disk or carried by a result; columns of CSV samples; sizes of
  ROS messages.
* `foreign.py`: imported models as trees, and files that decide over them.
* `recognition.py`: whether a file is a problem file.
* `validation_messages.py`, `partial_reading.py`: messages in plain words; the rest of a file without its mistakes.
* `document.py`: the merged document and its digest, by which two problems are equal.
* `writing.py`: plain data as YAML.

Not allowed here: a traceback or a first mistake that hides the others. All findings are collected, then reported once.
"""
