"""A second proof of a result: its own tables, enumeration and model; nothing from the encoding or the search."""
