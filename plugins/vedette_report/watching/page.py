"""The page of a run that goes on: that of a finished run, whose columns come one scan after the other."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from queue import Queue
from threading import Thread
from time import sleep
from typing import Any, final

import numpy as np

from vedette import Array, Experiment, Frame, Gaussian, Recording, Scan, to_config
from vedette.display import without_passwords
from vedette.tracking import State
from vedette_files import Tables, Terms
from vedette_report.drawing import canvas
from vedette_report.page.build import DRAWING
from vedette_report.page.frames import limits_of, picture
from vedette_report.page.geography import graticule, read_underlay
from vedette_report.page.skeleton import page
from vedette_report.watching.journal import Journal
from vedette_report.watching.records import Records, Seen
from vedette_report.watching.server import Server

LIVE = (*DRAWING, "live_data.js", "live.js")
"""Scripts of the page: those of a finished run's, but for its start."""

_SILENT, _ASKS = "default-src 'none';", "default-src 'none'; connect-src 'self';"
"""What the page of a finished run may ask for, and what this one may."""

_WAITING, _TOGETHER = 256, 64
"""Scans that may wait until they are written down, and that are written together."""
_REST = 0.005
"""s between two records: what comes meanwhile goes into one."""

_SIDE = 640
"""Pixels of a frame's longer side, at most, that are shown."""

_AROUND = 10_000.0
"""m around the origin in which there are meridians and parallels."""


@final
class LivePage:
    """Shows a run at `server.address` while it goes: `take` is told of each scan, as `Experiment.finish` tells it.

    `state` is any of the run, `came` returns when the latest scan came, in s since 1970.
    """

    def __init__(
        self,
        experiment: Experiment,
        recording: Recording,
        state: State,
        came: Callable[[], float],
        *,
        port: int = 0,
        underlay: Path | None = None,
    ) -> None:
        modes = experiment.tracker.estimator.mode_prob(state.belief)
        self._records = Records(experiment, recording, 0 if modes is None else modes.shape[-1])
        self._journal, self._came, self._waiting = Journal(), came, Queue[Seen | None](_WAITING)
        self._limits: tuple[float, float] | None = None
        self._failed: BaseException | None = None
        facts = self._facts(experiment, recording, underlay)
        text = page(experiment.title or "vedette watch", facts, LIVE).replace(_SILENT, _ASKS, 1)
        self.server = Server(text, self._journal, self._picture, port)
        self._thread = Thread(target=self._record, daemon=True)
        self._thread.start()

    def take(
        self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None, told: Tables | None = None
    ) -> None:
        """Show a scan, the states before and after it, and that one's estimates (t,) and mode probabilities (t, r).

        `told` are its tables, of a run that is judged and written besides: of such a run all scans have them.
        """
        if self._failed is not None:
            raise self._failed
        self._waiting.put(Seen(self._came(), scan, before, state, estimate, modes, told))

    def end(self, *, interrupted: bool, wait: float = 5.0) -> None:
        """Tell the readers that no further scan comes, let them take what is left, and stop."""
        self._waiting.put(None)
        self._thread.join(wait)
        self._journal.end("interrupted" if interrupted else "ended")
        self.server.close(wait)

    def _record(self) -> None:
        """Write down what is told of the scans, those that wait together."""
        seen: list[Seen | None] = []
        try:
            while None not in seen:
                seen = [self._waiting.get()]
                while len(seen) < _TOGETHER and not self._waiting.empty():
                    seen.append(self._waiting.get())
                told = [note for note in seen if note is not None]
                if told:
                    self._journal.add(self._records.record(told), len(told), told[-1].scan.frame)
                sleep(_REST)
        except BaseException as error:
            self._failed = error
            while self._waiting.get() is not None:  # whoever puts something there must not wait for ever
                pass

    def _facts(self, experiment: Experiment, recording: Recording, underlay: Path | None) -> dict[str, Any]:
        terms = Terms.of(recording.notes)
        return {
            **self._records.about,
            "centre": [0.0, 0.0],
            "columns": self._records.columns,
            "words": "",
            "metrics": {"rows": [], "of_objects": {}, "objects": []},
            "config": without_passwords(json.dumps(to_config(experiment), indent=2)) + "\n",
            "colours": {"tracks": canvas.TRACKS, "modes": canvas.MODES},
            "frames": [],
            "dated": terms.dated,
            "live": True,
            "underlay": [] if underlay is None else read_underlay(underlay, terms.origin),
            "graticule": [] if terms.origin is None else graticule(terms.origin, np.full(2, -_AROUND), np.full(2, _AROUND)),
        }

    def _picture(self, frame: Frame) -> dict[str, Any]:
        """Return a frame as the page takes it."""
        if self._limits is None:
            self._limits = limits_of(frame)
        return picture(frame, self._limits, max(1, -(-max(frame.pixels.shape[-2:]) // _SIDE)))
