"""FilterPy's matrices as configs, and its filters as estimators over Vedette's models: beside the kinds of the shelf."""

import numpy as np
import pytest

import vedette
from support import filterpy_answers
from support.paths import EXAMPLES
from vedette.errors import InputError
from vedette_adapters.filterpy import FilterPyEstimator, config_of, prior_of
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

pytest.importorskip("filterpy", reason="filterpy is not installed: its filters were not tried")

from filterpy.kalman import (
    CubatureKalmanFilter,
    ExtendedKalmanFilter,
    FadingKalmanFilter,
    InformationFilter,
    JulierSigmaPoints,
    KalmanFilter,
    SquareRootKalmanFilter,
    UnscentedKalmanFilter,
)

MOTION = ConstantVelocity(0.5)
LINE = EXAMPLES / "filterpy" / "line.csv"
RETURNS = np.loadtxt(LINE, delimiter=",", skiprows=1)


def unscented(n, m):
    return UnscentedKalmanFilter(n, m, 1.0, None, None, JulierSigmaPoints(n, 1.0))


def cubature(n, m):
    return CubatureKalmanFilter(n, m, 1.0, None, None)


CASES = {
    "Kalman": (KalmanFilter(4, 2), ExtendedKalman(MOTION), CartesianPosition(5.0, detection_probability=0.9)),
    "square root": (SquareRootKalmanFilter(4, 2), ExtendedKalman(MOTION), CartesianPosition(5.0)),
    "extended": (ExtendedKalmanFilter(4, 2), ExtendedKalman(MOTION), RangeBearing(5.0, 0.01)),
    "unscented": (unscented(4, 2), UnscentedKalman(MOTION), RangeBearing(5.0, 0.01)),
    "cubature": (cubature(4, 2), CubatureKalman(MOTION), RangeBearing(5.0, 0.01)),
    "a turn, unscented": (unscented(5, 2), UnscentedKalman(CoordinatedTurn(0.5, 0.01)), RangeBearing(5.0, 0.01)),
}


@pytest.mark.parametrize("case", CASES)
def test_its_filters_answer_as_the_kinds_do(case):
    """Two targets at a bearing of 180 deg, two returns and soft weights: predictions, innovations and updates."""
    theirs, ours, sensor = CASES[case]
    rng, state = np.random.default_rng(0), ours.motion.state
    mean = np.zeros((2, len(state)))
    mean[:, :4] = [[-900.0, 1.0, 3.0, -2.0], [-600.0, -2.0, 0.0, 5.0]]
    cov = np.tile(np.diag([25.0, 25.0, 4.0, 4.0, 1e-4][: len(state)]), (2, 1, 1))
    beliefs = {
        one: one.start(vedette.Gaussian(mean, cov), state, rng) for one in (FilterPyEstimator(ours.motion, theirs), ours)
    }
    for k in range(1, 4):
        z = sensor.measure(np.array([[-900.0 + 3 * k, 1.0 - 2 * k], [-600.0, -2.0 + 5 * k]]))
        noise = None if k < 3 else np.tile(2.0 * sensor.noise(mean[:, :2]).reshape(-1, 2, 2)[0], (2, 1, 1))
        seen = vedette.Detections(z, np.ones(2, dtype=bool), noise=noise)
        weights, found = np.array([[0.1, 0.8, 0.1], [0.3, 0.0, 0.7]]), []
        for one, belief in beliefs.items():
            ahead = one.predict(belief, 1.5, rng)
            innovation = one.evaluate(ahead, sensor, seen, 0.99)
            beliefs[one] = one.update(ahead, innovation, weights)
            found.append((ahead, innovation, beliefs[one]))
        (a, i, p), (b, j, q) = found
        for name in ("loglik", "distance", "log_volume"):
            np.testing.assert_allclose(getattr(i, name), getattr(j, name), rtol=1e-8, atol=1e-8)
        for one, other in ((a, b), (p, q)):
            np.testing.assert_allclose(one.mean, other.mean, rtol=1e-8, atol=1e-8)
            np.testing.assert_allclose(one.cov, other.cov, rtol=1e-7, atol=1e-8)


def test_what_it_cannot_do_is_said():
    linear = FilterPyEstimator(MOTION, KalmanFilter(4, 2))
    assert "use an ExtendedKalmanFilter" in linear.refuses(RangeBearing(5.0, 0.01))
    assert linear.refuses(CartesianPosition(5.0)) is None
    with pytest.raises(ValueError, match=r"filter: must have 4 axes.*got 3"):
        FilterPyEstimator(MOTION, KalmanFilter(3, 2))
    with pytest.raises(ValueError, match=r"filter: must be a KalmanFilter or .*, got InformationFilter"):
        FilterPyEstimator(MOTION, InformationFilter(4, 2))
    with pytest.raises(ValueError, match="motion: KalmanFilter needs a linear one, got 'coordinated_turn'"):
        FilterPyEstimator(CoordinatedTurn(0.5, 0.01), KalmanFilter(5, 2))


def test_a_filter_may_derive_from_one_of_filterpys():
    class Mine(SquareRootKalmanFilter):
        pass

    sensor, scan = CartesianPosition(5.0), vedette.Detections.of([[103.0, 52.0]])
    belief = vedette.Gaussian(np.array([[100.0, 50.0, 1.0, 0.0]]), np.diag([25.0, 25.0, 4.0, 4.0])[None])
    own, theirs = (FilterPyEstimator(MOTION, cls(4, 2)) for cls in (Mine, SquareRootKalmanFilter))
    found, wanted = (one.evaluate(belief, sensor, scan, 1.0).detail.post for one in (own, theirs))
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(
    ("make", "u"),
    [
        (filterpy_answers.kalman, None),
        (filterpy_answers.kalman, np.array([[0.2]])),
        (lambda: filterpy_answers.linear(SquareRootKalmanFilter, filterpy_answers.Q_FULL), None),
        (lambda: filterpy_answers.linear(InformationFilter, compute_log_likelihood=False), None),
    ],
    ids=["Kalman", "control", "square root", "information"],
)
def test_its_matrices_make_the_config_that_answers_as_it_does(make, u):
    one = make()
    one.B = np.array([[0.5], [1.0]])
    config = config_of(one, ["x", "vx"], u=u, sensor="s")
    config["source"] = {"kind": "csv", "path": str(LINE), "detections": {"time": "t", "columns": {"x": "z"}}}
    (track,) = vedette.load(config).run().tracks
    answer = filterpy_answers.followed(one, u)
    np.testing.assert_allclose(track.mean, answer["x"], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(track.cov, answer["P"], rtol=1e-9, atol=1e-9)


def test_a_prior_that_is_not_diagonal_is_started_by_hand():
    one = filterpy_answers.kalman()
    one.P = np.array([[100.0, 20.0], [20.0, 9.0]])
    config = config_of(one, ["x", "vx"])
    assert config["birth"] is None
    tracker, prior = vedette.build(config), prior_of(one)
    state = tracker.start(prior, 0.0, 1)
    one.update(RETURNS[0, 1:].reshape(1, 1))
    found = tracker.estimate(tracker.step(state, vedette.Scan(0.0, "s", [RETURNS[0, 1:].tolist()])))
    np.testing.assert_allclose(found.mean[0], one.x.ravel(), rtol=1e-12)


def test_fading_and_what_is_not_linear():
    with pytest.warns(DeprecationWarning, match="Use KalmanFilter"):
        fading = FadingKalmanFilter(1.05, 2, 1)
    fading.H = np.array([[1.0, 0.0]])
    assert config_of(fading, ["x", "vx"])["estimator"]["alpha"] == pytest.approx(1.05)
    with pytest.raises(InputError, match="a UnscentedKalmanFilter is not made of matrices"):
        config_of(unscented(4, 2), ["x", "y", "vx", "vy"])


@pytest.mark.parametrize("axes", [["x", "vx"], [], "xyvw", ["x", "y", "z", "u", "v"]])
def test_axes_must_name_all_numbers_of_the_state(axes):
    with pytest.raises(InputError, match="axes: must name the 4 numbers"):
        config_of(KalmanFilter(dim_x=4, dim_z=2), axes)
