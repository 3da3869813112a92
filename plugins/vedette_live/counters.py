"""What a service counts, and how Prometheus reads it."""

from __future__ import annotations

import json
from collections import deque
from threading import Lock
from typing import final

import numpy as np
from attrs import define, field

MEANINGS = {
    "pieces_total": "pieces of bytes that came",
    "messages_total": "messages that came: taken, refused, dropped or waiting",
    "messages_taken_total": "messages whose scan was taken, and markers",
    "messages_refused_total": "messages that could not be used",
    "messages_dropped_total": "messages of scans that were dropped, as the tracker was behind",
    "messages_repeated_total": "messages that had come before, by their number",
    "datagrams_lost_total": "datagrams that the system dropped before we could read them",
    "scans_taken_total": "scans that the tracker took",
    "scans_refused_total": "scans that the tracker refused, those that came too late among them",
    "scans_dropped_total": "scans dropped whole, the oldest first, as the tracker was behind",
    "returns_left_out_total": "returns that were not finite, or had no covariance, of scans that were taken",
    "scans_late_total": "scans that were late within the horizon, and were taken",
    "scans_stepped_again_total": "steps that late scans made necessary",
    "reports_sent_total": "reports sent by outputs",
    "reports_merged_total": "scans without a report of their own, as others were taken with them",
    "reports_dropped_total": "reports that an output was too slow for, or failed to send",
    "saves_total": "times that the state was saved",
    "saves_failed_total": "times that the state could not be saved",
}
GAUGES = {
    "tracks_confirmed": "confirmed tracks",
    "tracks": "tracks, tentative ones included",
    "scans_waiting": "scans that wait for the tracker",
    "datagrams_lost_known": "1 if the system tells how many datagrams it drops",
    "scan_time_seconds": "time of the latest scan",
}
LABELLED = {
    "input_well": ("input", "gauge", "1 unless nothing can come by the input, as without a connection"),
    "input_messages_total": ("input", "counter", "messages that came by the input: used or refused"),
    "sensor_scans_total": ("sensor", "counter", "scans of the sensor that the tracker took"),
    "sensor_came_seconds": ("sensor", "gauge", "when the last of these had come"),
}
"""What is counted of each input and of each sensor."""
QUANTILES = (0.5, 0.9, 0.99)
_LATENCIES = 10_000
"""Latest scans whose latency is judged."""


@final
@define
class Counters:
    """Counts, the latest values, and the latest latencies in s. All threads add to it."""

    counts: dict[str, int] = field(factory=lambda: dict.fromkeys(MEANINGS, 0))
    values: dict[str, float] = field(factory=lambda: dict.fromkeys(GAUGES, 0.0))
    labelled: dict[tuple[str, str], float] = field(factory=dict)
    latencies: deque[float] = field(factory=lambda: deque[float](maxlen=_LATENCIES))
    _lock: Lock = field(factory=Lock)

    def add(self, name: str, count: int = 1) -> None:
        """Count."""
        with self._lock:
            self.counts[name] += count

    def tell(self, name: str, of: str, value: float, *, more: bool = False) -> None:
        """Tell a value of an input or a sensor, or so much `more` of it."""
        with self._lock:
            self.labelled[name, of] = value + (self.labelled.get((name, of), 0.0) if more else 0.0)

    def latency(self) -> dict[str, float]:
        """Return quantiles of the latest latencies in s, from the bytes that complete a scan to the tracks after it."""
        with self._lock:
            values = list(self.latencies)
        return {str(q): float(np.quantile(values, q)) for q in QUANTILES} if values else {}

    def text(self) -> str:
        """Return all in the text format that Prometheus scrapes."""
        with self._lock:
            counts, values, labelled = dict(self.counts), dict(self.values), sorted(self.labelled.items())
        lines = []
        for kind, meanings, numbers in (("counter", MEANINGS, counts), ("gauge", GAUGES, values)):
            for name, meaning in meanings.items():
                full = f"vedette_{name}"
                lines += [f"# HELP {full} {meaning}", f"# TYPE {full} {kind}", f"{full} {numbers[name]:.15g}"]
        for name, (label, kind, meaning) in LABELLED.items():
            lines += [f"# HELP vedette_{name} {meaning}", f"# TYPE vedette_{name} {kind}"]
            told = [(json.dumps(of, ensure_ascii=False), value) for (which, of), value in labelled if which == name]
            lines += [f"vedette_{name}{{{label}={of}}} {value:.15g}" for of, value in told]
        lines += ["# HELP vedette_latency_seconds from the bytes that complete a scan to the tracks after it"]
        lines += ["# TYPE vedette_latency_seconds summary"]
        lines += [f'vedette_latency_seconds{{quantile="{q}"}} {value:.6g}' for q, value in self.latency().items()]
        return "\n".join(lines) + "\n"
