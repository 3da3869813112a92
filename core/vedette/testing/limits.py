"""How long a law may take."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class TooLong(BaseException):
    """A law took longer than it may. No Exception, so that nobody on the way takes it for a component's own."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise TooLong after so many s of CPU time; only in a main thread of a system that has such timers.

    It is raised again where it is swallowed, as by whatever collects garbage just then, and at the end at the latest.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    runs, late = True, False

    def stop(number: int, frame: Any) -> None:
        nonlocal late
        if runs:
            late = True
            raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    left, _ = signal.setitimer(signal.ITIMER_PROF, seconds, max(seconds, 0.02))
    try:
        yield
    finally:
        runs = False
        signal.setitimer(signal.ITIMER_PROF, left)  # of a limit around this one
        signal.signal(signal.SIGPROF, before)
    if late:
        raise TooLong
