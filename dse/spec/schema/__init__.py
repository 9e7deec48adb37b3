"""The schema of the problem file: strict, frozen classes with quantities already read.

Read `model.py` first. CONTRIBUTING.md ("Add a decision") adds a key.

* `model.py`: threads, devices, processors, buses, connections, flows, settings: the whole file.
* `hardware.py`, `frames.py`, `resources.py`: types of processors and buses; frames on the wire; partitions, memories
  and budgets.
* `ros2.py`, `uncertainty.py`: names in ROS 2; stated uncertainties.
* `fields.py`, `quantity_fields.py`: the field types: reading, checking, writing, description for editors.
* `canopen.py`: identifiers by function code and node.
* `parts.py`: the base class of all sections.
* `json_schema.py`, `descriptions.yaml`: the JSON Schema, and the texts of its properties.

Not allowed here: unknown keys, coercion, a number without its unit. A key has its description and an example in
`descriptions.yaml`.
"""
