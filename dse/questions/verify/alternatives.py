"""Further designs that a result lists at or near its points: each looked at again, and whether there are more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import floor
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.answers.ranking.changes import changes_between
from dse.questions.verify.points import Bench, recomputed
from dse.space.model.space import Design, Space
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany
from dse.verification.prover import Method, Prover, make_prover


@dataclass
class _Group:
    """One entry of ``others`` under examination; `designs` are those that could be recomputed."""

    place: str
    stated: Mapping[str, Any]
    point: Design
    near: tuple[int, ...]
    share: Fraction
    designs: list[Design] = field(default_factory=list)

    @property
    def most(self) -> tuple[int, ...]:
        """The largest value of each objective, to be minimised, that is near enough."""
        return tuple(edge + floor(self.share * abs(edge)) for edge in self.near)


def check_others(bench: Bench, method: Method, deadline: float | None) -> None:
    """Check the further designs of a result: their number and order, their figures, and whether there are more.

    Findings are noted in `bench`. With `method` (the second proof) it is checked that a group said to be whole has no
    further design; `deadline` is a reading of `time.monotonic()`.
    """
    listed, wanted = bench.data.get("others", []), bench.data.get("others_asked")
    if not listed and wanted is None:
        return
    groups = _groups(bench, listed)
    if wanted is None:
        bench.find("others_asked", "is missing, though there are others")
    elif groups is not None:
        _check_asked(bench, listed, wanted)
    if groups is None or len(groups) != len(listed):
        return
    evaluator = Evaluator(bench.space)
    for group in groups:
        _check_designs(bench, evaluator, group)
    bench.checked.append(f"the further designs of {len({item['of'] for item in listed})} points")
    if wanted is not None and not any(item.place.startswith("others") for item in bench.findings):
        _check_more(bench, evaluator, groups, int(wanted["count"]), (method, deadline))


def _groups(bench: Bench, listed: Sequence[Mapping[str, Any]]) -> list[_Group] | None:
    """The entries with the points that they are about; None where the points themselves are in doubt."""
    if len(bench.designs) != len(bench.data["front"]):
        return None
    by_id = {point["id"]: at for at, point in enumerate(bench.data["front"])}
    groups = []
    for position, stated in enumerate(listed):
        place = f"others[{position}]"
        if stated["of"] not in by_id:
            bench.find(f"{place}.of", f"there is no point {stated['of']}")
            continue
        at = by_id[stated["of"]]
        groups.append(_Group(place, stated, bench.designs[at], bench.vectors[at], Fraction(stated["within"])))
    return groups


def _check_asked(bench: Bench, listed: Sequence[Mapping[str, Any]], wanted: Mapping[str, Any]) -> None:
    """One entry for the very objectives of each point that was asked about, and one for those within the share."""
    shares = [Fraction(0)] if wanted["within"] is None else [Fraction(0), Fraction(wanted["within"])]
    expected = [(point, share) for point in wanted["points"] for share in shares]
    stated = [(item["of"], Fraction(item["within"])) for item in listed]
    if stated != expected:
        words = ", ".join(f"{point} within {share}" for point, share in expected) or "nothing"
        bench.find("others", f"is not what was asked for, which is {words}")
    if len(set(wanted["points"])) != len(wanted["points"]) or type(wanted["count"]) is not int or wanted["count"] < 1:
        bench.find("others_asked", "asks for nothing that makes sense")


def _check_designs(bench: Bench, evaluator: Evaluator, group: _Group) -> None:
    """Each design as it is stated: near its point, new, and dominated by the points that are named."""
    of, first = group.stated["of"], None
    for number, sibling in enumerate(group.stated["designs"]):
        where = f"{group.place}.designs[{number}]"
        evaluation = recomputed(bench, evaluator, sibling, where, f"design {sibling['id']}")
        if evaluation is None:
            continue
        vector = bench.vector_of(evaluation)
        if any(value > edge for value, edge in zip(vector, group.most, strict=True)):
            bench.find(where, f"is not within {group.stated['within']} of point {of}")
        if evaluation.design in (group.point, *group.designs):
            bench.find(where, "is there before")
        group.designs.append(evaluation.design)
        dominating = [
            point["id"]
            for point, other in zip(bench.data["front"], bench.vectors, strict=True)
            if other != vector and all(a <= b for a, b in zip(other, vector, strict=True))
        ]
        bench.compare(f"{where}.dominated_by", sorted(dominating), sorted(sibling["dominated_by"]))
        different = len(changes_between(bench.space, group.point, evaluation.design))
        bench.compare(f"{where}.different_decisions", different, sibling["different_decisions"])
        head, _, tail = str(sibling["id"]).rpartition(".")
        first = int(tail) - number if first is None and tail.isdecimal() else first
        if head != str(of) or not tail.isdecimal() or int(tail) != (first or 0) + number:
            bench.find(f"{where}.id", f"is {sibling['id']!r}: expected the point and a number, one after the other")


def _check_more(
    bench: Bench, evaluator: Evaluator, groups: Sequence[_Group], count: int, means: tuple[Method, float | None]
) -> None:
    """Whether there are further designs still, as each entry says; one that was stopped says nothing."""
    if all(group.stated["more"] is None for group in groups):
        return
    try:
        prover, _ = make_prover(evaluator, *means)
    except (TooLarge, TooMany) as error:
        bench.left_open.append(f"whether there are further designs could not be proved again: {error}")
        return
    cores = {item.index for item in bench.space.open_cores}
    ties: dict[int, list[Design]] = {}
    for group in groups:
        known = [group.point, *group.designs]
        if group.share:
            known += [*bench.designs, *ties.get(group.stated["of"], [])]
        else:
            ties[group.stated["of"]] = group.designs
        _check_rest(bench, prover, group, known, count, cores)
    bench.checked.append(f"whether there are further designs: {prover.words}")


def _check_rest(
    bench: Bench, prover: Prover, group: _Group, known: Sequence[Design], count: int, cores: set[int]
) -> None:
    """Check that there is another design near the point, or none, as the entry says.

    Designs that differ in the cores of their threads only may count as one where nothing that is shown depends on it.
    """
    more, place = group.stated["more"], f"{group.place}.more"
    if more is None:
        return
    if type(more) is not bool or len(group.designs) > count or (more and len(group.designs) < count):
        bench.find(place, f"does not fit {len(group.designs)} designs of {count} that were asked for")
        return
    among = _decisions(bench.space, set() if more else cores)
    reply = prover.another_design(tuple(edge + 1 for edge in group.most), known, among)
    if more and reply.answer == "none":
        bench.find(place, "is not so: there is no other design")
    elif not more and reply.answer == "design":
        bench.find(place, "says that there are no others, but there is a further design")


def _decisions(space: Space, without: set[int]) -> list[int]:
    return [index for index in range(len(space.decisions)) if index not in without]
