"""Evaluation of a camera's frame, taken as one detection for each track."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.filters.detections import make_innovation
from vedette.filters.gaussian import Hypotheses
from vedette.filters.memo import embedded
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.supporting import ImagingSensor
from vedette.types import Frame, Gaussian, Innovation


def evaluate_frame(
    belief: Gaussian, state: Space, sensor: Sensor, frame: Frame, p_gate: float, passes: int = 1, least: float = 0.0
) -> Innovation:
    """Return the innovation of a frame and each track, as one detection, linearised again in each of up to `passes` passes.

    With p = H x the apparent position, S = H P H', e how far the point of linearisation is from the expected one, and
    q = g + J e: x+ = x- + P H' (I + J S)^-1 q, P+ in Joseph's form with the gain K = P H' (I + J S)^-1 J. No inverse of J is
    taken, so a frame without information (J = 0) leaves the belief as it is, and its detection probability is 0: where all
    pixels are unknown, or beside the image, the target cannot be seen. The squared distance is that of the sufficient
    statistic J^-1 q, whose covariance is J^-1 + S: it has as many degrees of freedom as there are apparent axes, not pixels.
    Passes end when no track's point moves by more than `least` standard deviations of the update.

    The evidence is that of the last linearisation. Where it speaks against the target, because the passes began far from it
    and have not arrived, Laplace's at x+ counts: llr(x+) - (x+ - x-)' P^-1 (x+ - x-) / 2 - log |I + J S| / 2.
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
        if np.max(np.abs(at - before), initial=0.0) <= least:
            break
    loglik = llr - np.sum((g + 0.5 * Je) * e, axis=-1) + 0.5 * np.sum(_times(S, pull) * q, axis=-1)
    if np.any(loglik < 0.0):
        loglik = np.where(loglik < 0.0, np.maximum(loglik, _arrived(sensor, x, frame, at, J, S, pull)), loglik)
    log_det = np.linalg.slogdet(np.eye(m) + J @ S)[1]
    distance = np.sum(_times(np.linalg.pinv(J, hermitian=True), q) * pull, axis=-1)
    gain = cross @ shrink
    keep = np.eye(len(state)) - gain @ J @ H
    post = keep @ belief.cov @ np.swapaxes(keep, -1, -2) + gain @ J @ np.swapaxes(gain, -1, -2)
    shift[..., where] += sensor.learn(at, frame) - at
    log_volume = 0.5 * (log_det - kernels.safe_log(np.linalg.det(J)))
    detail = Hypotheses(shift[..., None, :], kernels.symmetric(post)[..., None, :, :])
    likely = (loglik - 0.5 * log_det)[..., None]
    in_view = np.any(J != 0, axis=(-1, -2))
    return make_innovation(sensor, x, p_gate, likely, distance[..., None], log_volume[..., None], detail, in_view)


def _arrived(sensor: ImagingSensor, x: Array, frame: Frame, at: Array, J: Array, S: Array, pull: Array) -> Array:
    """Return llr(x+) - (x+ - x-)' P^-1 (x+ - x-) / 2 (*b, t); -inf where the image at x+ does not speak for the target.

    That is so where llr(x+) <= 0, and where x+ has left what the frame shows: the information there is under a quarter.
    """
    J_end, _, llr = sensor.information(x, frame, at)
    known, before = (np.trace(matrix, axis1=-2, axis2=-1) for matrix in (J_end, J))
    return np.where((llr > 0.0) & (known > 0.25 * before), llr - 0.5 * np.sum(_times(S, pull) * pull, axis=-1), -np.inf)


def _times(matrix: Array, vector: Array) -> Array:
    """Multiply (*b, p, q) by (*b, q): (*b, p)."""
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product
