"""Laws of births, on a Kalman filter of positions and velocities and a sensor of positions in clutter."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.metrics.consistency import nees
from vedette.supporting import Birth
from vedette.testing.comparisons import covariance, demand, same
from vedette.testing.law import Law
from vedette.testing.laws import birth_parameters, birth_returns, trackers
from vedette.testing.laws.birth_cases import Returns, begun, rate_of, unseen, unseen_after_nothing
from vedette.types import Detections


def pure(birth: Birth, drawn: Returns) -> None:
    """The same returns start the same tracks again; arguments stay as they were."""
    first, again = begun(birth, drawn), begun(birth, drawn)
    same("returns again", again.returns.astype(float), first.returns.astype(float), 0.0)
    same("mean again", again.prior.mean, first.prior.mean, 0.0)
    same("existence again", again.existence, first.existence, 0.0)


def newborn_tracks_are_whole(birth: Birth, drawn: Returns) -> None:
    """Each new track has a return of the scan, a mean, a covariance, and an existence in (0, 1]."""
    newborn, k, n = begun(birth, drawn), len(drawn.claimed), len(drawn.estimator.state)
    j = len(newborn.returns)
    demand(len(set(newborn.returns.tolist())) == j, f"returns: must differ from each other, got {newborn.returns}")
    inside = (newborn.returns >= 0) & (newborn.returns < k)
    demand(np.all(inside), f"returns: must be in 0 to {k - 1}, got {newborn.returns}")
    demand(newborn.prior.mean.shape == (j, n), f"mean: must have shape {(j, n)}, got {newborn.prior.mean.shape}")
    covariance("prior", newborn.prior.cov, definite=True)
    known = newborn.existence
    demand(known.shape == (j,), f"existence: must have shape {(j,)}, got {known.shape}")
    demand(np.all((known > 0) & (known <= 1)), f"existence: must be in (0, 1], got {known}")


def claimed_returns_start_nothing(birth: Birth, drawn: Returns) -> None:
    """A return that a track surely claims starts none, and the less it is claimed the surer is the track that it starts."""
    sure = begun(birth, drawn, np.ones(len(drawn.claimed)))
    demand(not len(sure.returns), "begin: a return with claimed = 1 must start no track")
    some, fewer = begun(birth, drawn), begun(birth, drawn, 0.5 * drawn.claimed)
    demand(set(some.returns) <= set(fewer.returns), f"begin: half as much claimed must start {some.returns} too")
    for i, existence in zip(some.returns.tolist(), some.existence.tolist(), strict=True):
        less = drawn.claimed.copy()
        less[i] /= 2
        other = begun(birth, drawn, less)
        free = other.existence[other.returns == i]
        told = f"existence: of a track from return {i} is {existence:.4g}, and {free} with half as much claimed"
        demand(len(free) and existence <= free[0] + 1e-9, told)


def padding_starts_nothing(birth: Birth, drawn: Returns) -> None:
    """Returns that are not valid start no track, and sixty of them before others change none of theirs."""
    k, wanted = len(drawn.claimed), begun(birth, drawn)
    padded = Detections(np.concatenate([np.zeros((60, 2)), drawn.detections.z]), np.arange(60 + k) >= 60)
    found = begun(birth, evolve(drawn, detections=padded, claimed=np.concatenate([np.zeros(60), drawn.claimed])))
    told = f"tracks start at {found.returns}, and at {60 + wanted.returns} without them"
    demand(np.array_equal(found.returns, 60 + wanted.returns), f"begin: after 60 returns with valid = False {told}")
    same("means after 60 returns that are not valid", found.prior.mean, wanted.prior.mean, 1e-9)


def tracks_start_near_their_returns(birth: Birth, drawn: Returns) -> None:
    """A new track's prior is one that its return fits: a squared distance below 30 for two measured axes."""
    newborn = begun(birth, drawn)
    where = drawn.estimator.state.locate(drawn.sensor.observes)
    S = newborn.prior.cov[:, where, :][..., where] + drawn.sensor.noise(newborn.prior.mean[:, where])
    distance = nees(drawn.detections.z[newborn.returns] - newborn.prior.mean[:, where], S)
    demand(np.all(distance < 30.0), f"begin: priors must fit their returns, got squared distances {distance}")


def rates_are_densities(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track: rates are finite, >= 0, one a return; a scan without returns raises none."""
    memory, k = birth.predict(unseen(birth, drawn), drawn.estimator, drawn.dt, drawn.rng()), len(drawn.claimed)
    rate = rate_of(birth, memory, drawn)
    demand(rate.shape == (k,), f"rate: must have shape {(k,)}, got {rate.shape}")
    demand(np.all(np.isfinite(rate) & (rate >= 0)), f"rate: must be finite and >= 0, got {rate}")
    missed = rate_of(birth, unseen_after_nothing(birth, memory, drawn), drawn)
    demand(np.all(missed <= rate * (1 + 1e-9)), f"update: rates must not grow without returns, got {missed} after {rate}")


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, newborn_tracks_are_whole, claimed_returns_start_nothing, padding_starts_nothing,
        tracks_start_near_their_returns,
    )),
    Law(rates_are_densities, needs="models_unseen"),
    *birth_returns.LAWS, *birth_parameters.LAWS, *trackers.OF_BIRTHS,
)  # fmt: skip
