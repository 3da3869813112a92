"""Who takes a camera's frames says so; the tracker refuses a camera to all others, whatever their class."""

import pytest
from attrs import frozen

import vedette
from vedette import MotionModel, Tracker, fields
from vedette.filters import GaussianFilter, evaluate_linearised, predict_linearised
from vedette_standard.associators.nearest import Nearest

MOTION = {"kind": "carrying", "motion": {"kind": "image_velocity"}, "carries": {"amplitude": "count", "spread": "px",
          "background": "count"}}  # fmt: skip
CAMERA = {"camera": {"kind": "gaussian_spot"}}
EKF, UKF = {"kind": "ekf", "motion": MOTION}, {"kind": "ukf", "motion": MOTION}


def tracker(estimator):
    return {
        "estimator": estimator,
        "sensors": CAMERA,
        "associator": {"kind": "nearest"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
    }


def mixture(*modes):
    return {"kind": "imm", "modes": list(modes), "transition": [[0.9, 0.1], [0.1, 0.9]]}


@pytest.mark.parametrize(
    "estimator",
    [EKF, EKF | {"kind": "iekf"}, mixture(EKF, EKF), {"kind": "gaussian_sum", "each": EKF},
     {"kind": "residual_monitored", "of": EKF}],
    ids=lambda config: config["kind"],
)  # fmt: skip
def test_those_that_take_frames_get_a_camera(estimator):
    assert vedette.build(tracker(estimator)).estimator.traits.takes_frames


@pytest.mark.parametrize(
    "estimator",
    [UKF, *({**UKF, "kind": kind} for kind in ("ckf", "srkf", "bootstrap_particles", "auxiliary_particles")),
     mixture(EKF, UKF), {"kind": "gaussian_sum", "each": UKF}, {"kind": "residual_monitored", "of": UKF}],
    ids=lambda config: config["kind"],
)  # fmt: skip
def test_those_that_do_not_are_refused_one(estimator):
    with pytest.raises(vedette.ConfigError, match=f"sensors.camera: is a camera, but '{estimator['kind']}' takes no frames"):
        vedette.build(tracker(estimator))


@frozen
class Stranger(GaussianFilter):
    """A third party's filter that says nothing of frames, although its class is that of filters that take them."""

    kind = "test_stranger"
    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief, dt, rng):
        return predict_linearised(belief, self.motion, dt)

    def evaluate(self, belief, sensor, observed, p_gate):
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate)


@frozen
class Seer(Stranger):
    kind = "test_seer"
    declares = vedette.Traits(takes_frames=True)


def test_a_third_partys_estimator_declares_it():
    whole = vedette.build(tracker(EKF))
    parts = whole.sensors, Nearest(), whole.lifecycle, None
    with pytest.raises(ValueError, match=r"sensors\.camera: is a camera, but 'test_stranger' takes no.*'ekf'"):
        Tracker(Stranger(whole.estimator.motion), *parts)
    Tracker(Seer(whole.estimator.motion), *parts)
