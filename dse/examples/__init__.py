"""Example problems: those that are shipped with `dse`, and random ones.

Read `shipped.py` first.

* `shipped.py`: the files of the folder `problems`, in a checkout or an installation.
* `random/`: random problems of any size.
* `model_decisions.py`: a file that decides over an AADL model, to start from.

Not allowed here: an import of `search`, `verification` or anything above.
"""
