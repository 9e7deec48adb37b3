"""`dse.sensitivity`: margins of one design, influential inputs, stated uncertainties.

Read `sensitivity.py` first, then `design_function.py`.

* `sensitivity.py`: the study of one design.
* `traced_numbers.py`, `inputs.py`, `design_function.py`: numbers that remember their expression; a space over its
  inputs; metrics and requirements of a design as functions of inputs.
* `input_line.py`, `margins.py`: a design along a line through its inputs; margins and tornado bars.
* `intervals.py`, `response_variables.py`: exact bounds over a box of inputs; response times as variables there.
* `uncertainty.py`, `importance.py`: sampled inputs; probabilities and Sobol indices.

Not allowed here: a copy of a formula. The expressions come from `analysis`, computed with traced numbers, and are
compared with it at random inputs. Margins and interval bounds are exact; samples are floats.
"""
