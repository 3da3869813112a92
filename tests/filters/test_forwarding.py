"""A component that holds another forwards what that one needs, or says what it drops; the rest is refused at build."""

import numpy as np
import pytest
from attrs import frozen

import vedette
from support.mutants.estimators import Around
from vedette import ConfigError, Detections, Estimator, Gaussian, MotionModel, Scan, Tracker, fields
from vedette.filters import unforwarded
from vedette.testing import examine, laws_of
from vedette.testing.law import FAST
from vedette.testing.strategies import components
from vedette_flir.motion.constant_axes import Carrying
from vedette_standard.associators.nearest import Nearest
from vedette_standard.births.given import Given
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.lifecycles.single_target import SingleTarget
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_target_oriented.literal import TargetOrientedLiteral

PARTS = {"radar": CartesianPosition(10.0)}, Nearest(), SingleTarget()
RADIUS = 300.0


def variant(name, **members):
    return frozen(type(name, (Around,), {"kind": f"test_{name.lower()}", **members}))


BARE = variant("Bare", reframe=Estimator.reframe)
DROPS = variant("Drops", reframe=Estimator.reframe, drops=("reframes", "bounded"))
STILL = variant("Still", reframe=lambda self, belief, combined: belief)
OPEN = variant("Open", drops=())


def refuse(estimator):
    if estimator.of.motion.reframes:
        raise ValueError("of: its motion turns its frame")


REFUSES = variant("Refuses", reframe=Estimator.reframe, __attrs_post_init__=refuse)


def rms(estimator):
    """The error in m over one circle at 10 m/s, by a motion whose frame turns with its target."""
    rng, tracker = np.random.default_rng(0), Tracker(estimator, *PARTS)
    prior = Gaussian(np.array([[0.0, RADIUS, 10.0, 0.0, 0.0, -10.0, RADIUS]]), np.diag([100.0, 100, 4, 4, 0, 0, 0])[None])
    state, errors = tracker.start(prior, 0.0), []
    for k in range(1, 120):
        place = RADIUS * np.array([np.sin(10 * k / RADIUS), np.cos(10 * k / RADIUS)])
        state = tracker.step(state, Scan(float(k), "radar", Detections.of([place + 10 * rng.standard_normal(2)])))
        errors.append(tracker.estimate(state).mean[0, :2] - place)
    return np.sqrt(np.mean(np.sum(np.square(errors), axis=-1)))


TURNING = TargetOrientedLiteral(sigma_forward=0.5, sigma_side=0.1, side_speed=-0.3)


def test_a_wrapper_that_forgets_to_forward_is_refused_when_a_tracker_is_built():
    """Whatever it is in, with its place and the method that is missing; what its part does not need, it need not have."""
    with pytest.raises(ValueError, match=r"^estimator: .*`reframes`.*`reframe`.*`__attrs_post_init__`"):
        Tracker(BARE(ExtendedKalman(TURNING)), *PARTS)
    with pytest.raises(ValueError, match=r"^estimator\.modes\[0\]: .*`bounded`.*`extent`"):
        Tracker(Imm((OPEN(ExtendedKalman(ConstantVelocity(1.0))),), transition=np.eye(1)), *PARTS)
    Tracker(Around(ExtendedKalman(TURNING)), *PARTS)
    Tracker(DROPS(ExtendedKalman(TURNING)), *PARTS)


def test_a_config_with_it_is_refused_with_its_place():
    brought = BARE, ExtendedKalman, TargetOrientedLiteral, CartesianPosition, Nearest, SingleTarget, Given
    registry = vedette.Registry.of(*brought)
    config = {
        "estimator": {
            "kind": "test_bare",
            "of": {
                "kind": "ekf",
                "motion": {"kind": "target_oriented_literal", "sigma_forward": 0.5, "sigma_side": 0.1},
            },
        },
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 10.0}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
    }
    with pytest.raises(ConfigError) as refusal:
        vedette.build(config, registry)
    assert [problem.place for problem in refusal.value.problems] == ["estimator"]


def test_what_a_forgotten_frame_costs():
    """A wrapper that forwards tracks as what it wraps does; one that only claims to need no frame is lost."""
    right = rms(ExtendedKalman(TURNING))
    assert 11.0 < right < 12.0
    assert rms(Around(ExtendedKalman(TURNING))) == right
    assert rms(DROPS(ExtendedKalman(TURNING))) > 500.0
    assert rms(STILL(ExtendedKalman(TURNING))) > 500.0


@pytest.mark.parametrize(("wrapper", "verdict"), [
    (Around, "held"), (DROPS, "failed"), (STILL, "failed"), (BARE, "failed"), (REFUSES, "skipped"),
])  # fmt: skip
def test_the_kit_fails_a_wrapper_that_does_not_turn_the_frame(wrapper, verdict):
    law = next(law for law in laws_of(wrapper) if law.name == "a_frame_turns_before_each_prediction")
    assert examine(wrapper, law, components(wrapper, {}), FAST).verdict == verdict


@frozen
class Braked(MotionModel):
    """A third party's motion around another one."""

    kind = "test_braked"
    of: MotionModel = fields.part("the motion")

    @property
    def state(self):
        return self.of.state

    @property
    def zero_variance(self):
        return self.of.zero_variance

    def move(self, x, dt):
        return self.of.move(x, dt)

    def noise(self, x, dt):
        return self.of.noise(x, dt)


HALF = frozen(type("Half", (Braked,), {"kind": "test_half", "reframes": True}))


@pytest.mark.parametrize("motion", [Braked(TURNING), HALF(TURNING), Carrying(Braked(TURNING), {"width": "m"})])
def test_a_motion_that_loses_the_frame_of_another_is_refused(motion):
    with pytest.raises(ValueError, match=r"^estimator\.motion(\.motion)?: .*`reframe"):
        Tracker(ExtendedKalman(motion), *PARTS)
    assert unforwarded(Braked(ConstantVelocity(1.0))) == ""
