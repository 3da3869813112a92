"""Laws for states with an angle and for frames that turn, tried with motions of the kit's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, TypeVar, final

import attrs
import numpy as np
from attrs import frozen

from vedette import fields
from vedette.filters import predicted, unforwarded
from vedette.roles import Component, Estimator, MotionModel
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, closed_by, closed_if, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, not_refused, soft
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.sensors import Watch
from vedette.types import Detections, Gaussian

C = TypeVar("C", bound=Component)
HEADING, STATE = Space.of(heading="rad mod 2pi"), Space.of(heading="rad mod 2pi", rate="rad/s")
PLACE = Space.of(x="m")
MARKED = Space.of(x="m", vx="m/s", mark="m")
TURNED = np.array([2.0, 0.0])
"""How far the second scene is turned: the first lies on the wrap, the second does not."""


class Shift(MotionModel):
    """A motion x' = F x, not wrapped: that is the estimator's to do."""

    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    def move(self, x: Array, dt: float) -> Array:
        return x @ self.jacobian(x, dt).T


@final
@frozen
class Spin(Shift):
    """A heading that turns at a rate, under white noise of the rate's derivative."""

    kind: ClassVar[str] = "kit_spin"
    state: ClassVar[Space] = STATE

    density: float = fields.quantity("rad^2/s^3", "spectral density of the noise", above=0)

    def jacobian(self, x: Array, dt: float) -> Array:
        return np.array([[1.0, dt], [0.0, 1.0]])

    def noise(self, x: Array, dt: float) -> Array:
        return self.density * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


@final
@frozen
class Marked(Shift):
    """A position that drifts, and a mark without variance that `reframe` sets to the combined position."""

    kind: ClassVar[str] = "kit_marked"
    reframes: ClassVar[bool] = True
    state: ClassVar[Space] = MARKED
    zero_variance: ClassVar[Space] = Space.of(mark="m")

    density: float = fields.quantity("m^2/s^3", "spectral density of the noise", above=0)

    def jacobian(self, x: Array, dt: float) -> Array:
        return np.array([[1.0, dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])

    def noise(self, x: Array, dt: float) -> Array:
        return self.density * np.array([[dt**3 / 3, dt**2 / 2, 0.0], [dt**2 / 2, dt, 0.0], [0.0, 0.0, 0.0]])

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        return Gaussian(np.concatenate([own.mean[..., :2], combined.mean[..., :1]], axis=-1), own.cov)


@final
@frozen
class Gusts(MotionModel):
    """A place that jumps, by much more in one half of the plane than in the other."""

    kind: ClassVar[str] = "kit_gusts"
    state: ClassVar[Space] = PLACE

    density: float = fields.quantity("m^2/s", "variance gained in 1 us at 0", above=0)

    def move(self, x: Array, dt: float) -> Array:
        return x

    def noise(self, x: Array, dt: float) -> Array:
        return 1e6 * self.density * dt * (1.0 + 0.9 * np.tanh(2.0 * x[..., None]))


def _over(make: Callable[[float], MotionModel], value: Any, count: list[int]) -> Any:
    """Return a component or a tuple of some with each of its motions replaced by the kit's, none like another."""
    if isinstance(value, MotionModel):
        count.append(len(count))
        return make(0.01 * 4.0 ** count[-1])
    if isinstance(value, tuple):
        return tuple(_over(make, each, count) for each in value)
    return _remade(make, value, count) if isinstance(value, Component) else value


def _remade(make: Callable[[float], MotionModel], component: Any, count: list[int]) -> Any:
    names = [field.name for field in attrs.fields(type(component)) if field.init]
    return type(component)(**{name: _over(make, getattr(component, name), count) for name in names})


def over_the_kits(make: Callable[[float], MotionModel], component: C) -> C:
    """Return an estimator or a motion around the kit's motions; Closed if it holds none, or they do not go together."""
    count: list[int] = []
    with closed_by((ValueError, NotImplementedError), "it does not go with the kit's motion: {}"):
        remade: C = _remade(make, component, count)
    closed_if(not count, "it holds no motion that could be replaced by the kit's")
    return remade


def frames_within_turn(model: MotionModel, drawn: Moves) -> None:
    """If it holds a motion: one that reframes does so within it, or is refused."""
    remade = over_the_kits(Marked, model)
    reason = unforwarded(remade)
    demand(not reason, f"reframes: {reason}")
    if not remade.reframes or any(name not in remade.state for name in MARKED.names):
        raise Closed("its state is not that of what it holds")
    rng, n = np.random.default_rng(drawn.seed), len(remade.state)
    own, combined = (Gaussian(frozen_copy(rng.uniform(-1.0, 1.0, (3, n))), np.zeros((3, n, n))) for _ in range(2))
    mark, x = remade.state.names.index("mark"), remade.state.names.index("x")
    same("reframe: the mark", remade.reframe(own, combined).mean[:, mark], combined.mean[:, x], 1e-9, 1.0)


def a_frame_turns_before_each_prediction(estimator: Estimator[Any], drawn: Scene) -> None:
    """On a motion that reframes: it has the belief from before the prediction, in whatever it is wrapped."""
    remade = over_the_kits(Marked, estimator)
    closed_if(remade.state != MARKED, "its state is not that of its motion")
    reason = unforwarded(remade)
    demand(not reason, f"traits: {reason}")
    rng = drawn.rng()
    sensor = Watch(Space.of(x="m"), np.array([[0.5]]), 0.8)
    not_refused(remade, sensor)
    cov = np.broadcast_to(np.diag([1.0, 0.1, 0.0]), (2, 2, 3, 3))
    belief = remade.start(Gaussian(frozen_copy(rng.uniform(-1.0, 1.0, (2, 2, 3))), frozen_copy(cov)), MARKED, rng)
    for k in range(3):
        before = remade.moments(belief).mean[..., 0]
        belief = predicted(remade, belief, drawn.dt, rng)
        same("reframe: the mark that the motion sets", remade.moments(belief).mean[..., 2], before, 1e-7, 1.0)
        scan = Detections(frozen_copy(rng.uniform(-2.0, 2.0, (2, 3, 1))), np.ones((2, 3), dtype=bool))
        innovation = remade.evaluate(belief, sensor, scan, P_GATE)
        belief = remade.update(belief, innovation, frozen_copy(soft(innovation.loglik, drawn.seed + k)))


def an_angle_has_no_seam(estimator: Estimator[Any], drawn: Scene) -> None:
    """On a motion with a heading that wraps: turn the belief and the returns, and the answer turns with them.

    What is estimated lies within the period, in [-pi, pi).
    """
    spins = over_the_kits(Spin, estimator)
    closed_if(spins.state != STATE, "its state is not that of its motion")
    rng = drawn.rng()
    sensor = Watch(HEADING, np.array([[0.02]]), 0.8)
    not_refused(spins, sensor)
    mean = np.stack([np.pi + rng.uniform(-0.2, 0.2, (2, 2)), rng.uniform(-0.1, 0.1, (2, 2))], axis=-1)
    z = [np.pi + rng.uniform(-0.6, 0.6, (2, 3, 1)) for _ in range(3)]
    cov = np.broadcast_to(np.diag([0.1, 0.01]), (2, 2, 2, 2))
    answers = [_answers(spins, drawn, sensor, mean + by, cov, [each + by[:1] for each in z]) for by in (0 * TURNED, TURNED)]
    for (name, one), (_, other) in zip(*answers, strict=True):
        if isinstance(one, Gaussian):
            same(f"mean {name}, within its period", one.mean, STATE.canonical(one.mean), 0.0)
            same(f"mean {name} turned", STATE.difference(other.mean, one.mean + TURNED), np.zeros(one.mean.shape), 1e-7, 1.0)
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


LAWS = (Law(an_angle_has_no_seam), Law(a_frame_turns_before_each_prediction))
