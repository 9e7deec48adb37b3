"""Random rules, derived metrics, requirements and objectives, with limits around values that designs attain."""

from __future__ import annotations

import random
import re
from fractions import Fraction
from itertools import islice
from math import ceil, floor
from typing import Any

from .evaluator import designs, evaluate, evaluated, non_dominated, violations
from .problem import NONE, Problem, as_list

SAMPLE = 120
"""Designs that are looked at when limits are chosen."""
MOST_LOOKED_AT = 300
"""Designs that are looked at when a limit on a core is chosen, or an overload is allowed."""
FEW = 200
"""Designs of a problem that leaves cores open."""
OVERLOADS = ("core of ", "load_share of ", "exclusive of ")
UNORDERED = (
    "type",
    "bus",
    "processor",
    "executor",
    "dispatch_protocol",
    "compute_execution_time",
    "response_time",
    "latency",
    "transmission_time.fixed",
    "transmission_time.per_byte",
    "communication",
)
COMPARABLE = (
    "offset",
    *UNORDERED,
    "period",
    "data_size",
    "rate",
    "data_rate",
    "price",
    "cores",
    "bandwidth",
    "overhead",
    "queue_size",
)


def _quote(name: str) -> str:
    return f"'{name}'" if " " in name else name


def _ref(decision: str) -> str:
    name, field = decision.rsplit(".", 1)
    return f"{_quote(name)}.{field}"


def add_rules(rng: random.Random, document: dict[str, Any]) -> None:
    """Up to three rules; one that leaves no design is nearly always dropped."""
    if not rng.random() < 0.6:
        return
    rules: list[str] = []
    for _ in range(rng.randint(1, 3)):
        text = _rule(rng, Problem(document))
        if text is None:
            continue
        document["rules"] = [*rules, text]
        if next(designs(Problem(document)), None) is not None or rng.random() < 0.05:
            rules.append(text)
        if rules:
            document["rules"] = list(rules)
        else:
            del document["rules"]


def _rule(rng: random.Random, problem: Problem) -> str | None:
    if not problem.decisions:
        return None
    verb = rng.choice(["", "require ", "forbid "])
    form = rng.randrange(6)
    if form == 0:
        return verb + _atom(rng, problem)
    if form == 1:
        return f"{verb}{_atom(rng, problem)} implies {_atom(rng, problem)}"
    if form == 2:
        used = _names_in_use(problem)
        return f"{rng.choice(used)} requires {rng.choice(used)}"
    if form == 3:
        return f"{verb}not {_atom(rng, problem)} {rng.choice(['or', 'and'])} {_atom(rng, problem)}"
    if form == 4:
        word = rng.choice(["or", "and"])
        return f"{verb}({_atom(rng, problem)} {word} {_atom(rng, problem)}) implies {_atom(rng, problem)}"
    return f"forbid {_atom(rng, problem)} and {_atom(rng, problem)}"


def _names_in_use(problem: Problem) -> list[str]:
    """Slots, and types of the catalogues, whether some slot may have them or not."""
    names: list[str] = [*problem.sections["processor_types"], *problem.sections["bus_types"]]
    for section in ("processors", "buses"):
        for name in problem.sections[section]:
            names += [_quote(name), *(t for t in problem.types(name) if t != NONE)]
    names += [name for name in problem.buses if name not in problem.sections["buses"]]
    return list(dict.fromkeys(names))


def _atom(rng: random.Random, problem: Problem) -> str:
    """A comparison of decisions; those with periods are the most interesting."""
    decisions = {d: options for d, options in problem.decisions.items() if problem.owner(d)[1] in COMPARABLE}
    periods = [d for d in decisions if d.endswith(".period")]
    if len(periods) > 1 and rng.random() < 0.5:
        left, right = rng.sample(periods, 2)
        return f"{_ref(left)} {rng.choice(['==', 'is a multiple of', '<=', '>', '!='])} {_ref(right)}"
    if not decisions or rng.random() < 0.12:
        return rng.choice(_names_in_use(problem))
    decision = rng.choice(periods if periods and rng.random() < 0.3 else list(decisions))
    options = decisions[decision]
    if rng.random() < 0.2:
        return f"{_ref(decision)} in [{', '.join(rng.sample(options, rng.randint(1, len(options))))}]"
    unordered = problem.owner(decision)[1] in UNORDERED
    sign = rng.choice(["==", "!="] if unordered else ["==", "!=", "<", "<=", ">", ">="])
    return f"{_ref(decision)} {sign} {rng.choice(options)}"


def _candidates(problem: Problem) -> list[str]:
    """The metrics that a requirement or an objective may name."""
    found = [f"{metric} of {_quote(flow)}" for flow in problem.paths for metric in ("latency", "min latency", "jitter")]
    if "clocks" in problem.document:
        found += [f"{metric} of {_quote(flow)}" for flow in problem.paths for metric in ("reaction time", "run jitter")]
        aged = [flow for flow, path in problem.paths.items() if problem.is_always_timed(path[0])]
        found += [f"data age of {_quote(flow)}" for flow in aged]
        found += 2 * [f"disparity of {_quote(name)}" for name in problem.meetings]
    found += [f"utilisation of {_quote(slot)}" for slot in problem.sections["processors"]]
    found += [f"load of {_quote(bus)}" for bus in problem.sections["buses"]]
    found += ["price", "power", *problem.totals, *problem.metrics]
    found += [
        f"{metric} of {_quote(name)}"
        for metric in ("price", "power")
        for section in ("processors", "buses", "devices")
        for name in problem.sections[section]
    ]
    if len(problem.paths) == 1:
        found += ["jitter", "latency"]
    if len(problem.sections["processors"]) == 1:
        found.append("utilisation")
    return found


class _Sample:
    """Figures of up to SAMPLE designs, spread evenly, and every candidate metric's value in each of them."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self.metrics = _candidates(Problem(document))
        problem = Problem({**document, "objectives": [f"minimise {metric}" for metric in self.metrics]})
        found = list(designs(problem))
        self.figures = [evaluate(problem, design) for design in found[:: len(found) // SAMPLE + 1]]
        columns = zip(*(figures["objectives"] for figures in self.figures), strict=True)
        self.values = dict(zip(self.metrics, map(list, columns), strict=True)) if found else {}
        self.varying = [metric for metric, values in self.values.items() if len(set(values)) > 1]

    def satisfying(self, requirements: list[str]) -> list[int]:
        """The indices of the designs that meet the requirements."""
        problem = Problem({**self.document, "requirements": requirements})
        return [i for i, figures in enumerate(self.figures) if not violations(problem, figures)]


def add_question(rng: random.Random, document: dict[str, Any]) -> None:
    """Derived metrics, requirements, objectives and a baseline."""
    if rng.random() < 0.4:
        document["metrics"] = _derived_metrics(rng, Problem(document))
    sample = _Sample(document)
    requirements = _requirements(rng, sample)
    if requirements:
        document["requirements"] = requirements
    document["objectives"] = _objectives(rng, sample, sample.satisfying(requirements))
    _ask_for_cores(random.Random(rng.getstate()[1][1]), sample)
    _ask_for_busy_time(random.Random(rng.getstate()[1][0]), sample)
    _ask_for_extremes(random.Random(rng.getstate()[1][1]), sample)
    if rng.random() < 0.25 and sample.figures:
        _require_flow_latency(rng, sample)
    if rng.random() < 0.2:
        _add_baseline(rng, document)
    _ask_for_changes(random.Random(rng.getstate()[1][2]), document)
    _ask_for_single_cores(random.Random(rng.getstate()[1][3]), document)


def _ask_for_single_cores(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes what one core carries, or each; at most two threads have several to choose from."""
    problem = Problem(document)
    slots = [slot for slot in problem.sections["processors"] if problem.most_cores(slot) > 1]
    if not slots or rng.random() < 0.7:
        return
    slot = rng.choice(slots)
    most = problem.most_cores(slot)
    count, wide = sum(1 for _ in islice(designs(problem), FEW)), max(map(problem.most_cores, slots))
    left = sum(count * wide**number <= FEW for number in (1, 2))
    for name in [name for name in problem.places if len(problem.cores(name)) > 1][left:]:
        chosen = rng.randint(1, 2) if rng.random() < 0.5 else 1
        document[problem.section_of[name]][name]["core"] = str(min(chosen, problem.last_core(name)))
        document.get("baseline", {}).get(name, {}).pop("core", None)
    core = rng.randint(1, most)
    of = rng.choice([f"core {core} of {_quote(slot)}", f"each core of {_quote(slot)}"])
    if rng.random() < 0.6 and len(document["objectives"]) < 4:
        document["objectives"] = [
            *document["objectives"],
            f"{rng.choice(['minimise', 'maximise'])} utilisation of {of}",
        ]
        return
    asking = Problem({**document, "objectives": [f"minimise utilisation of {of}"]})
    values = sorted(
        figures["objectives"][0] * 10**6
        for _, figures in islice(evaluated(asking), MOST_LOOKED_AT)
        if not figures["violations"]
    )
    value = rng.choice(values) if values else Fraction(0)
    sign = rng.choice(["<=", "<=", "<", ">="]) if "each" not in of else "<="
    limit = floor(value) if sign == ">=" else ceil(value) + (sign == "<")
    document["requirements"] = [*document.get("requirements", []), f"utilisation of {of} {sign} {limit} ppm"]


def allow_what_is_needed(rng: random.Random, document: dict[str, Any]) -> None:
    """Where no design keeps every implied limit, mostly that of a design that keeps all else is lifted."""
    found = []
    for _, figures in islice(evaluated(Problem(document)), MOST_LOOKED_AT):
        found.append(figures["violations"])
        if not found[-1]:
            return
    if not found or rng.random() < 0.1:
        return
    slots = {**document["processors"], **document.get("buses", {})}
    needed = [[text.partition(" of ")[2] for text in texts if text.startswith(OVERLOADS)] for texts in found]
    others = [len(texts) - len(names) for texts, names in zip(found, needed, strict=True)]
    _, names = min(zip(others, needed, strict=True), key=lambda item: (item[0], len(item[1])))
    for name in names:
        if name in slots:
            slots[name]["overload"] = "allowed"


def _ask_for_cores(rng: random.Random, sample: _Sample) -> None:
    """Often a limit around what a core carries that threads have to share; drawn apart from all else."""
    shared = [
        (slot, peak.exact)
        for figures in sample.figures
        for slot, peak in figures["peak"].items()
        if figures["cores"][slot] > 1 and peak.exact > max(figures["shares"][slot].values(), default=peak.exact)
    ]
    if not shared or rng.random() < 0.3:
        return
    slot, peak = rng.choice(shared)
    limit = max(0, rng.choice([floor, ceil])(peak * 10**6) + rng.choice([0, 0, 1, -1]))
    text = f"utilisation of {_quote(slot)} {rng.choice(['<=', '<=', '<'])} {limit} ppm"
    sample.document["requirements"] = [*sample.document.get("requirements", []), text]


def _ask_for_busy_time(rng: random.Random, sample: _Sample) -> None:
    """Sometimes an objective or a limit about the busy time of a bus; drawn apart from all else."""
    document = sample.document
    buses = Problem(document).timed_buses
    if not buses or not sample.figures or rng.random() < 0.6:
        return
    bus = rng.choice(buses)
    of = rng.choice([f" of {_quote(bus)}", ""]) if len(buses) == 1 else f" of {_quote(bus)}"
    if rng.random() < 0.5 and len(document["objectives"]) < 4:
        document["objectives"] = [*document["objectives"], f"{rng.choice(['minimise', 'maximise'])} busy{of}"]
        return
    values = sorted(figures["busy"][bus] for figures in sample.figures)
    value = values[int(len(values) * rng.choice([0, 0.5, 0.8]))] * 10**6
    sign = rng.choice(["<=", "<=", "<=", "<", ">=", ">"])
    limit = ceil(value) if sign[0] == "<" else floor(value)
    text = f"busy{of} {sign} {rng.choice([f'{limit} ppm', f'{limit / 10**4:.4f} %'])}"
    document["requirements"] = [*document.get("requirements", []), text]


def _ask_for_changes(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes how much changes, as an objective, a limit or in a derived metric; drawn apart from all else."""
    problem = Problem(document)
    found = list(designs(problem)) if rng.random() < 0.4 else []
    if not found:
        return
    baseline = document.setdefault("baseline", {})
    costs: dict[str, Any] = {}
    for decision, option in rng.choice(found).items():
        name, field = problem.owner(decision)
        stated = option if option is not None else rng.choice(problem.decisions[decision])
        if rng.random() < (0.8 if option is not None else 0.3):
            baseline.setdefault(name, {}).setdefault(field, stated)
        if rng.random() < 0.2 and field != "core":
            costs.setdefault(name, {})[field] = rng.choice(["0", "2", "5"])
    if not baseline:
        del document["baseline"]
        return
    if costs:
        document["cost_of_change"] = costs
    metric = "changes"
    if rng.random() < 0.3:
        metric = "effort"
        document["metrics"] = {**document.get("metrics", {}), metric: "changes * 3 - changes"}
    if rng.random() < 0.6 and len(document["objectives"]) < 4:
        document["objectives"] = [
            *document["objectives"],
            f"{rng.choice(['minimise', 'minimise', 'maximise'])} {metric}",
        ]
        return
    asked = Problem({**document, "objectives": ["minimise changes"], "requirements": []})
    values = sorted(evaluate(asked, one)["objectives"][0] for one in found[:: len(found) // SAMPLE + 1])
    value = values[int(len(values) * rng.choice([0, 0.3, 0.6, 0.8]))]
    text = f"changes {rng.choice(['<=', '<=', '<=', '<', '>=', '=='])} {value}"
    document["requirements"] = [*document.get("requirements", []), text]


def _ask_for_extremes(rng: random.Random, sample: _Sample) -> None:
    """Sometimes the greatest or least of several metrics, with a name or without; drawn apart from all else."""
    document = sample.document
    if not sample.figures or rng.random() < 0.5:
        return
    for _ in range(rng.choice([1, 1, 2])):
        text, unit = _extreme(rng, Problem(document))
        metric = text
        if rng.random() < 0.5 or not re.fullmatch(r"(max|min)\(.*\)", text) or " - " in text:
            metric = f"extreme{len(document.get('metrics', {}))}"
            document["metrics"] = {**document.get("metrics", {}), metric: text}
        if rng.random() < 0.6 and len(document["objectives"]) < 4:
            sense = rng.choice(["minimise", "minimise", "maximise"])
            counts = {"utilisation": "processors", "latency": "flows", "load": "buses"}
            several = [kind for kind, section in counts.items() if len(Problem(document).sections[section]) > 1]
            metric = rng.choice([metric, metric, *several])
            same = (f" {metric}", f"({metric})", metric.removeprefix("max").removeprefix("min").strip("()"))
            if not any(objective.endswith(same) for objective in document["objectives"]):
                document["objectives"] = [*document["objectives"], f"{sense} {metric}"]
            continue
        problem = Problem({**document, "objectives": [f"minimise {metric}"], "requirements": []})
        found = list(designs(problem))
        values = sorted(evaluate(problem, one)["objectives"][0] for one in found[:: len(found) // SAMPLE + 1])
        value = values[int(len(values) * rng.choice([0, 0.5, 0.8]))] * (10**6 if unit == "ppm" else 1)
        sign = rng.choice(["<=", "<=", "<", ">=", ">", "=="])
        limit = ceil(value) if sign[0] == "<" else floor(value)
        euros = f"{'-' if limit < 0 else ''}{abs(limit) // 100}.{abs(limit) % 100:02} EUR"
        said = euros if unit == "EUR" else f"{limit} {unit}"
        document["requirements"] = [*document.get("requirements", []), f"{metric} {sign} {said}"]


def _extreme(rng: random.Random, problem: Problem) -> tuple[str, str]:
    """An extreme, alone or in a sum, with its unit."""
    flows = [_quote(flow) for flow in problem.paths]
    kind, other = rng.choice(["max", "max", "min"]), rng.choice(["max", "min"])
    one, two = rng.choice(flows), rng.choice(flows)
    slots = [_quote(name) for section in ("processors", "buses") for name in problem.sections[section]]
    first, second = rng.choice(slots), rng.choice(slots)
    return rng.choice(
        [
            (f"{kind}(utilisation)", "ppm"),
            (f"{kind}(utilisation of {_quote(next(iter(problem.sections['processors'])))}, utilisation / 2)", "ppm"),
            ("max(utilisation) - min(utilisation)", "ppm"),
            (f"{kind}(latency)", "ns"),
            (f"{kind}(jitter * 2)", "ns"),
            (f"{kind}(load)", "B/s"),
            (f"{kind}(latency of {one}, 2 * min latency of {two})", "ns"),
            (f"{kind}({other}(latency of {one}, latency of {two}), jitter of {one} + jitter of {two})", "ns"),
            (f"{kind}(price of {first}, price of {second}) - {other}(price of {second}, price / 3)", "EUR"),
            (f"-{kind}(price of {first} * 3, price - price of {second})", "EUR"),
        ]
    )


def _objectives(rng: random.Random, sample: _Sample, feasible: list[int]) -> list[str]:
    """One to five objectives; of several draws the one with the most trade-offs."""
    count = rng.choice([1, 2, 2, 3, 3, 3, 4, 4, 5])
    best: tuple[int, list[str]] = (-1, [])
    for _ in range(rng.choice([1, 15, 15])):
        chosen = _metrics_to_optimise(rng, sample, count)
        senses = [rng.choice([1] * 5 + [-1]) for _ in chosen]
        vectors = {
            tuple(sense * sample.values[metric][i] for sense, metric in zip(senses, chosen, strict=True))
            for i in feasible
        }
        texts = [
            f"{'minimise' if sense > 0 else 'maximise'} {metric}" for sense, metric in zip(senses, chosen, strict=True)
        ]
        best = max(best, (len(non_dominated(vectors)) if vectors else 0, texts), key=lambda draw: draw[0])
    return best[1]


def _metrics_to_optimise(rng: random.Random, sample: _Sample, count: int) -> list[str]:
    """Different metrics, those that differ between designs first."""
    chosen: list[str] = []
    rest = [metric for metric in sample.metrics if metric not in sample.varying]
    for metric in (*rng.sample(sample.varying, len(sample.varying)), *rng.sample(rest, len(rest))):
        alike = any(
            set(metric.split(" of ")) <= set(other.split(" of "))
            or set(other.split(" of ")) <= set(metric.split(" of "))
            for other in chosen
        )
        if len(chosen) < count and not alike:
            chosen.append(metric)
    return chosen


def _derived_metrics(rng: random.Random, problem: Problem) -> dict[str, str]:
    flow = _quote(rng.choice(list(problem.paths)))
    metrics = {"line_variation": f"jitter of {flow} * 0.6 m/s"}
    if rng.random() < 0.5:
        metrics["mean_distance"] = f"latency of {flow} * 0.6 m/s / 2 + min latency of {flow} * 0.3 m/s"
    if rng.random() < 0.4:
        metrics["budget"] = "price * 2 - price / 3"
    if rng.random() < 0.3:
        metrics["spread"] = f"latency of {flow} - 2 * min latency of {flow}"
    return metrics


def _requirements(rng: random.Random, sample: _Sample) -> list[str]:
    """Limits around attained values; most of them can be met together."""
    texts: list[str] = []
    if not sample.figures:
        return texts
    for _ in range(rng.choice([0, 1, 2, 2, 3, 4])):
        text = _general_requirement(rng, sample) if rng.random() < 0.25 else _requirement(rng, sample)
        if text not in texts and (sample.satisfying([*texts, text]) or rng.random() < 0.2):
            texts.append(text)
    return texts


def _requirement(rng: random.Random, sample: _Sample) -> str:
    pool = sample.varying if sample.varying and rng.random() < 0.85 else sample.metrics
    metric = rng.choice(pool)
    values = sorted(sample.values[metric])
    sign = rng.choice(["<="] * 6 + ["<", "<", ">=", ">", "=="])
    at = rng.choice([0, 0.3, 0.6, 0.8, 0.95])
    value = values[int(len(values) * (1 - at if sign in (">=", ">") and at else at))]
    if rng.random() < 0.03:
        value = values[0] - abs(values[0]) / 7 - 1
    return f"{metric} {sign} {_limit(rng, sample.document, metric, value, sign)}"


def _general_requirement(rng: random.Random, sample: _Sample) -> str:
    """A requirement without a name, which holds for every flow, processor or bus."""
    wired = all(share is not None for share in sample.figures[0]["load_share"].values())
    metric = rng.choice(["utilisation", "load" if wired else "utilisation", "latency", "jitter"])
    if metric == "utilisation":
        return f"utilisation {rng.choice(['<=', '<'])} {rng.choice(['5 %', '12.5 %', '30 %', '70 %', '100 %'])}"
    if metric == "load":
        return f"load <= {rng.choice(['1 %', '10 %', '50 %', '123456 ppm'])}"
    worst = max(max(sample.values[f"{metric} of {_quote(flow)}"]) for flow in sample.document["flows"])
    return f"{metric} <= {floor(worst * rng.choice([7, 9, 10, 10]) / 10)} ns"


def _limit(rng: random.Random, document: dict[str, Any], metric: str, value: Fraction, sign: str) -> str:
    """A limit at or next to a value, in a unit that can say it."""
    whole = rng.choice([floor, ceil]) if value.denominator > 1 else int
    kind = metric.split(" of ")[0]
    if kind == "utilisation":
        ppm = whole(value * 10**6)
        return rng.choice([f"{max(ppm, 0)} ppm", f"{max(ppm, 0) / 10**4:.4f} %"])
    if kind == "load":
        slot = re.sub(r"^load of |'", "", metric)
        types = as_list(document["buses"][slot]["type"])
        wired = all("bandwidth" in document["bus_types"][t] for t in types)
        if wired and rng.random() < 0.5:
            return rng.choice(["1 %", "5.5 %", "20 %", "50 %", "80000 ppm"])
        return f"{max(whole(value), 0)} B/s"
    if kind in ("price", "budget"):
        return f"{whole(value) / 100:.2f} EUR"
    if kind == "power":
        return f"{whole(value)} mW"
    if kind == "mass":
        return f"{whole(value)} {document['totals']['mass']}"
    if kind in ("line_variation", "mean_distance"):
        return rng.choice([f"{whole(value)} nm", f"{whole(value) / 10**6:.6f} mm"])
    ns = whole(value) + (rng.choice([0, 0, 0, 1, -1]) if sign != "==" else 0)
    return rng.choice([f"{ns} ns", f"{Fraction(ns, 1000).__ceil__()} us", f"{ns / 10**6:.6f} ms"])


def _require_flow_latency(rng: random.Random, sample: _Sample) -> None:
    name = rng.choice(list(sample.document["flows"]))
    values = sorted(sample.values[f"latency of {_quote(name)}"])
    limit = ceil(values[rng.randrange(len(values) // 2, len(values))])
    sample.document["flows"][name]["latency"] = f"0 ns .. {limit} ns"


def _add_baseline(rng: random.Random, document: dict[str, Any]) -> None:
    problem = Problem(document)
    design = next(designs(problem), None)
    if design is None:
        return
    baseline: dict[str, dict[str, str]] = {}
    for decision, option in design.items():
        if option is not None and rng.random() < 0.8:
            name, field = problem.owner(decision)
            baseline.setdefault(name, {})[field] = option
    if baseline:
        document["baseline"] = baseline
