"""The common part of motion models of an image plane: the same processes along both axes, in pixels."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import ClassVar

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space


def both_axes(block: Array) -> Array:
    """Map a matrix (p, p) over one axis' processes to (2p, 2p) over both axes, each process' column and row adjacent."""
    p = len(block)
    both = np.zeros((p, 2, p, 2))
    both[:, 0, :, 0] = both[:, 1, :, 1] = block
    return both.reshape(2 * p, 2 * p)


def apart(*blocks: Array) -> Array:
    """Return the block-diagonal matrix of independent processes."""
    size = sum(len(block) for block in blocks)
    whole, at = np.zeros((size, size)), 0
    for block in blocks:
        whole[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return whole


def fading(tau: float, sigma: float, dt: float) -> tuple[Array, Array]:
    """Return exact F and Q, (1, 1) each, of a first-order Gauss-Markov process of stationary standard deviation `sigma`."""
    return np.array([[math.exp(-dt / tau)]]), np.array([[-(sigma**2) * math.expm1(-2.0 * dt / tau)]])


@frozen
class ImagePlane(MotionModel):
    """A linear model of one axis of the image, repeated for the other."""

    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True
    space: ClassVar[Space]

    @property
    def state(self) -> Space:
        return self.space

    @abstractmethod
    def one_axis(self, dt: float) -> tuple[Array, Array]:
        """Return F and Q (p, p) of one axis."""

    def move(self, x: Array, dt: float) -> Array:
        """Return F x: (*b, n) -> (*b, n)."""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F (n, n)."""
        return both_axes(self.one_axis(dt)[0])

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q (n, n)."""
        return both_axes(self.one_axis(dt)[1])
