"""The instance of an AADL system: a tree of components with properties, connections and flows.

Read `model.py` first: it builds everything below in order and offers it in one place.

* `model.py`: a model as its instance, from files on.
* `library.py`: the files of a model, and the meaning of a name in one of them.
* `inheritance.py`: classifiers with all that they inherit, refinements merged, prototypes resolved.
* `instance.py`: the tree of components, in the chosen modes.
* `properties.py`: the value of a property, by the rules of AADL (AS5506, section 11.3).
* `connections.py`: connections from end to end, across feature groups and levels.
* `flows.py`: end-to-end flows, flattened.
* `unread_properties.py`: a remark for each property that nothing reads.

Not allowed here: sections and keys of problem files; those belong to `document`.
"""
