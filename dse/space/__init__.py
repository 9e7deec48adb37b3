"""The space of designs: names resolved, quantities integer, decisions numbered."""
