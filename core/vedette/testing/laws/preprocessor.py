"""Laws of preprocessors: from raw scans of one moment to the returns of a tracker's sensor."""

from __future__ import annotations

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.sampling.trajectories import psd_root
from vedette.space import Array
from vedette.supporting import Preprocessor
from vedette.testing.judging import covariance, demand, finite, frozen_copy, same
from vedette.testing.law import Law, Profile
from vedette.testing.states import SEEDS, sizes
from vedette.types import Detections, Scan


@frozen(eq=False)
class Raw:
    """One moment's scans by sensor name: returns of states of usual size, with the sensor's own noise."""

    scans: dict[str, Scan]
    padded: dict[str, Scan]
    empty: dict[str, Scan]


def drawn(preprocessor: Preprocessor, profile: Profile) -> st.SearchStrategy[Raw]:
    """What every law of a preprocessor is given: up to 4 returns of each of its sensors."""
    return st.builds(_raw, st.just(preprocessor), st.integers(0, 4), SEEDS)


def _raw(preprocessor: Preprocessor, k: int, seed: int) -> Raw:
    rng = np.random.default_rng(seed)
    full, padded, empty = {}, {}, {}
    for name, sensor in preprocessor.sensors.items():
        x = sizes(sensor.observes) * rng.uniform(-1.0, 1.0, (k, len(sensor.observes)))
        m = len(sensor.measurement)
        root = psd_root(np.broadcast_to(sensor.noise(x), (k, m, m)))
        noise = (root @ rng.standard_normal((k, m, 1)))[..., 0]
        z = sensor.measurement.displace(sensor.measure(x), noise)
        full[name] = _scan(name, z, k)
        padded[name] = _scan(name, np.concatenate([z, np.zeros((2, m))]), k)
        empty[name] = _scan(name, np.zeros((0, m)), 0)
    return Raw(full, padded, empty)


def _scan(name: str, z: Array, count: int) -> Scan:
    return Scan(5.0, name, Detections(frozen_copy(z), np.arange(len(z)) < count))


def _made(preprocessor: Preprocessor, scans: dict[str, Scan]) -> Detections:
    """What it makes of the scans, the valid returns only."""
    made = preprocessor.process(scans)
    m = len(preprocessor.measurement)
    demand(made.z.shape[-1:] == (m,), f"z: must have {m} axes {preprocessor.measurement}, got shape {made.z.shape}")
    demand(made.valid.shape == made.z.shape[:-1], f"valid: must have shape {made.z.shape[:-1]}, got {made.valid.shape}")
    evidence = None if made.evidence is None else made.evidence[made.valid]
    noise = None if made.noise is None else made.noise[made.valid]
    return Detections(made.z[made.valid], made.valid[made.valid], evidence, noise)


def pure(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Calls leave the scans as they were, and give the same again."""
    first, again = _made(preprocessor, drawn.scans), (_made(preprocessor, drawn.empty), _made(preprocessor, drawn.scans))[1]
    same("returns again", again.z, first.z, 0.0)


def makes_finite_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """What it makes is finite and canonical, over `measurement`."""
    made = _made(preprocessor, drawn.scans)
    finite("z", made.z)
    same("z, canonical", made.z, preprocessor.measurement.canonical(made.z), 1e-9)
    if made.evidence is not None:
        finite("evidence", made.evidence)


def noise_is_positive_definite(preprocessor: Preprocessor, drawn: Raw) -> None:
    """The noise that a return brings is symmetric and positive definite."""
    made = _made(preprocessor, drawn.scans)
    if made.noise is not None:
        m = len(preprocessor.measurement)
        demand(made.noise.shape == (len(made.z), m, m), f"noise: must be (k, {m}, {m}), got shape {made.noise.shape}")
        covariance("noise", made.noise, definite=True)


def padding_changes_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Returns that are not valid are as if they were not there."""
    plain, padded = _made(preprocessor, drawn.scans), _made(preprocessor, drawn.padded)
    same("returns", padded.z, plain.z)
    if plain.noise is not None and padded.noise is not None:
        same("noise", padded.noise, plain.noise)


def nothing_comes_of_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """From scans without returns it makes none."""
    made = _made(preprocessor, drawn.empty)
    demand(not len(made.z), f"returns: must be none where none were reported, got {len(made.z)}")


LAWS = (
    Law(pure),
    Law(makes_finite_returns),
    Law(noise_is_positive_definite),
    Law(padding_changes_nothing),
    Law(nothing_comes_of_nothing),
)
