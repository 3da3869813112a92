"""Births along an edge, anywhere in a box, from two scans, and from tracks that ended."""

import numpy as np
import pytest

from vedette import ConfigError, Detections, Gaussian, Scan, Tracker, build
from vedette.sampling import Bounds
from vedette_standard.associators.jpda import Jpda
from vedette_standard.births.places import Appearance, Edge
from vedette_standard.births.poisson import Poisson
from vedette_standard.births.two_point import TwoPoint
from vedette_standard.births.uniform import Uniform
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing

FILTER, RADAR = Kalman(ConstantVelocity(0.3)), CartesianPosition(2.0, 0.8, 1e-5)
RNG = np.random.default_rng(0)
AXES = [FILTER.state.names.index(name) for name in ("x", "y", "vx", "vy")]
SPREAD = {"vx": 5.0, "vy": 5.0}
BOX = {"x": Bounds(-500.0, 500.0), "y": Bounds(-500.0, 500.0)}


def intensity_at(birth, places):
    memory = birth.initial_memory(FILTER, RNG)
    rate, _ = birth.reveal(memory, FILTER, RADAR, Detections.of(places), 1.0)
    return rate / 0.8


def test_targets_that_come_in_across_a_line_are_spread_evenly_along_it():
    edge = Edge([0.0, 100.0], [800.0, 100.0], width=20.0, speed=[6.0, 1.0], parts=16, initial=3.0)
    along = np.linspace(120.0, 680.0, 57)
    rate = intensity_at(Poisson(enter=(edge,)), np.stack([along, np.full(57, 100.0)], axis=-1))
    across = np.sqrt(2 * np.pi * (20.0**2 + 4.0))
    np.testing.assert_allclose(rate, 3.0 / 800.0 / across, rtol=0.02)
    parts = edge.gaussians(FILTER.state)
    np.testing.assert_allclose(parts.mean[:, AXES[2:]], np.tile([0.0, 6.0], (16, 1)), atol=1e-12)
    turned = Edge([0.0, 0.0], [0.0, 50.0], width=1.0, speed=[2.0, 1.0]).gaussians(FILTER.state)
    np.testing.assert_allclose(turned.mean[:, AXES[2:]], np.tile([-2.0, 0.0], (8, 1)), atol=1e-12)
    assert np.all(np.linalg.eigvalsh(turned.cov) > 0)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: Edge([0.0, 0.0], [0.0, 0.0], 1.0, [1.0, 1.0]), "end: must differ from start"),
        (lambda: Edge([0.0, 0.0, 1.0], [0.0, 1.0], 1.0, [1.0, 1.0]), r"start: must be \[x, y\]"),
        (lambda: Poisson(), "appear: must hold at least one"),
        (lambda: Uniform(BOX, SPREAD), "rate: must be > 0 unless `initial` is"),
        (lambda: Uniform({}, SPREAD, rate=1.0), "view: must hold the box"),
    ],
)
def test_what_is_wrong_is_told(made, said):
    with pytest.raises(ValueError, match=said):
        made()


def test_anywhere_in_a_box_a_new_track_exists_by_the_rate_against_the_clutter():
    birth, z = Uniform(BOX, SPREAD, initial=4.0), np.array([[10.0, 20.0], [700.0, 0.0]])
    memory = birth.initial_memory(FILTER, RNG)
    rate, found = birth.reveal(memory, FILTER, RADAR, Detections.of(z), 1.0)
    np.testing.assert_allclose(rate, [4.0 * 0.8 / 1e6, 0.0])
    newborn = birth.begin(found, FILTER, RADAR, "radar", Detections.of(z), np.array([0.25, 0.0]))
    np.testing.assert_allclose(newborn.existence, [0.75 * 3.2e-6 / (3.2e-6 + 1e-5)])
    assert newborn.returns.tolist() == [0]
    np.testing.assert_allclose(newborn.prior.mean[0, AXES], [10.0, 20.0, 0.0, 0.0])
    np.testing.assert_allclose(np.diag(newborn.prior.cov[0])[AXES], [4.0, 4.0, 25.0, 25.0])


def test_undetected_targets_come_leave_and_are_found():
    birth = Uniform(BOX, SPREAD, initial=4.0, rate=0.5, lifetime=50.0)
    later = birth.predict(birth.initial_memory(FILTER, RNG), FILTER, 10.0, RNG)
    np.testing.assert_allclose(later.mean(), 4.0 * np.exp(-0.2) + 0.5 * 50.0 * (1.0 - np.exp(-0.2)))
    left = birth.update(later, FILTER, RADAR, Detections.of([], 2), np.zeros(0), 0.9)
    np.testing.assert_allclose(left, later * (1 - 0.8 * 0.9))
    half = CartesianPosition(2.0, 0.8, 1e-5, view={"x": Bounds(0.0, 500.0)})
    left = birth.update(later, FILTER, half, Detections.of([], 2), np.zeros(0), 1.0)
    np.testing.assert_allclose([left[0, 0, 0], left[0, -1, -1]], later[0, 0] * [1.0, 0.2])


def test_what_a_return_without_its_velocity_detects_has_no_track_yet():
    partial = Partial(PositionVelocity(2.0, 0.5, 0.8, 1e-9), {"vx": 6.0, "vy": 10.0})
    birth, missing = Uniform(BOX, SPREAD, initial=4.0), np.zeros((4, 4), dtype=bool)
    missing[1:, 2:] = True
    seen = Detections(np.zeros((4, 4)), np.array([True, True, True, False]), missing=missing)  # one of three is complete
    left = birth.update(birth.initial_memory(FILTER, RNG), FILTER, partial, seen, np.zeros(4), 0.9)
    np.testing.assert_allclose(left, 4.0 * (1 - 0.8 * 0.9 / 3))


@pytest.mark.parametrize("other", [CartesianPosition(2.0, 0.8, 1e-5), BearingOnly(0.01, detection_probability=0.8)])
@pytest.mark.parametrize("birth", ["poisson", "uniform"])
def test_looks_of_a_sensor_that_starts_no_track_leave_as_many_without_one(birth, other):
    """Whom it detects is still for the other to find."""
    at = {name: [0.0, 300.0] for name in ("x", "y", "vx", "vy")}
    appears = Poisson((Appearance(at, initial=4.0),), sensors=("radar",))
    made = appears if birth == "poisson" else Uniform(BOX, SPREAD, initial=4.0, sensors=("radar",))
    estimator, sensors = ExtendedKalman(ConstantVelocity(0.3)), {"radar": RADAR, "other": other}
    tracker, nothing = Tracker(estimator, sensors, Jpda(), Existence(), made), Detections.of([], len(other.measurement))
    state = tracker.step(tracker.start(time=0.0), Scan(0.0, "other", nothing))
    np.testing.assert_array_equal(getattr(state.unseen, "weights", state.unseen), 4.0)


def test_the_density_of_returns_integrates_to_the_number_detected():
    """In range and bearing the density is r times that of the area: summed over cells of a disc within the box."""
    radar = RangeBearing(sigma_range=0.5, sigma_bearing=1e-4, detection_probability=0.7, max_range=2000.0)
    birth = Uniform(BOX, SPREAD, initial=4.0)
    r, b = np.meshgrid((np.arange(100) + 0.5) * 4.0, (np.arange(90) + 0.5) * np.pi / 45 - np.pi, indexing="ij")
    z = np.stack([r.ravel(), b.ravel()], axis=-1)
    rate, _ = birth.reveal(birth.initial_memory(FILTER, RNG), FILTER, radar, Detections.of(z), 1.0)
    np.testing.assert_allclose(np.sum(rate) * 4.0 * np.pi / 45, 4.0 * 0.7 * np.pi * 400.0**2 / 1e6, rtol=1e-3)


def test_a_sensor_that_cannot_start_tracks_there_is_refused():
    birth = Uniform(BOX, SPREAD, rate=1.0)
    bearings = BearingOnly(sigma_bearing=0.01)
    with pytest.raises(ValueError, match=r"'bearings': .* does not give x, y"):
        Tracker(ExtendedKalman(ConstantVelocity(0.3)), {"bearings": bearings}, Jpda(), Existence(), birth)


def two_scans(first, second, **given):
    birth = TwoPoint(max_speed=20.0, **given)
    tracker = Tracker(FILTER, {"radar": RADAR}, Jpda(), MOfN(hits=1, looks=1, misses=9), birth)
    state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of(first, 2)))
    assert len(state.ids) == 0
    return tracker, tracker.step(state, Scan(2.0, "radar", Detections.of(second, 2)))


def test_two_points_are_a_position_and_a_velocity():
    tracker, state = two_scans([[0.0, 0.0], [500.0, 500.0]], [[20.0, -10.0], [-400.0, 300.0]])
    assert state.ids.tolist() == [0]
    estimate = tracker.estimate(state)
    np.testing.assert_allclose(estimate.mean[0, AXES], [20.0, -10.0, 10.0, -5.0])
    expected = np.block([[4 * np.eye(2), 2 * np.eye(2)], [2 * np.eye(2), 2 * np.eye(2)]])
    np.testing.assert_allclose(estimate.cov[0][np.ix_(AXES, AXES)], expected)


@pytest.mark.parametrize(("distance", "tracks"), [(39.0, 1), (48.0, 1), (49.0, 0)])
def test_what_no_target_can_reach_starts_nothing(distance, tracks):
    """40 m by speed, and 3 standard deviations of the difference, 8.49 m."""
    assert len(two_scans([[0.0, 0.0]], [[distance, 0.0]])[1].ids) == tracks


def test_nothing_starts_without_an_earlier_return():
    assert len(two_scans([], [[1.0, 0.0]])[1].ids) == 0
    assert len(two_scans([[1.0, 0.0]], [])[1].ids) == 0


def test_tracks_that_end_are_undetected_targets_again():
    place = Appearance({"x": [0, 50], "y": [0, 50], "vx": [0, 5], "vy": [0, 5]}, rate=0.01)
    ended = Gaussian(np.array([[1.0, 2.0, 3.0, 4.0]]), np.eye(4)[None])
    for recycles in (False, True):
        birth = Poisson((place,), recycles=recycles)
        memory = birth.initial_memory(FILTER, RNG)
        after = birth.recycle(memory, FILTER, ended, np.array([0.07]))
        assert len(after.weights) == len(memory.weights) + recycles
        assert np.sum(after.weights) == pytest.approx(np.sum(memory.weights) + 0.07 * recycles)
    np.testing.assert_array_equal(FILTER.moments(after.belief).mean[-1], ended.mean[0])
    with pytest.raises(ValueError, match="recycles: must be false, as 'bootstrap_particles' would"):
        birth.initial_memory(BootstrapParticles(ConstantVelocity(0.3), particles=100), RNG)


def test_what_a_track_had_is_found_again_where_it_recycles():
    """A target is missed until its track ends; where that is recycled, its next return starts a track that likely exists."""
    place = Appearance({"x": [0, 500], "y": [0, 500], "vx": [0, 5], "vy": [0, 5]}, rate=1e-3)
    found = []
    for recycles in (False, True):
        tracker = Tracker(
            FILTER, {"radar": RADAR}, Jpda(), Existence(delete=0.3), Poisson((place,), lifetime=1e4, recycles=recycles)
        )
        state = tracker.start(Gaussian(np.zeros((1, 4)), np.eye(4)[None]))
        times = np.arange(10.0)
        for time in times:
            state = tracker.step(state, Scan(time, "radar", Detections.of([], 2)))
            if not len(state.ids):
                break
        assert not len(state.ids)
        state = tracker.step(state, Scan(time + 1.0, "radar", Detections.of([[0.5, 0.5]])))
        found.append(float(state.existence[0]) if len(state.ids) else 0.0)
    assert found[1] > 100 * found[0]


@pytest.mark.parametrize("estimator", ["kalman", "bootstrap_particles"])
def test_a_place_that_lacks_an_axis_is_refused_where_the_config_names_it(estimator):
    whole = {"x": [0, 50], "y": [0, 50], "vx": [0, 5], "vy": [0, 5]}
    places = [{"at": whole, "initial": 1.0}, {"at": {"x": [0, 50], "y": [0, 50], "vx": [0, 5]}, "rate": 0.1}]
    particles = {"particles": 100} if estimator == "bootstrap_particles" else {}
    parts = {
        "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}, **particles},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "pda"},
        "lifecycle": {"kind": "existence"},
    }
    with pytest.raises(ConfigError, match=r"^birth\.appear\[1\]\.at: must state .* of 'vy'$"):
        build({**parts, "birth": {"kind": "poisson", "appear": places}})
    assert build({**parts, "birth": {"kind": "poisson", "appear": places[:1]}}).starters == {"radar"}
