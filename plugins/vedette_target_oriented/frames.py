"""Conversions between the paper's frame and Cartesian axes."""

from __future__ import annotations

import numpy as np

from vedette import Array, Gaussian, Space
from vedette_target_oriented.resets import STATE, basis

_PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


def in_frame(prior: Gaussian, last: Array) -> Gaussian:
    """Convert a prior over x, y, vx, vy (*b, 4) to the frame along its velocity (*b, 7); `last` (*b, 2): last position."""
    heading = np.arctan2(prior.mean[..., 3], prior.mean[..., 2])
    turn = np.zeros((*heading.shape, 4, 4))
    turn[..., range(2), range(2)] = 1.0
    turn[..., 2:, 2:] = np.swapaxes(basis(heading), -1, -2)
    mean, cov = np.zeros((*heading.shape, 7)), np.zeros((*heading.shape, 7, 7))
    mean[..., :4] = (turn @ prior.mean[..., None])[..., 0]
    mean[..., 4], mean[..., 5:7] = heading, last
    cov[..., :4, :4] = turn @ prior.cov @ np.swapaxes(turn, -1, -2)
    return Gaussian(mean, cov)


def cartesian(space: Space, estimate: Gaussian) -> Gaussian:
    """Convert an estimate over `space` to x, y, vx, vy: the axes themselves, or those of the paper's frame turned back."""
    if "heading" not in space:
        axes = space.locate(_PLANE)
        return Gaussian(estimate.mean[..., axes], estimate.cov[..., axes, :][..., axes])
    own = space.locate(STATE)
    mean, cov = estimate.mean[..., own], estimate.cov[..., own[:4], :][..., own[:4]]
    turn = np.zeros((*mean.shape[:-1], 4, 4))
    turn[..., range(2), range(2)] = 1.0
    turn[..., 2:, 2:] = basis(mean[..., 4])
    return Gaussian((turn @ mean[..., :4, None])[..., 0], turn @ cov @ np.swapaxes(turn, -1, -2))
