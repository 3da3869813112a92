"""Laws of sources."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from itertools import pairwise
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtri

from vedette import fields
from vedette.errors import ConfigError, InputError
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.supporting import Source
from vedette.testing.bands import judge_run_means, judge_scale
from vedette.testing.comparisons import Closed, demand, finite, same
from vedette.testing.law import Law, Profile
from vedette.testing.laws.frames import Picture
from vedette.testing.states import SEEDS
from vedette.testing.strategies import SENSOR, components, usual
from vedette.types import Detections, Recording, Scan, Trajectory
from vedette.wrapping import WrappedSensor

CAMERA = Picture(Space.of(x="px", y="px"), 0.0)
OTHER = "kit_other"
"""The name of a second sensor, which a source may not know."""
NEAR, FAR = 20.0, 100.0
"""Squared distances, in deviations: a return is a target's within the first, and none that is farther off than the other."""
BESIDE, PICTURES = 12.0, 12
"""Pixels from a target from which on there is nothing but background; so many openings say how that varies."""


Look = tuple[int, int, NDArray[np.int64], float]
"""Of a target in a scan: which scan, how many returns it has, those near the target, and how surely it is detected."""


@final
@frozen
class Altered(WrappedSensor):
    """A sensor with another detection probability and another density of false returns, the same everywhere."""

    kind: ClassVar[str] = "kit_altered"

    of: Sensor = fields.part("the sensor")
    detection: float = fields.probability("detection probability")
    density: float = fields.quantity("1", "false returns per unit of what is measured", at_least=0)

    def detects(self, x: Array) -> Array:
        """Return the detection probability."""
        return np.array(self.detection)

    def clutter(self, z: Array) -> Array:
        """Return the density."""
        return np.array(self.density)


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
            raise Closed(f"nothing to open: {refusal}") from None


def drawn(source: Source, profile: Profile) -> st.SearchStrategy[Opened]:
    """What every law of a source is given: one sensor named `radar`."""
    plain = _plain()
    return st.builds(Opened, _sensors(), plain, SEEDS, st.just(profile.runs), st.just(profile.alpha))


@cache
def _plain() -> st.SearchStrategy[Sensor]:
    return components(usual("sensor", "cartesian_position"))


@cache
def _sensors() -> st.SearchStrategy[Sensor]:
    plain = _plain()
    others = [
        components(usual("sensor", kind)) for kind in ("range_bearing", "range_bearing_rate", "range_bearing_elevation")
    ]
    return st.one_of(plain, *others)


def the_seed_decides(source: Source, drawn: Opened) -> None:
    """Opened again with an equal generator, it gives the same scans and the same truth."""
    first, again = drawn.open(source), drawn.open(source)
    demand(len(first.scans) == len(again.scans), f"scans: {len(first.scans)} at first, then {len(again.scans)}")
    for one, other in zip(first.scans, again.scans, strict=True):
        same("time again", np.array(other.time), np.array(one.time), 0.0)
        same("returns again", told(other), told(one), 0.0)
    for path, same_path in zip(first.truth, again.truth, strict=True):
        same(f"truth of {path.name} again", same_path.states, path.states, 0.0)


def draws_as_declared(source: Source, drawn: Opened) -> None:
    """One that says that it draws nothing gives the same scans whatever the generator."""
    if source.draws:
        raise Closed("it says that it draws")
    one, other = drawn.open(source), drawn.again(1).open(source)
    demand(len(one.scans) == len(other.scans), f"draws: scans are {len(one.scans)}, then {len(other.scans)}; declare it")
    for first, second in zip(one.scans, other.scans, strict=True):
        same("draws: time with another generator", np.array(second.time), np.array(first.time), 0.0)
        same("draws: returns with another generator", told(second), told(first), 0.0)


def scans_come_in_time_order(source: Source, drawn: Opened) -> None:
    """No scan lies before the one that came before it, whichever sensor's it is."""
    recordings = []
    for names in ((SENSOR,), (OTHER, SENSOR)):
        with suppress(ConfigError, InputError):  # it may know one sensor only, or ask for both
            recordings.append(source.open(dict.fromkeys(names, drawn.sensor), np.random.default_rng(drawn.seed)))
    if not recordings:
        drawn.open(source)
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
            demand(not np.any(np.isinf(pixels)), "frame: has infinite pixels")
            continue
        z, valid = scan.detections.z, scan.detections.valid
        demand(z.ndim == 2 and z.shape[-1] == m, f"returns: must have shape (k, {m}), got {z.shape}")
        demand(valid.shape == z.shape[:-1], f"valid: must have shape {z.shape[:-1]}, got {valid.shape}")
        finite("returns", z[valid])
        same("returns, canonical", z[valid], drawn.sensor.measurement.canonical(z[valid]), 1e-9, 1.0 + np.abs(z[valid]))


def scans_last_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `duration`: between its first scan and its last no more s pass."""
    limit = getattr(source, "duration", None)
    if not isinstance(limit, float | int) or isinstance(limit, bool):
        raise Closed("it has no `duration`")
    times = [scan.time for scan in drawn.open(source).scans]
    if len(times) < 2:
        raise Closed("it gives one scan at most")
    demand(times[-1] - times[0] <= limit * (1 + 1e-9), f"times: last {times[-1] - times[0]:g} s, `duration` is {limit:g} s")


def truth_is_in_order(source: Source, drawn: Opened) -> None:
    """Every trajectory has rising times, and canonical states over its own space."""
    for path in drawn.open(source).truth:
        demand(np.all(np.diff(path.times) > 0), f"{path.name}: times must rise")
        wanted = (len(path.times), len(path.space))
        demand(path.states.shape == wanted, f"{path.name}: states must have shape {wanted}, got {path.states.shape}")
        same(f"{path.name}: states", path.states, path.space.canonical(path.states), 1e-12)


def _pictured(recording: Recording) -> Iterator[tuple[float, Array, list[dict[str, float]]]]:
    """Yield each picture's time, its pixels, and what is known of each target with truth in px, x and y in this picture."""
    paths = [path for path in recording.truth if all(f"{axis}: px" in _units(path) for axis in "xy")]
    for scan in recording.scans:
        if scan.frame is None:
            raise Closed("its scans are no pictures")
        corner, known = np.zeros(2) if scan.frame.corner is None else scan.frame.corner, []
        for path in paths:
            if (state := path.at(scan.time)) is not None:
                named = dict(zip(path.space.names, state.tolist(), strict=True))
                at = {axis: named[axis] + named.get(f"j{axis}", 0.0) - corner[i] for i, axis in enumerate("xy")}
                known.append(named | at)
        yield scan.time, told(scan), known


def _distance(pixels: Array, target: Mapping[str, float]) -> Array:
    """Return how far each pixel is from a target, (h, w)."""
    rows, columns = np.indices(pixels.shape[-2:])
    return np.asarray(np.hypot(columns - target["x"], rows - target["y"]))


def pictures_show_the_truth(source: Source, drawn: Opened) -> None:
    """If it gives pictures and truth in px: where a target is, counted from the corner, pixels differ from the others.

    If the truth has `width` and `height`: what stands out is .3 to 1.4 times as wide and high.
    """
    contrast: list[float] = []
    sizes: list[Array] = []
    for _, pixels, targets in _pictured(drawn.open(source)):
        for target in targets:
            near = _distance(pixels, target) < 1.5
            rest = pixels[..., ~near]
            if not near.any() or not np.isfinite(pixels[..., near]).any():
                continue
            spread, usual = float(np.nanstd(rest)) + 1e-9, np.nanmean(rest)
            light = np.abs(np.nan_to_num(pixels - usual))
            if light.max() < 6.0 * spread:
                continue  # nothing stands out
            contrast.append((float(np.nanmean(pixels[..., near])) - float(usual)) / spread)
            box = np.array([target.get("width", np.nan), target.get("height", np.nan)])
            at, end = np.array([target["x"], target["y"]]), np.array(pixels.shape[:-3:-1])
            if len(targets) == 1 and pixels.ndim == 2 and np.all((at > box) & (at < end - box)):
                bright = light > 0.5 * light.max()
                if light.max() > 20.0 * np.median(light):  # no noise is so bright
                    sizes.append(np.array([np.ptp(np.flatnonzero(bright.any(axis=axis))) + 1 for axis in (0, 1)]) / box)
    if not contrast:
        raise Closed("no target is within a picture with truth in px, or none stands out")
    mean = float(np.mean(contrast))
    demand(abs(mean) > 1.0, f"frame: at the truth pixels must differ, are {mean:.3g} deviations from the others on average")
    for name, ratio in zip(("width", "height"), np.median(sizes, axis=0) if sizes else (), strict=False):
        demand(0.3 < ratio < 1.4, f"truth: what stands out is {ratio:.3g} times as large as its {name}, must be .3 to 1.4")


def _units(path: Trajectory) -> list[str]:
    return [f"{axis.name}: {axis.unit}" for axis in path.space.axes]


def truth_moves_as_its_velocities(source: Source, drawn: Opened) -> None:
    """If its truth has vx beside x: x gains what vx adds up to, give or take a twentieth, along the whole of a path.

    If it has a `heading`, too: that leads the way.
    """
    judged = False
    for path in drawn.open(source).truth:
        names, dt = path.space.names, np.diff(path.times)[:, None]
        pairs = [(i, names.index(f"v{name}")) for i, name in enumerate(names) if f"v{name}" in names]
        if not pairs or len(path.times) < 6:
            continue
        judged = True
        places, speeds = (list(each) for each in zip(*pairs, strict=True))
        moved, v = path.states[-1, places] - path.states[0, places], path.states[:, speeds]
        steps = dt * (v[1:] + v[:-1]) / 2
        off, far = np.linalg.norm(moved - steps.sum(axis=0)), np.sum(np.linalg.norm(steps, axis=-1))
        rough = np.linalg.norm(dt * np.diff(v, axis=0))  # the error is .3 of it for a Brownian path, less for a smooth one
        told = f"{path.name}: moves by {moved.tolist()}, its velocities add up to {steps.sum(axis=0).tolist()}"
        demand(off <= 0.05 * far + 2.0 * rough + 1e-6, told)
        if {"heading", "vx", "vy"} <= set(names):
            vx, vy, to = path.states[:, [names.index(name) for name in ("vx", "vy", "heading")]].T
            ahead, way = np.sum(vx * np.cos(to) + vy * np.sin(to)), np.sum(np.hypot(vx, vy))
            demand(ahead >= 0.5 * way, f"{path.name}: heads where no more than {ahead / way:.3g} of its way leads")
    if not judged:
        raise Closed("it has no truth with velocities")


def every_generator_its_own(source: Source, drawn: Opened) -> None:
    """One that draws gives other scans from another generator."""
    if not source.draws:
        raise Closed("it says that it draws nothing")
    one, other = drawn.open(source), drawn.again(1).open(source)
    pairs = list(zip(one.scans, other.scans, strict=False))
    if not any(told(scan).size for scan, _ in pairs):
        raise Closed("it gives no returns")
    demand(
        len(one.scans) != len(other.scans)
        or any(a.time != b.time or not np.array_equal(told(a), told(b), equal_nan=True) for a, b in pairs),
        "open: gives the same scans from another generator, and says that it draws",
    )


def scans_come_once(source: Source, drawn: Opened) -> None:
    """No scan of a sensor comes twice."""
    scans = drawn.open(source).scans
    for one, other in zip(scans, list(scans)[1:], strict=False):
        twice = one.sensor == other.sensor and one.time == other.time and told(one).size > 0
        demand(not (twice and np.array_equal(told(one), told(other))), f"scans: the one at {one.time:g} s comes twice")


def scans_come_unseen(source: Source, drawn: Opened) -> None:
    """Scans come whether or not anything is detected: about as many of a sensor that detects nothing."""
    seen = len(drawn.open(source).scans)
    blind = len(drawn.again(0, Altered(drawn.sensor, 0.0, 0.0)).open(source).scans)
    demand(2 * blind >= seen, f"scans: {seen}, but {blind} of a sensor that detects nothing: one without returns is a scan")


def _near(sensor: Sensor, recording: Recording, beyond: bool = False) -> Iterator[Look]:
    """Yield for each target in each scan: which scan, how many returns, those near it, and how surely it is detected.

    `beyond`: for each that is not there yet, or no longer, where it appears, or was last, if nobody else is there; and at
    last how many returns lie around that.
    """
    if any(scan.pose is not None for scan in recording.scans):
        raise Closed("its sensor is on a moving platform")
    if any(scan.frame is not None for scan in recording.scans):
        raise Closed("its scans are pictures")
    paths = [path for path in recording.truth if all(axis in path.space for axis in sensor.observes.names)]
    if beyond:  # others say where a target is now and then, not when it is there
        within = [[scan.time for scan in recording.scans if path.at(scan.time) is not None] for path in paths]
        paths = [path for path, times in zip(paths, within, strict=True) if times and np.all(np.isin(times, path.times))]
    for number, scan in enumerate(recording.scans):
        z = scan.detections.z[scan.detections.valid]
        states = [path.at(scan.time) for path in paths]
        there = [path.space.locate(sensor.observes) for path in paths]
        seen = [sensor.measure(state[own]) for state, own in zip(states, there, strict=True) if state is not None]
        for path, state, own in zip(paths, states, there, strict=True):
            if beyond:
                state = None if state is not None else path.states[0 if scan.time < path.times[0] else -1]
            if state is None:
                continue
            x = state[own]
            root = np.linalg.cholesky(np.broadcast_to(sensor.noise(x), (z.shape[-1],) * 2))
            others = _apart(sensor, root, np.reshape(seen, (-1, len(root))), x)
            if beyond and np.any(others < FAR):
                continue
            apart = _apart(sensor, root, z, x)
            last = np.sum((apart >= NEAR) & (apart < FAR)) if beyond else sensor.detects(x)
            yield number, len(z), np.flatnonzero(apart < NEAR), float(last)


def _apart(sensor: Sensor, root: Array, z: Array, x: Array) -> Array:
    """Return how far returns (k, m) are from that of a target at x, squared, in deviations of the root of its noise."""
    return np.asarray(np.sum(np.linalg.solve(root, sensor.measurement.difference(z, sensor.measure(x)).T) ** 2, axis=0))


def returns_are_of_the_truth(source: Source, drawn: Opened) -> None:
    """If it has truth: over a few openings, returns lie around it as often as the sensor detects.

    A source may have a sensor of its own for the scene, in `sensors`: then as often as that one detects.
    """
    sensor = _own(source, drawn.sensor)
    _are_hit([look for k in range(6) for look in _near(sensor, drawn.again(k).open(source))])


def _own(source: Source, sensor: Sensor) -> Sensor:
    own = getattr(source, "sensors", None)
    return own.get(SENSOR, sensor) if isinstance(own, Mapping) else sensor


def _are_hit(looks: list[Look]) -> None:
    hits, chances = sum(len(near) > 0 for _, _, near, _ in looks), sum(chance for *_, chance in looks)
    if chances < 20:
        raise Closed("it has too little truth for that")
    demand(hits > 0.8 * chances - 3 * np.sqrt(chances), f"returns: {hits} lie at the truth, {chances:.0f} should")


def nobody_is_seen_before_or_after(source: Source, drawn: Opened) -> None:
    """If it draws, and its truth comes and goes: before and after, no returns lie where a target appears, or was last."""
    if not source.draws or getattr(source, "sensors", None):
        raise Closed("it draws nothing, or its scene has a sensor of its own")
    sensor = Altered(drawn.plain, 1.0, 0.0)
    scenes = [drawn.again(k, sensor).open(source) for k in range(6)]
    looks = [(len(near) > 0, around) for scene in scenes for *_, near, around in _near(sensor, scene, beyond=True)]
    if len(looks) < 6 or any(around for _, around in looks):
        raise Closed("its targets are there all the time, or in clutter")
    seen = sum(hit for hit, _ in looks)
    demand(seen < 0.8 * len(looks), f"returns: in {seen} of {len(looks)} looks lie at a target that is not there")


def _beside(source: Source, drawn: Opened) -> Iterator[list[tuple[float, Array]]]:
    """Yield for some openings each picture's time, and its pixels less the `level`, NaN where a target is near."""
    level, parts = getattr(source, "level", None), [getattr(source, name, 0.0) for name in ("sigma", "clutter")]
    if not isinstance(level, float) or not all(isinstance(part, float) for part in parts) or not any(parts):
        raise Closed("it has no `sigma` and `level`, or nothing varies")
    for k in range(PICTURES):
        found = []
        for time, pixels, targets in _pictured(drawn.again(k).open(source)):
            near = np.any([_distance(pixels, target) <= BESIDE for target in targets], axis=0)
            found.append((time, np.where(near, np.nan, pixels - level)))
        yield found


def pictures_vary_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `sigma` and `level` in counts, and perhaps `clutter`: so pixels vary beside the targets, and around that."""
    squares = [np.array([pixels for _, pixels in each]) ** 2 for each in _beside(source, drawn)]
    if not all(np.isfinite(each).any() for each in squares):
        raise Closed("no pixel is beside its targets")
    stated = np.sum(np.square([getattr(source, name, 0.0) for name in ("sigma", "clutter")]))
    ratios = np.array([np.nanmean(each) for each in squares]) / stated
    judge_run_means("variance of pixels", ratios, 0.6, 1.6, drawn.alpha / 20)


def backgrounds_drift_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `clutter`, `clutter_time` and `drift`: a background is the one before, moved by the drift, that fades.

    What is new in it has the variance clutter^2 (1 - keep^2), keep = exp(-dt / clutter_time), beside that of the noise.
    """
    clutter, time, drift = (getattr(source, name, None) for name in ("clutter", "clutter_time", "drift"))
    if not clutter or time is None or drift is None:
        raise Closed("it has no `clutter` with `clutter_time` and `drift`")
    sigma, ratios = getattr(source, "sigma", 0.0), []
    for pictures in _beside(source, drawn):
        for (begin, one), (end, other) in pairwise(pictures):
            move, keep = np.multiply(end - begin, drift), np.exp((begin - end) / time)
            step, edge = np.round(move).astype(int), int(np.ceil(np.max(np.abs(move)))) + 1
            if np.any(np.abs(move - step) > 0.01):
                raise Closed("it does not drift by whole pixels")
            new = (other - keep * np.roll(one, step[::-1], axis=(0, 1)))[edge:-edge, edge:-edge]
            if np.isfinite(new).sum() < 200:
                raise Closed("few pixels are beside its targets")
            ratios.append(np.nanmean(new**2) / (clutter**2 * (1 - keep**2) + sigma**2 * (1 + keep**2)))
    judge_run_means("variance of what is new in a picture", np.array(ratios), 0.95, 1.05, drawn.alpha / 20)


def scatters_as_stated(source: Source, drawn: Opened) -> None:
    """If it draws, with `sigma` in m: returns err by that in x and y, and by `extent` times a hull's length and width.

    If it has `clutter` in 1/m^2: so dense are false returns in the middle of where they lie.
    """
    sigma, extent, density = (getattr(source, name, 0.0) for name in ("sigma", "extent", "clutter"))
    if not source.draws or not isinstance(sigma, float) or not sigma or hasattr(source, "level"):
        raise Closed("it draws nothing, or has no `sigma` in m")
    squares, false, looks, there = [], [], 0, 0.0
    for k in range(PICTURES):
        recording = drawn.again(k, drawn.plain).open(source)
        for scan in recording.scans:
            if scan.frame is not None:
                raise Closed("its scans are pictures")
            z, free, looks = scan.detections.z, np.ones(len(scan.detections.z), dtype=bool), looks + 1
            for path in recording.truth:
                named = dict(zip(path.space.names, () if (state := path.at(scan.time)) is None else state, strict=False))
                if not {"x", "y", *(("heading", "length", "width") if extent else ())} <= set(named):
                    continue
                off, to = z - [named["x"], named["y"]], named.get("heading", 0.0)
                turned = off @ [[np.cos(to), -np.sin(to)], [np.sin(to), np.cos(to)]]
                spread = np.hypot(sigma, extent * np.array([named.get("length", 0.0), named.get("width", 0.0)]))
                near = np.sum((turned / spread) ** 2, axis=-1) < NEAR
                free &= ~near
                there += getattr(source, "detection_probability", 0.0)
                squares += [(turned[near] / spread) ** 2] if near.sum() == 1 else []
            false.append(z[free])
    demand(len(squares) > 0.5 * there - 20.0, f"returns: {len(squares)} err as stated, {there:.3g} targets are detected")
    if len(squares) < 40:
        raise Closed("it has too little truth for that")
    for i, axis in enumerate(("along", "across") if extent else ("x", "y")):
        judge_scale(f"errors {axis}, of returns", np.array(squares)[:, 0, i], 1.0, drawn.alpha / 3)
    rest = np.concatenate(false)
    if density and len(rest) > 200:
        away = np.linalg.norm(rest - rest.mean(axis=0), axis=-1)
        found, wanted = np.sum(away < away.max() / 2), density * np.pi * (away.max() / 2) ** 2 * looks
        demand(abs(found - wanted) < 7.0 * np.sqrt(wanted), f"returns: {found} are false, must be {wanted:.3g} by `clutter`")


def drawn_together_as_alone(source: Source, drawn: Opened) -> None:
    """If it has `open_together`: runs in lock-step have the times of one drawn alone, and returns at their own states."""
    if not hasattr(source, "open_together"):
        raise Closed("it has no `open_together`")
    sensor, alone = _own(source, drawn.plain), drawn.again(0, drawn.plain).open(source)
    scenes = source.open_together({SENSOR: drawn.plain}, [np.random.default_rng([drawn.seed, run]) for run in range(6)])
    if scenes is None or any(scan.pose is not None for scan in alone.scans):
        raise Closed("it draws no such scene in lock-step, or on a moving platform")
    times = np.array([scan.time for scan in scenes.scans])
    same("times in lock-step", times, np.array([scan.time for scan in alone.scans]), 1e-9)
    looks: list[Look] = []
    for run, states in enumerate(scenes.states):
        seen = [scan.detections.z[run][scan.detections.valid[run]] for scan in scenes.scans]
        scans = [Scan(time, SENSOR, Detections.of(z, z.shape[-1])) for time, z in zip(times.tolist(), seen, strict=True)]
        looks += _near(sensor, Recording(tuple(scans), (Trajectory(f"of run {run}", scenes.space, times, states),)))
    _are_hit(looks)


def targets_are_missed_as_stated(source: Source, drawn: Opened) -> None:
    """If it draws and has truth: of a sensor that detects half, half are seen, and returns come in no order of targets."""
    if not source.draws:
        raise Closed("it says that it draws nothing")
    if SENSOR in (getattr(source, "sensors", None) or ()) or hasattr(source, "detection_probability"):
        raise Closed("its scene has a sensor of its own")
    sensor = Altered(drawn.plain, 0.5, 0.0)
    seen, looks, first, both = 0, 0, 0, 0
    for k in range(drawn.scans):
        by_scan: dict[int, list[int]] = {}
        for scan, count, near, _ in _near(sensor, drawn.again(k, sensor).open(source)):
            seen, looks = seen + (len(near) > 0), looks + 1
            if count == 2 and len(near) == 1:
                by_scan.setdefault(scan, []).append(int(near[0]))
        firsts = [rows[0] for rows in by_scan.values() if sorted(rows) == [0, 1]]
        first, both = first + firsts.count(0), both + len(firsts)
        if looks > 300 and (both > 100 or not both):
            break
    if looks < 50:
        raise Closed("it has too little truth for that")
    reach = -ndtri(drawn.alpha / 4)
    demand(
        -0.02 * looks < seen - looks / 2 + reach * np.sqrt(looks) / 2
        and seen - looks / 2 < reach * np.sqrt(looks) / 2 + 0.25 * looks,  # two that are close share a return
        f"returns: targets are seen {seen} times in {looks} looks of a sensor that detects half",
    )
    fair = both < 30 or abs(first - both / 2) < reach * np.sqrt(both) / 2
    demand(fair, f"returns: that of the first target stands first in {first} of {both} scans with both")


def order_of_returns_tells_nothing(source: Source, drawn: Opened) -> None:
    """If it draws and has truth: where a return stands in its scan does not tell whether it is the target's."""
    if not source.draws:
        raise Closed("it says that it draws nothing")
    places: list[float] = []
    variance = 0.0
    for k, density in enumerate(np.append(1e-8 * 4.0 ** np.arange(12), 0.0)):
        sensor = Altered(drawn.plain, 0.9, float(density))
        counts = [len(scan.detections.z) for scan in drawn.again(k, sensor).open(source).scans]
        if counts and np.mean(counts) > 3:
            break
    else:
        raise Closed("it draws no false returns")
    for k in range(drawn.scans):
        for _, count, near, _ in _near(sensor, drawn.again(k, sensor).open(source)):
            if count > 1 and len(near) == 1:
                places.append(near[0] - (count - 1) / 2)
                variance += (count**2 - 1) / 12
        if len(places) > drawn.scans:
            break
    if len(places) < 40:
        raise Closed("it has too little truth for that")
    off = float(np.sum(places) / np.sqrt(variance))
    where = "before" if off < 0 else "behind"
    demand(
        abs(off) < -ndtri(drawn.alpha / 2), f"returns: targets' stand {where} false ones, by {abs(off):.1f} standard errors"
    )


LAWS: tuple[Law, ...] = (
    *map(Law, (
        the_seed_decides, draws_as_declared, scans_come_in_time_order, scans_are_the_sensors, scans_last_as_stated,
        truth_is_in_order, every_generator_its_own, scans_come_once, scans_come_unseen, returns_are_of_the_truth,
        truth_moves_as_its_velocities, pictures_show_the_truth, nobody_is_seen_before_or_after, pictures_vary_as_stated,
        backgrounds_drift_as_stated, drawn_together_as_alone,
    )),
    Law(scatters_as_stated, effort="statistical"),
    Law(targets_are_missed_as_stated, effort="statistical"),
    Law(order_of_returns_tells_nothing, effort="statistical"),
)  # fmt: skip
