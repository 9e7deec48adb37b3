"""Benchmarks: ``python -m tests.benchmarks``. Described in `reports/benchmarks/README.md`, with peers' tests."""
