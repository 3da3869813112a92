"""What the laws of sources are tried on, and those of all; those of pictures and of returns are in modules beside."""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from itertools import pairwise

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette.errors import ConfigError, InputError
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.supporting import Source
from vedette.testing.comparisons import Closed, Unlike, closed_if, demand, finite, same, stated
from vedette.testing.law import Law, Profile
from vedette.testing.laws.frames import Picture
from vedette.testing.sensors import Altered
from vedette.testing.states import SEEDS, speeds_of
from vedette.testing.strategies import SENSOR, components, usual
from vedette.types import Recording, Scan

CAMERA = Picture(Space.of(x="px", y="px"), 0.0)
OTHER = "kit_other"
"""The name of a second sensor, which a source may not know."""
OPENINGS = 12
"""So many openings say how much what is drawn varies."""
SENSORS = ("cartesian_position", "range_bearing", "range_bearing_rate", "range_bearing_elevation")
PART = 12
"""Steps of a path after which it is judged whether it moved as its velocities say, as well as at its end."""
NEAR, FAR = 20.0, 100.0
"""Squared distances, in deviations: a return is a target's within the first, and none that is farther off than the other."""


def told(scan: Scan) -> Array:
    """Return what a scan brings: its pixels, or its returns."""
    return np.asarray(scan.detections.z if scan.frame is None else scan.frame.pixels)


@frozen(eq=False)
class Opened:
    """The tracker's sensor, one of positions, and the seed of everything random."""

    sensor: Sensor
    plain: Sensor
    seed: int
    scans: int
    alpha: float

    def again(self, k: int, sensor: Sensor | None = None) -> Opened:
        """The same from a seed that is `k` later, and perhaps of another sensor."""
        return evolve(self, seed=self.seed + k, sensor=self.sensor if sensor is None else sensor)

    def fitting(self, source: Source) -> Opened:
        """The same, of the sensor of positions if the source refuses the other."""
        with suppress(ConfigError, InputError):
            source.open({SENSOR: self.sensor}, np.random.default_rng(self.seed))
            return self
        return evolve(self, sensor=self.plain)

    def open(self, source: Source) -> Recording:
        """All scans, drawn afresh from the seed, for the sensor, or for a camera if the source refuses that one.

        Closed if there is nothing to open where the source points.
        """
        try:
            return source.open({SENSOR: self.sensor}, np.random.default_rng(self.seed))
        except (ConfigError, InputError) as refusal:
            with suppress(ConfigError, InputError):
                seen = source.open({SENSOR: CAMERA}, np.random.default_rng(self.seed))
                if all(scan.frame is not None for scan in seen.scans[:1]):
                    return seen  # of a camera
            raise (Unlike if hasattr(source, "path") else Closed)(f"nothing to open: {refusal}") from None


def drawn(draw: st.DrawFn, source: Source, profile: Profile) -> Opened:
    """What every law of a source is given: one sensor named `radar`."""
    return draw(_opened().map(lambda given: Opened(*given, profile.runs, profile.alpha).fitting(source)))


@cache
def _opened() -> st.SearchStrategy[tuple[Sensor, Sensor, int]]:
    """Return the strategy of any of the usual sensors, the first of them, and a seed."""
    each = [components(usual("sensor", kind)) for kind in SENSORS]
    return st.tuples(st.one_of(each), each[0], SEEDS)


def the_seed_decides(source: Source, drawn: Opened) -> None:
    """Opened again with an equal generator, it gives the same scans and the same truth."""
    first, again = drawn.open(source), drawn.open(source)
    _are_equal(first, again, "again")
    for path, same_path in zip(first.truth, again.truth, strict=True):
        same(f"truth of {path.name} again", same_path.states, path.states, 0.0)


def _are_equal(one: Recording, other: Recording, what: str) -> None:
    demand(len(one.scans) == len(other.scans), f"scans {what}: {len(one.scans)} at first, then {len(other.scans)}")
    for first, second in zip(one.scans, other.scans, strict=True):
        same(f"time {what}", np.array(second.time), np.array(first.time), 0.0)
        same(f"returns {what}", told(second), told(first), 0.0)


def draws_as_declared(source: Source, drawn: Opened) -> None:
    """One that says that it draws nothing gives the same scans whatever the generator."""
    _are_equal(drawn.open(source), drawn.again(1).open(source), "with another generator, and it does not declare `draws`")


def scans_come_in_time_order(source: Source, drawn: Opened) -> None:
    """It gives scans, and none lies before the last one, whichever sensor's it is, nor in lock-step by `open_together`."""
    recordings, together = [], getattr(source, "open_together", lambda *_: None)
    for names in ((SENSOR,), (OTHER, SENSOR)):
        sensors, rng = dict.fromkeys(names, drawn.sensor), np.random.default_rng(drawn.seed)
        with suppress(ConfigError, InputError):  # it may know one sensor only, or ask for both
            recordings += [each for each in (source.open(sensors, rng), together(sensors, [rng])) if each is not None]
    recordings = recordings or [drawn.open(source)]
    demand(any(len(each.scans) for each in recordings), "scans: there are none; one that finds none must raise InputError")
    for recording in recordings:
        times = np.array([scan.time for scan in recording.scans])
        finite("times", times)
        for i in np.flatnonzero(np.diff(times) < 0)[:1]:
            late, early = recording.scans[i], recording.scans[i + 1]
            told = f"that of {early.sensor!r} at {early.time:g} s comes after that of {late.sensor!r} at {late.time:g} s"
            demand(False, f"times: must not go back, {told}")


def scans_are_the_sensors(source: Source, drawn: Opened) -> None:
    """Scans name one of the tracker's sensors, and their returns are finite, canonical and over what it measures."""
    m = len(drawn.sensor.measurement)
    for scan in drawn.open(source).scans:
        demand(scan.sensor == SENSOR, f"sensor: must be one of the tracker's, {SENSOR!r}, got {scan.sensor!r}")
        if scan.frame is not None:
            pixels = told(scan)
            demand(pixels.ndim in (2, 3) and pixels.size, f"frame: must be (h, w) or (3, h, w), got {pixels.shape}")
            fine = np.isfinite(pixels)
            dead = f"frame: {fine.sum()} of {fine.size} pixels are finite; some must be, and dead ones NaN"
            demand(fine.any() and not np.isinf(pixels).any(), dead)
            continue
        z, valid = scan.detections.z, scan.detections.valid
        demand(z.ndim == 2 and z.shape[-1] == m, f"returns: must have shape (k, {m}), got {z.shape}")
        demand(valid.shape == z.shape[:-1], f"valid: must have shape {z.shape[:-1]}, got {valid.shape}")
        finite("returns", z[valid])
        same("returns, canonical", z[valid], drawn.sensor.measurement.canonical(z[valid]), 1e-9, 1.0 + np.abs(z[valid]))


def scans_last_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `duration`: between its first scan and its last no more s pass."""
    limit = stated(source, "duration", "s")
    times = [scan.time for scan in drawn.open(source).scans]
    closed_if(len(times) < 2, "it gives one scan at most")
    demand(times[-1] - times[0] <= limit * (1 + 1e-9), f"times: last {times[-1] - times[0]:g} s, `duration` is {limit:g} s")


def truth_is_in_order(source: Source, drawn: Opened) -> None:
    """Every trajectory has a name of its own, rising times, and canonical states over its own space."""
    truth = drawn.open(source).truth
    twice = {path.name for path in truth if sum(path.name == other.name for other in truth) > 1}
    demand(not twice, f"truth: trajectories must have names of their own, several are {min(twice, default='')!r}")
    for path in truth:
        demand(np.all(np.diff(path.times) > 0), f"{path.name}: times must rise")
        wanted = (len(path.times), len(path.space))
        demand(path.states.shape == wanted, f"{path.name}: states must have shape {wanted}, got {path.states.shape}")
        same(f"{path.name}: states", path.states, path.space.canonical(path.states), 1e-12)


def truth_moves_as_its_velocities(source: Source, drawn: Opened) -> None:
    """If its truth has vx beside x: x gains what vx adds up to, give or take a twentieth, along a path and each part.

    If it has a `heading`, too: that leads the way.
    """
    judged = False
    for path in drawn.open(source).truth:
        names, dt = path.space.names, np.diff(path.times)[:, None]
        if not (pairs := speeds_of(path.space)) or len(path.times) < 6:
            continue
        judged = True
        places, speeds = (list(each) for each in zip(*pairs, strict=True))
        x, v = path.states[:, places], path.states[:, speeds]
        over = Space(tuple(path.space.axes[i] for i in places))
        steps, turns = dt * (v[1:] + v[:-1]) / 2, dt * np.diff(v, axis=0)
        sums = np.cumsum(np.concatenate([steps, turns**2, np.abs(steps)], axis=-1), axis=0)
        for part in {len(sums), min(PART, len(sums))}:
            made = np.concatenate([sums[part - 1 :: part][:1], np.diff(sums[part - 1 :: part], axis=0)])
            moved = over.difference(x[part::part], x[:-part:part])
            added, squares, far = (np.reshape(each, moved.shape) for each in np.split(made, 3, axis=-1))
            # What a Brownian path adds is .3 of the root of these squares, a smooth one less.
            allowed = 0.05 * np.linalg.norm(far, axis=-1) + 2.0 * np.sqrt(squares.sum(axis=-1)) + 1e-6
            for i in np.flatnonzero(np.linalg.norm(over.difference(moved, added), axis=-1) > allowed)[:1]:
                told = f"{path.name}: moves by {moved[i].tolist()} from {path.times[i * part]:g} s"
                demand(False, f"{told} to {path.times[(i + 1) * part]:g} s, its velocities add up to {added[i].tolist()}")
        if {"heading", "vx", "vy"} <= set(names):
            vx, vy, to = path.states[:, [names.index(name) for name in ("vx", "vy", "heading")]].T
            ahead, way = np.sum(vx * np.cos(to) + vy * np.sin(to)), np.sum(np.hypot(vx, vy))
            demand(ahead >= 0.5 * way, f"{path.name}: heads where no more than {ahead / way:.3g} of its way leads")
    closed_if(not judged, "it has no truth with velocities")


def every_generator_its_own(source: Source, drawn: Opened) -> None:
    """One that draws gives other scans from another generator."""
    one, other = drawn.open(source), drawn.again(1).open(source)
    pairs = zip(one.scans, other.scans, strict=False)
    unlike = any(a.time != b.time or not np.array_equal(told(a), told(b), equal_nan=True) for a, b in pairs)
    closed_if(not (unlike or any(told(scan).size for scan in one.scans)), "it gives no returns")
    unlike = unlike or len(one.scans) != len(other.scans)
    demand(unlike, "open: gives the same scans from another generator, and says that it draws")


def scans_come_once(source: Source, drawn: Opened) -> None:
    """No scan of a sensor comes twice."""
    for one, other in pairwise(drawn.open(source).scans):
        twice = one.sensor == other.sensor and one.time == other.time and told(one).size > 0
        demand(not (twice and np.array_equal(told(one), told(other))), f"scans: the one at {one.time:g} s comes twice")


def scans_come_unseen(source: Source, drawn: Opened) -> None:
    """Scans come whether or not anything is detected: about as many of a sensor that detects nothing."""
    seen = len(drawn.open(source).scans)
    blind = len(drawn.again(0, Altered(drawn.sensor, 0.0, 0.0)).open(source).scans)
    demand(2 * blind >= seen, f"scans: {seen}, but {blind} of a sensor that detects nothing: one without returns is a scan")


LAWS = (
    *map(Law, (the_seed_decides, scans_come_in_time_order, scans_are_the_sensors, scans_last_as_stated)),
    *(Law(law, share=2) for law in (truth_is_in_order, scans_come_once, scans_come_unseen)),
    Law(truth_moves_as_its_velocities),
    Law(draws_as_declared, needs="not draws"),
    Law(every_generator_its_own, needs="draws", share=2),
)
