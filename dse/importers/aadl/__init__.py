"""AADL models as problem files: text, syntax tree, instance, problem; see `dse.importers.aadl.reading`."""
