"""The price of insisting: the front with one option fixed, from what the search of the whole front has proved.

What holds for all designs holds for those with the option: points of the front that have it stay, refuted regions stay
refuted. What is left open is what points without the option dominated alone (`dse.search.certificate.narrowed`); often
that is nothing. The model is made once, and each option restricts a copy of it.
"""

from __future__ import annotations

from dataclasses import replace

from dse.analysis.evaluate import Evaluator
from dse.encode.model import EncodedSpace, encode
from dse.search.certificate import ObjectiveScale, narrowed
from dse.search.front import FrontSearch, SearchLimits, search_front
from dse.space.model.space import INACTIVE, Design
from dse.support.errors import RefereeError


class Insistence:
    """The model of a space and the search of its front, ready for the fronts with one option each.

    A front does not depend on which others were searched before: the same options give the same designs, in any order
    and on any number of machines.
    """

    def __init__(self, evaluator: Evaluator, whole: FrontSearch) -> None:
        self.evaluator = evaluator
        self.senses = [objective.sense for objective in evaluator.space.objectives]
        self._encoded = encode(evaluator)
        objectives = self._encoded.objectives
        offsets, steps = (tuple(getattr(item, name) for item in objectives) for name in ("offset", "step"))
        points = {vector: evaluator.evaluate(design).design for vector, design in whole.points.items()}
        self.whole = replace(whole, points=points, frame=ObjectiveScale(self._encoded.everywhere, offsets, steps))

    def known(self, decision: int, option: int) -> FrontSearch:
        """The part of the whole front that has an option, and the regions left to search for the front with the option.

        As with a fixed decision, a design that has no use for the decision is one that has the option.
        """

        def keeps(design: Design) -> bool:
            return design[decision] in (option, INACTIVE)

        return narrowed(self.whole, self.senses, keeps)

    def front(self, decision: int, option: int, budget: SearchLimits) -> FrontSearch:
        """The front with an option: as far as it was searched, when the budget ends.

        Raises
        ------
        RefereeError
            when the solver's figures and the analysis disagree, or a design has another option.
        """
        known = self.known(decision, option)
        if known.is_complete:
            return known
        space = self.evaluator.space
        if decision in {item.index for item in (*space.open_cores, *space.open_priorities)}:
            # which cores and priorities may change places depends on those that are fixed: the model is made anew
            return search_front(
                Evaluator(replace(space, fixed={**space.fixed, decision: option})), budget, earlier=known
            )
        search = search_front(self.evaluator, budget, earlier=known, encoded=self._restricted(decision, option))
        if any(design[decision] not in (option, INACTIVE) for design in search.points.values()):
            raise RefereeError(f"a design without option {option} of decision {decision} is on the front with it")
        return search

    def _restricted(self, decision: int, option: int) -> EncodedSpace:
        """A copy of the model without the other options of a decision, which its tables do not look at either."""
        space = self.evaluator.space
        fixed = replace(space, fixed={**space.fixed, decision: option})
        encoded = replace(self._encoded.copy(), space=fixed)
        for number, literal in enumerate(encoded.options[decision]):
            if number != option:
                encoded.model.add_bool_and([literal.negated()])
        return encoded
