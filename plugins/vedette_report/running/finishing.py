"""Ctrl-C while the files of a run are made, its last scan being tracked."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from signal import SIGINT, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from typing import Any, final

TOLD = b"vedette: interrupted: the files of the run are written first; Ctrl-C once more leaves none\n"


@final
class Finishing(AbstractContextManager["Finishing"]):
    """Holds back the first Ctrl-C from `begin` on, and says so: all scans of the run would be lost. `pressed` tells of it.

    Before, and from a second one on, it is raised at once. Threads are not interrupted, and where Python's own handler was
    replaced, that stays.
    """

    def __init__(self) -> None:
        self.pressed = self._begun = False

    def begin(self) -> None:
        """Hold it back from now on."""
        if current_thread() is main_thread() and getsignal(SIGINT) is default_int_handler:
            self._begun = True
            signal(SIGINT, self._held)

    def __exit__(self, *error: object) -> None:
        if self._begun:
            signal(SIGINT, default_int_handler)

    def _held(self, number: int, frame: Any) -> None:
        self.pressed = True
        signal(SIGINT, default_int_handler)
        os.write(2, TOLD)  # it may have come within a print
