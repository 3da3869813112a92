"""Returns that lack components: as a sensor that measures only the others, in every estimator, the gate and the tracker."""

import re

import attrs
import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Pose, Scan, ScanRefused
from vedette.tracking.gate import Gate
from vedette_standard.estimators.auxiliary import AuxiliaryParticles
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate
from vedette_standard.sensors.range_only import RangeOnly

CV = ConstantVelocity(0.5)
ESTIMATORS = [
    ExtendedKalman(CV),
    IteratedExtendedKalman(CV),
    UnscentedKalman(CV),
    CubatureKalman(CV),
    SquareRootKalman(CV),
    BootstrapParticles(CV, 200),
    AuxiliaryParticles(CV, 200),
    GaussianSum(ExtendedKalman(CV), parts=3),
    Imm((ExtendedKalman(CV), UnscentedKalman(ConstantVelocity(2.0))), np.array([[0.9, 0.1], [0.2, 0.8]])),
]
each = pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: e.kind)

RADAR = RangeBearing(10.0, 0.01, detection_probability=0.9)
WHOLE = PositionVelocity(5.0, 0.5, 0.9)
CASES = {
    "bearing": (RADAR, BearingOnly(0.01, detection_probability=0.9), [1]),
    "range": (RADAR, RangeOnly(10.0, detection_probability=0.9), [0]),
    "position": (WHOLE, CartesianPosition(5.0, 0.9), [0, 1]),
    "no rate": (RangeBearingRate(10.0, 0.01, 0.5, detection_probability=0.9), RADAR, [0, 1]),
}


def prior(*batch):
    rng = np.random.default_rng(0)
    mean = np.array([800.0, 500.0, -10.0, 5.0]) + rng.normal(size=(*batch, 4)) * [20, 20, 3, 3]
    a = np.diag([20.0, 20.0, 3.0, 3.0]) @ (np.eye(4) + rng.normal(size=(*batch, 4, 4)) / 5)
    return Gaussian(mean, a @ np.swapaxes(a, -1, -2))


def lacking(z, present, m, noise=None):
    """Returns (*b, k, present) as ones of m components, NaN where they lack one."""
    wide = np.full((*z.shape[:-1], m), np.nan)
    wide[..., present] = z
    own = None
    if noise is not None:
        own = np.full((*wide.shape, m), np.nan)
        own[..., np.array(present)[:, None], present] = noise
    return Detections(wide, np.ones(z.shape[:-1], bool), None, own, np.isnan(wide))


def update(estimator, sensor, seen):
    rng = np.random.default_rng(2)
    belief = estimator.predict(estimator.start(prior(2, 3), CV.state, rng), 1.5, rng)
    innovation = estimator.evaluate(belief, sensor, seen, 0.99)
    weights = np.random.default_rng(3).random(innovation.loglik.shape)
    after = estimator.moments(estimator.update(belief, innovation, weights / weights.sum(axis=-1, keepdims=True)))
    return innovation, after


def same_update(one, other):
    for name in ("loglik", "distance", "nis", "log_volume"):
        np.testing.assert_allclose(getattr(one[0], name), getattr(other[0], name), rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(one[1].mean, other[1].mean, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(one[1].cov, other[1].cov, rtol=1e-6, atol=1e-6)


@each
@pytest.mark.parametrize("own", [False, True], ids=["sensor's noise", "own noise"])
@pytest.mark.parametrize("case", CASES)
def test_a_return_that_lacks_components_is_one_of_the_sensor_that_measures_the_others(estimator, own, case):
    whole, part, present = CASES[case]
    rng = np.random.default_rng(4)
    m = len(part.measurement)
    z = part.measure(prior(2, 4).mean[..., CV.state.locate(part.observes)])
    noise = part.noise(z)[..., :m, :m] * (1 + rng.random((2, 4, 1, 1))) if own else None
    narrow = Detections(z, np.ones((2, 4), bool), None, noise)
    wide = lacking(z, present, len(whole.measurement), noise)
    same_update(update(estimator, Partial(whole), wide), update(estimator, part, narrow))


@each
def test_whole_and_partial_returns_stand_side_by_side(estimator):
    """Each return of a scan is scored as it would be alone, and without gaps all is as ever."""
    z = RADAR.measure(prior(2, 3).mean[..., :2])
    missing = np.zeros(z.shape, bool)
    missing[:, 1, 0] = missing[:, 2, 1] = True
    mixed = update(estimator, RADAR, Detections(z, np.ones((2, 3), bool), missing=missing))[0]
    whole = update(estimator, RADAR, Detections(z, np.ones((2, 3), bool)))[0]
    np.testing.assert_allclose(mixed.loglik[..., [0, 1]], whole.loglik[..., [0, 1]], rtol=1e-9)
    for column, part, axis in ((2, CASES["bearing"][1], 1), (3, CASES["range"][1], 0)):
        alone = update(estimator, part, Detections(z[:, column - 1 : column, [axis]], np.ones((2, 1), bool)))[0]
        np.testing.assert_allclose(mixed.loglik[..., column], alone.loglik[..., 1], rtol=1e-9)
    same_update(
        update(estimator, RADAR, Detections(z, np.ones((2, 3), bool), missing=np.zeros(z.shape, bool))),
        update(estimator, RADAR, Detections(z, np.ones((2, 3), bool))),
    )


def test_the_comparison_bites():
    """A large noise in place of a gap is not the same: the likelihood is off by its determinant."""
    z = BearingOnly(0.01).measure(prior(2, 4).mean[..., :2])
    wide = np.concatenate([np.zeros((2, 4, 1)), z], axis=-1)
    noise = np.broadcast_to(np.diag([1e8, 1e-4]), (2, 4, 2, 2))
    faked = update(ExtendedKalman(CV), RADAR, Detections(wide, np.ones((2, 4), bool), None, noise))
    with pytest.raises(AssertionError):
        same_update(faked, update(ExtendedKalman(CV), CASES["bearing"][1], Detections(z, np.ones((2, 4), bool))))


# The gate.


def test_the_gate_takes_each_return_for_the_components_it_has():
    """Against the sensor of the present ones: its own threshold, and its own density of clutter."""
    area = {"max_range": 4e3, "clutter_per_scan": 5.0}
    whole = Partial(RangeBearing(10.0, 0.01, detection_probability=0.9, **area), {"bearing": 2 * np.pi})
    part = RangeOnly(10.0, detection_probability=0.9, **area)
    z = part.measure(prior(2, 4).mean[..., :2]) + np.array([[0.0], [30.0], [60.0], [90.0]])
    gate, scores = Gate(0.99), []
    for sensor, seen in ((whole, lacking(z, [0], 2)), (part, Detections(z, np.ones((2, 4), bool)))):
        seen = attrs.evolve(seen, z=np.nan_to_num(seen.z))
        innovation = update(ExtendedKalman(CV), sensor, seen)[0]
        scores.append(gate.scores(innovation, sensor, seen, np.ones((2, 3)), gate.for_sensor(sensor)))
    np.testing.assert_allclose(scores[0], scores[1], rtol=1e-9)
    assert np.isneginf(scores[0]).any()
    assert np.isfinite(scores[0][..., 1:]).any()


# The tracker.

CONFIG = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {
            "kind": "partial",
            "optional": {"range_rate": 100.0},
            "of": {"kind": "range_bearing_rate", "sigma_range": 10.0, "sigma_bearing": 0.01, "sigma_rate": 0.5},
        }
    },
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns"},
    "lifecycle": {"kind": "m_of_n"},
}


def scan(time, *returns, **more):
    z = np.array(returns, float)
    return Scan(time, "radar", Detections(z, np.ones(len(z), bool), missing=np.isnan(z), **more))


def test_a_track_lives_on_returns_without_their_rate_but_starts_at_whole_ones():
    tracker = vedette.build(CONFIG)
    state = tracker.start()
    state = tracker.step(state, scan(0.0, [1000.0, 0.5, np.nan]))
    assert len(state.ids) == 0
    for i in range(6):
        rate = -8.0 if i % 2 == 0 else np.nan
        state = tracker.step(state, scan(2.0 * (i + 1), [1000.0 - 16 * i, 0.5, rate]))
    assert state.ids.tolist() == [0]
    assert state.confirmed.all()
    assert np.hypot(*tracker.estimate(state).mean[0, 2:]) == pytest.approx(8.0, abs=1.0)


def test_it_is_placed_like_the_sensor_that_it_holds():
    tracker = vedette.build(CONFIG)
    sensor = tracker.sensors["radar"]
    pose = Pose(np.array([100.0, 50.0]), np.array([1.0, 2.0]), 0.3)
    x = prior(3).mean
    np.testing.assert_array_equal(sensor.at(pose).measure(x), sensor.of.at(pose).measure(x))
    assert sensor.at(pose).optional == sensor.optional
    assert vedette.build(vedette.to_config(tracker)) == tracker


@pytest.mark.parametrize(
    ("returns", "more", "message"),
    [
        ([[np.nan, 0.5, 1.0]], {}, "missing: 'partial' always reports range; of its axes a return may lack: range_rate"),
        ([[1000.0, 0.5, np.inf]], {}, "return [0]: must be finite numbers"),
        (
            [[1000.0, 0.5, np.nan]],
            {"noise": np.array([np.diag([1.0, -1.0, 1.0])])},
            "its noise must be symmetric and positive",
        ),
    ],
)
def test_what_may_not_be_missing_is_refused(returns, more, message):
    tracker = vedette.build(CONFIG)
    with pytest.raises(ScanRefused, match=re.escape(message)):
        tracker.step(tracker.start(), scan(0.0, *returns, **more))


def test_noise_of_a_missing_component_is_not_looked_at():
    tracker = vedette.build(CONFIG)
    state = tracker.step(tracker.start(), scan(0.0, [1000.0, 0.5, -8.0]))
    ends = []
    for hidden in (np.nan, 7.0, -3.0):
        noise = np.array([[[100.0, 0.0, hidden], [0.0, 1e-4, 0.0], [hidden, 0.0, hidden]]])
        ends.append(tracker.estimate(tracker.step(state, scan(2.0, [984.0, 0.5, np.nan], noise=noise))).mean)
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], ends[2])


def test_a_plain_sensor_takes_no_gaps():
    config = CONFIG | {"sensors": {"radar": CONFIG["sensors"]["radar"]["of"]}}
    tracker = vedette.build(config)
    with pytest.raises(ScanRefused, match=re.escape("of its axes a return may lack: none")):
        tracker.step(tracker.start(), scan(0.0, [1000.0, 0.5, np.nan]))


def test_clutter_must_be_known_where_components_may_be_missing():
    with pytest.raises(vedette.ConfigError, match=re.escape("must be 'sensor', as returns of 'radar' may lack components")):
        vedette.build(CONFIG | {"gate": {"clutter": "nonparametric"}})


@pytest.mark.parametrize(
    ("optional", "message"),
    [
        ({"rate": 1.0}, "optional.rate: must be one of range, bearing"),
        ({"range": 0.0}, "optional.range: must be > 0, got 0"),
        ({"range": 1.0, "bearing": 1.0}, "optional: must leave one of range, bearing that is always reported"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(optional, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        Partial(RADAR, optional)


def test_the_kalman_filter_takes_a_partial_linear_sensor():
    assert Kalman(CV).refuses(Partial(WHOLE)) is None
    assert Kalman(CV).refuses(Partial(RADAR)) is not None
