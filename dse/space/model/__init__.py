"""The data of a design space: frozen classes and trees, without the code that builds them.

Read `space.py` first; its docstring states the units.

* `space.py`: decisions, processors, buses, components, connections, executors, reservations, and the `Space`.
* `trees.py`: values that depend on decisions, and reading them in a design.
* `flows.py`: end-to-end flows and their steps.
* `arrivals.py`: the releases of jobs under each dispatch protocol.
* `criteria.py`: metrics, requirements, rules and objectives with names resolved.
* `metric_kinds.py`: the names of metrics and their dimensions.
* `budgets.py`: stated budgets of processors and memories (OSATE).

Not allowed here: an import of any folder but `spec/language` (for syntax trees) and `support`.
"""
