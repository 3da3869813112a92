"""Wide Gaussians given a return: linearised where the two agree, not at the Gaussian's mean."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Gaussian, Indices, Sensor, Space, kernels
from vedette.filters import embedded


@final
@frozen(eq=False)
class AtReturns:
    """What returns (j,) say of Gaussians (c,): log(P_D N(z; c)) (c, j), and each Gaussian's moments given each (c, j, n)."""

    returns: Indices
    loglik: Array
    given: Gaussian


def at_returns(prior: Gaussian, state: Space, sensor: Sensor, detections: Detections) -> AtReturns | None:
    """Return what each complete return says of Gaussians (c, n); None if the filter's own way is exact, or the only one.

    With x the mean of the Gaussian given what `Sensor.invert` says of the return, z = h(x) + H (s - x) + v of the state s:
    a Gauss-Newton step from there. A filter linearises at the Gaussian's mean, which a radar in its midst sees in no
    direction; and takes P_D there, which a return beyond the edge of a view does not have.
    """
    returns, own = np.flatnonzero(detections.complete), state.locate(sensor.observes)
    if not len(returns) or (sensor.linear and np.ndim(sensor.detects(prior.mean[:, own])) == 0):
        return None  # P_D is one number
    z, noise = detections.z[returns], detections.noise_of(returns)
    try:
        spot = sensor.invert(z, noise)
    except NotImplementedError:
        return None
    if sensor.linear and np.ptp(sensor.detects(np.concatenate([prior.mean[:, own], spot.mean]))) == 0:
        return None
    mean, cov = prior.mean[:, None, own], prior.cov[:, None, own][..., own]
    share = np.swapaxes(np.linalg.solve(cov + spot.cov, np.broadcast_to(cov, (*cov.shape[:1], *spot.cov.shape))), -1, -2)
    x = mean + (share @ sensor.observes.difference(spot.mean, mean)[..., None])[..., 0]
    c, j, m = len(prior.mean), *z.shape
    H = np.broadcast_to(sensor.jacobian(x), (c, j, m, len(own)))
    # Of the line, nothing wraps: else a bearing of its tangent, many turns away from a Gaussian far aside, may fit again.
    line, off = (H @ (mean - x)[..., None])[..., 0], sensor.measurement.difference(z, sensor.measure(x))
    R, detects = np.broadcast_to(sensor.noise(x) if noise is None else noise, (c, j, m, m)), sensor.detects(x)
    seen = kernels.evaluate_returns(  # each pair as a run with a track and a return
        np.repeat(prior.cov, j, axis=0)[:, None],
        off.reshape(-1, 1, m),
        line.reshape(-1, 1, m),
        embedded(H, own, len(state)).reshape(-1, 1, m, len(state)),
        R.reshape(-1, 1, 1, m, m),
        np.broadcast_to(detects, (c, j)).reshape(-1, 1),
        1.0,
        (),
    )
    loglik, shift, post = seen.loglik[:, 0, 1], seen.detail.shift, seen.detail.post
    after = Gaussian(prior.mean[:, None] + shift.reshape(c, j, -1), post.reshape(c, j, len(state), len(state)))
    return AtReturns(returns, loglik.reshape(c, j), after)
