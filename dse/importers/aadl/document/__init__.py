"""The instance of an AADL system as the document of a problem file.

Read `problem.py` first: one writer for each section, in order.

* `problem.py`: the whole document.
* `components.py`: threads, devices and other components of flows.
* `connections.py`: connections with sizes, rates and buses.
* `hardware.py`: processors, buses, virtual buses and their types.
* `partitions.py`, `budgets.py`: partitions in time; budgets of processors and memories.
* `implementations.py`: several implementations of a subsystem as options of one decision.
* `values.py`: property values as texts with units.

Not allowed here: computing a figure. A document states the values of the model, each with its place; rules and names
are those of OSATE.
"""
