"""Evaluation of a camera's frame, taken as one detection for each track."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette import kernels
from vedette.filters.detections import make_innovation
from vedette.filters.memo import embedded
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.supporting import ImagingSensor
from vedette.types import Frame, Gaussian, Hypotheses, Innovation

FURTHER = 10
"""Passes beyond those of the update, where these have not found the target."""


def evaluate_frame(
    belief: Gaussian, state: Space, sensor: Sensor, frame: Frame, p_gate: float, passes: int = 1
) -> Innovation:
    """Return the innovation of a frame and each track, as one detection, linearised again in each of up to `passes` passes.

    With p = H x the apparent position, S = H P H', e how far the point of linearisation is from the expected one, and
    q = g + J e: x+ = x- + P H' (I + J S)^-1 q, P+ in Joseph's form with the gain K = P H' (I + J S)^-1 J. No inverse of J is
    taken, so a frame without information (J = 0) leaves the belief as it is, and its detection probability is 0: where all
    pixels are unknown, or beside the image, the target cannot be seen. The squared distance is that of the sufficient
    statistic J^-1 q, whose covariance is J^-1 + S: it has as many degrees of freedom as there are apparent axes, not pixels.
    Passes end when no track's point moves.

    The evidence is that of the last linearisation. If it speaks against the target, the passes may have begun far from the
    target and not have reached it. Then further passes follow, and the largest value of Laplace's formula counts:
    llr(x+) - (x+ - x-)' P^-1 (x+ - x-) / 2 - log |I + J S| / 2.
    """
    assert isinstance(sensor, ImagingSensor)
    where = state.locate(sensor.observes)
    x, m = belief.mean[..., where], len(sensor.measurement)
    slope = sensor.jacobian(x)
    H = embedded(slope, where, len(state))
    cross = belief.cov @ np.swapaxes(H, -1, -2)
    S = H @ cross
    expected = sensor.measure(x)
    at = sensor.seek(x, belief.cov[..., where, :][..., where], frame)
    for _ in range(passes):
        J, g, llr = sensor.information(x, frame, at)
        e = sensor.measurement.difference(sensor.measure(at), expected)
        Je = _times(J, e)
        q = g + Je
        shrink = np.linalg.inv(np.eye(m) + J @ S)
        pull = _times(shrink, q)
        shift = _times(cross, pull)
        before, at = at, state.displace(belief.mean, shift)[..., where]
        if np.array_equal(at, before):
            break
    log_det = np.linalg.slogdet(np.eye(m) + J @ S)[1]
    loglik = llr - np.sum((g + 0.5 * Je) * e, axis=-1) + 0.5 * np.sum(_times(S, pull) * q, axis=-1)
    likely = loglik - 0.5 * log_det
    if p_gate < 1 and np.any(likely < 0.0):
        arrived = _arrived(
            sensor, frame, x, at, pull, S, lambda step: state.displace(belief.mean, _times(cross, step))[..., where]
        )
        likely = np.where(likely < 0.0, np.maximum(likely, arrived), likely)
    distance = np.sum(_times(np.linalg.pinv(J, hermitian=True), q) * pull, axis=-1)
    gain = cross @ shrink
    keep = np.eye(len(state)) - gain @ J @ H
    post = keep @ belief.cov @ np.swapaxes(keep, -1, -2) + gain @ J @ np.swapaxes(gain, -1, -2)
    shift[..., where] += sensor.learn(at, frame) - at
    log_volume = 0.5 * (log_det - kernels.safe_log(np.linalg.det(J)))
    detail = Hypotheses(shift[..., None, :], kernels.symmetric(post)[..., None, :, :])
    in_view = np.any(J != 0, axis=(-1, -2))
    return make_innovation(sensor, x, p_gate, likely[..., None], distance[..., None], log_volume[..., None], detail, in_view)


def _arrived(
    sensor: ImagingSensor, frame: Frame, x: Array, at: Array, pull: Array, S: Array, displaced: Callable[[Array], Array]
) -> Array:
    """Return the largest evidence (*b, t) of further passes from `at`, which `pull` led to; -inf where none counts.

    Those count where the image speaks for the target and still shows it: llr > 0, and the information is a quarter of the
    largest or more.
    """
    best, most = np.full(at.shape[:-1], -np.inf), np.zeros(at.shape[:-1])
    expected, unit = sensor.measure(x), np.eye(S.shape[-1])
    for _ in range(FURTHER):
        J, g, llr = sensor.information(x, frame, at)
        known = np.trace(J, axis1=-2, axis2=-1)
        most = np.maximum(most, known)
        evidence = llr - 0.5 * np.sum(_times(S, pull) * pull, axis=-1) - 0.5 * np.linalg.slogdet(unit + J @ S)[1]
        best = np.where((llr > 0.0) & (known >= 0.25 * most), np.maximum(best, evidence), best)
        pull = _times(
            np.linalg.inv(unit + J @ S), g + _times(J, sensor.measurement.difference(sensor.measure(at), expected))
        )
        at = displaced(pull)
    return best


def _times(matrix: Array, vector: Array) -> Array:
    """Multiply (*b, p, q) by (*b, q): (*b, p)."""
    return (matrix @ vector[..., None])[..., 0]
