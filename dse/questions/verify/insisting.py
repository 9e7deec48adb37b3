"""The price of insisting in a result: each front with an option fixed looked at again, and proved a second time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.answers.designs import InsistedOption, InsistedPoint, Insisting
from dse.questions.verify.points import Bench, recomputed
from dse.space.model.space import INACTIVE, Design, Space
from dse.space.question.open_cores import rules_on_order, tells_cores_apart
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany
from dse.verification.geometry import Bound, covers, open_parts
from dse.verification.prover import Method, Prover, make_prover, outer_bound


def open_options(space: Space) -> list[tuple[int, int]]:
    """Every option of every open decision that is not fixed, by number, in the order of the problem.

    Pairs (decision, option). A decision is open when it has more than one option. Cores of threads are left out where
    nothing tells cores apart, and so are best orders that no rule looks at: they are chosen for each design anew.
    """
    alike = {item.index for item in (() if tells_cores_apart(space) else space.open_cores)}
    alike |= {item.index for item in (() if rules_on_order(space) else space.open_priorities)}
    return [
        (number, option)
        for number, decision in enumerate(space.decisions)
        if decision.is_open and number not in space.fixed and number not in alike
        for option in range(len(decision.options))
    ]


def stated_insisting(data: Mapping[str, Any], points: Sequence[InsistedPoint]) -> Insisting:
    """The price of insisting as a result file states it, with its points recomputed.

    An `Insisting` of points and of a status with ids for each option; the names of decisions and options are taken from
    the file as they are.
    """
    options = [
        InsistedOption(item["decision"], item["option"], item["status"], tuple(item["front"]))
        for item in data["options"]
    ]
    return Insisting(tuple(points), tuple(options))


@dataclass(frozen=True)
class _Known:
    """A point that fronts refer to by its id."""

    design: Design
    vector: Bound
    is_whole: bool
    """Whether it is on the whole front."""


def check_insisting(bench: Bench, method: Method, deadline: float | None) -> None:
    """Check the price of insisting: every option is listed, and its front is valid, non-dominated and complete.

    Every front with one option fixed is proved again by the second proof, as long as `deadline` allows; findings go to
    `bench`.
    """
    stated = bench.data.get("insisting")
    if stated is None or len(bench.designs) != len(bench.data["front"]):
        return
    wanted = open_options(bench.space)
    decisions = bench.space.decisions
    names = [(decisions[number].name, decisions[number].options[option]) for number, option in wanted]
    if [(item["decision"], item["option"]) for item in stated["options"]] != names:
        bench.find("insisting.options", "are not all options of all open decisions, in the order of the problem")
        return
    before = len(bench.findings)
    known = _points(bench, stated["points"])
    for at, (item, (decision, option)) in enumerate(zip(stated["options"], wanted, strict=True)):
        _check_listed(bench, f"insisting.options[{at}]", item, known, (decision, option))
    if len(bench.findings) > before:
        return
    try:
        prover, tables = make_prover(Evaluator(bench.space), method, deadline)
        outer = outer_bound(tables)
        for at, (item, chosen) in enumerate(zip(stated["options"], wanted, strict=True)):
            with bench.in_time(f"the fronts with {at} of {len(wanted)} options were proved again"):
                _check_missing(bench, f"insisting.options[{at}].front", item, known, chosen, (prover, outer))
    except (TooLarge, TooMany) as error:
        bench.left_open.append(f"the fronts with one option each could not be proved again: {error}")
        return
    bench.checked.append(f"the fronts with each of {len(wanted)} options: {prover.words}")


def _points(bench: Bench, listed: Sequence[Mapping[str, Any]]) -> dict[int, _Known]:
    """All points by id, those recomputed that the whole front does not have."""
    front = zip(bench.data["front"], bench.designs, bench.vectors, strict=True)
    known = {point["id"]: _Known(design, vector, True) for point, design, vector in front}
    evaluator = Evaluator(bench.space)
    for position, point in enumerate(listed):
        place = f"insisting.points[{position}]"
        with bench.in_time(f"{position} of {len(listed)} points of fronts with an option were recomputed"):
            evaluation = recomputed(bench, evaluator, point, place, f"point {point['id']}")
        bench.compare(f"{place}.id", len(bench.designs) + position + 1, point["id"])
        if evaluation is not None:
            known[point["id"]] = _Known(evaluation.design, bench.vector_of(evaluation), False)
    return known


def _check_listed(
    bench: Bench, place: str, item: Mapping[str, Any], known: Mapping[int, _Known], chosen: tuple[int, int]
) -> None:
    """Check the claims about an option's front that need no proof."""
    decision, option = chosen
    unknown = [number for number in item["front"] if number not in known]
    if unknown or item["front"] != sorted(set(item["front"])):
        bench.find(f"{place}.front", "is no list of ids in ascending order, each of a point")
        return
    if (item["status"] == "infeasible" and item["front"]) or (item["status"] == "complete" and not item["front"]):
        bench.find(f"{place}.status", f"{item['status']!r} does not fit {len(item['front'])} points")
    for number in item["front"]:
        if known[number].design[decision] not in (option, INACTIVE):
            bench.find(f"{place}.front", f"point {number} has another option")
        for other in item["front"]:
            if other != number and covers(known[other].vector, known[number].vector):
                bench.find(f"{place}.front", f"point {number} is no better than point {other}")
    for number, point in known.items():
        has_option = point.is_whole and point.design[decision] in (option, INACTIVE)
        if has_option and number not in item["front"] and item["status"] != "incomplete":
            bench.find(f"{place}.front", f"lacks point {number} of the whole front, which has the option")


def _check_missing(
    bench: Bench,
    place: str,
    item: Mapping[str, Any],
    known: Mapping[int, _Known],
    chosen: tuple[int, int],
    means: tuple[Prover, Bound],
) -> None:
    """No design with the option is better than all points; of a front that was not finished none dominates a point."""
    prover, outer = means
    vectors = [known[number].vector for number in item["front"]]
    if item["status"] == "incomplete":
        parts = [
            tuple(value if at == axis else other + 1 for at, other in enumerate(vector))
            for vector in vectors
            for axis, value in enumerate(vector)
        ]
    else:
        parts = open_parts(vectors, (), outer)
    for part in parts:
        reply = prover.in_region(part, given=chosen)
        if reply.answer == "design":
            bench.find(place, "lacks a design with the option, or has a point that such a design dominates")
            return
