"""A second, independent reading of the documents: it shares no code with `dse`."""
