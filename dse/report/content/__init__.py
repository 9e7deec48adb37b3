"""The pages of answers: one file for each verb.

Read `verify.py` first (the shortest page), then the folder `front`.

* `front`: the front on a screen, as pages, and as the data of the HTML page.
* `analyse.py`, `simulate.py`, `measured.py`: one design, analysed, simulated, against measurements.
* `explain.py`, `verify.py`, `compare.py`: explanations, verdicts, comparisons.
* `study.py`, `sweep.py`, `sensitivity.py`: a study as a page; the sections of sweeps and sensitivity.
* `check.py`, `fit.py`, `sizes.py`: descriptions of spaces; fits; sizes of ROS messages.

Not allowed here: HTML, Markdown or terminal codes. A file returns pages, sections or plain data; the writers set them.
"""
