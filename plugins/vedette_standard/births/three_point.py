"""Tracks that start at the returns of three scans."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Indices, Sensor, fields, kernels
from vedette.hypotheses import firsts
from vedette_standard.births.following import Following, Waiting, none_follow, pairs


@frozen(eq=False)
class Chains:
    """The returns of the scan before, and positions and velocities (j, 2d) of those that follow another."""

    last: Waiting
    moving: Waiting

    def later(self, dt: float) -> Chains:
        """Return the same, `dt` longer ago."""
        return Chains(self.last.later(dt), self.moving.later(dt))


@final
@frozen(kw_only=True)  # what has no default stands after what has
class ThreePoint(Following):
    """Starts a track at a return that goes on as two of the scans before do: at speeds up to `max_speed`, nearly straight.

    The first two give position and velocity by two-point differencing. That is moved to the third, with the covariance
    (a dt^2 / 2)^2 of what an acceleration a = `max_acceleration` does to the position, and (a dt)^2 to the velocity; the
    return lies within `deviations` of it and updates it. None of the three belongs to a track; the likeliest counts. False
    returns start fewer tracks than by two scans, and real ones start a scan later.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.3.

    >>> from vedette import Detections
    >>> from vedette_standard import CartesianPosition, ConstantVelocity, Kalman
    >>> birth = ThreePoint(max_speed=18.0, max_acceleration=2.0, deviations=2.0, claimed=0.4, initial=0.3)
    >>> sensor, estimator, memory = CartesianPosition(3.0), Kalman(ConstantVelocity(0.1)), None
    >>> for seen, dt in ([[0.0, 0.0], [0.0, 900.0]], 2.0), ([[20.0, 0.0], [0.0, 880.0], [60.0, 0.0]], 3.0):
    ...     claimed = np.array([0.0, 0.4, 0.0][: len(seen)])
    ...     memory = birth.update(memory, estimator, sensor, Detections.of(seen), claimed, 1.0)
    ...     memory = birth.predict(memory, estimator, dt, None)
    >>> seen = Detections.of([[52.0, 0.0], [76.0, 0.0], [0.0, 850.0], [75.5, 0.0]])
    >>> new = birth.begin(memory, estimator, sensor, "radar", seen, np.zeros(4))
    >>> new.returns.tolist(), new.existence.tolist()  # predicted: 50 m, with 9 + 2 (3 4.5) + 9 4.5 + 9^2 m^2; S = 166.5
    ([0, 3], [0.3, 0.3])
    >>> np.allclose(new.prior.mean[:, ::2], np.array([50.0, 10.0]) + np.outer([2.0, 25.5], [157.5, 18.0]) / 166.5)
    True
    >>> after = np.array([[157.5, 18.0], [18.0, 40.5]]) - np.outer([157.5, 18.0], [157.5, 18.0]) / 166.5  # 40.5 = 4.5 + 6^2
    >>> np.allclose(new.prior.cov[0][::2, ::2], after), np.allclose(new.prior.cov[0][1::2, 1::2], after)
    (True, True)
    """

    kind: ClassVar[str] = "three_point"

    max_acceleration: float = fields.quantity("m/s^2", "what a target's acceleration may be", at_least=0)
    initial: float = fields.probability("probability that a new track is of a target", default=0.8, above=0)

    def followers(self, now: Gaussian, memory: Chains, limit: Array) -> tuple[Indices, Gaussian]:
        """Return which positions (k, d) go on as a chain does, and position and velocity (j, 2d) of these by all three."""
        d, a, ends = now.mean.shape[-1], self.max_acceleration, memory.moving.earlier
        if not len(ends.mean):
            return none_follow(d)
        dt = ends.ago[:, None]
        F = np.eye(2 * d) + dt[:, None] * np.diag(np.ones(d), d)
        mean = (F @ ends.mean[..., None])[..., 0]
        push = np.repeat(np.concatenate([0.5 * a * dt * dt, a * dt], axis=-1), d, axis=-1)
        cov = F @ ends.cov @ np.swapaxes(F, -1, -2) + np.eye(2 * d) * (push**2)[:, None]
        # Who goes on lies within the deviations on each axis, too.
        wide = np.max(now.cov, axis=0, initial=0.0) + cov[:, :d, :d]
        half = self.deviations * np.sqrt(np.einsum("...ii->...i", wide))
        chain, row = kernels.pairs_in_boxes(mean[:, :d] - half, mean[:, :d] + half, now.mean, (), len(mean) * len(now.mean))
        S, off = cov[chain, :d, :d] + now.cov[row], now.mean[row] - mean[chain, :d]
        distance = np.sum(off * np.linalg.solve(S, off[..., None])[..., 0], axis=-1)
        moved = np.linalg.norm(now.mean[row] - ends.mean[chain, :d], axis=-1)
        noise = np.sqrt(np.linalg.eigvalsh(now.cov[row] + ends.cov[chain, :d, :d])[..., -1])
        reached = moved <= limit[row] * ends.ago[chain] + self.deviations * noise
        within = np.flatnonzero((distance <= self.deviations**2) & reached)
        order = within[np.lexsort((distance[within] + np.linalg.slogdet(S[within])[1], row[within]))]
        best = order[firsts(row[order])]
        chain, near, S, off = chain[best], row[best], S[best], off[best]
        gain = cov[chain][..., :d] @ np.linalg.inv(S)
        after = mean[chain] + (gain @ off[..., None])[..., 0]
        rest = np.eye(2 * d) - np.concatenate([gain, np.zeros_like(gain)], axis=-1)
        left = rest @ cov[chain] @ np.swapaxes(rest, -1, -2) + gain @ now.cov[near] @ np.swapaxes(gain, -1, -2)
        left = 0.5 * (left + np.swapaxes(left, -1, -2))  # positive however long the gap before
        noise = np.sqrt(np.linalg.eigvalsh(left[:, d:, d:])[..., -1])
        slow = np.linalg.norm(after[:, d:], axis=-1) <= limit[near] + self.deviations * noise
        return near[slow], Gaussian(after[slow], left[slow])

    def remembered(self, memory: Chains | None, now: Waiting, sensor: Sensor, limit: Array) -> Chains:
        """Return this scan's returns, the chains that end there, and of those before what its sensor could not have seen."""
        before = now.of(slice(0)) if memory is None else memory.last
        near, moving = pairs(Gaussian(now.mean, now.cov), before.earlier, limit, self.deviations)
        ends = Waiting(moving.mean, moving.cov, now.ago[near], now.left[near])
        if memory is None:
            return Chains(now, ends)
        return Chains(before.outlasting(sensor).and_now(now), memory.moving.outlasting(sensor).and_now(ends))
