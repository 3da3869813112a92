"""Who takes a camera's frames says so; the tracker refuses a camera to all others, whatever their class."""

import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette import Frame, Gaussian, MotionModel, Space, Tracker, fields
from vedette.filters import GaussianFilter, evaluate_frame, evaluate_linearised, predict_linearised
from vedette.supporting import ImagingSensor
from vedette_flir.camera import Camera
from vedette_flir.sensors.gaussian_spot import GaussianSpot
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


def test_a_filter_takes_what_its_camera_learns_of_a_frame():
    """Of an amplitude that is 10 too small and a background that is 4 too low the parts that the gains say."""
    camera = GaussianSpot(camera=Camera(2.0, window=16), gain_amplitude=0.25, gain_background=0.5)
    filter_ = vedette.build(tracker(EKF)).estimator
    where = filter_.state.locate(camera.observes)
    mean, cov = np.zeros((1, len(filter_.state))), np.zeros((1, len(filter_.state), len(filter_.state)))
    mean[0, where], cov[0, where[:2], where[:2]] = [8.0, 7.0, 40.0, 2.5, 10.0], 1.0
    pixels = camera.render(np.array([8.0, 7.0, 50.0, 2.5, 14.0]), (16, 16)) + 14.0
    innovation = evaluate_linearised(Gaussian(mean, cov), filter_.state, camera, Frame(pixels), 0.99)
    after = filter_.update(Gaussian(mean, cov), innovation, np.array([[0.0, 1.0]])).mean[0, where]
    np.testing.assert_allclose(after, [8.0, 7.0, 42.5, 2.5, 12.0], atol=0.01)


@frozen
class Peak(ImagingSensor):
    """A camera whose likelihood ratio is a parabola over the place, with its top at 3, 5."""

    kind = "test_peak"
    observes = measurement = Space.of(x="px", y="px")
    J, top, height = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([3.0, 5.0]), 20.0
    offset: float = 0.0

    def measure(self, x):
        return x

    def noise(self, x):
        return np.linalg.inv(self.J)

    def detects(self, x):
        return np.ones(x.shape[:-1])

    def seek(self, x, cov, frame):
        return x + self.offset

    def information(self, x, frame, at):
        off = self.top - at
        llr = self.height - 0.5 * np.einsum("...i,ij,...j", off, self.J, off)
        return np.broadcast_to(self.J, (*x.shape[:-1], 2, 2)), off @ self.J, llr


@pytest.mark.parametrize(("offset", "passes"), [(0.0, 1), (2.0, 1), (-1.0, 3)])
def test_evidence_and_posterior_do_not_depend_on_where_a_parabola_is_linearised(offset, passes):
    """They are those of a return at its top with the covariance J^-1."""
    camera, x, P = Peak(offset), np.array([2.0, 7.0]), np.array([[3.0, 1.0], [1.0, 2.0]])
    found = evaluate_frame(Gaussian(x[None], P[None]), camera.observes, camera, Frame(np.zeros((2, 2))), 0.99, passes)
    S, off = P + np.linalg.inv(camera.J), camera.top - x
    evidence = camera.height - 0.5 * off @ np.linalg.solve(S, off) - 0.5 * np.linalg.slogdet(np.eye(2) + camera.J @ P)[1]
    np.testing.assert_allclose(found.loglik[0, 1], evidence)
    np.testing.assert_allclose(found.distance[0, 0], off @ np.linalg.solve(S, off))
    np.testing.assert_allclose(found.detail.shift[0, 0], P @ np.linalg.solve(S, off))
    np.testing.assert_allclose(found.detail.post[0, 0], P - P @ np.linalg.solve(S, P))
