"""Answers as data: results, analyses, explanations and studies, with their JSON, CSV and frames.

Read `base.py` first, then `result.py`, the answer of `dse solve`.

* `base.py`: an answer and its form of JSON.
* `result.py`, `designs.py`, `robust.py`: the front of a question; the designs that it lists; the robust front.
* `question_data.py`: a question and its settings, as plain data.
* `analysis.py`, `simulation.py`, `measured.py`: one design, analysed, simulated, against measurements.
* `explanation.py`, `verification.py`, `comparison.py`: conflicts and relaxations; verdicts; two results or designs.
* `studies/`: fronts over a varied input or limit; margins, tornado bars, probabilities.
* `contention_verdicts.py`: requirements that a design keeps with CPU contention.
* `reading.py`: results read back from JSON.
* `ranking/`, `tables/`, `forms/`: order of a front; frames and units; JSON schemas.
* `exports/`, `drawing/`: a design in other formats; the architecture as SVG.

Not allowed here: searching, proving, changing a question; `questions` does that. Figures stay exact; rounding is for
display only.
"""
