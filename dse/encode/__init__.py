"""The design space as a CP-SAT model.

Read `model.py` first: it reads like a contents page. Then `linear.py`: literals and linear forms.

* `model.py`: the whole model of a space.
* `linear.py`: the model under construction, literals of options, linear forms.
* `literals.py`: literals by index, the same in every copy of a model.
* `decisions.py`: one option for each active decision; structure and rules.
* `requirements.py`: requirements as linear constraints.
* `sums.py`, `table_parts.py`: measures as linear forms; large tables as sums of smaller ones.
* `rates.py`: activation rates as variables or tables; acyclic dispatch.
* `search_order.py`: depth-first search in the order of the file.
* `tuning.py`: switches and constants of the heuristics of the model.
* `messages/`: messages that wait for buses.
* `scheduling/`: response times, shared cores and clocks.

Not allowed here: running the solver (`search` does), and a formula of a metric: coefficients come from tabulating
`analysis`. Sums stay below 2**53. Rounding relaxes a constraint and loses no design; the referee decides.
"""
