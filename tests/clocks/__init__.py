"""Clocks, offsets and logical execution time."""
