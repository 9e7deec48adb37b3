"""One function for each verb of `dse`: from a problem and the changes of a caller to an answer.

Read `problem.py` first (load and ask), then `verbs/solve.py`.

* `problem.py`, `question.py`: a loaded problem; the keywords by which a caller changes its question.
* `builder.py`: a problem made in Python, without a file.
* `verbs/`: solve, check, analyse, compare, export, fit, import, insist, simulate, sizes.
* `explain/`, `verify/`, `sweep/`, `sensitivity/`, `robust/`: the larger verbs.
* `complete_design.py`, `named_design.py`: a whole design from some decisions; a design as a caller names it.
* `reopen.py`, `result_problem.py`, `result_question.py`: a result file as a result; its problem; its question.
* `front_verdicts.py`: which designs of a front hold when threads wait, on cores that are chosen.
* `beyond_limit.py`: the nearest design beyond a limit of a front.
* `stopped_search.py`, `resume.py`: the state of a stopped search; its continuation.

Not allowed here: printing, options of a command, the solver (only `encode`, `search` and `verification` import it),
formulas of metrics.
"""
