"""Ctrl-C: what the program remembers of it, and where Python loses it."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

AGAIN_S = 0.02
"""After so long the callback in which Ctrl-C came is over."""


class Interrupts:
    """Whether Ctrl-C came: compiled modules that are being imported turn it into errors of their own.

    `came` is asked where an error may be nothing but a lost Ctrl-C.
    """

    came = False

    @classmethod
    def note(cls, number: int, frame: FrameType | None) -> None:
        """The handler of SIGINT."""
        cls.came = True
        raise KeyboardInterrupt

    @staticmethod
    def repeat(lost: UnraisableHookArgs) -> None:
        """The hook for what cannot be raised: a Ctrl-C that came in a callback of Python's own comes again.

        The signal is sent again after `AGAIN_S` seconds; other exceptions go to Python's own hook.
        """
        if lost.exc_type is not KeyboardInterrupt:
            sys.__unraisablehook__(lost)
            return
        main_thread = threading.main_thread().ident
        assert main_thread is not None
        again = threading.Timer(AGAIN_S, signal.pthread_kill, (main_thread, signal.SIGINT))
        again.daemon = True
        again.start()
