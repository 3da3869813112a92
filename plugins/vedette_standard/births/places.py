"""Where targets appear, as sums of Gaussians."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Space, fields


@final
@frozen
class Appearance:
    """Targets that appear around a state: how many there are before the first scan, and how many more come."""

    at: dict[str, tuple[float, float]] = fields.table("state axis to [mean, standard deviation]", pairs=True)
    initial: float = fields.quantity("1", "expected number before the first scan", default=0.0, at_least=0)
    rate: float = fields.quantity("1/s", "expected number that appear per second", default=0.0, at_least=0)

    def gaussians(self, state: Space) -> Gaussian:
        """Return mean (1, n) and covariance (1, n, n); ValueError if an axis is not stated."""
        if lacking := [name for name in state.names if name not in self.at]:
            raise ValueError(f"at: must state [mean, standard deviation] of {', '.join(map(repr, lacking))}")
        mean, deviation = np.array([self.at[name] for name in state.names]).T
        return Gaussian(state.canonical(mean[None]), np.diag(deviation**2)[None])


def present(dt: float, lifetime: float) -> float:
    """Return how many are there after dt s, if one a second has come and each stays for a mean `lifetime`, in s."""
    return -lifetime * math.expm1(-dt / lifetime)


@final
@frozen
class Edge:
    """Targets that come in across a line in the plane, evenly along it, to its left as seen from `start`.

    It is a row of `parts` Gaussians, each as wide as half their distance, whose sum is even to 2 %, and of the standard
    deviation `width` across the line. The velocity is at right angles to it, `speed` with a standard deviation that holds
    along the line, too.
    """

    start: Array = fields.pair("m", "x and y of one end")
    end: Array = fields.pair("m", "x and y of the other end")
    width: float = fields.quantity("m", "standard deviation of the position across the line", above=0)
    speed: Array = fields.pair("m/s", "mean and standard deviation of the speed", of="mean, standard deviation")
    parts: int = fields.integer("number of Gaussians along the line", default=8, at_least=1)
    others: dict[str, tuple[float, float]] = fields.table("further state axis to [mean, standard deviation]", pairs=True)
    initial: float = fields.quantity("1", "expected number before the first scan", default=0.0, at_least=0)
    rate: float = fields.quantity("1/s", "expected number that come in per second", default=0.0, at_least=0)

    def __attrs_post_init__(self) -> None:
        if np.array_equal(self.start, self.end):
            raise ValueError("end: must differ from start")

    def gaussians(self, state: Space) -> Gaussian:
        """Return means (p, n) and covariances (p, n, n); ValueError if an axis is not stated."""
        line = np.subtract(self.end, self.start)
        length = float(np.hypot(*line))
        along = line / length
        across = np.array([-along[1], along[0]])
        step = length / self.parts
        axes = ("x", "y", "vx", "vy")
        if lacking := [name for name in state.names if name not in axes and name not in self.others]:
            raise ValueError(f"others: must state [mean, standard deviation] of {', '.join(map(repr, lacking))}")
        mean, cov = np.zeros((self.parts, len(state))), np.zeros((self.parts, len(state), len(state)))
        for i, name in enumerate(state.names):
            if name in self.others:
                mean[:, i], cov[:, i, i] = self.others[name][0], self.others[name][1] ** 2
        position = [state.names.index(name) for name in axes[:2]]
        mean[:, position] = np.add(self.start, (np.arange(self.parts) + 0.5)[:, None] * step * along)
        spread = (0.5 * step) ** 2 * np.outer(along, along) + self.width**2 * np.outer(across, across)
        cov[:, np.array(position)[:, None], position] = spread
        if "vx" in state:
            velocity = [state.names.index(name) for name in axes[2:]]
            mean[:, velocity] = self.speed[0] * across
            cov[:, np.array(velocity)[:, None], velocity] = self.speed[1] ** 2 * np.eye(2)
        return Gaussian(state.canonical(mean), cov)
