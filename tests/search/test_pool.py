"""Ctrl-C while a solver works: the call is ended and waited for, for Python would abort a thread inside the solver."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

import pytest

from dse.analysis.evaluate import Evaluator
from dse.encode.model import encode
from dse.search.alternatives import Finder
from dse.search.solver.strategy import Strategy
from dse.search.workers import heard, stop_on_interrupt
from tests.helpers.support import PROBLEMS, brute_front, load_space

SLOW = """
import sys, threading, time, types
from ortools.sat.python import cp_model
import dse.cli.main

def solve():
    model, count = cp_model.CpModel(), 60
    for _ in range(count):  # pigeons: not to be refuted while we wait
        row = [model.new_bool_var("") for _ in range(count - 1)]
        model.add_exactly_one(row)
        rows.append(row)
    for column in zip(*rows):
        model.add_at_most_one(column)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.cp_model_presolve = False
    solver.parameters.symmetry_level = 0
    solver.parameters.catch_sigint_signal = False
    solver.parameters.max_time_in_seconds = 1
    begun.set()
    solver.solve(model)

class Late:
    def __del__(self, sleep=time.sleep):  # Python is tidying up: time for the solver to come back
        sleep(3)

sys.modules["late"] = types.ModuleType("late")
sys.modules["late"].late = Late()

def run(arguments):
    threading.Thread(target=solve, daemon=True).start()
    begun.wait()
    time.sleep(0.2)
    print("said")
    return 5

rows, begun = [], threading.Event()
dse.cli.main.run = run
from dse.cli.entry import main
main()
"""


def test_the_program_leaves_while_a_thread_is_inside_the_solver() -> None:
    run = subprocess.run([sys.executable, "-c", SLOW], capture_output=True, text=True, check=False, timeout=50)
    assert (run.returncode, run.stdout, run.stderr) == (5, "said\n", "")


def test_ctrl_c_is_heard_and_waits_for_the_call_to_end() -> None:
    solver = Strategy(encode(Evaluator(load_space(PROBLEMS[0]))))
    ended = threading.Event()

    def question() -> None:
        threading.Timer(0.1, signal.raise_signal, (signal.SIGINT,)).start()
        while not solver.stopped:
            time.sleep(0.001)
        time.sleep(0.3)  # a solver ends soon, but not at once
        ended.set()

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            heard(solver, question)
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.is_set()


def test_a_finder_that_was_stopped_says_so() -> None:
    evaluator = Evaluator(load_space(PROBLEMS[0]))
    finder = Finder(evaluator)
    objectives, design = next(iter(brute_front(evaluator).items()))
    finder.stop()
    found = finder.near(objectives, design, 3)
    assert (found.designs, found.more) == ((), None)


def test_ctrl_c_calls_stop_once_and_then_raises() -> None:
    heard_of = []
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with stop_on_interrupt(lambda: heard_of.append(1)):
            signal.raise_signal(signal.SIGINT)
            assert heard_of == [1]
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard_of == [1]
