"""The problem file: text to a validated, frozen specification.

Read `schema/model.py` first (the keys of the file), then `loading/load.py` (the way from a path to a `Spec`).

* `schema/`: the classes that a file is read into; `dse schema` prints them.
* `loading/`: YAML with places, includes, validation, all mistakes at once.
* `language/`: the grammar of requirements, objectives, derived metrics and rules.
* `quantities/`: the stated quantities by their paths, and their roundings.
* `kinds.py`: what executors and buses may be, by the names that files give them.

Not allowed here: resolving names between sections, decisions, formulas; those belong to `space` and `analysis`. Values
are read with their unit once, here, as integers or exact fractions.
"""
