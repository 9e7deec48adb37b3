"""Results with one thing wrong: each mutation changes one part of a true result, as a careful forger would."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, cores_of, with_contention
from dse.analysis.evaluate import Evaluator
from dse.answers.contention_verdicts import Contended, judge
from dse.answers.forms.codec import written
from dse.answers.ranking.ranking import rank
from dse.answers.result import decisions_of, ranked
from dse.questions.problem import Problem
from dse.space.model.space import Design, Space
from dse.verification.exhaustion import exhaust
from dse.verification.tables import build_tables
from tests.helpers.effort import LONG
from tests.verification.shared import copied

Data = dict[str, Any]
Mutation = tuple[str, Data]
DRAWN = 50 if LONG else 8


def mutations(data: Data, asked: Problem, seed: int, most: int = 4) -> Iterator[Mutation]:
    """(what is wrong, the result): at most `most` of each kind."""
    rng = random.Random(seed)
    for kind in KINDS:
        found = list(kind(data, asked.space, rng))
        for name, mutated in rng.sample(found, min(most, len(found))):
            assert mutated != data, name
            yield name, mutated


def drawn(items: list[Data], rng: random.Random) -> list[tuple[int, Data]]:
    """Some of the points or regions that are listed, with their numbers: of a long front only these are changed."""
    return [(at, items[at]) for at in sorted(rng.sample(range(len(items)), min(DRAWN, len(items))))]


def vectors(data: Data) -> list[tuple[int, ...]]:
    names = [item["name"] for item in data["objectives"]]
    return [tuple(point["objectives"][name] for name in names) for point in data["front"]]


def renumbered(data: Data, space: Space) -> Data:
    """Ids, ranks and scores as they would be if the listed points were the front."""
    names = [item["name"] for item in data["objectives"]]
    senses = [item["sense"] for item in data["objectives"]]
    order = {
        vector: number for number, (_, vector, _) in enumerate(ranked([(v, ()) for v in vectors(data)], senses), 1)
    }
    if data["ranking"]["method"] == "ideal":
        ranks = rank("ideal", vectors(data), list(zip(names, senses, strict=True))).ranks
        for point, vector, number in zip(data["front"], vectors(data), ranks, strict=True):
            point.update(id=order[vector], rank=number, score="")
        data["front"].sort(key=lambda point: (point["rank"], point["id"]))
    return data


def points_removed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    for at, _ in drawn(data["front"], rng):
        changed = copied(data)
        point = changed["front"].pop(at)
        if not changed["front"]:
            changed["status"] = "infeasible"
        yield f"point {point['id']} removed", renumbered(changed, space)


def points_repeated(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    for at, _ in drawn(data["front"], rng):
        changed = copied(data)
        changed["front"].insert(at, copied(changed["front"][at]))
        yield f"point at {at} repeated", changed


def numbers_changed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    for at, point in drawn(data["front"], rng):
        for block in ("objectives", "metrics"):
            for name, figure in point[block].items():
                changed = copied(data)
                changed["front"][at][block][name] = (figure or 0) + rng.choice([-1, 1, 1000])
                yield f"front[{at}].{block}[{name}] changed", changed
        for name in point["objectives"]:
            changed = copied(data)
            step = rng.choice([-1, 1])
            for block in ("objectives", "metrics"):
                if name in changed["front"][at][block]:
                    changed["front"][at][block][name] = (point[block][name] or 0) + step
            yield f"front[{at}] {name} changed everywhere", renumbered(changed, space)


def labels_changed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    for at, _ in drawn(data["front"], rng):
        for key in ("id", "rank"):
            changed = copied(data)
            changed["front"][at][key] += 1
            yield f"front[{at}].{key} changed", changed


def decisions_altered(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    options = {item.name: item.options for item in space.decisions}
    for at, point in drawn(data["front"], rng):
        for name, chosen in point["decisions"].items():
            for option in options[name]:
                if option != chosen:
                    changed = copied(data)
                    changed["front"][at]["decisions"][name] = option
                    yield f"front[{at}] {name}: {option} instead of {chosen}", changed
            changed = copied(data)
            del changed["front"][at]["decisions"][name]
            yield f"front[{at}] {name} left out", changed
        for name in set(options) - set(point["decisions"]):
            changed = copied(data)
            changed["front"][at]["decisions"][name] = rng.choice(options[name])
            yield f"front[{at}] {name} added", changed


def designs_swapped(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    """A point made into another feasible design, with all its figures right; or such a point added."""
    evaluator = Evaluator(space)
    feasible = [tuple(int(option) for option in row) for row in exhaust(build_tables(evaluator)).designs]
    shown = [point["decisions"] for point in data["front"]]
    others = [design for design in feasible if decisions_of(space, design) not in shown]
    for design in rng.sample(others, min(6, len(others))):
        new = listed(evaluator, design)
        if data["front"]:
            changed = copied(data)
            at = rng.randrange(len(data["front"]))
            changed["front"][at].update(new)
            yield f"front[{at}] is another design", renumbered(changed, space)
        changed = copied(data)
        changed["front"].append({"id": 0, "rank": 0, "score": "", **new})
        changed["status"] = "complete" if data["status"] == "infeasible" else data["status"]
        yield "a point that does not belong to the front", renumbered(changed, space)


def listed(evaluator: Evaluator, design: Design) -> Data:
    evaluation = evaluator.evaluate(tuple(max(option, 0) for option in design))
    names = [measure.metric.name for measure in evaluator.objectives]
    space = evaluator.space
    cores = {space.components[thread].name: core for thread, core in cores_of(space, evaluation.design).items()}
    counted = with_contention(space)
    judged = {} if counted is None else written(Contended, judge(ContentionReferee(counted), evaluation.design))
    return {
        "objectives": dict(zip(names, evaluation.objectives, strict=True)),
        "metrics": evaluator.metric_values(evaluation.design),
        "decisions": decisions_of(space, evaluation.design),
        **({"cores": cores} if cores else {}),
        **({"contention": judged} if judged else {}),
    }


def contention_changed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    """Another core, and another word on what a design keeps when response times count."""
    for at, point in drawn(data["front"], rng):
        for thread, core in point.get("cores", {}).items():
            changed = copied(data)
            changed["front"][at]["cores"][thread] = core % 4 + 1
            yield f"front[{at}].cores[{thread}] changed", changed
        if "cores" in point:
            changed = copied(data)
            del changed["front"][at]["cores"]
            yield f"front[{at}].cores missing", changed
        if "contention" not in point:
            continue
        other = {"kept": "broken", "broken": "kept"}[point["contention"]["status"]]
        changed = copied(data)
        changed["front"][at]["contention"]["status"] = other
        yield f"front[{at}].contention is {other}", changed
        changed = copied(data)
        del changed["front"][at]["contention"]
        yield f"front[{at}].contention missing", changed
        for position, item in enumerate(point["contention"]["broken"]):
            changed = copied(data)
            del changed["front"][at]["contention"]["broken"][position]
            yield f"front[{at}].contention.broken[{position}] missing", changed
            changed = copied(data)
            changed["front"][at]["contention"]["broken"][position]["value"] = 1 if item["value"] is None else None
            yield f"front[{at}].contention.broken[{position}].value changed", changed


def regions_changed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    signs = {item["name"]: 1 if item["sense"] == "minimise" else -1 for item in data["objectives"]}
    outermost = {
        name: max((sign * region[name] for region in data["refuted"]), default=0) for name, sign in signs.items()
    }
    for at, region in drawn(data["refuted"], rng):
        changed = copied(data)
        del changed["refuted"][at]
        yield f"refuted[{at}] missing", changed
        for name, sign in signs.items():
            if sign * region[name] == outermost[name]:
                continue  # the edge of the objective space: beyond it there is nothing, however far out it is drawn
            for step in (-1, 1):
                changed = copied(data)
                changed["refuted"][at][name] += step
                yield f"refuted[{at}] {name} {step:+}", changed


def regions_invented(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    """A refuted region that holds a point, instead of the point."""
    names = [item["name"] for item in data["objectives"]]
    signs = [1 if item["sense"] == "minimise" else -1 for item in data["objectives"]]
    for at, point in drawn(data["front"], rng):
        changed = copied(data)
        del changed["front"][at]
        beyond = {name: point["objectives"][name] + sign for name, sign in zip(names, signs, strict=True)}
        edge = {
            name: sign * max(sign * region[name] for region in data["refuted"])
            for name, sign in zip(names, signs, strict=True)
        }
        changed["refuted"] += [beyond, edge]
        if not changed["front"]:
            changed["status"] = "infeasible"
        yield f"point {point['id']} called impossible", renumbered(changed, space)


def statements_changed(data: Data, space: Space, rng: random.Random) -> Iterator[Mutation]:
    effective = data["problem"]["effective"]
    for key in ("requirements", "rules", "objectives"):
        for at in range(len(effective[key])):
            changed = copied(data)
            del changed["problem"]["effective"][key][at]
            yield f"effective.{key}[{at}] missing", changed
    for key, value in (("profile", "osate-2.19"), ("worst_case", "deadline")):
        if effective[key] != value and key == "profile":
            changed = copied(data)
            changed["problem"]["effective"]["fixed"] = {"no such": "decision"}
            yield f"effective.fixed with {key}", changed
    places: tuple[tuple[tuple[str, ...], Any], ...] = (
        (("problem", "sha256"), "0" * 64),
        (("problem", "name"), "another"),
        (("search", "space_size"), data["search"]["space_size"] + 1),
        (("status",), "incomplete"),
        (("status",), "infeasible" if data["front"] else "complete"),
        (("status",), "optimal"),
        (("front",), None),
        (("refuted",), []),
        (("unexplored",), data["refuted"][:1]),
    )
    for path, other in places:
        changed = copied(data)
        holder = changed
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = other
        yield f"{'.'.join(path)} is {str(other)[:20]}", changed
    for at in range(len(data["objectives"])):
        for key, value in (("sense", "maximise"), ("unit", "s"), ("name", "price of nothing")):
            changed = copied(data)
            if changed["objectives"][at][key] == value:
                value = "minimise"
            changed["objectives"][at][key] = value
            yield f"objectives[{at}].{key} is {value}", changed
    for name in data["metric_units"]:
        changed = copied(data)
        changed["metric_units"][name] = "furlong"
        yield f"unit of {name}", changed


KINDS = (
    points_removed,
    points_repeated,
    numbers_changed,
    labels_changed,
    decisions_altered,
    designs_swapped,
    contention_changed,
    regions_changed,
    regions_invented,
    statements_changed,
)
