"""Frames whitened by the ones before: the textbook's estimate, consistent where pixels remember, and no other elsewhere."""

import numpy as np
import pytest

import vedette
from vedette import Frame, Gaussian, Scan
from vedette_flir.camera import Camera
from vedette_flir.estimators.whitened import WhitenedFilter
from vedette_flir.matched_truth import RATE, config, follow, offset, shown, wander, white
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.robustness import HALF, MEMORY, over_time
from vedette_flir.sensors.gaussian_spot import GaussianSpot

LOOKS = {"amplitude": "count", "spread": "px", "background": "count"}
MATCHED = {"kind": "jittered_wander", "sigma_jitter": 0.2}
FAINT = np.array([3.0, 2.0, 0.0])


def record(kind, noise, runs=12, **more):
    built = config(3, 0.2, MATCHED)
    if kind == "whitened_filter":
        built["estimator"] = {**built["estimator"], "kind": kind, "memory": MEMORY, **more}
    rng = np.random.default_rng(5)
    state, times = wander(0.2, runs, rng)
    start = offset(0.2, runs, rng)
    scans = shown(times, state[..., :2] + state[..., 2:], GaussianSpot(), FAINT, noise(runs, rng), HALF)
    return follow(built, state, start, 0.2, FAINT, scans)


def rms(part):
    return np.sqrt(np.mean(part**2))


@pytest.mark.costly
def test_where_pixels_remember_it_is_consistent_and_errs_less():
    """On matched truth, SNR 3: NEES / 4 1.03 for 1.20, the sum's error .231 for .304 px, and NIS / 2 1."""
    own, plain = record("whitened_filter", over_time), record("iekf", over_time)
    assert not own.lost.any()
    assert abs(own.nees.mean() - 1.0) < 0.1 < plain.nees.mean() - 1.0
    assert rms(own.apparent) < 0.85 * rms(plain.apparent)
    assert 0.9 < own.nis.mean() < 1.1


@pytest.mark.costly
def test_without_a_memory_worth_a_frame_it_is_the_iterated_filter():
    own, plain = record("whitened_filter", white, 4, memory=1e-3), record("iekf", white, 4)
    np.testing.assert_allclose(own.apparent, plain.apparent, atol=1e-6)
    np.testing.assert_allclose(own.nees, plain.nees, rtol=1e-5)


def test_two_frames_are_weighed_as_the_joint_gaussian_says():
    """A still target whose place is known to .05 px, so that all is linear: both frames' pixels as one Gaussian vector."""
    motion = Carrying(JitteredWander(sigma=3.0, tau=1e6, sigma_jitter=1e-4), LOOKS)
    camera = GaussianSpot(across=("x", "jx"), down=("y", "jy"))
    estimator, r, dt = WhitenedFilter(motion, memory=MEMORY, passes=1), np.exp(-1 / RATE / MEMORY), 1 / RATE
    mean = np.zeros((1, 7))
    mean[0, 4:] = 10.0, 2.0, 0.0
    P = np.diag([0.05**2, 0.05**2, 1e-8, 1e-8, 0, 0, 0])
    rng = np.random.default_rng(6)
    belief = estimator.start(Gaussian(mean, P[None]), estimator.state, rng)
    clean = camera.render(np.array([12.03, 11.98, 0, 0, 10.0, 2.0, 0.0]), (24, 24))
    first = rng.standard_normal((24, 24))
    noises = first, r * first + np.sqrt(1 - r**2) * rng.standard_normal((24, 24))
    frames = [Frame(clean + each, np.array([-12.0, -12.0])) for each in noises]
    for i, frame in enumerate(frames):
        belief = estimator.predict(belief, dt * (i > 0), rng)
        made = estimator.evaluate(belief, camera, frame, 1.0)
        belief = estimator.update(belief, made, np.array([[0.0, 1.0]]))
    window = [camera.camera.cut(frame, np.zeros((1, 2))) for frame in frames]
    picture = camera.picture(tuple(mean[:, i] for i in (4, 5, 6)), *window[0].offsets(np.zeros((1, 2))))
    D = picture.slopes.reshape(2, -1).T
    rest = np.concatenate([(each.values - picture.image).ravel() for each in window])
    R = np.kron(np.array([[1.0, r], [r, 1.0]]), np.eye(len(D)))
    both = np.concatenate([D, D])
    information = np.diag([1 / (0.05**2 + 1e-8)] * 2) + both.T @ np.linalg.solve(R, both)
    expected = np.linalg.solve(information, both.T @ np.linalg.solve(R, rest))
    found = estimator.moments(belief)
    np.testing.assert_allclose(found.mean[0, :2] + found.mean[0, 2:4], expected, atol=2e-3)
    np.testing.assert_allclose(found.cov[0, :2, :2], np.linalg.inv(information), rtol=0.03, atol=1e-6)


@pytest.mark.parametrize(
    "camera", [Camera(correlated=0.5), Camera(window=10)], ids=["correlated over space", "another window"]
)
def test_cameras_that_it_cannot_whiten_are_refused(camera):
    estimator = WhitenedFilter(Carrying(JitteredWander(), LOOKS), memory=MEMORY)
    assert estimator.refuses(GaussianSpot(camera=camera))
    assert estimator.refuses(GaussianSpot()) is None


def test_a_tracker_takes_it():
    built = config(3, 0.2, MATCHED)
    built["estimator"] = {**built["estimator"], "kind": "whitened_filter", "memory": MEMORY}
    tracker = vedette.load(built).tracker
    state = tracker.start(Gaussian(np.array([[0.0, 0, 0, 0, 10, 2, 0]]), np.diag([0.1] * 4 + [0] * 3)[None]), 0.0)
    frame = Frame(np.random.default_rng(1).standard_normal((24, 24)), np.array([-12.0, -12.0]))
    assert np.all(np.isfinite(tracker.estimate(tracker.step(state, Scan.image(0.1, "camera", frame))).mean))
