"""What laws of preprocessors are tried on: one moment's scans, drawn and exact, and what is made of them."""

from __future__ import annotations

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.metrics.consistency import nees
from vedette.sampling import psd_root
from vedette.space import Array
from vedette.supporting import ImagingSensor, Preprocessor
from vedette.testing.comparisons import Closed, Unlike, demand, deviations, frozen_copy, products
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, sizes
from vedette.types import Detections, Scan


@frozen(eq=False)
class Raw:
    """One moment's scans by sensor name: returns of states of usual size, with the sensor's own noise."""

    scans: dict[str, Scan]
    padded: dict[str, Scan]
    empty: dict[str, Scan]
    seed: int
    runs: int
    alpha: float


def drawn(draw: st.DrawFn, preprocessor: Preprocessor, profile: Profile) -> Raw:
    """What every law of a preprocessor is given: up to 4 returns of each of its sensors."""
    k, seed = draw(st.integers(0, 4)), draw(SEEDS)
    rng = np.random.default_rng(seed)
    full, padded, empty = {}, {}, {}
    for name, sensor in preprocessor.sensors.items():
        x = sizes(sensor.observes) * rng.uniform(-1.0, 1.0, (k, len(sensor.observes)))
        x[: int(rng.integers(2))] = 0.0  # where a range is 0, too
        m = len(sensor.measurement)
        root = psd_root(np.broadcast_to(sensor.noise(x), (k, m, m)))
        noise = (root @ rng.standard_normal((k, m, 1)))[..., 0]
        z = sensor.measurement.displace(sensor.measure(x), np.where(np.any(x, axis=-1, keepdims=True), noise, 0.0))
        full[name] = scan_of(name, z, k)
        padded[name] = scan_of(name, np.concatenate([z, np.zeros((2, m))]), k)
        empty[name] = scan_of(name, np.zeros((0, m)), 0)
    return Raw(full, padded, empty, seed, profile.runs, profile.alpha)


def scan_of(name: str, z: Array, count: int) -> Scan:
    return Scan(5.0, name, Detections(frozen_copy(z), np.arange(len(z)) < count))


def made_of(preprocessor: Preprocessor, scans: dict[str, Scan]) -> Detections:
    """What it makes of the scans, the valid returns only."""
    made = preprocessor.process(scans)
    m = len(preprocessor.measurement)
    demand(made.z.shape[-1:] == (m,), f"z: must have {m} axes {preprocessor.measurement}, got shape {made.z.shape}")
    demand(made.valid.shape == made.z.shape[:-1], f"valid: must have shape {made.z.shape[:-1]}, got {made.valid.shape}")
    evidence = None if made.evidence is None else made.evidence[made.valid]
    return Detections(made.z[made.valid], made.valid[made.valid], evidence, made.noise_of(made.valid))


@frozen(eq=False)
class Exact:
    """States (3, n) as each sensor sees them without error, where the output's axes stand in theirs, and what it makes."""

    states: Array
    where: list[int]
    scans: dict[str, Scan]
    made: Detections

    @property
    def x(self) -> Array:
        """The states over the axes of the output."""
        return self.states[:, self.where]

    def far(self) -> Array:
        """How far returns lie from their states, squared, in deviations of the noise that they state."""
        if len(self.made.z) != 3 or self.made.noise is None:
            raise Closed("it does not make one return with its noise of each")
        return nees(self.made.z - self.x, self.made.noise)


def leaning(R: Array) -> Array:
    """Return R with its correlations (*b, m, m) half way to 1."""
    return np.asarray(0.5 * (R + products(deviations(R))))


def exactly(preprocessor: Preprocessor, drawn: Raw, scale: float | None = None, several: bool = False) -> Exact:
    """What is made of exact returns; Closed if the axes of the output are not those of a state that all sensors observe.

    `scale` of the sensor's noise, `leaning`: each return brings it as its own. `several` sensors are taken, too.
    """
    space, sensors = preprocessor.measurement, preprocessor.sensors
    if any(isinstance(sensor, ImagingSensor) for sensor in sensors.values()):
        raise Unlike("it reads pictures, and no returns")
    observed = {sensor.observes for sensor in sensors.values()}
    if (len(sensors) > 1 and not several) or len(observed) != 1 or set(space.axes) - set(next(iter(observed)).axes):
        raise Unlike("what it makes are not axes of a state that one sensor observes")
    (state,) = observed
    rng = np.random.default_rng(sum(len(scan.detections.z) for scan in drawn.scans.values()))
    x = sizes(state) * rng.uniform(0.3, 1.0, (3, len(state))) * rng.choice([-1.0, 1.0], (3, 1))
    scans = {}
    for name, sensor in sensors.items():
        z, m = sensor.measure(x), len(sensor.measurement)
        own = None if scale is None else np.broadcast_to(scale * leaning(sensor.noise(x)), (3, m, m))
        scans[name] = Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool), None, own))
    return Exact(x, [state.names.index(axis) for axis in space.names], scans, made_of(preprocessor, scans))
