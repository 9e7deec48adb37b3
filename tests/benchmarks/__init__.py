"""Benchmarks: ``python -m tests.benchmarks``. Their peers' own tests are here too; see `reports/benchmarks/README.md`."""
