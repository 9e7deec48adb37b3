"""Random problems of any size, drawn from published figures of automotive and robotic systems.

Read `problem.py` first.

* `problem.py`: the text of a problem file, with limits just above a starting design.
* `families.py`, `published.py`: kinds of systems; published figures, with sources.
* `topology.py`, `draft.py`: flows and connections; threads with their figures and options.
* `document.py`, `text.py`: the drawn system as a document; the document as YAML.

Not allowed here: a draw that depends on the machine or on time. Equal arguments give equal bytes.
"""

from dse.examples.random.families import FAMILIES as FAMILIES
from dse.examples.random.problem import random_problem as random_problem
