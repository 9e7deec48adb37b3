"""One problem read twice, by the product and by the oracle, and the way from one's designs and figures to the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import product
from math import prod

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import Measure
from dse.space.model.space import INACTIVE, Design
from tests.oracle import evaluator as oracle
from tests.oracle.problem import as_list, option_value

PER_UNIT = {"ppm": 10**6}
"""How many of the product's units make one of the oracle's, where they differ: a core is a million ppm."""


@dataclass(frozen=True)
class Judged:
    """A valid design: canonical in the product, named in the oracle, and the oracle's figures of it."""

    design: Design
    named: oracle.Design
    figures: dict

    @property
    def vector(self) -> tuple[Fraction, ...]:
        """The oracle's objectives, in the oracle's units; maximised ones negated."""
        return self.figures["objectives"]


class Pair:
    """A problem in both readings."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.product = dse.loads(text)
        self.space = self.product.space
        self.evaluator = Evaluator(self.space)
        self.oracle = oracle.load_text(text)

    # Designs

    @cached_property
    def options(self) -> dict[str, list[str]]:
        """For each decision of the oracle, its options in the product's order; by value they must be the same."""
        mine = {item.name: item for item in self.space.decisions if item.is_open}
        assert mine.keys() == oracle.decisions(self.oracle).keys()
        found = {}
        for name, texts in oracle.decisions(self.oracle).items():
            field = self.oracle.owner(name)[1]
            by_value = {option_value(field, text): text for text in texts}
            values = [option_value(field, text) for text in mine[name].options]
            assert values == list(by_value), name
            found[name] = [by_value[value] for value in values]
        return found

    def design(self, named: oracle.Design) -> Design:
        """A design of the oracle in the product's numbers; single options are no decisions of the oracle."""
        chosen = []
        for item in self.space.decisions:
            option = named[item.name] if item.is_open else item.options[0]
            options = self.options[item.name] if item.is_open else item.options
            chosen.append(INACTIVE if option is None else options.index(option))
        return tuple(chosen)

    def named(self, design: Design) -> oracle.Design:
        """A design of the product in the oracle's words."""
        return {
            item.name: None if option < 0 else self.options[item.name][option]
            for item, option in zip(self.space.decisions, design, strict=True)
            if item.is_open
        }

    @cached_property
    def valid(self) -> list[Judged]:
        """Every design that the oracle admits, in the product's order; requirements are not looked at."""
        found = [Judged(self.design(named), named, figures) for named, figures in oracle.evaluated(self.oracle)]
        return sorted(found, key=lambda judged: judged.design)

    @cached_property
    def feasible(self) -> list[Judged]:
        """The valid designs that meet the requirements."""
        return [judged for judged in self.valid if not judged.figures["violations"]]

    @cached_property
    def front(self) -> dict[tuple[Fraction, ...], list[Judged]]:
        """The oracle's front: each vector with all designs that have it, the first one first."""
        groups: dict[tuple[Fraction, ...], list[Judged]] = {}
        for judged in self.feasible:
            groups.setdefault(judged.vector, []).append(judged)
        return {vector: groups[vector] for vector in oracle.non_dominated(set(groups))}

    # Figures

    def vector(self, counted: Iterable[int]) -> tuple[Fraction, ...]:
        """Objectives as the product counts them, in the oracle's units; maximised ones negated."""
        senses = [1 if item.sense == "minimise" else -1 for item in self.space.objectives]
        measures = self.evaluator.objectives
        return tuple(
            sign * exact_value(measure, count) for sign, measure, count in zip(senses, measures, counted, strict=True)
        )

    @property
    def is_rounded(self) -> bool:
        """Whether an objective's common denominator is too fine for the product to count in."""
        return any(measure.rounded for measure in self.evaluator.objectives)

    def oracle_metrics(self, figures: dict) -> dict[str, Fraction]:
        """The oracle's figures by the names under which the product lists them."""
        found: dict[str, Fraction] = {}
        for flow, row in figures["flows"].items():
            found |= {
                f"latency of {flow}": row["max"],
                f"min latency of {flow}": row["min"],
                f"jitter of {flow}": row["jitter"],
            }
        listed = {measure.metric.name for measure in self.evaluator.metrics}
        for kind, key in (("run jitter", "run"), ("reaction time", "reaction"), ("data age", "age")):
            rows = figures["flows"].items()
            found |= {f"{kind} of {flow}": row[key] for flow, row in rows if f"{kind} of {flow}" in listed}
        rows = {f"disparity of {name}": value for name, value in figures["disparity"].items()}
        found |= {name: value for name, value in rows.items() if name in listed}
        rows = {f"response time of {name}": value for name, value in figures["responses"].items()}
        found |= {name: value for name, value in rows.items() if name in listed}
        found |= {f"utilisation of {slot}": value for slot, value in figures["utilisation"].items()}
        for slot, used in figures["core use"].items():
            if self._has_cores(slot):
                found |= {f"utilisation of core {core} of {slot}": value for core, value in enumerate(used, start=1)}
        found |= {f"load of {bus}": value for bus, value in figures["load"].items()}
        found |= {f"busy of {bus}": value for bus, value in figures["busy"].items()}
        found |= {"price": figures["price"]["system"], "power": figures["power"]["system"]}
        found |= {total: amounts["system"] for total, amounts in figures["totals"].items()}
        if any("changes" in text for text in self._asked()):
            found["changes"] = Fraction(figures["changes"])
        return found | figures["metrics"]

    def _has_cores(self, slot: str) -> bool:
        """Whether cores of a processor are listed: the core of every thread that may run there is stated or chosen."""
        places = self.oracle.places
        here = [name for name in places if slot in as_list(self.oracle.component(name)["processor"])]
        told = all(len(self.oracle.stated_cores(name)) == 1 for name in here)
        told = told or self.oracle.names_cores or self.oracle.chooses_executors
        return bool(here) and self.oracle.most_cores(slot) > 1 and told

    def _asked(self) -> list[str]:
        """The metrics, objectives and requirements of the problem, as texts."""
        document = self.oracle.document
        return [
            *document.get("metrics", {}).values(),
            *document.get("objectives", ()),
            *document.get("requirements", ()),
        ]

    # Brute force with the product's evaluator alone

    @property
    def combinations(self) -> int:
        """How many combinations of options there are, whether designs or not."""
        return prod(len(item.options) for item in self.space.decisions)

    def raw(self) -> Iterator[Design]:
        """Every combination of options."""
        return product(*(range(len(item.options)) for item in self.space.decisions))

    def own_front(self) -> dict[tuple[int, ...], Design]:
        """The front by looking at every combination with the product's evaluator: vectors with their first design."""
        first: dict[tuple[int, ...], Design] = {}
        for raw in self.raw():
            evaluation = self.evaluator.evaluate(raw)
            if evaluation.is_feasible:
                known = first.get(evaluation.objectives)
                if known is None or evaluation.design < known:
                    first[evaluation.objectives] = evaluation.design
        vectors = {self.vector(counted): counted for counted in first}
        return {vectors[vector]: first[vectors[vector]] for vector in oracle.non_dominated(set(vectors))}


def exact_value(measure: Measure, counted: int) -> Fraction:
    """What the product counts in a fraction of its unit, in the oracle's unit."""
    return Fraction(counted, measure.scale * PER_UNIT.get(measure.unit, 1))
