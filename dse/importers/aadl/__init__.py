"""AADL models as problem files: text, syntax tree, instance tree, document.

Read `reading.py` first: it calls the three steps in order.

* `reading.py`: the importer, from the files of a model to the document of a problem.
* `syntax/`: text to a syntax tree; nothing is looked up.
* `instance/`: syntax trees to the instance of one system: components, properties, connections, flows.
* `document/`: the instance to the sections of a problem file.
* `property_set.py`: the property set for figures that AADL has no property for; read here, written by the AADL export.

Not allowed here: silence. A property or a construct that is not understood becomes a remark with its place.
"""
