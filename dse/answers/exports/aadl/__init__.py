"""Designs as AADL: a whole model, or an implementation that extends the imported model.

Read `model.py` first.

* `model.py`: a design of a problem file as one package with a property set.
* `extension.py`: a design of an imported model as an implementation that extends it.
* `message_sizes.py`: ports whose messages have another size, in such an implementation.
* `fixed_document.py`: the document of a problem with every decision made.
* `package.py`, `names.py`: parts of a package as text; identifiers and quantities as AADL writes them.
* `flows.py`, `paths.py`: end-to-end flows; their paths, component by component.
* `budgets.py`: budgets as properties that OSATE reads.

Not allowed here: reading AADL; `importers/aadl` does, and has the property set that both share (`property_set.py`).
"""
