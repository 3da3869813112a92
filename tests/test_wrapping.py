"""What wraps a motion model or a sensor passes on all that it does not define itself."""

from typing import Any

import numpy as np
import pytest
from attrs import frozen

from vedette import Gaussian, MotionModel, Pose, Sensor, Space, WrappedMotion, WrappedSensor, fields

X, COV, Z, PLACE = (
    np.array([[3.0, -4.0], [0.5, 2.0]]),
    np.diag([4.0, 9.0]),
    np.array([[-1.0], [7.0]]),
    Pose(np.array([5.0, 6.0])),
)
BELIEF = Gaussian(X, np.broadcast_to(COV, (2, 2, 2)))


@frozen
class Odd(Sensor):
    """A sensor none of whose answers is the usual one."""

    kind = "test_odd"
    claims, linear = True, True
    observes, measurement, optional = Space.of(x="m", y="m"), Space.of(height="m"), {"height": 8.0}
    where: float = 0.0

    def measure(self, x):
        return x[..., :1] - 2.0 * x[..., 1:] - self.where

    def jacobian(self, x):
        return np.array([[1.0, -2.0]])

    def noise(self, x):
        return 2.0 + x[..., :1, None] ** 2

    def mean_noise(self, x, cov):
        return self.noise(x) + cov[..., :1, :1]

    def detects(self, x):
        return 0.1 + 0.5 * (x[..., 0] > 1.0)

    def clutter(self, z):
        return 3.0 + np.abs(z[..., 0])

    def unresolved(self, x):
        return 5.0 * self.noise(x)

    def covers(self, z):
        return z[..., 0] > 0.0

    def invert(self, z, noise=None):
        return Gaussian(np.concatenate([z, -z], axis=-1), COV if noise is None else 7.0 * COV)

    def at(self, pose):
        return Odd(float(pose.position[0]))


@frozen
class Wild(MotionModel):
    """A motion model none of whose answers is the usual one."""

    kind = "test_wild"
    linear, divisible, reframes = True, False, True
    state, zero_variance = Space.of(x="m", y="m"), Space.of(y="m")

    def move(self, x, dt):
        return x[..., ::-1] * dt

    def jacobian(self, x, dt):
        return dt * np.eye(2)[::-1]

    def noise(self, x, dt):
        return dt * np.diag([1.0, 2.0])

    def mean_noise(self, x, cov, dt):
        return self.noise(x, dt) + cov

    def reframe(self, own, combined):
        return Gaussian(own.mean + combined.mean[::-1], own.cov)


@frozen
class Around(WrappedSensor):
    kind = "test_around"
    of: Sensor = fields.part("the sensor")


@frozen
class Along(WrappedMotion):
    kind = "test_along"
    of: MotionModel = fields.part("the motion")


ASKED: dict[str, tuple[Any, ...]] = {
    **dict.fromkeys(("measure", "jacobian", "noise", "detects", "unresolved"), (X,)),
    **dict.fromkeys(("clutter", "covers"), (Z,)),
    "mean_noise": (X, COV),
    "invert": (Z, np.eye(1)),
    "at": (Pose(np.array([5.0, 6.0])),),
}
MOVED: dict[str, tuple[Any, ...]] = {
    **dict.fromkeys(("move", "jacobian", "noise"), (X, 2.0)), "mean_noise": (X, COV, 2.0), "reframe": (BELIEF, BELIEF)
}  # fmt: skip


def plain(answer):
    """Return an answer as what can be compared."""
    if isinstance(answer, Gaussian):
        return answer.mean.tolist(), answer.cov.tolist()
    return getattr(answer, "of", answer.tolist() if isinstance(answer, np.ndarray) else answer)


@pytest.mark.parametrize(
    ("role", "wrapper", "one", "asked"), [(Sensor, Around, Odd(), ASKED), (MotionModel, Along, Wild(), MOVED)],
    ids=["sensor", "motion"],
)  # fmt: skip
def test_every_method_of_the_role_is_that_of_what_is_wrapped(role, wrapper, one, asked):
    """But its compiled twin, which knows nothing of the wrapper, and `placed`, which asks `at`."""
    names = {name for name in vars(role) if name[0] != "_"} - {"twin", "placed"}
    assert set(asked) < names
    for name in names:
        found, wanted = (getattr(each, name) for each in (wrapper(one), one))
        if name in asked:
            found, wanted = found(*asked[name]), wanted(*asked[name])
        assert plain(found) == plain(wanted), name


def test_the_mean_noise_of_who_has_noise_of_his_own_is_that():
    """And of a sensor that measures otherwise: what is wrapped would average over other places."""
    louder = frozen(type("Louder", (Around,), {"noise": lambda self, x: 4.0 * self.of.noise(x)}))(Odd())
    shifted = frozen(type("Shifted", (Around,), {"measure": lambda self, x: self.of.measure(x + 1.0)}))(Odd())
    for sensor in (louder, shifted):
        np.testing.assert_array_equal(sensor.mean_noise(X, COV), sensor.noise(X))
    restless = frozen(type("Restless", (Along,), {"noise": lambda self, x, dt: 9.0 * np.eye(2)}))(Wild())
    np.testing.assert_array_equal(restless.mean_noise(X, COV, 2.0), restless.noise(X, 2.0))
