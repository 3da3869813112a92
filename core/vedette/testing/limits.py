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

    It is raised again as long as it is swallowed, as by whatever collects garbage just then.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    runs = True

    def stop(number: int, frame: Any) -> None:
        if runs:
            raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    left, _ = signal.setitimer(signal.ITIMER_PROF, seconds, max(seconds, 0.02))
    try:
        yield
    finally:
        runs = False
        signal.setitimer(signal.ITIMER_PROF, left)  # of a limit around this one
        signal.signal(signal.SIGPROF, before)
