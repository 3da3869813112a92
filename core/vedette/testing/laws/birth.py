"""Laws of births, on a Kalman filter of positions and velocities and a sensor of positions in clutter."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.config.registry import Registry
from vedette.roles import Estimator, Sensor
from vedette.space import Array
from vedette.supporting import Birth
from vedette.testing.judging import Closed, covariance, demand, frozen_copy, same
from vedette.testing.law import Law, Profile
from vedette.testing.states import SEEDS, STEPS
from vedette.testing.strategies import SENSOR
from vedette.types import Detections, Newborn

P_GATE = 0.99


@frozen(eq=False)
class Returns:
    """Returns (k, 2) of a sensor of positions, the probabilities (k,) that tracks claim them, time steps in s."""

    estimator: Estimator[Any]
    sensor: Sensor
    detections: Detections
    claimed: Array
    dt: float
    later: float
    seed: int

    def rng(self) -> np.random.Generator:
        """A generator that always starts the same."""
        return np.random.default_rng(self.seed)


def drawn(birth: Birth, profile: Profile) -> st.SearchStrategy[Returns]:
    """What every law of a birth is given: up to 4 returns, some of which tracks claim."""
    return st.builds(_returns, st.integers(0, 4), STEPS, STEPS, SEEDS)


def _returns(k: int, dt: float, later: float, seed: int) -> Returns:
    registry, rng = Registry.installed(), np.random.default_rng(seed)
    motion: Any = registry.get("motion", "constant_velocity").cls
    kalman: Any = registry.get("estimator", "kalman").cls
    position: Any = registry.get("sensor", "cartesian_position").cls
    z = frozen_copy(200.0 * rng.standard_normal((k, 2)))
    return Returns(
        kalman(motion(0.5)), position(5.0, 0.9, 1e-5), Detections.of(z, 2), frozen_copy(rng.random(k)), dt, later, seed
    )


def _begun(birth: Birth, given: Returns, claimed: Array | None = None) -> Newborn:
    """The tracks that start at the returns of the first scan."""
    if not birth.starts_from(SENSOR):
        raise Closed("no return starts a track")
    found, chosen = None, given.claimed if claimed is None else claimed
    if birth.models_unseen:
        memory = birth.initial_memory(given.estimator, given.rng())
        found = birth.reveal(memory, given.estimator, given.sensor, given.detections, P_GATE)[1]
    try:
        return birth.begin(found, given.estimator, given.sensor, SENSOR, given.detections, chosen)
    except ValueError as refusal:
        raise Closed(f"it starts no tracks there: {refusal}") from None


def pure(birth: Birth, drawn: Returns) -> None:
    """The same returns start the same tracks again; arguments stay as they were."""
    first, again = _begun(birth, drawn), _begun(birth, drawn)
    same("returns again", again.returns.astype(float), first.returns.astype(float), 0.0)
    same("mean again", again.prior.mean, first.prior.mean, 0.0)
    same("existence again", again.existence, first.existence, 0.0)


def newborn_tracks_are_whole(birth: Birth, drawn: Returns) -> None:
    """Each new track has a return of the scan, a mean, a covariance, and an existence in (0, 1]."""
    newborn, k, n = _begun(birth, drawn), len(drawn.claimed), len(drawn.estimator.state)
    j = len(newborn.returns)
    demand(len(set(newborn.returns.tolist())) == j, f"returns: must differ from each other, got {newborn.returns}")
    demand(
        np.all((newborn.returns >= 0) & (newborn.returns < k)), f"returns: must be in 0 to {k - 1}, got {newborn.returns}"
    )
    demand(newborn.prior.mean.shape == (j, n), f"mean: must have shape {(j, n)}, got {newborn.prior.mean.shape}")
    covariance("prior", newborn.prior.cov, definite=True)
    known = newborn.existence
    demand(known.shape == (j,), f"existence: must have shape {(j,)}, got {known.shape}")
    demand(np.all((known > 0) & (known <= 1)), f"existence: must be in (0, 1], got {known}")


def claimed_returns_start_nothing(birth: Birth, drawn: Returns) -> None:
    """A return that a track surely claims starts none, and one that is claimed less is no less likely to start one."""
    sure = _begun(birth, drawn, np.ones(len(drawn.claimed)))
    demand(not len(sure.returns), "begin: a return with claimed = 1 must start no track")
    some, fewer = _begun(birth, drawn), _begun(birth, drawn, 0.5 * drawn.claimed)
    demand(set(some.returns) <= set(fewer.returns), f"begin: half as much claimed must start {some.returns} too")


def padding_starts_nothing(birth: Birth, drawn: Returns) -> None:
    """A return that is not valid starts no track."""
    padded = Detections(drawn.detections.z, np.zeros(len(drawn.claimed), dtype=bool))
    given = Returns(drawn.estimator, drawn.sensor, padded, np.zeros(len(drawn.claimed)), drawn.dt, drawn.later, drawn.seed)
    demand(not len(_begun(birth, given).returns), "begin: a return with valid = False must start no track")


def tracks_start_near_their_returns(birth: Birth, drawn: Returns) -> None:
    """A new track's prior is one that its return fits: a squared distance below 30 for two measured axes."""
    newborn = _begun(birth, drawn)
    where = drawn.estimator.state.locate(drawn.sensor.observes)
    S = newborn.prior.cov[:, where, :][..., where] + drawn.sensor.noise(newborn.prior.mean[:, where])
    nu = drawn.detections.z[newborn.returns] - newborn.prior.mean[:, where]
    distance = np.sum(nu * np.linalg.solve(S, nu[..., None])[..., 0], axis=-1)
    demand(np.all(distance < 30.0), f"begin: priors must fit their returns, got squared distances {distance}")


def rates_are_densities(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track: rates are finite, >= 0, one a return; a scan without returns raises none."""
    if not birth.models_unseen:
        raise Closed("it does not say that it models targets without a track")
    estimator, sensor, k = drawn.estimator, drawn.sensor, len(drawn.claimed)
    memory = birth.predict(birth.initial_memory(estimator, drawn.rng()), estimator, drawn.dt, drawn.rng())
    rate, _ = birth.reveal(memory, estimator, sensor, drawn.detections, P_GATE)
    if rate is None:
        raise Closed("it states no rate")
    demand(rate.shape == (k,), f"rate: must have shape {(k,)}, got {rate.shape}")
    demand(np.all(np.isfinite(rate) & (rate >= 0)), f"rate: must be finite and >= 0, got {rate}")
    nothing = Detections.of([], len(sensor.measurement))
    after = birth.update(memory, estimator, sensor, nothing, np.zeros(0), P_GATE)
    missed, _ = birth.reveal(after, estimator, sensor, drawn.detections, P_GATE)
    assert missed is not None
    demand(
        np.all(missed <= rate * (1 + 1e-9)),
        f"update: rates must not grow without returns, got {missed} after {rate}",
    )


LAWS = (
    Law(pure),
    Law(newborn_tracks_are_whole),
    Law(claimed_returns_start_nothing),
    Law(padding_starts_nothing),
    Law(tracks_start_near_their_returns),
    Law(rates_are_densities),
)
