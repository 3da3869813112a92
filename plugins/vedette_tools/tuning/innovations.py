"""What a run's innovations, hits and false returns are over what its tracker expects of them, scan by scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from attrs import define, field, frozen

from vedette import Array, Gaussian, ImagingSensor, Sensor, Tracker
from vedette.metrics import gate_truncation
from vedette.tracking import Expected, State
from vedette_report.noises import at_fault

LAGS = 2
"""Innovations are compared with themselves and with those of so many scans later."""
SURE = 0.5
"""A track's return counts if it was detected more probably than not."""


def names_of(sensors: Mapping[str, Sensor]) -> list[tuple[str, str, str]]:
    """Return sensor, axis and what is compared, of each moment: `square`, `lag 1` ... by axis, and `hits` and `false`."""
    names = []
    for name, sensor in sensors.items():
        if isinstance(sensor, ImagingSensor):
            continue
        for axis in sensor.measurement.names:
            names += [(name, axis, "square"), *((name, axis, f"lag {lag}") for lag in range(1, LAGS + 1))]
        names += [(name, "", "hits"), (name, "", "false")]
    return names


@frozen(eq=False)
class Moments:
    """Sums over each scan (s, q) that are 0 on average where the tracker is right, and their variances there (s, q).

    After Mehra, On the Identification of Variances and Adaptive Kalman Filtering, IEEE Trans. Automatic Control 15, 1970.
    """

    names: Sequence[tuple[str, str, str]]
    sums: Array
    variances: Array

    def normalised(self, scans: slice) -> Array:
        """Return each moment over some scans (q,), over its standard deviation."""
        total, variance = np.sum(self.sums[scans], axis=0), np.sum(self.variances[scans], axis=0)
        return np.divide(total, np.sqrt(variance), out=np.zeros_like(total), where=variance > 0)

    def noises(self, scans: slice) -> list[Noise]:
        """Return what innovations say of Q and R by sensor and axis."""
        total, variance = np.sum(self.sums[scans], axis=0), np.sum(self.variances[scans], axis=0)
        at = {name: i for i, name in enumerate(self.names)}
        noises = []
        for (sensor, axis, what), i in at.items():
            count, pairs = variance[i] / 2.0, variance[at[sensor, axis, "lag 1"]] if axis else 0.0
            if what == "square" and count > 0:
                size = 1.0 + float(total[i] / count)
                white = float(total[at[sensor, axis, "lag 1"]] / max(pairs, 1e-300) / max(size, 1e-300)) if pairs else 0.0
                noises.append(Noise(sensor, axis, size, white, float(count), float(pairs)))
        return noises


@frozen
class Noise:
    """NIS along one measured axis over its expectation, of `count` returns; how far each innovation is like the next."""

    sensor: str
    axis: str
    nis: float
    whiteness: float
    count: float
    pairs: float

    @property
    def hint(self) -> str:
        """Which of Q and R is likely wrong, or ""."""
        return at_fault(self.nis, self.whiteness, self.count, self.pairs)

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {"sensor": self.sensor, "axis": self.axis, "nis": self.nis, "whiteness": self.whiteness, "hint": self.hint}


@define
class Gathering:
    """Gathers the moments of a run, told of each scan after it was tracked."""

    tracker: Tracker
    names: list[tuple[str, str, str]] = field(init=False)
    sums: list[Array] = field(init=False, factory=list)
    variances: list[Array] = field(init=False, factory=list)
    _at: dict[tuple[str, str, str], int] = field(init=False)
    _last: dict[tuple[int, str], list[Array]] = field(init=False, factory=dict)

    def __attrs_post_init__(self) -> None:
        self.names = names_of(self.tracker.sensors)
        self._at = {name: i for i, name in enumerate(self.names)}

    def add(self, it: Expected, state: State, expected: float) -> None:
        """Take what was expected of a scan, the state after it, and the expected number of returns of no track."""
        sums, variances = np.zeros(len(self.names)), np.zeros(len(self.names))
        self.sums.append(sums)
        self.variances.append(variances)
        scan = it.scan
        if isinstance(it.sensor, ImagingSensor):
            return
        at = {track: row for row, track in enumerate(it.state.ids.tolist())}
        shown = [row for row, track in enumerate(state.ids.tolist()) if track in at and bool(state.confirmed[row])]
        claimed = 0.0
        if shown:
            predicted = it.tracks
            for row in shown:
                before = at[int(state.ids[row])]
                claimed += float(state.hit[row])
                self._track(sums, variances, it, state, row, Gaussian(predicted.mean[before], predicted.cov[before]))
        i = self._at[scan.sensor, "", "false"]
        sums[i] = float(np.count_nonzero(scan.detections.valid)) - claimed - expected
        variances[i] = expected

    def _track(self, sums: Array, variances: Array, it: Expected, state: State, row: int, prior: Gaussian) -> None:
        """Add what one track, of the belief `prior` before the scan, made of it."""
        scan, sensor = it.scan, it.sensor
        name, space, gate = scan.sensor, sensor.measurement, self.tracker.gate.probability
        x = prior.mean[self.tracker.state.locate(sensor.observes)]
        declared, i = float(sensor.detects(x)) * gate, self._at[name, "", "hits"]
        sums[i] += float(state.hit[row]) - declared
        variances[i] += declared * (1.0 - declared)
        last = self._last.setdefault((int(state.ids[row]), name), [])
        weights = state.weights[row, 1:] * (state.distances[row] <= it.gate.threshold)
        used = np.flatnonzero(weights)
        if np.sum(weights) <= SURE:
            last.insert(0, np.full(len(space), np.nan))
            return
        returns = used if state.returns is None else state.returns[row, used]
        share, seen = weights[used] / np.sum(weights[used]), scan.detections
        expected, S, _ = it.returns_of(prior, seen.noise_of(returns[np.argmax(share)]))
        residual = space.difference(seen.z[returns], expected) / np.sqrt(np.diagonal(S))
        known = np.ones(residual.shape, bool) if seen.missing is None else ~seen.missing[returns]
        residual = np.where(known, residual, 0.0)
        within = float(gate_truncation(len(space), gate))
        u = np.where(np.all(known, axis=0), share @ residual, np.nan) / np.sqrt(within)
        for axis, square, one in zip(space.names, share @ residual**2 / within, u, strict=True):
            i = self._at[name, axis, "square"]
            if not np.isnan(one):
                sums[i] += square - 1.0
                variances[i] += 2.0
        for lag, before in enumerate(last[:LAGS], 1):
            for axis, product in zip(space.names, u * before, strict=True):
                i = self._at[name, axis, f"lag {lag}"]
                if not np.isnan(product):
                    sums[i] += product
                    variances[i] += 1.0
        last.insert(0, u)
        del last[LAGS:]

    def found(self) -> Moments:
        """Return what was gathered."""
        q = len(self.names)
        return Moments(self.names, np.array(self.sums).reshape(-1, q), np.array(self.variances).reshape(-1, q))
