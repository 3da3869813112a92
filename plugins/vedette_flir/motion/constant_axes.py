"""A motion with additional noise-free axes."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Gaussian, MotionModel, Space, fields


def _zero_variance(self: Carrying) -> Space:
    own = self.motion.zero_variance
    return Space(own.axes + tuple(axis for axis in Space.of(**self.carries).axes if axis.name not in own))


def _state(self: Carrying) -> Space:
    if taken := [name for name in self.carries if name in self.motion.state]:
        raise ValueError(f"carries.{taken[0]}: the motion {self.motion.kind!r} has this axis already: {self.motion.state}")
    return Space(self.motion.state.axes + Space.of(**self.carries).axes)


@final
@frozen
class Carrying(MotionModel):
    """Another motion with added axes that stay constant until a sensor learns them: the target's appearance in an image.

    F = [F_motion 0; 0 I], Q = [Q_motion 0; 0 0].

    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> inner, T = ImageVelocity(sigma_accel=30.0, shake=4.0), 0.5
    >>> model = Carrying(inner, {"amplitude": "count", "width": "px"})
    >>> x = np.array([100.0, 50.0, 6.0, -4.0, 40.0, 7.0])
    >>> model.move(x, T).tolist(), model.state.names[4:], model.zero_variance.names
    ([103.0, 48.0, 6.0, -4.0, 40.0, 7.0], ('amplitude', 'width'), ('amplitude', 'width'))
    >>> F, Q = np.eye(6), np.zeros((6, 6))
    >>> F[:4, :4], Q[:4, :4] = inner.jacobian(x[:4], T), inner.noise(x[:4], T)
    >>> np.allclose(model.jacobian(x, T), F), np.allclose(model.noise(x, T), Q), model.linear, model.divisible
    (True, True, True, True)
    """

    kind: ClassVar[str] = "carrying"

    motion: MotionModel = fields.part("how the target moves")
    carries: dict[str, str] = fields.names('axis to its unit, as in amplitude = "count"')
    state: Space = field(init=False, repr=False, eq=False, default=Factory(_state, takes_self=True))
    zero_variance: Space = field(init=False, repr=False, eq=False, default=Factory(_zero_variance, takes_self=True))

    @property
    def divisible(self) -> bool:
        return self.motion.divisible

    @property
    def linear(self) -> bool:
        return self.motion.linear

    @property
    def reframes(self) -> bool:
        return self.motion.reframes

    def _wide(self, own: Array, rest: float) -> Array:
        """Put the motion's own matrix in the corner, and `rest` on the remaining diagonal."""
        n, size = len(self.motion.state), len(self.state)
        whole = np.zeros((*own.shape[:-2], size, size))
        whole[..., :n, :n] = own
        whole[..., range(n, size), range(n, size)] = rest
        return whole

    def move(self, x: Array, dt: float) -> Array:
        """Move the motion's axes, keep the others: (*b, n) -> (*b, n)."""
        n = len(self.motion.state)
        return np.concatenate([self.motion.move(x[..., :n], dt), x[..., n:]], axis=-1)

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F: (*b, n) -> (*b, n, n) or (n, n)."""
        return self._wide(self.motion.jacobian(x[..., : len(self.motion.state)], dt), 1.0)

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q: (*b, n) -> (*b, n, n) or (n, n)."""
        return self._wide(self.motion.noise(x[..., : len(self.motion.state)], dt), 0.0)

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        """Return the mean of Q over a belief: (*b, n), (*b, n, n) -> (*b, n, n) or (n, n)."""
        n = len(self.motion.state)
        return self._wide(self.motion.mean_noise(x[..., :n], cov[..., :n, :n], dt), 0.0)

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        """Return the motion's part in its new frame, the rest as it was."""
        n = len(self.motion.state)
        inner, whole = (Gaussian(part.mean[..., :n], part.cov[..., :n, :n]) for part in (own, combined))
        turned = self.motion.reframe(inner, whole)
        mean = np.concatenate([turned.mean, own.mean[..., n:]], axis=-1)
        return Gaussian(mean, self._wide(turned.cov, 0.0))
