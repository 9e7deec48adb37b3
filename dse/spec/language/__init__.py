"""The expression language of requirements, objectives, derived metrics and rules.

Read `expressions.py` first: the syntax trees.

* `expressions.py`: frozen syntax trees.
* `grammar.py`: the parser of requirements, objectives, derived metrics and assignments.
* `rules.py`: the parser of conditions between decisions.
* `scan.py`: errors with an offset, quotes, operators, word boundaries.

Not allowed here: resolving names. `space/question` resolves the trees against the architecture.
"""
