"""The record of a run as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import exp, log
from typing import Any

from tests.helpers.tuned import HEURISTICS

from .contending import LEAST_S, OURS, TIMES
from .heuristics import ratios
from .run import LOOPS, MINIZINC_THREADS


def markdown(record: dict[str, Any]) -> str:
    """The whole report."""
    parts = [*_head(record)]
    for name, make in (
        ("fronts", _fronts),
        ("curves", _curves),
        ("startup", _startup),
        ("commands", _commands),
        ("contention", _contention),
        ("classical", _classical),
        ("analysis", _analysis),
        ("heuristics", _heuristics),
    ):
        if record.get(name):
            parts += ["", *make(record[name])]
    return "\n".join(parts) + "\n"


def _head(record: dict[str, Any]) -> Iterator[str]:
    yield "# Benchmarks"
    yield ""
    machine = record["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    yield f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB, {machine['system']};"
    yield f"{versions}; commit {record['commit']}."
    yield f"Seed {record['seed']}, {record['repeats']} repeats, time limit {record['limit_s']:g} s."
    yield f"Command: `{record['command']}`."
    yield ""
    yield "Seconds are medians with the least and the most in brackets, each run in a process of its own, in turns."
    yield "Other work may have run on the same machine: compare ratios rather than seconds."


def _heuristics(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "## Without each heuristic"
    yield ""
    yield "Processor seconds, calls of CP-SAT and deterministic time, as multiples of those with all heuristics."
    yield ""
    names = [name for name in HEURISTICS if any(name in row for row in rows)]
    lines = []
    for row in rows:
        whole = row["all"]
        cells = [_show(whole.get("user_s")) + " s"]
        for name in names:
            found = row.get(name, {"failed": "not measured"})
            good = "failed" not in found and "failed" not in whole
            cells.append(
                (" / ".join(ratios(found, whole)) if good else "-") + ("" if found.get("is_complete", True) else " +")
            )
        lines.append([row["case"], *cells])
    yield from _table(["problem", "all", *names], lines)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def _show(value: dict[str, float] | None, digits: int = 2) -> str:
    if not value:
        return "-"
    if value["least"] == value["most"]:
        return f"{value['median']:.{digits}f}"
    return f"{value['median']:.{digits}f} ({value['least']:.{digits}f}-{value['most']:.{digits}f})"


def _fronts(rows: list[dict[str, Any]]) -> Iterator[str]:
    done = [row for row in rows if "points" in row]
    yield "## Stages"
    yield ""
    yield "One worker. `prove` ends when no region is open; `enumerate` also makes every design the canonical one."
    yield ""
    stages_head = ("build s", "encode s", "prove s", "enumerate s", "report s")
    head: tuple[str, ...] = ("problem", "points", *stages_head, "calls a point", "ms a point", "MB")
    body = []
    for row in done:
        mine, count = row["ours_1"], max(1, row["points"])
        state = "" if row["is_complete"] else f" (not proved, gap {_percent(row['gap'])})"
        stages = [_show(mine[key]) for key in ("build_s", "encode_s", "proof_s", "enumerate_s", "report_s")]
        cost = [f"{row['calls'] / count:.2f}", f"{1000 * mine['proof_s']['median'] / count:.1f}"]
        body.append([row["case"], f"{row['points']}{state}", *stages, *cost, _show(mine["peak_mb"], 0)])
    yield from _table(head, body)
    yield ""
    yield "## Against the textbook loop, MiniZinc and brute force"
    yield ""
    yield "CP-SAT's default parameters, no hints: lexicographic epsilon-constraint for two objectives, minimise a sum"
    yield "and cut off what is dominated for three and more. Once on a plain model (a literal for every pair of a"
    yield "coefficient and a rate), once on ours. All seconds include the encoding. Ratios are to ours with one worker,"
    yield "repeat by repeat. `+`: not ended at the time limit, the ratio is a lower bound. Brute force: all"
    yield "combinations through the vectorised analysis, if at most 5e7."
    yield ""
    yield "MiniZinc: the same loops on the plain model with a free solver, a process for each call. After the"
    yield "semicolon: the seconds that the solver itself reports, and their ratio to ours; the rest is encoding,"
    yield f"translating, starting and flattening. Asked up to {MINIZINC_THREADS} threads."
    yield ""
    minizinc = {row.get("minizinc", {}).get("solver"): None for row in done}
    solvers = " / ".join(filter(None, minizinc)) or "MiniZinc"
    loops = [cell for name in LOOPS for cell in (f"loop, {name} s", "times ours")]
    loops += [f"{solvers} s", "times ours"]
    head = ("problem", "ours s", "ours, 2 workers s", *loops, "brute force", "front confirmed by")
    body = []
    for row in done:
        cells = [row["case"], _show(row["ours_1"]["proof_s"]), _show(row["ours_2"]["proof_s"])]
        for loop in (*row["textbook"].values(), row.get("minizinc", {})):
            cells += _loop(loop)
        full = row["exhaustive"]
        cells.append(f"{full['designs']:.1e} in {full['seconds']:.1f} s" if full.get("is_complete") else "-")
        body.append([*cells, row["checked_by"]])
    yield from _table(head, body)
    yield ""
    yield "## Against genetic algorithms"
    yield ""
    yield "pymoo on the vectorised analysis, with our time and with ten times that (at least 0.2 s; up to three seeds)."
    yield "Hypervolume and found points as shares of the true front's. In pymoo's favour: the baseline is in the first"
    yield "population, the clock starts after imports and tables, and every non-dominated design ever evaluated counts."
    yield ""
    names = [f"{algorithm} x{factor}" for algorithm in ("nsga2", "nsga3") for factor in (1, 10)]
    head = ("problem", "points", *(f"{name}: {what}" for name in names for what in ("hypervolume", "found")))
    body = []
    for row in done:
        made = row.get("genetic", {})
        cells = [row["case"], str(row["points"])]
        for name in names:
            item = made.get(name)
            cells += [_share(item["hypervolume"]), _share(item["share_of_true_front"])] if item else ["-", "-"]
        body.append(cells)
    yield from _table(head, body)
    failed = [f"* {row['case']}: {'; '.join(map(str, row['failed']))}" for row in rows if row["failed"]]
    if failed:
        yield ""
        yield "Runs that failed:"
        yield from failed


def _loop(loop: dict[str, Any]) -> tuple[str, str]:
    """Seconds, or how far it came, and the ratio to ours."""
    if "seconds" not in loop:
        return _why(loop), "-"
    ratio = _show(loop["times_ours"], 1)
    if not loop["is_complete"]:
        return f"not ended at {_show(loop['seconds'])}, {loop['points']} points", f"{ratio}+"
    if "solver_s" in loop:
        return f"{_show(loop['seconds'])}; {_show(loop['solver_s'])}", f"{ratio}; {_show(loop['solver_times_ours'], 1)}"
    return _show(loop["seconds"]), ratio


def _why(loop: dict[str, Any]) -> str:
    """Why there are no seconds."""
    if "failed" in loop:
        return f"failed: {loop['failed'][0]}".replace("|", "/")
    return loop.get("left_out", "not asked")


def _share(value: dict[str, float] | None) -> str:
    if not value:
        return "-"
    return f"{100 * value['median']:.1f} %"


def _percent(value: float | None) -> str:
    return "unknown" if value is None else f"{100 * value:.2g} %"


def _curves(series: dict[str, list[dict[str, Any]]]) -> Iterator[str]:
    yield "## Cost curves"
    yield ""
    yield "One worker. The gap is certified: whatever design is missing, a found one is at most that share of each"
    yield "objective's range worse (from the best value that is still possible to the worst one found)."
    for name, rows in series.items():
        yield ""
        yield f"### {name.capitalize()}"
        yield ""
        body = []
        for row in rows:
            if "points" not in row:
                body.append([row["case"], "failed: " + "; ".join(row["failed"]), *["-"] * 7])
                continue
            state = "proved" if row["is_complete"] else f"open at {row['limit_s']:g} s, gap {_percent(row['gap'])}"
            shown = [_show(row[key]) for key in ("build_s", "encode_s", "proof_s")]
            size = [str(row["variables"]), str(row["calls"])]
            body.append([row["case"], str(row["points"]), state, *shown, *size, _show(row["peak_mb"], 0)])
        head = ("problem", "points", "state", "build s", "encode s", "prove s", "variables", "calls", "MB")
        yield from _table(head, body)
        yield ""
        yield from _fits(name, [row for row in rows if row.get("is_complete")])


def _fits(name: str, rows: list[dict[str, Any]]) -> Iterator[str]:
    """Least squares on logarithms: a power of what grows, or for objectives a factor for each one more."""
    if len(rows) < 3:
        yield "Too few proved rows to fit a growth."
        return
    exponential = name == "objectives"
    for what in ("build_s", "encode_s", "proof_s", "peak_mb"):
        grown = [row["value"] if exponential else log(row["value"]) for row in rows]
        pairs = list(zip(grown, [log(max(1e-4, row[what]["median"])) for row in rows], strict=True))
        slope = _slope(pairs)
        fit = f"a factor of {exp(slope):.2f} for each" if exponential else f"{name}^{slope:.2f}"
        yield f"* {what.removesuffix('_s').removesuffix('_mb')} grows as {fit}"
    points = [(log(max(1, row["points"])), log(max(1e-4, row["proof_s"]["median"]))) for row in rows]
    if len({x for x, _ in points}) > 2:
        yield f"* prove grows as points^{_slope(points):.2f}"


def _slope(pairs: list[tuple[float, float]]) -> float:
    mean_x = sum(x for x, _ in pairs) / len(pairs)
    mean_y = sum(y for _, y in pairs) / len(pairs)
    return sum((x - mean_x) * (y - mean_y) for x, y in pairs) / sum((x - mean_x) ** 2 for x, _ in pairs)


def _commands(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "## Whole processes, with a result that is kept"
    yield ""
    yield "`dse solve -q --workers 1` without and with `--json PATH`, which is written while it searches; processor"
    yield "seconds of the process, in turns."
    yield ""
    body = []
    for row in rows:
        worked = [_show(item) for item in row["processor_seconds"].values()]
        size = f"{row['bytes'] / 1e6:.2f}"
        times = _show(row["kept_times_plain"])
        body.append([row["case"], f"{row['points']} ({row['status']})", *worked, times, size, row["agreement"]])
    yield from _table(("problem", "points", "without", "with --json", "times", "MB", "answers"), body)


def _contention(rows: list[dict[str, Any]]) -> Iterator[str]:
    """The part of the report."""
    yield "## Deadlines and open cores"
    yield ""
    yield "Every thread has a deadline, and its core is open. Processor seconds of the search with one worker,"
    yield "ours with canonical designs, and their ratio to ours, repeat by repeat. `+`: not ended within its limit,"
    yield f"which is {TIMES} times what ours took, at least {LEAST_S:g} s; with the points that it had found."
    yield "`ours with` a peer's way: our search, in which it replaces what ours does about deadlines."
    yield ""
    yield from _ways(rows)


def _classical(rows: list[dict[str, Any]]) -> Iterator[str]:
    """The part of the report."""
    yield "## Knapsacks and assignments"
    yield ""
    yield "Whole processes, and their processor seconds: `dse solve -q --workers 1 --json`, with canonical designs"
    yield "and all that it writes, beside an exact epsilon-constraint method (Kirlik and Sayin 2014) with CP-SAT on a"
    yield "model written straight from the numbers, which finds points only. The first problem is so small that both"
    yield "do little but start. The method asks for each corner that it looks at in two calls of the solver or in"
    yield "one, with the default `linearization_level` or 2. After the semicolon: the seconds in the solver, of the"
    yield "first run; the rest is the start, and with four objectives the list of rectangles, which grows beyond"
    yield "100,000 and is kept in arrays of numpy. Ratios of whole processes to ours, repeat by repeat: below 1 ours"
    yield f"is the slower one. `+`: not ended within its limit, {TIMES} times what ours took and at least {LEAST_S:g}"
    yield "s; with the points that it had found."
    yield ""
    yield from _ways(rows)


def _ways(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Ours and the others, each with its ratio."""
    names = list(next((row["ways"] for row in rows if "ways" in row), {}))
    head = ["problem", "points", "ours s", *(cell for name in names[1:] for cell in (f"{name} s", "times ours"))]
    body = []
    for row in rows:
        if "ways" not in row:
            body.append([row["case"], f"failed: {row['failed'][0]}", *["-"] * (len(head) - 1)])
            continue
        points = f"{row['points']}{'' if row['is_complete'] else ' (not ended)'}"
        cells = [_way_cells(row["ways"][OURS])[0]]
        cells += [cell for name in names[1:] for cell in _way_cells(row["ways"][name])]
        body.append([row["case"], points, *cells, row["agreement"]])
    yield from _table((*head, "the same front by"), body)


def _way_cells(way: dict[str, Any]) -> tuple[str, str]:
    """Processor seconds, those in the solver where they are known, points of what did not end, the ratio to ours."""
    if "worked_s" not in way:
        return f"failed: {way['failed'][0]}".replace("|", "/"), "-"
    more = "" if way["is_complete"] else "+"
    points = "" if way["is_complete"] else f", {way['points']} points"
    inside = f"; {way['solver_s']:.1f}" if "solver_s" in way else ""
    return f"{_show(way['worked_s'])}{inside}{points}", f"{_show(way['times_ours'], 1)}{more}"


def _startup(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "## Whole processes"
    yield ""
    yield "Processor seconds do not count what else the machine was doing."
    yield ""
    body = [
        [f"`{row['command']}`", *(_show(row[key], 2) for key in ("seconds", "processor_seconds", "times_import"))]
        for row in rows
    ]
    yield from _table(("command", "seconds", "processor seconds", "times the import of the solver"), body)


def _analysis(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "## Designs analysed per second"
    yield ""
    body = [
        [row["case"], _show(row["build_s"], 3), _show(row["per_second"], 0), _show(row["singles_per_second"], 0)]
        for row in rows
    ]
    yield from _table(("problem", "tables s", "vectorised, in batches of 400 000", "one by one"), body)
