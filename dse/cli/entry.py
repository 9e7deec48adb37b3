"""The ``dse`` program: from its first import on, Ctrl-C and closed streams are no reason for a traceback.

Until `main` runs, Ctrl-C ends the process as it ends a program without Python: nothing is said, and nothing was begun.
"""

from __future__ import annotations

import signal
import sys

if "dse.cli.main" not in sys.modules and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import atexit
import gc
import io
import os
import threading
from contextlib import suppress
from typing import Any, TextIO

from dse.cli.interrupts import Interrupts


class Unheard(io.FileIO):
    """A stream for messages beside the answer, which drops them once its reader has gone."""

    def write(self, data: Any) -> int:
        """Write data as to a file; without a reader everything counts as written."""
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            return memoryview(data).nbytes


def main() -> None:
    """Run the command line and leave with its exit code.

    Ctrl-C before the command is loaded ends with code 5, as one during a search does.
    """
    code = 5  # as dse.support.errors.EXIT_INCOMPLETE, which may not be there yet
    try:
        signal.signal(signal.SIGINT, Interrupts.note)
        sys.unraisablehook = Interrupts.repeat
        _open_closed_streams()
        _outlive_readers()
        gc.set_threshold(200_000, 20, 20)  # nearly all objects stay; looking for cycles took up to a fifth of the time
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # we use none; looking for them takes time
        from dse.cli.postponed import postpone

        postpone()
        from dse.cli.main import run

        code = run(sys.argv[1:])
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # what is left is to leave
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with suppress(OSError, ValueError, AttributeError):
            sys.stderr.write("\ndse: interrupted\n")
    _leave(code)


def _leave(code: int) -> None:
    """End the process without tidying up, which takes seconds after large problems and is of no use.

    It would end threads that are inside the solver in the midst of C++, too: an abort.
    """
    if threading.active_count() == 1:
        atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def _outlive_readers() -> None:
    """Let messages on standard error change no exit code and end no work when their reader has gone."""
    said = sys.stderr
    with suppress(OSError, ValueError):
        raw = io.BufferedWriter(Unheard(said.fileno(), "wb", closefd=False))
        sys.stderr = io.TextIOWrapper(raw, said.encoding, said.errors, line_buffering=True, write_through=True)


def _open_closed_streams() -> None:
    """Streams that the caller has closed are None in Python, and would be opened by the next file."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            opened: TextIO = os.fdopen(os.open(os.devnull, os.O_RDWR), "w" if number else "r")
            setattr(sys, name, opened)
