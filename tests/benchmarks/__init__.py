"""Benchmarks: ``python -m tests.benchmarks``. Not part of the tests; see `reports/benchmarks/README.md`."""
