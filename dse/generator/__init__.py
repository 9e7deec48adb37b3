"""Random problems of any size, drawn from published figures of automotive and robotic systems."""

from dse.generator.families import FAMILIES as FAMILIES
from dse.generator.problem import random_problem as random_problem
