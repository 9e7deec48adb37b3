"""Mutated files for the loader and the command line: ``python -m tests.fuzz``; a few of them in the tests."""
