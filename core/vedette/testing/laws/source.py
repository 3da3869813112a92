"""Laws of sources."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtri

from vedette import fields
from vedette.errors import ConfigError, InputError
from vedette.roles import Sensor
from vedette.space import Array
from vedette.supporting import Source
from vedette.testing.comparisons import Closed, demand, finite, same
from vedette.testing.law import Law, Profile
from vedette.testing.states import SEEDS
from vedette.testing.strategies import SENSOR, components, usual
from vedette.types import Recording
from vedette.wrapping import WrappedSensor

OTHER = "kit_other"
"""The name of a second sensor, which a source may not know."""


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


@frozen(eq=False)
class Opened:
    """The tracker's sensor, and the seed of everything random."""

    sensor: Sensor
    seed: int
    scans: int
    alpha: float

    def again(self, k: int, sensor: Sensor | None = None) -> Opened:
        """The same from a seed that is `k` later, and perhaps of another sensor."""
        return evolve(self, seed=self.seed + k, sensor=self.sensor if sensor is None else sensor)

    def open(self, source: Source) -> Recording:
        """All scans, drawn afresh from the seed; Closed if there is nothing to open where the source points."""
        try:
            return source.open({SENSOR: self.sensor}, np.random.default_rng(self.seed))
        except (ConfigError, InputError) as refusal:
            raise Closed(f"nothing to open: {refusal}") from None


def drawn(source: Source, profile: Profile) -> st.SearchStrategy[Opened]:
    """What every law of a source is given: one sensor named `radar`."""
    return st.builds(Opened, _sensors(), SEEDS, st.just(profile.runs), st.just(profile.alpha))


@cache
def _sensors() -> st.SearchStrategy[Sensor]:
    return components(usual("sensor", "cartesian_position"))


def the_seed_decides(source: Source, drawn: Opened) -> None:
    """Opened again with an equal generator, it gives the same scans and the same truth."""
    first, again = drawn.open(source), drawn.open(source)
    demand(len(first.scans) == len(again.scans), f"scans: {len(first.scans)} at first, then {len(again.scans)}")
    for one, other in zip(first.scans, again.scans, strict=True):
        same("time again", np.array(other.time), np.array(one.time), 0.0)
        same("returns again", other.detections.z, one.detections.z, 0.0)
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
        same("draws: returns with another generator", second.detections.z, first.detections.z, 0.0)


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
    """Scans name one of the tracker's sensors, and their returns are finite and over what it measures."""
    m = len(drawn.sensor.measurement)
    for scan in drawn.open(source).scans:
        demand(scan.sensor == SENSOR, f"sensor: must be one of the tracker's, {SENSOR!r}, got {scan.sensor!r}")
        z, valid = scan.detections.z, scan.detections.valid
        demand(z.ndim == 2 and z.shape[-1] == m, f"returns: must have shape (k, {m}), got {z.shape}")
        demand(valid.shape == z.shape[:-1], f"valid: must have shape {z.shape[:-1]}, got {valid.shape}")
        finite("returns", z[valid])


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


def every_generator_its_own(source: Source, drawn: Opened) -> None:
    """One that draws gives other scans from another generator."""
    if not source.draws:
        raise Closed("it says that it draws nothing")
    one, other = drawn.open(source), drawn.again(1).open(source)
    pairs = list(zip(one.scans, other.scans, strict=False))
    if not any(np.any(scan.detections.valid) for scan, _ in pairs):
        raise Closed("it gives no returns")
    demand(
        len(one.scans) != len(other.scans)
        or any(a.time != b.time or not np.array_equal(a.detections.z, b.detections.z) for a, b in pairs),
        "open: gives the same scans from another generator, and says that it draws",
    )


def scans_come_once(source: Source, drawn: Opened) -> None:
    """No scan of a sensor comes twice."""
    scans = drawn.open(source).scans
    for one, other in zip(scans, list(scans)[1:], strict=False):
        twice = one.sensor == other.sensor and one.time == other.time and len(one.detections.z) > 0
        demand(
            not (twice and np.array_equal(one.detections.z, other.detections.z)),
            f"scans: the one at {one.time:g} s comes twice",
        )


def scans_come_unseen(source: Source, drawn: Opened) -> None:
    """Scans come whether or not anything is detected: about as many of a sensor that detects nothing."""
    seen = len(drawn.open(source).scans)
    blind = len(drawn.again(0, Altered(drawn.sensor, 0.0, 0.0)).open(source).scans)
    demand(2 * blind >= seen, f"scans: {seen}, but {blind} of a sensor that detects nothing: one without returns is a scan")


def _near(sensor: Sensor, recording: Recording) -> Iterator[tuple[int, NDArray[np.int64], float]]:
    """Yield for each target in each scan the number of returns, those near it, and how surely it is detected."""
    if any(scan.pose is not None for scan in recording.scans):
        raise Closed("its sensor is on a moving platform")
    for scan in recording.scans:
        z = scan.detections.z[scan.detections.valid]
        for path in recording.truth:
            state = path.at(scan.time)
            if state is None or any(axis not in path.space for axis in sensor.observes.names):
                continue
            x = state[path.space.locate(sensor.observes)]
            root = np.linalg.cholesky(np.broadcast_to(sensor.noise(x), (z.shape[-1],) * 2))
            off = np.linalg.solve(root, sensor.measurement.difference(z, sensor.measure(x)).T)
            near = np.flatnonzero(np.sum(off**2, axis=0) < 20.0) if len(z) else np.zeros(0, dtype=int)
            yield len(z), near, float(sensor.detects(x))


def returns_are_of_the_truth(source: Source, drawn: Opened) -> None:
    """If it has truth: over a few openings, returns lie around it as often as the sensor detects.

    A source may have a sensor of its own for the scene, in `sensors`: then as often as that one detects.
    """
    own = getattr(source, "sensors", None)
    sensor = own.get(SENSOR, drawn.sensor) if isinstance(own, Mapping) else drawn.sensor
    looks = [look for k in range(6) for look in _near(sensor, drawn.again(k).open(source))]
    hits, chances = sum(len(near) > 0 for _, near, _ in looks), sum(chance for _, _, chance in looks)
    if chances < 20:
        raise Closed("it has too little truth for that")
    demand(hits > 0.8 * chances - 3 * np.sqrt(chances), f"returns: {hits} lie at the truth, {chances:.0f} should")


def order_of_returns_tells_nothing(source: Source, drawn: Opened) -> None:
    """If it draws and has truth: where a return stands in its scan does not tell whether it is the target's."""
    if not source.draws:
        raise Closed("it says that it draws nothing")
    places: list[float] = []
    variance = 0.0
    for k, density in enumerate(np.append(1e-8 * 4.0 ** np.arange(12), 0.0)):
        sensor = Altered(drawn.sensor, 0.9, float(density))
        counts = [len(scan.detections.z) for scan in drawn.again(k, sensor).open(source).scans]
        if counts and np.mean(counts) > 3:
            break
    else:
        raise Closed("it draws no false returns")
    for k in range(drawn.scans):
        for count, near, _ in _near(sensor, drawn.again(k, sensor).open(source)):
            if count > 1 and len(near) == 1:
                places.append(near[0] - (count - 1) / 2)
                variance += (count**2 - 1) / 12
        if len(places) > drawn.scans:
            break
    if len(places) < 40:
        raise Closed("it has too little truth for that")
    off = float(np.sum(places) / np.sqrt(variance))
    demand(
        abs(off) < -ndtri(drawn.alpha / 2),
        f"returns: those of targets stand {'before' if off < 0 else 'behind'} false ones, by {abs(off):.1f} standard errors",
    )


LAWS = (
    Law(the_seed_decides),
    Law(draws_as_declared),
    Law(scans_come_in_time_order),
    Law(scans_are_the_sensors),
    Law(scans_last_as_stated),
    Law(truth_is_in_order),
    Law(every_generator_its_own),
    Law(scans_come_once),
    Law(scans_come_unseen),
    Law(returns_are_of_the_truth),
    Law(order_of_returns_tells_nothing, effort="statistical"),
)
