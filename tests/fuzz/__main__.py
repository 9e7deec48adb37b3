"""The fuzzing command: ``python -m tests.fuzz [--of launches|imports] [--cases 100000] [--seed 1] [--folder DIR]``."""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from .harness import Fuzzer, Outcome
from .importing import ImportFuzzer
from .launches import LaunchFuzzer

SAY_EVERY = 1000


def main() -> int:
    """Run the cases; every fault leaves its file and what was called. The exit code is 1 when there was one."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    kinds = ("problems", "launches", "imports")
    parser.add_argument("--of", choices=kinds, default="problems", help="which files are mutated")
    parser.add_argument("--cases", type=int, default=100_000, help="how many mutated files")
    parser.add_argument("--first", type=int, default=0, help="the number of the first case, to repeat one")
    parser.add_argument("--seed", type=int, default=1, help="of all mutations")
    parser.add_argument("--coverage", action="store_true", help="of problems: mutate on from what reaches new lines")
    parser.add_argument("--memory", type=float, default=6.0, help="GB of address space that may be used")
    parser.add_argument("--folder", type=Path, help="where it works and leaves faults; else a temporary one")
    options = parser.parse_args()
    limit = int(options.memory * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    folder = options.folder or Path(tempfile.mkdtemp(prefix="fuzz-"))
    fuzzer: Fuzzer | LaunchFuzzer | ImportFuzzer
    if options.of == "launches":
        fuzzer = LaunchFuzzer(folder.resolve(), options.seed)
    elif options.of == "imports":
        fuzzer = ImportFuzzer(folder.resolve(), options.seed)
    else:
        fuzzer = Fuzzer(folder.resolve(), options.seed, coverage=options.coverage)
    codes: Counter[str] = Counter()
    slowest: list[tuple[float, int, str]] = []
    faults = 0
    started = time.monotonic()
    for number in range(options.first, options.first + options.cases):
        outcome = fuzzer.run(fuzzer.case(number))
        kind = outcome.case.seeded if options.of == "imports" else outcome.case.arguments[0]
        codes[f"{kind} {outcome.code}"] += 1
        slowest = sorted([*slowest, (round(outcome.seconds, 1), number, kind)])[-5:]
        if outcome.fault:
            faults += 1
            print(f"case {number}: {_leave(folder, number, outcome)}", flush=True)
        if (number + 1) % SAY_EVERY == 0:
            print(
                f"{number + 1} cases, {faults} faults, {time.monotonic() - started:.0f} s", file=sys.stderr, flush=True
            )
    found: dict[str, Any] = {
        "cases": options.cases,
        "seed": options.seed,
        "faults": faults,
        "codes": dict(sorted(codes.items())),
        "slowest": slowest,
        "seconds": round(time.monotonic() - started),
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }
    if isinstance(fuzzer, Fuzzer) and fuzzer.coverage is not None:
        found["lines"] = len(fuzzer.coverage.seen)
        found["corpus"] = len(fuzzer.problems) + len(fuzzer.results)
    print(json.dumps(found, indent=1))
    return 1 if faults else 0


def _leave(folder: Path, number: int, outcome: Outcome) -> str:
    """Keep what is needed to repeat a fault; returns its last line."""
    kept = folder / "faults"
    kept.mkdir(exist_ok=True)
    (kept / f"{number}-{Path(outcome.case.name).name}").write_bytes(outcome.case.data)
    words = [repr(outcome.case.arguments), outcome.fault, outcome.output[-3000:]]
    (kept / f"{number}.txt").write_text("\n\n".join(words), encoding="utf-8", errors="replace")
    return f"{' '.join(outcome.case.arguments)!r}: {(outcome.fault.strip().splitlines() or [''])[-1]}"


if __name__ == "__main__":
    sys.exit(main())
