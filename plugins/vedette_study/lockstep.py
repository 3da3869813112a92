"""Many runs of one tracker at once: every array gains a leading run axis, the loop is over scans alone."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Scan, Space, Tracker
from vedette_study.seeds import RunSeeds


@frozen(eq=False)
class Runs:
    """The estimates of a single-target tracker after `s` scans in each of its runs `*b`.

    times (s,) in s, mean (*b, s, n), cov (*b, s, n, n) over `space`, mode_prob (*b, s, r) or None; nis and hit (*b, s): the
    squared distance weighted over the scan's returns, and the weight of having been detected.
    """

    space: Space
    times: Array
    mean: Array
    cov: Array
    mode_prob: Array | None
    nis: Array
    hit: Array


def run_together(tracker: Tracker, given: Gaussian, begin: float, scans: Iterable[Scan], seed: int | RunSeeds = 0) -> Runs:
    """Track one target in every run: prior `given` (*b, 1, n) at `begin` in s, scans whose detections lead with `*b`.

    The tracker's lifecycle must keep its tracks, as 'single_target' does. Equal to each run alone to 1e-12.
    """
    state = tracker.start(given, begin, seed)
    times, means, covs, modes, nis, hit = [], [], [], [], [], []
    for scan in scans:
        state = tracker.step(state, scan)
        estimate = tracker.estimate(state)
        prob = tracker.estimator.mode_prob(state.belief)
        times.append(scan.time)
        means.append(estimate.mean[..., 0, :])
        covs.append(estimate.cov[..., 0, :, :])
        nis.append(state.nis[..., 0])
        hit.append(state.hit[..., 0])
        if prob is not None:
            modes.append(prob[..., 0, :])
    axis = given.mean.ndim - 2
    return Runs(
        space=tracker.state,
        times=np.array(times),
        mean=np.stack(means, axis),
        cov=np.stack(covs, axis),
        mode_prob=np.stack(modes, axis) if modes else None,
        nis=np.stack(nis, axis),
        hit=np.stack(hit, axis),
    )
