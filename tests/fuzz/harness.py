"""One mutated file for one command, run in this process: which exit code, how long, and what should not be."""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from dse.cli.main import run

from .mutations import TOKENS, changed_number, changed_tokens, mutated

ROOT = Path(__file__).parents[2]
EXIT_CODES = (0, 2, 3, 4, 5)
LIMIT_S = 60
"""A case that takes longer hangs."""
SHORT = ("--time-limit", "0.2s")
SIMULATED = ("--duration", "5ms", "--runs", "1", "--offsets", "random")
QUESTIONS = (
    "jitter of sensor_to_valve <= 10 ms",
    "utilisation of computer <= 70 %",
    "response time of control <= 4 ms",
    "load of can0 < 10 %",
    "price <= 500 EUR",
    "computer.type == small or control.period == 5 ms",
    "control.period is a multiple of filter.period",
)
OF_HOSTS = (
    "response time of plan <= 8 ms",
    "response time of detect <= 30 ms",
    "latency of main <= 60 ms",
    "utilisation of core 2 of computer <= 50 %",
    "share.budget == 2 ms or left.core == right.core",
    "grab.executor == left implies right.kind is in [fifo]",
    "share.core == detect.core",
)
"""Of `hosts.yaml`, the same of `pump.yaml` above."""
# (weight, arguments before the file, arguments after it)
ON_PROBLEMS: tuple[tuple[int, tuple[str, ...], tuple[str, ...]], ...] = (
    (100, ("check",), ()),
    (30, ("analyse",), ()),
    (8, ("export", "--format", "svg"), ()),
    (6, ("analyse", "--response-times"), ()),
    (12, ("solve",), (*SHORT, "--json", "-")),
    (4, ("solve",), (*SHORT, "--robust", "--json", "-")),
    (4, ("solve",), (*SHORT, "--deadlines", "all", "--processing", "response-time")),
    (2, ("solve",), (*SHORT, "--deadlines", "none", "--robust")),
    (2, ("explain",), (*SHORT, "--deadlines", "all")),
    (1, ("sweep",), (*SHORT, "--deadlines", "all", "--vary", "price=0 EUR..500 EUR", "--no-store")),
    (2, ("explain",), (*SHORT, "--all", "--csv", "-")),
    (2, ("check",), ("--deadlines", "all", "--fix", "control.period=5 ms")),
    (2, ("sensitivity",), ("--samples", "20", "--time-limit", "0.5s")),
    (2, ("solve",), (*SHORT, "--report", "-o", "report")),
    (4, ("explain",), SHORT),
    (4, ("simulate",), SIMULATED),
    (1, ("sensitivity",), ("--samples", "2", "--no-front")),
)
ON_RESULTS: tuple[tuple[int, tuple[str, ...], tuple[str, ...]], ...] = (
    (10, ("verify",), SHORT),
    (4, ("report",), ("-o", "report")),
    (4, ("compare",), ("pump.json",)),
    (3, ("solve", "--resume"), (*SHORT, "-q", "--json", "-")),
    (2, ("export",), ("--alternative", "1")),
)
ON_OPTIONS = (
    ("solve", "--require"),
    ("solve", "--fix"),
    ("solve", "--minimise"),
    ("solve", "--max-jitter"),
    ("solve", "--time-limit"),
    ("solve", "--rank-by"),
    ("solve", "--within"),
    ("analyse", "--design"),
    ("analyse", "--require"),
    ("explain", "--require"),
    ("explain", "--offer"),
    ("sweep", "--vary"),
    ("simulate", "--duration"),
)


ASKED = (
    ("pump.yaml", QUESTIONS, ("computer.type += large", "jitter of sensor_to_valve=1ms..40ms", "10 ms")),
    ("hosts.yaml", OF_HOSTS, ("share.budget=1 ms", "left.core=2", "latency of main=20ms..90ms", "10 ms")),
)
"""A file, what may be asked of it, and what else options take."""


SOLVED: dict[str, str] = {}
"""Results that were computed for an earlier folder, by name."""


class Hangs(BaseException):
    """The alarm of a case that takes too long; no handler of the program catches it."""


@dataclass(frozen=True)
class Case:
    """What is run: arguments in which ``FILE`` stands for the mutated file."""

    name: str
    data: bytes
    arguments: tuple[str, ...]
    seeded: str


@dataclass(frozen=True)
class Outcome:
    """What came of a case; `fault` says what should not have been."""

    case: Case
    code: int | None
    seconds: float
    output: str
    fault: str = ""
    new_lines: int = 0


@dataclass
class Coverage:
    """Lines of the program that were reached, by file; counts what is new."""

    seen: set[tuple[str, int]] = field(default_factory=set)
    package: str = str(ROOT / "dse")

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Watch the lines of this thread."""
        before = sys.gettrace()
        sys.settrace(self._call)
        try:
            yield
        finally:
            sys.settrace(before)

    def _call(self, frame: FrameType, event: str, argument: Any) -> Any:
        return self._line if frame.f_code.co_filename.startswith(self.package) else None

    def _line(self, frame: FrameType, event: str, argument: Any) -> Any:
        if event == "line":
            self.seen.add((frame.f_code.co_filename, frame.f_lineno))
        return self._line


class Fuzzer:
    """Draws cases from a seed and runs them in a folder of its own.

    With `coverage` a file that reaches lines that no file reached before joins those that are mutated.
    """

    def __init__(self, folder: Path, seed: int, *, coverage: bool = False) -> None:
        self.folder, self.seed = folder, seed
        self.coverage = Coverage() if coverage else None
        self.problems, self.results = _corpus(folder)
        self.first = len(self.problems), len(self.results)
        self.texts = [text for _, text in (*self.problems, *self.results)]

    def case(self, number: int) -> Case:
        """The case with this number: of a fuzzer without coverage always the same one."""
        rng = random.Random(f"{self.seed}/{number}")
        drawn = rng.random()
        if drawn < 0.70:
            name, text = self._one_of(self.problems, self.first[0], rng)
            arguments = _command(ON_PROBLEMS, rng)
        elif drawn < 0.93:
            name, text = self._one_of(self.results, self.first[1], rng)
            arguments = _command(ON_RESULTS, rng)
        else:
            return self._asked(rng)
        return Case(_named(name), mutated(text, rng, self.texts), arguments, name)

    @staticmethod
    def _one_of(texts: list[tuple[str, str]], first: int, rng: random.Random) -> tuple[str, str]:
        """One of the first, which are sound, as often as one of those that joined them."""
        return rng.choice(texts if rng.random() < 0.5 else texts[:first])

    def _asked(self, rng: random.Random) -> Case:
        """A good file with a mutated option."""
        command, option = rng.choice(ON_OPTIONS)
        name, questions, more_texts = rng.choice(ASKED)
        text = rng.choice((*questions, *more_texts))
        for _ in range(rng.randrange(4)):
            change = changed_number if rng.random() < 0.4 else changed_tokens
            text = change(text, rng, (*questions, " ".join(TOKENS)))
        more = {"sweep": ("--no-store", "--workers", "1", "-q"), "simulate": SIMULATED[2:], "analyse": ()}
        short = () if option == "--time-limit" else SHORT
        safe = text.encode("utf-8", "replace").decode().replace("\0", "�")
        data = (ROOT / "tests" / "fuzz" / name).read_bytes()
        return Case("case.yaml", data, (command, "FILE", f"{option}={safe}", *more.get(command, short)), name)

    def run(self, case: Case) -> Outcome:
        """Run it, and keep its file where it reached new lines."""
        if self.coverage is None:
            return run_case(case, self.folder)
        before = len(self.coverage.seen)
        with self.coverage.watching():
            outcome = run_case(case, self.folder)
        new = len(self.coverage.seen) - before
        if new and not outcome.fault and len(case.data) < 100_000:
            self._keep(case)
        return Outcome(case, outcome.code, outcome.seconds, outcome.output, outcome.fault, new)

    def _keep(self, case: Case) -> None:
        text = case.data.decode("utf-8", "replace")
        kept = self.results if case.name.endswith(".json") else self.problems
        kept.append((case.seeded, text))


def _named(seed_name: str) -> str:
    return "case.json" if seed_name.endswith(".json") else "case.yaml"


def _command(table: Sequence[tuple[int, tuple[str, ...], tuple[str, ...]]], rng: random.Random) -> tuple[str, ...]:
    _, before, after = rng.choices(table, [row[0] for row in table])[0]
    return (*before, "FILE", *after)


def run_case(case: Case, folder: Path) -> Outcome:
    """Write the file of a case into a folder and run its command there."""
    (folder / case.name).write_bytes(case.data)
    arguments = [case.name if part == "FILE" else part for part in case.arguments]
    out, err = io.BytesIO(), io.StringIO()
    code, fault = None, ""
    started = time.monotonic()
    with _in_folder(folder), _alarm(LIMIT_S):
        stream = io.TextIOWrapper(out, encoding="utf-8", errors="strict", write_through=True)
        try:
            with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(err):
                code = run(arguments)
        except Hangs:
            fault = f"took longer than {LIMIT_S} s\n{traceback.format_exc()}"
        except BaseException:  # noqa: BLE001 (whatever it is, it is a finding)
            fault = traceback.format_exc()
    seconds = time.monotonic() - started
    output = out.getvalue().decode("utf-8", "replace") + err.getvalue()
    if not fault and code not in EXIT_CODES:
        fault = f"exit code {code}"
    elif not fault and "Traceback (most recent call last)" in output:
        fault = "a traceback was printed"
    elif not fault and code and not output.strip() and "-q" not in case.arguments:
        fault = f"exit code {code} without a word"
    return Outcome(case, code, seconds, output, fault)


@contextlib.contextmanager
def _in_folder(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextlib.contextmanager
def _alarm(seconds: int) -> Iterator[None]:
    def ring(number: int, frame: FrameType | None) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _corpus(folder: Path) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Problems and results to begin with, in a folder in which they find each other."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(ROOT / "problems" / "catalogues", folder / "catalogues", dirs_exist_ok=True)
    here = Path(__file__).parent
    files = [
        *sorted(here.glob("*.yaml")),
        *sorted((ROOT / "problems").glob("*.yaml")),
        *sorted((ROOT / "problems" / "catalogues").glob("*.yaml")),
        *sorted((ROOT / "tests" / "encode" / "problems").glob("*.yaml")),
    ]
    problems = [(path.name, path.read_text(encoding="utf-8")) for path in files]
    for path in files:
        if not (folder / path.name).exists():
            shutil.copy(path, folder / path.name)
    hosts = (here / "hosts.yaml").read_text(encoding="utf-8")  # what polls is never robust
    (folder / "waiting.yaml").write_text(hosts.replace("[fifo, polling]", "[fifo, wait_set]"), encoding="utf-8")
    with _in_folder(folder), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        wanted = {
            "pump.json": ["solve", "pump.yaml"],
            "starter.json": ["solve", "starter.yaml"],
            "bindings.json": ["solve", "bindings.yaml"],
            "others.json": ["solve", "pump.yaml", "--further", "2", "--within", "5%"],
            "impossible.json": ["solve", "pump.yaml", "--max-jitter", "5ms"],
            "why.json": ["explain", "pump.yaml", "--max-jitter", "5ms"],
            "all.json": ["solve", "everything.yaml", "--deadlines", "all", "--time-limit", "20"],
            "robust.json": ["solve", "everything.yaml", "--robust", "--time-limit", "20"],
            "hosts.json": ["solve", "hosts.yaml"],
            "shared.json": ["solve", "waiting.yaml", "--robust"],
            "swept.json": ["sweep", "pump.yaml", "--vary", "jitter of sensor_to_valve=1ms..40ms", "--no-store"],
        }
        for name, arguments in wanted.items():
            if name in SOLVED:
                Path(name).write_text(SOLVED[name], encoding="utf-8")
            elif not Path(name).exists():
                run([*arguments, "--json", name])
                SOLVED[name] = Path(name).read_text(encoding="utf-8")
        results = [(name, Path(name).read_text(encoding="utf-8")) for name in wanted]
    return problems, results
