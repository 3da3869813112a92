"""What a detector would report for a scene of radar pictures: points with errors, misses and clutter, batched over runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, ConfigError, Detections, Mask, Recording, Scan, Sensor, Source, Space, fields
from vedette_marine.ais import Reports
from vedette_sim.marine_scene import RadarPicturesScene
from vedette_sim.polar_fields import own_stream

POSITION = Space.of(x="m", y="m")

POINTS = 18
"""Number of the random stream, beside those of the pictures."""


@final
@frozen(eq=False)
class PointRuns:
    """Runs of one scene: times (s,) in s, returns z (r, s, k, 2), which are real (r, s, k), and each run's AIS by vessel."""

    times: Array
    z: Array
    valid: Mask
    ais: tuple[Mapping[str, Reports], ...]

    def scans(self, sensor: str) -> tuple[Scan, ...]:
        """Return all runs in lock-step: each scan's returns are (r, k, 2)."""
        looks = enumerate(self.times.tolist())
        return tuple(Scan(time, sensor, Detections(self.z[:, i], self.valid[:, i])) for i, time in looks)


@final
@frozen
class RadarPointsScene(Source):
    """Returns of a scene's vessels without pictures: z = centre + along-ship and across-ship errors, clutter, misses.

    The errors are Gaussian, along the hull with variance sigma^2 + (extent length)^2, across it sigma^2 + (extent width)^2.
    Clutter is uniform over the radar's disc. Paths, times, lost frames and AIS are the scene's. Each run has a random stream
    of its own: run 3 of 10 is also run 3 of 100.

    >>> from vedette_sim.marine_hull import Vessel
    >>> from vedette_sim.ppi import PpiRadar
    >>> from vedette_sim.ships import Ship
    >>> ship = Vessel(Ship([300.0, 400.0], course=0.5, speed=10.0, appears=1.5), 100.0, 20.0)
    >>> radar, own = PpiRadar(10.0, 1500.0, size=320), Ship([100.0, 50.0], course=1.0)
    >>> scene = RadarPicturesScene(radar, {"a": ship}, frames=2, interval=1.0, ownship=own)
    >>> runs = RadarPointsScene(scene, 0.8, sigma=4.0, extent=0.1, clutter=0.0).batch(1000, 5)
    >>> runs.times.tolist(), bool(runs.valid[:, 0].any())  # it appears at 1.5 s, and has gone 5 m at 2 s
    ([1.0, 2.0], False)
    >>> back = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    >>> along, across = ((runs.z[:, 1, 0] - [300.0, 400.0])[runs.valid[:, 1, 0]] @ back).T
    >>> wanted = [0.8, 5.0, np.hypot(4, 10), np.hypot(4, 2)]
    >>> np.allclose([len(along) / 1000, along.mean(), along.std(), across.std()], wanted, rtol=0.1)
    True
    >>> runs = RadarPointsScene(scene, 0.0, clutter=2e-6).batch(1000, 5)
    >>> false = (runs.z[:, 0] - [100.0, 50.0])[runs.valid[:, 0]]  # over the disc around own ship
    >>> wanted = [2e-6 * np.pi * 1500**2, 1500**2 / 4, 1500**2 / 4]
    >>> np.allclose([len(false) / 1000, *np.mean(false**2, axis=0)], wanted, rtol=0.1), bool(np.abs(false).max() < 1500)
    (True, True)
    """

    kind: ClassVar[str] = "radar_points_scene"

    scene: RadarPicturesScene = fields.part("whose vessels, times and AIS these are")
    detection_probability: float = fields.probability("of a vessel in a scan", default=0.95)
    sigma: float = fields.quantity("m", "standard deviation of a point's return, per axis", default=4.0, above=0)
    extent: float = fields.quantity("1", "part of the hull's size that adds to it", default=0.14, at_least=0)
    clutter: float = fields.quantity("1/m^2", "false returns per scan and area", default=5e-7, at_least=0, at_most=1e-3)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Draw one run, for one sensor that measures positions."""
        fitting = [name for name, sensor in sensors.items() if sensor.measurement == POSITION]
        if len(sensors) != 1 or len(fitting) != 1:
            given = ", ".join(f"{name} of {sensor.measurement}" for name, sensor in sensors.items()) or "none"
            raise ConfigError.at("sensors", f"points need one sensor that measures {POSITION}; got {given}")
        seed = int(rng.integers(2**63))
        times, z, valid = self._returns(1, seed)
        looks = enumerate(times.tolist())
        scans = tuple(Scan(time, fitting[0], Detections.of(z[0, i][valid[0, i]], 2)) for i, time in looks)
        return Recording(scans, self.scene.truth(times, seed))

    def batch(self, runs: int, seed: int) -> PointRuns:
        """Draw many runs at once. AIS of run 0 is the scene's own for this seed."""
        return PointRuns(*self._returns(runs, seed), tuple(self.scene.ais(seed, run) for run in range(runs)))

    def _returns(self, runs: int, seed: int) -> tuple[Array, Array, Mask]:
        """Draw the times, returns and which of them are real, of many runs at once."""
        times, disc = self.scene.times(seed), np.pi * self.scene.radar.range**2
        drawn = [self._run(own_stream(seed, POINTS, run), times, disc) for run in range(runs)]
        most = max(int(count.max()) for _, count in drawn)
        z, valid = np.zeros((runs, len(times), most, 2)), np.zeros((runs, len(times), most), dtype=bool)
        for run, (returns, count) in enumerate(drawn):
            valid[run] = np.arange(most) < count[:, None]
            z[run][valid[run]] = returns
        return times, z, valid

    def _run(self, rng: np.random.Generator, times: Array, disc: float) -> tuple[Array, NDArray[np.intp]]:
        """Draw the returns (n, 2), scan by scan and shuffled within each, and the number in each scan (s,)."""
        scene, s = self.scene, len(times)
        antenna = scene.ownship.states(times)[:, :2]
        places, scans = [], []
        for vessel in scene.vessels.values():
            path = vessel.path
            error, seen = rng.standard_normal((s, 2)), rng.random(s) < self.detection_probability
            seen &= np.array([vessel.there(time) for time in times.tolist()])
            at = np.maximum(times, path.appears)
            heading, centre = path.heading(at), path.states(at)[:, :2]
            seen &= np.hypot(*(centre - antenna).T) <= scene.radar.range
            along, across = (np.hypot(self.sigma, self.extent * size) for size in (vessel.length, vessel.width))
            forward = np.column_stack([np.cos(heading), np.sin(heading)])
            port = np.column_stack([-forward[:, 1], forward[:, 0]])
            places.append((centre + along * error[:, :1] * forward + across * error[:, 1:] * port)[seen])
            scans.append(np.flatnonzero(seen))
        false = rng.poisson(self.clutter * disc, s)
        scans.append(np.repeat(np.arange(s), false))
        away, angle = scene.radar.range * np.sqrt(rng.random(len(scans[-1]))), 2.0 * np.pi * rng.random(len(scans[-1]))
        places.append(antenna[scans[-1]] + away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
        scan = np.concatenate(scans)
        order = np.lexsort((rng.random(len(scan)), scan))
        return np.concatenate(places)[order], np.bincount(scan, minlength=s)
