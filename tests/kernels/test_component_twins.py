"""Filters through compiled twins of components give what they give by the components' own methods."""

import ctypes
import pickle

import numpy as np
import pytest
from attrs import frozen
from scipy import LowLevelCallable

from vedette import Detections, Gaussian, Pose, Sensor, Space, Twin, kernels
from vedette_standard import compiled
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_3d import CoordinatedTurn3d
from vedette_standard.motion.curvilinear import Curvilinear
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.motion.product import Product
from vedette_standard.motion.singer import Singer
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

pytestmark = pytest.mark.skipif(not kernels.RUNNING.startswith("compiled"), reason="the kernels that run call no twin")
CALLS = ("evaluate_twin", "evaluate_points_twin", "predict_twin", "predict_points_twin")
CALLS += ("iterate_twin", "predict_root_twin", "evaluate_root_twin")
RNG = np.random.default_rng(0)
TURN = CoordinatedTurn(0.5, 0.01)
RADAR = RangeBearing(10.0, 0.02, sigma_extent=3.0, max_range=900.0, detection_probability=0.9)
UP, DEEP = ConstantVelocity(0.1, axes=("z",)), Singer(0.4, 20.0, axes=("depth",))
BIASED = Biased(RADAR, add={"range": "long"}, offset={"y": "east"})
CASES = [
    (ExtendedKalman(TURN), RADAR),
    (ExtendedKalman(TURN), BearingOnly(0.02).at(Pose([20.0, 5.0], [1.0, 2.0], 3.0))),
    (ExtendedKalman(ConstantVelocity(0.5)), PolarPosition(10.0, 0.02)),
    (ExtendedKalman(CoordinatedTurn3d(0.5, 0.01)), RangeBearingElevation(10.0, 0.02, 0.02)),
    (UnscentedKalman(TURN), RangeBearingRate(10.0, 0.02, 1.0)),
    (UnscentedKalman(CoordinatedTurn3d(0.5, 0.01)), RADAR),
    (CubatureKalman(TURN), RADAR),
    (IteratedExtendedKalman(TURN, passes=4), RADAR),
    (IteratedExtendedKalman(TURN, passes=1), BearingOnly(0.02)),
    (SquareRootKalman(TURN), RADAR),
    (SquareRootKalman(CoordinatedTurn3d(0.5, 0.01)), RangeBearingElevation(10.0, 0.02, 0.02)),
    (ExtendedKalman(Curvilinear(0.3, 0.2)), RADAR),
    (ExtendedKalman(Product((TURN, GaussMarkov(("long", "east"), 1.0, 60.0)))), BIASED),
    (ExtendedKalman(Product((DEEP, Product((UP, TURN))))), RADAR),
    (UnscentedKalman(Product((UP, Curvilinear(0.3, 0.2)))), RADAR),
    (SquareRootKalman(Product((TURN, UP, DEEP))), RADAR),
]


def without_twins(patch):
    for name in CALLS:
        patch.setattr(kernels, name, lambda *given: None)


def beliefs(estimator, shape):
    rng, n = np.random.default_rng(3), len(estimator.state)
    scale = np.array([{"m": 300.0, "m/s": 10.0}.get(axis.unit, 0.05) for axis in estimator.state.axes])
    root = rng.normal(size=(*shape, n, n)) * 0.1 * scale[:, None]
    return Gaussian(rng.normal(size=(*shape, n)) * scale, root @ np.swapaxes(root, -1, -2) + np.diag((0.05 * scale) ** 2))


def one_scan(estimator, sensor, belief, noise):
    rng, shape = np.random.default_rng(4), belief.mean.shape[:-2]
    x = belief.mean[..., estimator.state.locate(sensor.observes)]
    z = sensor.measurement.displace(sensor.measure(x), 0.01 * rng.normal(size=(*x.shape[:-1], len(sensor.measurement))))
    own = np.broadcast_to(2.0 * sensor.noise(x), (*z.shape, z.shape[-1])) if noise else None
    ahead = estimator.predict(estimator.start(belief, estimator.state, RNG), 1.5, RNG)
    seen = estimator.evaluate(ahead, sensor, Detections(z, np.ones(z.shape[:-1], bool), noise=own), 0.99)
    weights = np.full((*shape, z.shape[-2], 1 + z.shape[-2]), 1.0 / (1 + z.shape[-2]))
    after, ahead = estimator.moments(estimator.update(ahead, seen, weights)), estimator.moments(ahead)
    return [ahead.mean, ahead.cov, seen.loglik, seen.distance, seen.log_volume, after.mean, after.cov]


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize(("estimator", "sensor"), CASES, ids=lambda part: part.kind)
def test_a_scan_is_the_same_by_twins_and_by_methods(monkeypatch, estimator, sensor, noise):
    for shape in ((1,), (11,), (2, 3), (2, 1)):
        belief = beliefs(estimator, shape)
        by_twins = one_scan(estimator, sensor, belief, noise)
        with monkeypatch.context() as patch:
            without_twins(patch)
            by_methods = one_scan(estimator, sensor, belief, noise)
        for got, wanted in zip(by_twins, by_methods, strict=True):
            scale = np.max(np.abs(wanted), axis=tuple(range(len(shape))), keepdims=True)
            assert got.shape == wanted.shape
            assert np.all(np.abs(got - wanted) <= 1e-12 * scale + 1e-12)


@pytest.mark.parametrize("passes", [2, 3, 4, 5, 20])
def test_passes_near_the_mode_do_not_turn_on_rounding(monkeypatch, passes):
    estimator = IteratedExtendedKalman(TURN, passes=passes)
    belief = beliefs(estimator, (60,))
    by_twins = one_scan(estimator, RADAR, belief, True)
    without_twins(monkeypatch)
    for got, wanted in zip(by_twins, one_scan(estimator, RADAR, belief, True), strict=True):
        assert np.all(np.abs(got - wanted) <= 1e-11 * (np.max(np.abs(wanted), axis=0) + 1.0))


@pytest.mark.parametrize("kind", sorted(compiled.TWINS["baseline"]))
def test_all_instruction_sets_agree(kind):
    rng = np.random.default_rng(1)
    x, parameters = rng.normal(size=(37, 9)) * 100, np.abs(rng.normal(size=11)) * [1, 1, 1, 1, 1, 1e3, 1, 1, 1, 1, 1]
    axes = {"range_bearing_rate": 4, "range_bearing_elevation": 3, "coordinated_turn_3d": 9, "curvilinear": 6}.get(
        kind, 5 if "turn" in kind else 2
    )
    measured = 3 if kind in ("range_bearing_rate", "range_bearing_elevation") else 1 if kind.endswith("_only") else 2

    def found(functions):
        own = np.ascontiguousarray(x[:, :axes])
        if "turn" in kind or kind == "curvilinear":
            return kernels.move_twin(own / 100, 0.7, functions[kind], parameters, ())
        return kernels.measure_twin(own, functions[kind], parameters, measured)

    base = found(compiled.TWINS["baseline"])
    for functions in compiled.TWINS.values():
        for got, wanted in zip(found(functions), base, strict=True):
            np.testing.assert_allclose(got, wanted, rtol=1e-11, atol=1e-13 * np.max(np.abs(wanted)))


D = ctypes.POINTER(ctypes.c_double)
SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_int, D, D, D, D, D, D, ctypes.c_void_p)


@SIGNATURE
def _sum_of_axes(count, x, parameters, z, slope, noise, detects, data):
    for i in range(count):
        z[i] = x[i] + x[count + i]
        slope[i] = slope[count + i] = 1.0
        noise[i], detects[i] = parameters[i], 0.5


@frozen
class SumOfAxes(Sensor):
    """A third party's, whose twin is called through `scipy.LowLevelCallable`."""

    kind = "sum_of_axes"
    observes = Space.of(x="m", y="m")
    measurement = Space.of(total="m")

    @property
    def twin(self):
        return Twin(LowLevelCallable(_sum_of_axes), np.array([4.0]))

    def measure(self, x):
        raise AssertionError("the twin is asked")

    noise = detects = jacobian = clutter = measure


def test_a_third_partys_twin_is_called():
    sensor, belief = SumOfAxes(), Gaussian(np.array([[3.0, 4.0, 0.0, 0.0]]), np.eye(4)[None])
    seen = ExtendedKalman(ConstantVelocity(0.5)).evaluate(belief, sensor, Detections.of([[8.0]]), 1.0)
    assert seen.distance == pytest.approx(1.0 / 6.0)
    assert seen.loglik[0, 0] == pytest.approx(np.log(0.5))


def test_a_function_of_another_signature_is_refused():
    other = ctypes.CFUNCTYPE(None, ctypes.c_int)(lambda count: None)
    with pytest.raises(ValueError, match="function"):
        Twin(LowLevelCallable(other), np.zeros(1))


def test_an_estimator_that_has_used_twins_is_copied():
    estimator = ExtendedKalman(TURN)
    one_scan(estimator, RADAR, beliefs(estimator, (1,)), False)
    assert pickle.loads(pickle.dumps(estimator)) == estimator


def test_a_subclass_does_not_inherit_the_twin():
    class Longer(RangeBearing):
        def measure(self, x):
            return super().measure(x) + [1.0, 0.0]

    belief = beliefs(ExtendedKalman(TURN), (1,))
    z = RADAR.measure(belief.mean[:, :2])
    near = ExtendedKalman(TURN).evaluate(belief, Longer(10.0, 0.02), Detections.of(z + [1.0, 0.0]), 1.0)
    assert near.distance == pytest.approx(0.0, abs=1e-20)
