"""Files of other formats as the plain data of problem files, each value with its place in the source.

Read `registry.py` first: one entry for each format; the command, its options and the help text follow from it.
CONTRIBUTING.md adds an importer step by step.

* `registry.py`: the list of formats, and the result of an importer: document, places, remarks.
* `aadl/`: AADL models.
* `ros2/`: CARET files, traces, bags, launch files, executor configurations, message definitions.
* `can.py`, `can_sizes.py`, `can_dbc.py`: CAN databases (DBC, KCD, SYM, ARXML), by cantools; sizes refused before it
  reads them, and what of DBC files is mended.
* `amalthea.py`, `amalthea_xml.py`: Amalthea models, and the tree of their elements.
* `autoware/`: system design files of Autoware.
* `allowance.py`: the limit on the parts and texts that one file may ask for.

Not allowed here: an import of any folder but `support`; the schema of problem files checks the data later, in `spec`.
Nothing in a file is executed. A part that is left out becomes a remark with its place, a mistake a `Diagnostic`.
"""
