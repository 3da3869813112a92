"""A filter that takes every return, with a gate that only observes: how the paper's figures are made."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Estimator, Gaussian, Scan, Sensor
from vedette.filters import predicted


@frozen(eq=False)
class Watched:
    """The filter's output on `s` scans of one certain return each, in `r` runs.

    mean (r, s, n), cov (r, s, n, n); distance (r, s): squared distance of the return, the least over modes (union gate);
    nis (r, s): the same expected over modes; mode_prob (r, s, q) or None.
    """

    mean: Array
    cov: Array
    distance: Array
    nis: Array
    mode_prob: Array | None


def watch(estimator: Estimator[Any], sensor: Sensor, given: Gaussian, begin: float, scans: Iterable[Scan]) -> Watched:
    """Run on `scans` (r, 1, m) from the prior `given` (r, 1, n) at `begin` in s; every return is the target's."""
    rng = np.random.default_rng(0)
    belief = estimator.start(given, estimator.state, rng)
    means, covs, distances, nis, modes = [], [], [], [], []
    time = begin
    for scan in scans:
        belief = predicted(estimator, belief, scan.time - time, rng)
        time = scan.time
        innovation = estimator.evaluate(belief, sensor, scan.detections, 1.0)
        sure = np.zeros(innovation.loglik.shape)
        sure[..., 1] = 1.0
        belief = estimator.update(belief, innovation, sure)
        moments, prob = estimator.moments(belief), estimator.mode_prob(belief)
        means.append(moments.mean[:, 0])
        covs.append(moments.cov[:, 0])
        distances.append(innovation.distance[:, 0, 0])
        nis.append(innovation.nis[:, 0, 0])
        if prob is not None:
            modes.append(prob[:, 0])
    return Watched(
        np.stack(means, axis=1),
        np.stack(covs, axis=1),
        np.stack(distances, axis=1),
        np.stack(nis, axis=1),
        np.stack(modes, axis=1) if modes else None,
    )
