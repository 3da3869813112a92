"""Some scans of a run as the text that its page takes: the page's own columns, as bytes in base64."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from importlib import import_module
from time import monotonic
from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, Experiment, Gaussian, Recording, Scan
from vedette.metrics import Block, RunningJudge
from vedette.tracking import State
from vedette_files import Series, Tables
from vedette_report.page.columns import arrays, middle
from vedette_report.series.about import about
from vedette_report.series.judged import judged
from vedette_report.series.rows import ScanRows
from vedette_report.series.tables import no_rows, together
from vedette_report.watching.truth import TrueObjects

RAY, CAME, COVERED = "returns.ray", "scans.came", "scans.covered"
"""Columns: a bearing's direction, which a record may lack; when a scan came, in s since 1970; one that is NaN if unknown."""

PLACES = ("scans.platform", "returns.x", "entries.x", "truth.x")
"""Columns of places: once one is known, the map's centre stays."""

_SHARE, _PAUSE, _LONGEST = 0.1, 0.02, 1.0
"""Of the time, at most, that comparing with the truth may take, so that not all is compared where that is slow; s that it
may take for several scans; s after which some scan is compared again."""

_WHOLE = 24
"""Records are multiples of so many bytes: typed arrays begin at multiples of 8, base64 is without padding at those of 3."""


@frozen(eq=False)
class Seen:
    """What is told of a scan: when it came, in s since 1970, and what `Experiment.finish` tells its `watch`.

    `told` are its tables where the run is judged and written besides, with numbers that go on from scan to scan.
    """

    came: float
    scan: Scan
    before: State
    state: State
    estimate: Gaussian
    modes: Array | None
    told: Tables | None = None


@final
class Records:
    """Makes the records of a run's scans, in their order.

    A record is numbers of 8 bytes: its length in bytes, the number of its first scan, how many scans it has, when the
    last of them came, the map's centre, and how many values each column has; then the columns, each filled up to a multiple
    of 8 bytes. `about` and `columns`, their names and types, are the same for all.
    """

    def __init__(self, experiment: Experiment, recording: Recording, modes: int) -> None:
        tracker = experiment.tracker
        self._rows = ScanRows(experiment, recording)
        self._truth = TrueObjects(recording, self._rows.plane, experiment.judge.truth_gap)
        self.about: dict[str, Any] = about(experiment, recording, self._rows.plane, modes)
        self._judge = RunningJudge(
            recording.truth, tracker.state, experiment.judge, tracker.gate.probability, nobody=recording.nobody
        )
        if recording.truth:
            import_module("scipy.optimize")  # the judge needs it, and a second's pause in the middle of a run is seen
        self._centre: Array | None = None
        self._count, self._entries, self._judged_at, self._judging = 0, 0, 0.0, 0.0
        self._none = no_rows(len(tracker.state), self._rows.axes, modes)
        named = self._arrays([])
        self.columns = [*((name, values.dtype.str[1:]) for name, values in named.items()), (RAY, "f4")]

    def record(self, seen: Sequence[Seen]) -> bytes:
        """Return the record of the next scans as text."""
        named = self._arrays(seen)
        columns = [named[name].tobytes() if name in named else b"" for name, _ in self.columns]
        sizes = [named[name].size if name in named else 0 for name, _ in self.columns]
        place = np.zeros(2) if self._centre is None else self._centre
        head = [0.0, self._count, len(seen), seen[-1].came, *place.tolist(), *sizes]
        body = b"".join(part for column in columns for part in (column, bytes(-len(column) % 8)))
        missing = -(8 * len(head) + len(body)) % _WHOLE
        head[0] = 8 * len(head) + len(body) + missing
        self._count += len(seen)
        return b64encode(np.array(head, dtype="<f8").tobytes() + body + bytes(missing))

    def _arrays(self, seen: Sequence[Seen]) -> dict[str, Any]:
        """Return the page's columns of some scans."""
        rows, compared = self._rows_of(seen)
        covered = rows["scans"]["covered"].astype(np.float32)
        series = Series(self.about, rows)
        centre = middle(series) if self._centre is None else self._centre
        made = dict(arrays(series, centre))
        made[COVERED] = covered if compared else np.full_like(covered, np.nan)
        made[CAME] = np.array([record.came for record in seen])
        if self._centre is None and any(np.isfinite(made[name]).any() for name in PLACES if name in made):
            self._centre = centre
        return made

    def _rows_of(self, seen: Sequence[Seen]) -> tuple[dict[str, dict[str, Any]], bool]:
        """Return the tables of some scans, counted from the first one's, and whether they were compared with the truth."""
        told = [record.told for record in seen if record.told is not None]
        if told:
            rows = together(told)
            for table in ("returns", "entries", "truth"):
                rows[table]["scan"] = rows[table]["scan"] - self._count
            rows["weights"]["entry"] = rows["weights"]["entry"] - self._entries
            self._entries += len(rows["entries"]["scan"])
            return rows, True
        parts: list[Tables] = [self._none]
        entries = 0
        for i, record in enumerate(seen):
            part = self._rows.of(record.scan, record.before, record.state, record.estimate, record.modes)
            part["returns"]["scan"] += i
            part["entries"]["scan"] += i
            part["weights"]["entry"] += entries
            entries += len(record.state.ids)
            parts.append(part)
        rows, block = together(parts), self._compared(seen)
        for table, columns in judged(block, len(seen), rows["entries"]["confirmed"]).items():
            rows[table] |= columns
        rows["truth"] = self._truth.true([record.scan.time for record in seen])
        return rows, block is not None

    def _compared(self, seen: Sequence[Seen]) -> Block | None:
        """Return what the judge says of some scans; nothing where it would hold the run up."""
        begin = monotonic()
        if begin < self._judged_at or (len(seen) > 1 and len(seen) * self._judging > _PAUSE):
            return None
        for record in seen:
            state = record.state
            self._judge.add(record.scan, state.ids, state.confirmed, record.estimate, state.nis, state.hit, record.modes)
        block = self._judge.finish_block()
        end = monotonic()
        self._judging = (end - begin) / max(len(seen), 1)
        self._judged_at = end + min((end - begin) * (1.0 / _SHARE - 1.0), _LONGEST)
        return block
