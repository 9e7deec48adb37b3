"""The benchmark command: ``python -m tests.benchmarks [--quick] [--only fronts,contention]``."""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from .cases import ROOT
from .commands import run_commands
from .comparing import run_classical
from .contending import run_contention
from .heuristics import run_heuristics
from .minizinc import installed
from .run import run_analysis, run_curves, run_fronts, run_startup, write
from .tables import markdown

PARTS = {
    "fronts": run_fronts,
    "curves": run_curves,
    "startup": run_startup,
    "commands": run_commands,
    "contention": run_contention,
    "classical": run_classical,
    "analysis": run_analysis,
    "heuristics": run_heuristics,
}
PACKAGES = ("ortools", "numpy", "pymoo", "moocore")


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small problems and one repeat: does everything work?")
    parser.add_argument("--only", default=",".join(PARTS), help="which parts, separated by commas")
    parser.add_argument("--match", default="", help="only problems whose name contains this")
    parser.add_argument("--seed", type=int, default=1, help="of the generated problems")
    parser.add_argument("--repeats", type=int, default=0, help="of every measurement (5; 1 when quick)")
    parser.add_argument("--limit", type=float, default=0.0, help="seconds for a search (300; 20 when quick)")
    parser.add_argument("--no-genetic", dest="genetic", action="store_false", help="leave the genetic algorithms out")
    parser.add_argument("--no-minizinc", dest="minizinc", action="store_false", help="leave MiniZinc out")
    parser.add_argument("--long", action="store_true", help="curves with 60 s and, where that was not enough, 600 s")
    parser.add_argument("--name", default="", help="of the report's files")
    parser.add_argument("--output", type=Path, default=ROOT / "reports" / "benchmarks", help="folder of the report")
    options = parser.parse_args()
    options.repeats = options.repeats or (1 if options.quick else 5)
    options.limit = options.limit or (20.0 if options.quick else 300.0)
    wanted = options.only.split(",")
    unknown = set(wanted) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}: choose from {', '.join(PARTS)}")
    record: dict[str, Any] = {
        "command": " ".join(["python -m tests.benchmarks", *sys.argv[1:]]),
        "machine": _machine(),
        "versions": _versions(),
        "commit": _commit(),
        "seed": options.seed,
        "repeats": options.repeats,
        "limit_s": options.limit,
    }
    name = options.name or ("quick" if options.quick else "latest")
    for part in wanted:
        print(f"== {part}", flush=True)

        def save(measured: Any, part: str = part) -> None:
            record[part] = measured
            write(options.output, record, markdown(record), name)

        save(PARTS[part](options, lambda line: print(line, flush=True), save))
    print(f"wrote {options.output / name}.md and .json")
    if any(word in str(record) for word in ("DISAGREES", "NOT THE SAME")):
        sys.exit("fronts disagree: see the table")


def _machine() -> dict[str, Any]:
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        name = lines[0] if lines else name
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 0
    return {
        "processor": name,
        "cores": os.cpu_count(),
        "memory_gb": round(pages / 2**30),
        "system": f"{platform.system()}, Python {platform.python_version()}",
    }


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    solver = installed()
    found["minizinc"] = f"{solver.minizinc} with {solver.text}" if solver else "not installed"
    return found


def _commit() -> str:
    command = ["git", "describe", "--always", "--dirty"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    main()
