"""AADL text to a syntax tree: names as written, nothing looked up.

Read `tree.py` first, then `parser.py`.

* `tree.py`: the nodes of the tree, frozen dataclasses.
* `tokens.py`, `cursor.py`: tokens with their places, and the cursor that every grammar rule reads from.
* `parser.py`: packages, classifiers, property sets; recursive descent, one function for each rule.
* `sections.py`: the sections of a classifier: features, flows, subcomponents, connections, modes.
* `values.py`: property associations and their values.
* `predeclared.py`: the property sets and units that every model has without declaring them.

Not allowed here: an import of `instance` or `document`. A mistake does not end the reading of a file: the parser goes
on behind the classifier that holds it.
"""
