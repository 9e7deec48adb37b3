"""A line on a terminal that moves while a command works, and that acknowledges Ctrl-C as soon as it comes."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from typing import Self

from dse.cli.printing import rewrite, tell

STEP_S = 0.2
"""How often the line is written."""


class Working:
    """The line, on standard error where that is a terminal: what is being done, and for how long.

    A signal is noted by the system itself, so that it is acknowledged while the solver works, too.
    """

    def __init__(self, text: str, *, quiet: bool) -> None:
        self.text = text
        self.live = sys.stderr.isatty() and not quiet
        self._begun = time.monotonic()
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self._ends: tuple[int, int] | None = None
        self._before = -1

    def __enter__(self) -> Self:
        if self.live:
            if threading.current_thread() is threading.main_thread():
                self._ends = os.pipe()
                for end in self._ends:
                    os.set_blocking(end, False)
                self._before = signal.set_wakeup_fd(self._ends[1], warn_on_full_buffer=False)
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._thread is None:
            return
        self._over.set()
        self._thread.join()
        if self._ends is not None:
            signal.set_wakeup_fd(self._before)
            for end in self._ends:
                os.close(end)
        rewrite("")

    @property
    def seconds(self) -> float:
        """The wall time since the command began, in seconds."""
        return time.monotonic() - self._begun

    def tell(self, text: str) -> None:
        """Print a line above the one that moves, where there is one."""
        if self.live:
            rewrite(f"{text}\n")

    def _run(self) -> None:
        stopping = False
        while True:
            stopping = stopping or self._is_interrupted()
            text = "Ctrl-C: stopping, and keeping what was found; again: at once" if stopping else self.text
            rewrite(f"{text}, {self.seconds:.1f} s")
            if self._over.wait(STEP_S):
                return

    def _is_interrupted(self) -> bool:
        """Whether Ctrl-C came since this was asked last."""
        try:
            return self._ends is not None and signal.SIGINT in os.read(self._ends[0], 4096)
        except BlockingIOError:
            return False


class Reporter(Working):
    """Progress of a search or study: the line that moves, or plain lines every `step_s` seconds where there is none."""

    def __init__(self, text: str, step_s: float, *, quiet: bool) -> None:
        super().__init__(text, quiet=quiet)
        self._quiet, self._step_s, self._said = quiet, step_s, time.monotonic()

    def report(self, text: str, plain: str) -> None:
        """Show a `text` in the line that moves; print it `plain` where there is none, unless that was done just now."""
        self.text = text
        now = time.monotonic()
        if not self._quiet and not self.live and now - self._said >= self._step_s:
            self._said = now
            tell(plain)
