"""Outputs while a service runs, each in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread
from typing import final

import numpy as np

from vedette.streams import TrackReport, now
from vedette_live.config import Sink
from vedette_live.counters import Counters
from vedette_live.log import LOG
from vedette_live.queues import BoundedQueue
from vedette_live.reports import chosen

_REPORTS = 256
"""Reports that wait for one output; the oldest are dropped."""


@final
class Sending:
    """One output: reports wait for it in a queue of its own; it opens anew after a failure."""

    def __init__(self, sink: Sink, counters: Counters, number: int, ails: dict[str, str]) -> None:
        self._sink, self._counters, self._name, self._ails = sink, counters, f"output {number}", ails
        self._waiting = BoundedQueue[Callable[[], TrackReport]](_REPORTS)
        self._last = -np.inf
        self._thread = Thread(target=self._send, name=self._name, daemon=True)
        self._thread.start()

    def put(self, report: TrackReport, predicted: Callable[[float], TrackReport], scans: int = 1) -> None:
        """Let a report be sent, if it is due, of so many scans that were taken together."""
        moment = report.time
        if self._last <= moment < self._last + self._sink.every:  # it goes back where scans were given up
            return
        self._last = moment
        if not self._sink.every:
            self._counters.add("reports_merged_total", scans - 1)
        made = (lambda: predicted(now())) if self._sink.predict else (lambda: report)
        dropped = self._waiting.put(made, wait=False)
        self._counters.add("reports_dropped_total", len(dropped))

    def _send(self) -> None:
        while not (self._waiting.closed and not self._waiting.items):
            try:
                with self._sink.output.open() as send:
                    self._send_by(send)
            except Exception as error:  # an output must not end the service, whoever wrote it
                self._fail(error)
                if self._waiting.closed:
                    return

    def _send_by(self, send: Callable[[bytes], None]) -> None:
        """Send what waits, until the queue is closed and empty."""
        while True:
            for made in self._waiting.take(1, 1.0):
                report = made()
                try:
                    data = self._sink.format.encode(chosen(report, report.confirmed) if self._sink.confirmed else report)
                    if data:
                        send(data)
                    self._counters.add("reports_sent_total")
                except Exception:
                    self._counters.add("reports_dropped_total")
                    raise
            self._ails.pop(self._name, None)  # not as it opens: a file on a full disk does that, too
            if self._waiting.closed and not self._waiting.items:
                return

    def _fail(self, error: Exception) -> None:
        if self._name not in self._ails:
            LOG.error("output failed", extra={"output": self._name, "why": str(error)})
        self._ails[self._name] = str(error)
        Event().wait(0.2)

    def close(self) -> None:
        """Send what waits, for at most 2 s, and stop; what waits then is dropped."""
        self._waiting.close()
        self._thread.join(2.0)
        self._counters.add("reports_dropped_total", len(self._waiting.take(_REPORTS, 0.0)))
