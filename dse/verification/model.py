"""A second model of a question: one integer variable for each decision, element constraints along the diagrams.

It shares no code with the encoding that the search used (literals for options, linear forms over cases), and is
solved with other settings: no presolve, another seed, another search.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import ceil
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluation
from dse.analysis.limits import Limit, judge, keeps_cores
from dse.analysis.views import View
from dse.space.model.space import INACTIVE, Design
from dse.support.timelimit import OutOfTime, look_at_the_clock
from dse.verification import solver_calls
from dse.verification.cases import Cases
from dse.verification.diagrams import Node, TooLarge, leaves
from dse.verification.element_constraints import Lookups
from dse.verification.messages.limits import limited_by_deadline, message_lessons
from dse.verification.messages.reasons import order_lessons, soonest_lesson, undelayed_lesson, waits_lesson
from dse.verification.messages.rows import BusRows
from dse.verification.messages.waiting import MessageWaits, message_of
from dse.verification.plain_sums import plain_sums
from dse.verification.reduced import ReducedRegion, Reduction
from dse.verification.rounds import Favourite, Rounds
from dse.verification.scheduling.by_type import MOST_AS_A_WHOLE, ByType
from dse.verification.scheduling.clock_reads import add_passage
from dse.verification.scheduling.contention import lessons_of, on_other_cores
from dse.verification.scheduling.core_limits import add_cores
from dse.verification.scheduling.core_symmetry import Numbering
from dse.verification.scheduling.first_designs import Claim, Earlier, EarlierDesigns, add_earlier, limit_options
from dse.verification.scheduling.reasons import Lesson, chain_lesson, full_lesson, waiting_lesson
from dse.verification.scheduling.waiting import WaitVariables
from dse.verification.solver_calls import Reply
from dse.verification.sums import Sum
from dse.verification.tables import EXACT, Tables

REPRESENTED = 2**62
"""The ends of what the solver adds stay below this."""


class SecondModel:
    """The question as a model, to be asked for designs in parts of the objective space.

    Only for designs with options that are `given` for decisions by number, if there are such.
    """

    def __init__(self, tables: Tables, deadline: float | None = None, given: Mapping[int, int] | None = None) -> None:
        sums = [*(bound.sum for bound in tables.bounds), *(total for total, _ in tables.objectives)]
        if any(max(abs(item.low), abs(item.high)) >= REPRESENTED for item in sums) or any(
            max(abs(leaf) for leaf in leaves(part)) >= EXACT
            for item in sums
            for part in item.diagrams
            if isinstance(part, Node)
        ):
            raise TooLarge("some figures are so large that a solver could not add them exactly")
        self.tables = tables
        self.deadline = deadline
        self.calls = 0
        self.model = cp_model.CpModel()
        self.given = given or {}
        self._by_type = ByType(tables, self.given, partial(SecondModel, tables, deadline))
        allowed = (
            [self.given.get(index)] if index in self.given else all_ for index, all_ in enumerate(tables.allowed)
        )
        self.chosen = [
            self.model.new_int_var_from_domain(cp_model.Domain.from_values(list(options)), "") for options in allowed
        ]
        self.lookups = Lookups(self.model, self.chosen.__getitem__, self.given)
        self._reduction = Reduction(tables)
        self._plain = plain_sums(self._reduction, deadline)
        for _, diagram in tables.conditions:
            self.model.add(self.lookups.variable(diagram) == 1)
        self.waiting: WaitVariables | None = None
        if tables.waits is not None:
            self.waiting = WaitVariables(tables.space, self.model, tables.waits, self.lookups.value)
        self.passages: list[Any] = []
        for passage in tables.passages:
            assert self.waiting is not None
            waits = self.waiting
            self.passages.append(
                add_passage(self.model, passage, self.lookups.value, self._total, waits.variables, waits.most)
            )
        for bound in tables.bounds:
            if bound.sum.high > 0:
                self.model.add(self._total(bound.sum) <= 0)
        for table in tables.cores:
            add_cores(self.model, table, self.lookups.value)
        self.limited = limited_by_deadline(tables.space, tables.messages)
        rows = BusRows(tables.space, self.model, self.chosen, self.limited)
        waiting = {} if self.waiting is None else self.waiting.of_messages
        self.message_waits = MessageWaits(rows, waiting, 0 if self.waiting is None else self.waiting.scale)
        self.objectives = []
        for total, divisor in tables.objectives:
            variable = self.model.new_int_var(-(-total.low // divisor), total.high // divisor, "")
            self.model.add(self._total(total) == divisor * variable)
            self.objectives.append(variable)
        self.option = [self._canonical(index) for index in range(len(self.chosen))]
        self.places = {number: self.lookups.variable(diagram) for number, diagram in tables.places.items()}
        moves = bool(tables.late) and tables.waits is None
        self.free_cores = {item.index for item in tables.space.open_cores} if moves else set[int]()
        self.moves_threads = bool(self.free_cores)
        self.free_cores |= {item.index for item in tables.space.open_priorities}  # whichever will do
        self.numbering = Numbering(tables, self.model, self.chosen, self.places)
        self._favourite = Favourite()
        self._earlier = Earlier(self._reduction, self.free_cores, deadline)
        problem = self.model.validate()
        assert not problem, problem

    def _total(self, total: Sum) -> Any:
        """A sum as an expression; each of the sums of an extreme has a variable of its own."""
        total_form: Any = sum(self.lookups.value(part) for part in total.parts)
        for number, times in total.waits:
            assert self.waiting is not None
            total_form = total_form + times * self.waiting.variables[number]
        for number, times in total.passages:
            total_form = total_form + times * self.passages[number]
        for pick in total.extremes:
            parts = []
            for item in pick.sums:
                part = self.model.new_int_var(item.low, item.high, "")
                self.model.add(part == self._total(item))
                parts.append(part)
            target = self.model.new_int_var(pick.low, pick.high, "")
            if pick.greatest:
                self.model.add_max_equality(target, parts)
            else:
                self.model.add_min_equality(target, parts)
            total_form = total_form + target
        return total_form

    def _canonical(self, index: int) -> Any:
        """The option as the canonical design has it: -1 where the decision is not used."""
        met = self.tables.met[index]
        if met is None:
            return self.chosen[index]
        shown = self.model.new_int_var(INACTIVE, max(self.tables.allowed[index]), "")
        self.model.add_element(self.lookups.variable(met), [INACTIVE, self.chosen[index]], shown)
        return shown

    def in_region(
        self,
        below: Sequence[int | None],
        from_on: Sequence[int | None] | None = None,
        given: tuple[int, int] | None = None,
    ) -> Reply:
        """A design whose objectives are below `below` and not below `from_on` (None: no bound).

        `given` is a decision and the option that the design has, unless it has no use for the decision.
        """
        for axis, bound in enumerate(from_on or ()):
            if bound is not None and self.tables.objectives[axis][0].is_open:
                raise TooLarge("how long response times may get at most depends on too much to tabulate")

        def ask(model: cp_model.CpModel) -> None:
            for axis, bound in enumerate(below):
                if bound is not None:
                    model.add(self._in(model, self.objectives[axis]) <= bound - 1)
            for axis, bound in enumerate(from_on or ()):
                if bound is not None:
                    model.add(self._in(model, self.objectives[axis]) >= bound)
            if given is None or given[0] not in self.numbering.decisions:
                self.numbering.add(model)
            if given is not None:
                decision, option = given
                domain = cp_model.Domain.from_values([INACTIVE, option])
                model.add_linear_expression_in_domain(self._in(model, self.option[decision]), domain)

        held = None if given is None else given[0]
        if self.waiting is None:
            ways = self._on_buses or solver_calls.WAYS
            return self._ask(ask, self._reduced(below, from_on), ways=ways, held=held)
        ways = solver_calls.WAITING if self.waiting.has_threads else ()
        ways = (*ways, *self._on_buses) or solver_calls.WAITING
        most = MOST_AS_A_WHOLE if self._by_type.combinations else None
        reply = self._ask(ask, self._reduced(below, from_on), ways=ways, held=held, most=most)
        return self._in_parts(below, from_on, given) if reply.answer == "unknown" else reply

    def _in_parts(self, *question: Any) -> Reply:
        """The answer to the question of `in_region` by type."""
        for part in self._by_type:
            before = part.calls
            reply = part.in_region(*question)
            self.calls += part.calls - before
            if reply.answer == "design":
                return reply
        return Reply("none")

    @property
    def _on_buses(self) -> solver_calls.Ways:
        """The ways of questions in which messages are limited, or identifiers are chosen; none of others."""
        return solver_calls.ON_BUSES if self.tables.messages or self.message_waits.before else ()

    def earlier_design(self, vector: Sequence[int], design: Design) -> Reply:
        """A design with these objectives that comes before `design` in the order of the file.

        A `Reply`; *none* confirms that the result shows the first design of the point.
        """
        places = self._earlier.places(vector, design)
        if not places:
            return Reply("none")

        def ask(model: cp_model.CpModel) -> None:
            self._add_earlier(model, [(vector, design)], [places])

        return self._ask(ask, partial(self._earlier.are_refuted, places), exactly=True, ways=solver_calls.IN_ORDER)

    def _add_earlier(
        self, model: cp_model.CpModel, claims: Sequence[Claim], places: Sequence[Sequence[EarlierDesigns]]
    ) -> Cases:
        chosen, shown, objectives = (
            [self._in(model, variable) for variable in variables]
            for variables in (self.chosen, self.option, self.objectives)
        )
        limit_options(model, chosen, self.tables.allowed, places)
        return add_earlier(model, (objectives, shown), claims, places, self.free_cores)

    def unproved_regions(self, regions: Sequence[Sequence[int]]) -> list[int]:
        """The positions of regions that one quick question about all of them does not prove empty.

        Bounds of objectives, exclusive, as in `in_region`; of plain sums each region is asked by itself.
        """
        if self._plain is not None:
            return [at for at, region in enumerate(regions) if not self._is_refuted_plainly(region)]
        model = self.model.clone()
        cases = Cases(model, len(regions))
        for objective, bounds in zip(self.objectives, zip(*regions, strict=True), strict=True):
            model.add(self._in(model, objective) <= cases.value([bound - 1 for bound in bounds]))
        self.numbering.add(model)
        return self._unproved(cases)

    def unproved_claims(self, claims: Sequence[Claim]) -> list[int]:
        """The positions of claims for which one quick question about all does not prove that no design is earlier.

        Of plain sums it is asked of those only whose objectives some other design has, too.
        """
        left = [at for at, claim in enumerate(claims) if self._plain is None or not self._is_the_only_one(*claim)]
        if not left:
            return []
        model, anywhere = self.model.clone(), [self._earlier.anywhere] * len(left)
        unproved = self._unproved(self._add_earlier(model, [claims[at] for at in left], anywhere))
        return [left[position] for position in unproved]

    def _is_the_only_one(self, vector: Sequence[int], design: Design) -> bool:
        """Whether it is proved that no other design has these objectives."""
        return self._is_refuted_plainly([value + 1 for value in vector], vector, design)

    def _is_refuted_plainly(self, *question: Any) -> bool:
        """Whether a question about plain sums is proved to have no answer, by a short attempt."""
        assert self._plain is not None
        self.calls += 1
        return self._plain.is_refuted(solver_calls.FIRST_LIMIT, *question)

    def _unproved(self, cases: Cases) -> list[int]:
        def attempt(model: cp_model.CpModel, limit: float) -> solver_calls.Outcome:
            self.calls += 1
            return solver_calls.attempted(model, self.deadline, limit, ways=self._on_buses or solver_calls.BY_ROWS)

        return cases.unproved(attempt)

    def another_design(self, below: Sequence[int], known: Sequence[Design], among: Sequence[int]) -> Reply:
        """A design with objectives below `below` that differs from each known one in some of the decisions `among`.

        A `Reply`; *none* proves that a list of further designs is complete.
        """

        def ask(model: cp_model.CpModel) -> None:
            for axis, bound in enumerate(below):
                model.add(self._in(model, self.objectives[axis]) <= bound - 1)
            for design in known:
                others = []
                for index in among:
                    other = model.new_bool_var("")
                    model.add(self._in(model, self.option[index]) != design[index]).only_enforce_if(other)
                    others.append(other)
                model.add_bool_or(others)

        return self._ask(ask)

    @staticmethod
    def _in(model: cp_model.CpModel, variable: Any) -> Any:
        if variable.index < 0:  # a negated literal
            return model.get_int_var_from_proto_index(-variable.index - 1).negated()
        return model.get_int_var_from_proto_index(variable.index)

    def _ask(
        self,
        ask: Callable[[cp_model.CpModel], None],
        is_refuted: Callable[[float], bool] | None = None,
        *,
        exactly: bool = False,
        ways: solver_calls.Ways = solver_calls.WAYS,
        held: int | None = None,
        most: int | None = None,
    ) -> Reply:
        """Solve; a design that only the coarse bounds admit is left out and the question asked again.

        Of one with threads that are late, or wait longer than thought, the model learns why. One with threads that wait
        less than the solution says is better than that, and an answer unless objectives are asked for `exactly`. Where
        threads are late other cores are tried, but for those of the decision `held`; where they wait longer, all but
        their cores is kept for some rounds, which are soon answered and teach as much. Unknown where `most` attempts of
        a round do not answer it.

        Raises
        ------
        OutOfTime
            when the deadline comes before the answer.
        """
        left_out: list[Design] = []
        rounds = Rounds(ways, self._favourite, self._keep)
        while True:
            look_at_the_clock()
            model = self.model.clone()
            ask(model)
            for values in left_out:
                self._leave_out(model, values)
            self.calls += 1
            status, solver = rounds.answer(model, self.deadline, is_refuted, most)
            if status == cp_model.INFEASIBLE:
                return Reply("none")
            if solver is None and most is not None and not solver_calls.is_over(self.deadline):
                return Reply("unknown")
            if solver is None:
                raise OutOfTime
            values = tuple(solver.value(self._in(model, variable)) for variable in self.chosen)
            claimed = tuple(solver.value(self._in(model, variable)) for variable in self.objectives)
            evaluation = self.tables.evaluator.evaluate(values)
            if evaluation.is_feasible and self._is_as_claimed(evaluation, claimed, exactly=exactly):
                return Reply("design", evaluation.design)
            view = View(values)
            late = [limit for limit in self.tables.late if not judge(limit, view).holds]
            if late and not evaluation.breaches and self.waiting is None:
                moved = on_other_cores(self.tables.evaluator, self.tables.late, evaluation, held)
                if moved is not None:
                    return Reply("design", moved.design)
            if self._learns(model, solver, values, late):
                rounds.learnt(values, solver, may_move=self.waiting is not None)
                continue
            full = [item.limit for item in self.tables.cores if not item.exact and not keeps_cores(item.limit, view)]
            full += [limit for limit in self.tables.loose if not judge(limit, view).holds]
            if full and not evaluation.breaches:
                for limit in full:
                    self._teach(self.model, full_lesson(self.tables.space, limit, values))
                continue
            broken = [verdict.requirement.text for verdict in evaluation.verdicts if not verdict.holds]
            assert not evaluation.breaches and not self.tables.is_exact, (values, evaluation.breaches, broken)
            left_out.append(values)

    def _keep(self, model: cp_model.CpModel, values: Design) -> None:
        """Every decision but those on cores is as it was."""
        cores = {item.index for item in self.tables.space.open_cores}
        for index, value in enumerate(values):
            if index not in cores:
                model.add(self._in(model, self.chosen[index]) == value)

    def _is_as_claimed(self, evaluation: Evaluation, claimed: Sequence[int], *, exactly: bool) -> bool:
        """Whether a design has the objectives that a solution says, or better ones."""
        if self.waiting is None:
            return True
        vector = self._vector(evaluation)
        return vector == claimed if exactly else all(own <= said for own, said in zip(vector, claimed, strict=True))

    def _vector(self, evaluation: Evaluation) -> tuple[int, ...]:
        """The objectives of a design, to be minimised."""
        signs = [1 if item.sense == "minimise" else -1 for item in self.tables.space.objectives]
        return tuple(sign * value for sign, value in zip(signs, evaluation.objectives, strict=True))

    def _learns(
        self, model: cp_model.CpModel, solver: cp_model.CpSolver, values: Design, late: Sequence[Limit]
    ) -> bool:
        """Whether the model is stricter for what a refused solution shows."""
        space = self.tables.space
        lessons: list[Lesson] = []
        view = View(values)
        if any(not judge(limit, view).holds for limit in self.tables.messages):
            lessons = message_lessons(space, self.tables.messages, values, has_places=bool(self.places))
        is_late = bool(lessons)  # a late message says more than how long messages wait
        if self.waiting is not None:
            said = {
                number: solver.value(self._in(model, variable)) for number, variable in self.waiting.variables.items()
            }
            low = self.waiting.too_low(values, said)
            if low and self.waiting.count(values) and not is_late:
                return True
            for number, waited in low.items():
                if is_late and number in self.waiting.of_messages:
                    continue
                first = self._order_lessons(model, solver, number, values)
                lessons += first or [self._waiting_lesson(number, waited, said[number], values)]
        lessons += lessons_of(space, late, values, self.tables.late) if late else []
        for lesson in lessons:
            self._teach(self.model, lesson)
        return bool(lessons)

    def _order_lessons(
        self, model: cp_model.CpModel, solver: cp_model.CpSolver, number: int, values: Design
    ) -> list[Lesson]:
        """Lessons that other messages go before one in a design, where the solution has them behind it.

        The `number` of a message is below 0; of a thread there is no such lesson.
        """
        if number >= 0 or not self.message_waits.before:
            return []
        message, _ = message_of(number)

        def is_open(other: int) -> bool:
            literal = self.message_waits.before.get((other, message))
            return literal is not None and not solver.value(self._in(model, literal))

        return list(order_lessons(self.tables.space, number, self.limited, values, is_open))

    def _waiting_lesson(self, number: int, waited: Fraction, said: int, values: Design) -> Lesson:
        """Why a thread, or a message (below 0), waits so long in a design, longer than a solution said."""
        assert self.waiting is not None
        chain = self.waiting.waits.chains.get(number)
        if chain is not None:
            return chain_lesson(self.tables.space, number, chain, waited, values)
        if number < 0:
            longer = Fraction(said, self.waiting.scale)
            space, waits = self.tables.space, self.waiting.waits.messages[number]
            lesson = soonest_lesson(space, number, self.limited, longer, values)
            lesson = lesson or undelayed_lesson(space, number, longer, values)
            return lesson or waits_lesson(space, number, waits, waited, values)
        return waiting_lesson(self.tables.space, number, waited, values)

    def _teach(self, model: cp_model.CpModel, lesson: Lesson) -> None:
        """Some decision has an option outside the box, or some thread another core than the first of its group."""
        ways = []
        for decision, options in lesson.box.items():
            left = [option for option in self.tables.allowed[decision] if option not in options]
            if left:
                other = model.new_bool_var("")
                domain = cp_model.Domain.from_values(left)
                model.add_linear_expression_in_domain(self._in(model, self.chosen[decision]), domain).only_enforce_if(
                    other
                )
                ways.append(other)
        for first, *others in lesson.groups:
            for thread in others:
                apart = model.new_bool_var("")
                one, another = (self._in(model, self.places[number]) for number in (first, thread))
                model.add(one != another).only_enforce_if(apart)
                ways.append(apart)
        for first, second in lesson.above:
            below = model.new_bool_var("")
            one, another = (self._in(model, self.chosen[decision]) for decision in (first, second))
            model.add(one + 1 <= another).only_enforce_if(below)
            ways.append(below)
        if lesson.raised is not None and self.waiting is not None:
            number, waited = lesson.raised
            longer = model.new_bool_var("")
            least = ceil(waited * self.waiting.scale)
            model.add(self.waiting.variables[number] >= least).only_enforce_if(longer)
            ways.append(longer)
        if lesson.before is not None:
            ways.append(self.message_waits.before[lesson.before])
        model.add_bool_or(ways)

    def _leave_out(self, model: cp_model.CpModel, values: Design) -> None:
        others = []
        for variable, value in zip(self.chosen, values, strict=True):
            other = model.new_bool_var("")
            model.add(self._in(model, variable) != value).only_enforce_if(other)
            others.append(other)
        model.add_bool_or(others)

    def _reduced(self, below: Sequence[int | None], from_on: Sequence[int | None] | None) -> Callable[[float], bool]:
        """Whether a region is refuted by some work on a smaller question, which is made when it is first needed."""
        region: ReducedRegion | None = None

        def is_refuted(limit: float) -> bool:
            nonlocal region
            if self._plain is not None:
                return self._plain.is_refuted(limit, below, from_on)
            if region is None:
                region = self._reduction.region(below, from_on)
            return region.is_refuted(limit, self.deadline)

        return is_refuted
