"""Answers as data: results, analyses, explanations and studies, with their JSON, CSV and frames.

Read `base.py` first, then `result.py`, the answer of `dse solve`.

* `base.py`: an answer and its form of JSON.
* `result.py`, `robust.py`: the front of a question; the robust front.
* `analysis.py`, `simulation.py`, `measured.py`: one design, analysed, simulated, against measurements.
* `explanation.py`, `verification.py`, `comparison.py`: conflicts and relaxations; verdicts; two results or designs.
* `sweep.py`, `sensitivity.py`: fronts over a varied input or limit; margins, tornado bars, probabilities.
* `contention_verdicts.py`: requirements that a design keeps with CPU contention.
* `reading.py`: results read back from JSON.
* `ranking/`, `tables/`, `exports/`, `forms/`: order of a front; frames and units; other formats; JSON schemas.

Not allowed here: searching, proving, changing a question; `questions` does that. Figures stay exact; rounding is for
display only.
"""
