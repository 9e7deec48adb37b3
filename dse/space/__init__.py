"""The design space: names resolved, quantities integer, decisions numbered.

Read `model/space.py` first (the data), then `build.py` (the construction, in order).

* `build.py`: a loaded problem to its `Space`, with every mistake in names and structure.
* `model/`: the data alone.
* `architecture/`: components, processors, buses, connections and flows of a problem.
* `question/`: metrics, requirements, rules, objectives, open cores and priorities.
* `packing.py`: connections that may share a frame where the search chooses.
* `parameters.py`: parameters of threads, and execution times by their values.
* `properties.py`: options in the file to decisions and trees of figures.
* `options.py`: texts such as ``nav.period = 10 ms`` to options.
* `core_symmetry.py`: interchangeable cores of a processor.
* `size.py`: the number of combinations of options.

Not allowed here: formulas of metrics, and floats. A figure that depends on a decision is a tree that `at(tree, view)`
reads. A `Space` is frozen.
"""
