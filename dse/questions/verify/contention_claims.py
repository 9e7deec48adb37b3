"""Checks of the verdicts with waiting for the CPU in a result: each is judged again, and each "broken" proved again.

A verdict says whether a design of a front without waiting keeps every requirement when threads wait: on its own cores,
on other cores, or on none. That it does on none is proved by a second model, which shares neither encoder nor search.
"""

from __future__ import annotations

from dataclasses import replace

from dse.analysis.diagnosis.front_verdicts import with_contention
from dse.analysis.evaluate import Evaluator
from dse.answers.contention_verdicts import NOT_JUDGED, Contended
from dse.answers.forms.codec import written
from dse.questions.result_question import named_design
from dse.questions.verify.contention import CoreJury, listed_designs, placed_as
from dse.questions.verify.points import Bench
from dse.space.model.space import Design
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, until
from dse.support.units.text import count_words
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany
from dse.verification.prover import Method, make_prover


def check_contention(bench: Bench, method: Method, deadline: float | None) -> None:
    """The core of each thread of each listed design, and what the design keeps when response times count.

    Each design is placed on cores and judged again (`ContentionReferee`), on those that the result names for it, too; a
    verdict that differs from the stated one is a finding. That no cores hold is proved by the second proof. Nothing is
    stated where the question already counts response times.
    """
    counted = with_contention(bench.space)
    jury = None if counted is None else CoreJury(counted)
    listed = listed_designs(bench.data)
    evaluator = Evaluator(bench.space)
    judged = proved = left = 0
    for place, item in listed:
        try:
            design = named_design(bench.space, item["decisions"])
        except UsageError:
            continue  # which was found with the design itself
        if evaluator.evaluate(design).breaches:
            continue  # likewise
        placed = {} if bench.under_way else placed_as(bench.space, design, item)
        for name, own in placed.items():
            bench.compare(f"{place}.{name}", own, item.get(name, {}))
        stated = item.get("contention", {})
        if jury is None:
            bench.compare(f"{place}.contention", {}, stated)
        elif stated != NOT_JUDGED:
            try:
                with until(deadline):
                    bench.compare(f"{place}.contention", written(Contended, jury.restated(design, stated)), stated)
                    if stated.get("status") == "broken" and jury.free:
                        proved += _is_refuted(bench, f"{place}.contention", jury, design, (method, deadline))
                judged += 1
            except OutOfTime:
                left += 1
    if left:
        bench.left_open.append(f"what {left} of {len(listed)} designs keep with response times: the time was too short")
    if listed:
        said = f", and what {judged} of them keep with response times" if judged else ""
        said += f" ({count_words(proved, 'design')} on no cores: proved again)" if proved else ""
        bench.checked.append(f"the cores of {count_words(len(listed), 'design')}{said}")


def _is_refuted(bench: Bench, place: str, jury: CoreJury, design: Design, means: tuple[Method, float | None]) -> bool:
    """Whether the second proof confirms that a design holds on no cores; notes what it finds else."""
    try:
        holds = _holds_elsewhere(jury, design, *means)
    except (TooLarge, TooMany) as error:
        bench.left_open.append(f"{place}: that no cores hold could not be proved again: {error}")
        return False
    if holds:
        bench.find(f"{place}.status", "is stated as 'broken', but there are cores on which every requirement holds")
    if holds is None:
        bench.left_open.append(f"{place}: that no cores hold was not proved again: the time was too short")
    return holds is False


def _holds_elsewhere(jury: CoreJury, design: Design, method: Method, deadline: float | None) -> bool | None:
    """Whether there are cores with which a design meets every requirement; None where the second proof cannot tell."""
    held = {at: option for at, option in enumerate(jury.whole(design)) if option >= 0 and at not in jury.free}
    space = replace(jury.space, objectives=(), fixed={**jury.space.fixed, **held})
    prover, _ = make_prover(Evaluator(space), method, deadline)
    return {"design": True, "none": False}.get(prover.in_region(()).answer)
