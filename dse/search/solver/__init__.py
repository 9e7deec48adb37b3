"""One call of CP-SAT, and the heuristics that make it short.

Read `strategy.py` first.

* `strategy.py`, `call.py`: which settings and heuristics a question is asked with; one call, its limits and what its
  solutions say.
* `settings.py`, `portfolio.py`: settings of CP-SAT; the choice between them by measured work.
* `subspaces.py`: a question asked for each combination of shared options, such as the types of processors.
* `bounding.py`, `value_grid.py`, `knapsack.py`: bounds of an objective from both sides; its possible values; two
  objectives by dynamic programming.
* `repair.py`, `pooled_cores.py`: other cores or options where a solution is refused; pools of interchangeable cores.

Not allowed here: a refutation by a heuristic. A heuristic offers a design, which `analysis` weighs. Work is counted in
deterministic time, never in seconds, so that a problem and a seed give one sequence of answers.
"""
