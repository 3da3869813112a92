"""Which Gaussians of unseen targets explain which returns, and what a target is like that gave one."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Estimator, Gaussian, Indices, Sensor, kernels
from vedette.filters import mixed
from vedette.tracking import take
from vedette_standard.births import in_gaussians
from vedette_standard.births.at_returns import AtReturns, at_returns
from vedette_standard.births.cells import counted
from vedette_standard.births.intensity import Intensity


@final
@frozen(eq=False)
class Explained:
    """log_share (c, k): the log density of returns from each Gaussian; near: those for which the filter's way is inexact."""

    intensity: Intensity
    estimator: Estimator[Any]
    sensor: Sensor
    detections: Detections
    log_share: Array
    near: AtReturns | None

    @property
    def rate(self) -> Array:
        """The density (k,) of each return from an unseen target."""
        return np.exp(kernels.log_sum(self.log_share, axis=0))

    def given(self, returns: Indices) -> Gaussian:
        """Return the moments (j, n) of unseen targets given that they gave the returns (j,)."""
        each = _given(self.intensity, self.estimator, self.sensor, self.detections, self.near, returns)
        every = Gaussian(each.mean.swapaxes(0, 1), each.cov.swapaxes(0, 1))
        return mixed(every, kernels.softmax(self.log_share[:, returns].T), self.estimator.state)


def explained(
    intensity: Intensity, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
) -> Explained:
    """Return how each Gaussian explains each return."""
    prior, valid = estimator.moments(intensity.belief), np.flatnonzero(detections.valid)
    near = at_returns(prior, estimator.state, sensor, detections)
    loglik = np.empty((len(intensity.number), len(detections.z)))
    if near is None or len(near.returns) < len(detections.z):
        loglik[:] = estimator.evaluate(intensity.belief, sensor, detections, p_gate).loglik[:, 1:]
    if near is not None:
        loglik[:, near.returns] = near.loglik
    number = np.zeros(loglik.shape)
    if intensity.number.shape[1] == 1:  # it is the same all over a Gaussian
        number[:] = intensity.number.reshape(-1, 1)
    else:
        mean = _given(intensity, estimator, sensor, detections, near, valid).mean
        places = in_gaussians.counted_along(prior, estimator.state, mean)
        number[:, valid] = counted(
            intensity.number, places, lambda at: in_gaussians.detection(prior, estimator.state, sensor, at)
        )
    with np.errstate(divide="ignore"):
        log_share = np.where(detections.valid, np.log(number) + loglik, -np.inf)
    return Explained(intensity, estimator, sensor, detections, log_share, near)


def _given(
    intensity: Intensity,
    estimator: Estimator[Any],
    sensor: Sensor,
    detections: Detections,
    near: AtReturns | None,
    returns: Indices,
) -> Gaussian:
    """Return the moments (c, j, n) of each Gaussian given each of some returns (j,)."""
    c, n = len(intensity.number), len(estimator.state)
    mean, cov = np.empty((c, len(returns), n)), np.empty((c, len(returns), n, n))
    close = np.isin(returns, [] if near is None else near.returns)
    if not close.all():
        alone = _by_the_filter(intensity.belief, c, estimator, sensor, detections, returns[~close])
        mean[:, ~close], cov[:, ~close] = alone.mean, alone.cov
    if near is not None:
        there = np.searchsorted(near.returns, returns[close])
        mean[:, close], cov[:, close] = near.given.mean[:, there], near.given.cov[:, there]
    return Gaussian(mean, cov)


def _by_the_filter(
    beliefs: Any, c: int, estimator: Estimator[Any], sensor: Sensor, detections: Detections, returns: Indices
) -> Gaussian:
    """Return the moments (c, j, n) of each of c beliefs given each of some returns (j,), as the filter has it."""
    j = len(returns)
    component, row = np.repeat(np.arange(c), j)[:, None], np.tile(returns, c)[:, None]
    noise, missing = (None if every is None else every[row] for every in (detections.noise, detections.missing))
    own = Detections(detections.z[row], np.ones(row.shape, dtype=bool), noise=noise, missing=missing)
    belief = take(beliefs, component, 0)
    seen = estimator.evaluate(belief, sensor, own, 1.0)  # the gate weighs a miss only
    after = estimator.moments(estimator.update(belief, seen, np.broadcast_to([0.0, 1.0], (len(row), 1, 2))))
    return Gaussian(after.mean.reshape(c, j, -1), after.cov.reshape(c, j, *after.cov.shape[-2:]))
