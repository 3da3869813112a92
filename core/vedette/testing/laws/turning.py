"""The law of estimators for states with an angle, tried with a motion of the kit's own."""

from __future__ import annotations

from typing import Any, ClassVar, final

import attrs
import numpy as np
from attrs import frozen

from vedette import fields
from vedette.filters import predicted
from vedette.roles import Component, Estimator, MotionModel
from vedette.space import Array, Space
from vedette.testing.judging import Closed, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.scene import P_GATE, Scene, soft
from vedette.testing.watch import Watch
from vedette.types import Detections, Gaussian

HEADING, STATE = Space.of(heading="rad mod 2pi"), Space.of(heading="rad mod 2pi", rate="rad/s")
TURNED = np.array([2.0, 0.0])
"""How far the second scene is turned: the first lies on the wrap, the second does not."""


@final
@frozen
class Spin(MotionModel):
    """A heading that turns at a rate, under white noise of the rate's derivative."""

    kind: ClassVar[str] = "kit_spin"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    density: float = fields.quantity("rad^2/s^3", "spectral density of the noise", above=0)

    @property
    def state(self) -> Space:
        return STATE

    def move(self, x: Array, dt: float) -> Array:
        return x @ self.jacobian(x, dt).T  # not wrapped: that is the estimator's to do

    def jacobian(self, x: Array, dt: float) -> Array:
        return np.array([[1.0, dt], [0.0, 1.0]])

    def noise(self, x: Array, dt: float) -> Array:
        return self.density * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


def _spinning(value: Any, count: list[int]) -> Any:
    """Return a component or a tuple of some with each of its motions replaced by a `Spin`, none like another."""
    if isinstance(value, MotionModel):
        count.append(len(count))
        return Spin(0.01 * 4.0 ** count[-1])
    if isinstance(value, tuple):
        return tuple(_spinning(each, count) for each in value)
    if not isinstance(value, Component):
        return value
    cls: Any = type(value)
    names = [field.name for field in attrs.fields(cls) if field.init]
    return cls(**{name: _spinning(getattr(value, name), count) for name in names})


def an_angle_has_no_seam(estimator: Estimator[Any], drawn: Scene) -> None:
    """On a motion with a heading that wraps: turn the belief and the returns, and the answer turns with them.

    What is estimated lies within the period, in [-pi, pi).
    """
    count: list[int] = []
    try:
        spins = _spinning(estimator, count)
    except (ValueError, NotImplementedError) as refusal:
        raise Closed(f"it does not go with a heading: {refusal}") from None
    if not count or spins.state != STATE:
        raise Closed("it holds no motion that could be replaced by the kit's")
    rng = drawn.rng()
    sensor = Watch(HEADING, np.array([[0.02]]), 0.8)
    if (reason := spins.refuses(sensor)) is not None:
        raise Closed(f"it refuses the kit's linear sensor: {reason}")
    mean = np.stack([np.pi + rng.uniform(-0.2, 0.2, (2, 2)), rng.uniform(-0.1, 0.1, (2, 2))], axis=-1)
    z = [np.pi + rng.uniform(-0.6, 0.6, (2, 3, 1)) for _ in range(3)]
    cov = np.broadcast_to(np.diag([0.1, 0.01]), (2, 2, 2, 2))
    answers = [_answers(spins, drawn, sensor, mean + by, cov, [each + by[:1] for each in z]) for by in (0 * TURNED, TURNED)]
    for (name, one), (_, other) in zip(*answers, strict=True):
        if isinstance(one, Gaussian):
            same(f"mean {name}, within its period", one.mean, STATE.canonical(one.mean), 0.0)
            same(
                f"mean {name}, turned", STATE.difference(other.mean, one.mean + TURNED), np.zeros(one.mean.shape), 1e-7, 1.0
            )
            same(f"cov {name}, turned", other.cov, one.cov, 1e-7, 1.0)
        else:
            same(f"{name}, turned", other, one, 1e-7, 1.0)


def _answers(
    estimator: Estimator[Any], drawn: Scene, sensor: Watch, mean: Array, cov: Array, z: list[Array]
) -> list[tuple[str, Any]]:
    """What an estimator says along three scans, by name."""
    rng = drawn.rng()
    belief = estimator.start(Gaussian(frozen_copy(STATE.canonical(mean)), frozen_copy(cov)), STATE, rng)
    found: list[tuple[str, Any]] = [("at the start", estimator.moments(belief))]
    for k, each in enumerate(z):
        belief = predicted(estimator, belief, drawn.dt, rng)
        scan = Detections(frozen_copy(HEADING.canonical(each)), np.ones(each.shape[:-1], dtype=bool))
        innovation = estimator.evaluate(belief, sensor, scan, P_GATE)
        found += [(f"predicted to scan {k + 1}", estimator.moments(belief)), ("loglik", innovation.loglik)]
        belief = estimator.update(belief, innovation, frozen_copy(soft(innovation.loglik, drawn.seed + k)))
        found.append((f"after scan {k + 1}", estimator.moments(belief)))
    return found


LAWS = (Law(an_angle_has_no_seam),)
