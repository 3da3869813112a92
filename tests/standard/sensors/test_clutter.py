"""Clutter as it is stated: its number over the view, how it spreads, what is drawn of it, and the scores that use it."""

import re

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import vedette
from support.laws_of_sensors import PROFILE
from support.statistics import ALPHA, dispersion_p
from vedette import Detections, Gaussian, Pose, Scan
from vedette.sampling import Bounds, draw_clutter
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate
from vedette_standard.sensors.range_only import RangeOnly

TURN, UP = (-np.pi, np.pi), (-np.pi / 2, np.pi / 2)
SPREADS = st.sampled_from(["area", "range"])
NUMBERS, NEAR, FAR = st.floats(0.1, 100.0), st.floats(1.0, 100.0), st.floats(150.0, 1e5)
VIEW = {"x": Bounds(-50, 150), "y": Bounds(10, 40), "vx": Bounds(-5, 5), "vy": Bounds(-2, 3)}


def nodes(*axes):
    """Gauss-Legendre nodes (g, m) over a box, and their weights (g,)."""
    places, weights = np.polynomial.legendre.leggauss(12)
    sides = [low + (high - low) * (places + 1) / 2 for low, high in axes]
    z = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(axes))
    w = np.stack(np.meshgrid(*[weights] * len(axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    return z, np.prod(w, axis=-1) * np.prod([(high - low) / 2 for low, high in axes])


def count(sensor, *axes):
    """Expected false returns in a box of the measurement space."""
    z, w = nodes(*axes)
    return float(np.sum(w * sensor.clutter(z)))


def count_around(sensor, at, near, far):
    """Expected false returns of a sensor of positions between two ranges from where it stands."""
    polar, w = nodes((near, far), TURN)
    r, b = polar.T
    return float(np.sum(w * r * sensor.clutter(at + np.stack([r * np.cos(b), r * np.sin(b)], axis=-1))))


def share(spread, power, near, middle, far):
    """The part of evenly spread clutter that lies below `middle`."""
    return (middle**power - near**power) / (far**power - near**power) if spread == "area" else (middle - near) / (far - near)


@PROFILE
@given(NUMBERS, NEAR, FAR, SPREADS, st.floats(0.2, 1.0))
def test_clutter_integrates_to_its_number_over_the_view(n, near, far, spread, part):
    stated = {"min_range": near, "max_range": far, "clutter_per_scan": n, "clutter_uniform_over": spread}
    middle = near + part * (far - near)
    plane, space = n * share(spread, 2, near, middle, far), n * share(spread, 3, near, middle, far)
    below = (near, middle)
    assert count(RangeOnly(10.0, **stated), below) == pytest.approx(plane, rel=1e-9)
    assert count(RangeBearing(10.0, 0.01, **stated), below, TURN) == pytest.approx(plane, rel=1e-9)
    doppler = RangeBearingRate(10.0, 0.01, 0.5, max_rate=60.0, **stated)
    assert count(doppler, below, TURN, (-60.0, 60.0)) == pytest.approx(plane, rel=1e-9)
    assert count(RangeBearingElevation(10.0, 0.02, 0.03, **stated), below, TURN, UP) == pytest.approx(space, rel=1e-9)
    at = np.array([300.0, -200.0])
    polar = PolarPosition(10.0, 0.02, **stated)
    assert count_around(polar.at(Pose(at)), at, near, middle) == pytest.approx(plane, rel=1e-9)
    assert count_around(attrs.evolve(polar, x=300.0, y=-200.0), at, near, middle) == pytest.approx(plane, rel=1e-9)


@PROFILE
@given(NUMBERS)
def test_clutter_of_a_box_integrates_to_its_number(n):
    position = CartesianPosition(3.0, view={name: VIEW[name] for name in "xy"}, clutter_per_scan=n)
    motion = PositionVelocity(3.0, 0.5, view=VIEW, clutter_per_scan=n)
    for sensor in (position, motion):
        assert count(sensor, *((VIEW[name].low, VIEW[name].high) for name in sensor.measurement.names)) == pytest.approx(n)
    assert count(BearingOnly(0.1, clutter_per_scan=n), TURN) == pytest.approx(n)


@PROFILE
@given(st.floats(1e-9, 1e-2), st.floats(0.0, 100.0), FAR)
def test_a_density_per_area_is_the_same_whatever_is_measured(c, near, far):
    area, volume = np.pi * (far**2 - near**2), 4 / 3 * np.pi * (far**3 - near**3)
    stated = {"min_range": near, "max_range": far, "clutter_density": c}
    assert count(RangeOnly(10.0, **stated), (near, far)) == pytest.approx(c * area)
    assert count(RangeBearing(10.0, 0.01, **stated), (near, far), TURN) == pytest.approx(c * area)
    doppler = RangeBearingRate(10.0, 0.01, 0.5, max_rate=60.0, **stated)
    assert count(doppler, (near, far), TURN, (-60.0, 60.0)) == pytest.approx(c * area)
    space = RangeBearingElevation(10.0, 0.02, 0.03, **stated)
    assert count(space, (near, far), TURN, UP) == pytest.approx(c * volume, rel=1e-6)
    assert count_around(PolarPosition(10.0, 0.02, **stated), np.zeros(2), near, far) == pytest.approx(c * area)
    assert float(RangeBearing(10.0, 0.01, clutter_density=c).clutter(np.array([2 * far, 0.0]))) == pytest.approx(2 * far * c)


@PROFILE
@given(NUMBERS, NEAR, FAR, SPREADS, st.floats(0.5, 2.0))
def test_positions_and_ranges_state_the_same_clutter(n, near, far, spread, part):
    """Per area it is that per range and bearing, over the range; within the limits, as at them beyond."""
    stated = {"min_range": near, "max_range": far, "clutter_per_scan": n, "clutter_uniform_over": spread}
    polar, split = PolarPosition(10.0, 0.02, **stated), RangeBearing(10.0, 0.02, **stated)
    r = np.array([near, part * near, part * far, far])
    z = np.stack([r * np.cos(1.0), r * np.sin(1.0)], axis=-1)
    ranges = np.stack([r, np.full(4, 1.0)], axis=-1)
    within = np.clip(r, near, far)
    np.testing.assert_allclose(polar.clutter(z) * within, np.broadcast_to(split.clutter(ranges), 4), rtol=1e-9)


RADAR = PolarPosition(5.0, 0.02, min_range=3.0, max_range=800.0, clutter_per_scan=30.0, clutter_uniform_over="range")
BOX = {"x": Bounds(-800, 800), "y": Bounds(-800, 800)}


def drawn_within(sensor, at, runs=400):
    """Range, bearing and number of drawn false returns in view."""
    box = {"x": Bounds(at[0] - 800, at[0] + 800), "y": Bounds(at[1] - 800, at[1] + 800)}
    z, valid = draw_clutter(sensor, box, np.random.default_rng(1), (runs,))
    dx, dy = np.moveaxis(z - at, -1, 0)
    r = np.hypot(dx, dy)
    inside = valid & (r >= 3.0) & (r <= 800.0)
    return r[inside], np.arctan2(dy, dx)[inside], np.sum(inside, axis=-1)


@pytest.mark.parametrize("at", [np.zeros(2), np.array([120.0, -333.0])], ids=["at 0", "on a platform"])
@pytest.mark.by_turns
def test_drawn_clutter_is_uniform_in_range_and_bearing(at):
    r, bearing, counts = drawn_within(RADAR.at(Pose(at)), at)
    assert dispersion_p(counts, 30.0) > ALPHA
    assert dispersion_p(counts, 33.0) < ALPHA
    assert stats.kstest(r, stats.uniform(3.0, 797.0).cdf).pvalue > ALPHA
    assert stats.kstest(bearing, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > ALPHA


def test_drawn_clutter_is_uniform_over_the_area():
    r, bearing, counts = drawn_within(attrs.evolve(RADAR, clutter_uniform_over="area"), np.zeros(2))
    assert dispersion_p(counts, 30.0) > ALPHA
    assert stats.kstest(r, lambda r: (r**2 - 9.0) / (800.0**2 - 9.0)).pvalue > ALPHA
    assert stats.kstest(r, stats.uniform(3.0, 797.0).cdf).pvalue < ALPHA
    assert stats.kstest(bearing, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > ALPHA


def test_a_scene_draws_the_clutter_of_its_radar():
    """A simulated quiet sea: the false returns of all scans are uniform in range."""
    radar = {name: value for name, value in attrs.asdict(RADAR).items() if not name.startswith("_")} | {"kind": RADAR.kind}
    look = {"interval": 1.0, "clutter": {axis: {"low": -800, "high": 800} for axis in "xy"}}
    recording = vedette.load(
        {
            "source": {"kind": "simulation", "duration": 100, "looks": {"radar": look}},
            "sensors": {"radar": radar},
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
            "lifecycle": {"kind": "existence"},
        }
    )
    scans = recording.source.open(recording.tracker.sensors, np.random.default_rng(3)).scans
    r = np.concatenate([np.hypot(*scan.detections.z.T) for scan in scans])
    assert stats.kstest(r[(r >= 3) & (r <= 800)], stats.uniform(3.0, 797.0).cdf).pvalue > ALPHA
    assert stats.kstest(r[r <= 800], lambda r: r**2 / 800.0**2).pvalue < ALPHA


# Scores.
def weights_of(associator, sensor, returns, pose):
    """Association weights of one sure track halfway between two returns, and the log densities of these."""
    tracker = vedette.build(
        {
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1e-3}},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0}},
            "associator": {"kind": associator},
            "lifecycle": {"kind": "single_target"},
            "birth": {"kind": "given", "start": {name: [0, 1] for name in ("x", "y", "vx", "vy")}},
        }
    )
    tracker = attrs.evolve(tracker, sensors={"radar": sensor})
    middle = np.mean(returns, axis=0)
    cov = np.diag([40.0**2, 40.0**2, 1e-6, 1e-6])
    state = tracker.start(Gaussian(np.array([[*middle, 0.0, 0.0]]), cov[None]), 0.0)
    return tracker.step(state, Scan(0.0, "radar", Detections.of(returns), pose)).weights[0]


@pytest.mark.parametrize("associator", ["pda", "jpda", "gnn", "nearest"])
@pytest.mark.parametrize("pose", [None, Pose(np.array([500.0, 70.0]))], ids=["fixed", "moving"])
def test_scores_take_the_density_at_each_returns_place(associator, pose):
    """Of two returns as likely the target's, the farther one is less likely clutter, by the ratio of the ranges."""
    at = np.zeros(2) if pose is None else pose.position
    returns = at + np.array([[50.0, 0.0], [110.0, 0.0]])
    even = attrs.evolve(RADAR, detection_probability=0.9, sigma_bearing=1e-3)
    miss, near, far = weights_of(associator, even, returns, pose)
    if associator in ("pda", "jpda"):
        assert far / near == pytest.approx(110.0 / 50.0, rel=1e-2)
        alike = weights_of(associator, attrs.evolve(even, clutter_uniform_over="area"), returns, pose)
        assert alike[2] / alike[1] == pytest.approx(1.0, rel=1e-2)
    else:
        assert (near, far) == (0.0, 1.0)
        _, near, far = weights_of(associator, even, returns[::-1], pose)
        assert (near, far) == (1.0, 0.0)
    assert miss < 0.5


# The laws bite.
class Mutant:
    """A sensor with another clutter density."""

    def __init__(self, sensor, clutter):
        self.sensor, self.clutter = sensor, clutter

    def __getattr__(self, name):
        return getattr(self.sensor, name)


def test_the_laws_of_clutter_bite():
    assert count_around(RADAR, np.zeros(2), 3.0, 800.0) == pytest.approx(30.0)
    per_area = Mutant(RADAR, lambda z: np.full(z.shape[:-1], 30.0 / (np.pi * (800.0**2 - 9.0))))
    assert count_around(per_area, np.zeros(2), 3.0, 400.0) != pytest.approx(30.0 * 397 / 797, rel=1e-3)
    not_per_area = Mutant(RADAR, lambda z: np.full(z.shape[:-1], 30.0 / (2 * np.pi * 797.0)))
    assert count_around(not_per_area, np.zeros(2), 3.0, 800.0) != pytest.approx(30.0, rel=1e-3)
    where_it_is_built = Mutant(RADAR, RADAR.clutter)
    assert count_around(where_it_is_built, np.array([300.0, 0.0]), 3.0, 800.0) != pytest.approx(30.0, rel=1e-3)


# Views and limits.
def test_nothing_is_detected_outside_the_view():
    sensor = CartesianPosition(3.0, 0.8, view={"x": VIEW["x"]})
    assert sensor.detects(np.array([[-51.0, 0.0], [0.0, 1e9], [151.0, 0.0]])).tolist() == [0.0, 0.8, 0.0]
    assert CartesianPosition(3.0, 0.8).detects(np.zeros((3, 2))).shape == ()
    radar = PolarPosition(3.0, 0.02, detection_probability=0.8, min_range=5.0, max_range=50.0)
    assert radar.detects(np.array([[4.0, 0.0], [30.0, 40.0], [51.0, 0.0]])).tolist() == [0.0, 0.8, 0.0]


def test_a_wrapped_sensor_has_the_clutter_of_what_it_wraps():
    inner = RangeBearing(10.0, 0.01, max_range=800.0, clutter_per_scan=30.0, clutter_uniform_over="range")
    assert float(Biased(inner, add={"bearing": "bias"}).clutter(np.zeros((1, 2)))) == float(inner.clutter(np.zeros((1, 2))))


def test_a_view_is_written_back():
    config = {"kind": "cartesian_position", "sigma": 3.0, "view": {"x": {"low": -1, "high": 2}, "y": {"low": 0, "high": 9}}}
    tracker = {
        "sensors": {"radar": config | {"clutter_per_scan": 2.0}},
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
        "lifecycle": {"kind": "existence"},
    }
    experiment = vedette.load(tracker)
    assert vedette.load(vedette.to_config(experiment)) == experiment
    assert float(experiment.tracker.sensors["radar"].clutter(np.zeros((1, 2)))) == pytest.approx(2.0 / 27.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: PolarPosition(1.0, 0.1, clutter_density=1e-6, clutter_per_scan=3.0, max_range=9.0),
            "clutter_per_scan: give either this or clutter_density, not both",
        ),
        (
            lambda: RangeBearing(1.0, 0.1, clutter_density=1e-6, clutter_per_scan=3.0, max_range=9.0),
            "clutter_per_scan: give either this or clutter_density, not both",
        ),
        (
            lambda: CartesianPosition(1.0, clutter_density=1e-6, clutter_per_scan=3.0),
            "clutter_per_scan: give either this or clutter_density, not both",
        ),
        (lambda: PolarPosition(1.0, 0.1, clutter_per_scan=3.0), "clutter_per_scan: needs max_range"),
        (lambda: PolarPosition(1.0, 0.1, min_range=9.0, max_range=3.0), "max_range: must be > min_range, 9 m, got 3 m"),
        (
            lambda: PolarPosition(1.0, 0.1, max_range=9.0, clutter_per_scan=3.0, clutter_uniform_over="range"),
            "clutter_uniform_over: 'range' needs min_range > 0",
        ),
        (
            lambda: PolarPosition(1.0, 0.1, clutter_uniform_over="bearing"),
            "clutter_uniform_over: must be one of 'area', 'range', got 'bearing'",
        ),
        (lambda: RangeBearingRate(1.0, 0.1, 1.0, clutter_density=1e-6), "clutter_density: needs max_rate"),
        (lambda: CartesianPosition(1.0, view={"vx": VIEW["vx"]}), "view.vx: must be one of x, y"),
        (lambda: CartesianPosition(1.0, view={"x": VIEW["x"]}, clutter_per_scan=3.0), "clutter_per_scan: needs view.y"),
        (lambda: PositionVelocity(1.0, 1.0, clutter_per_scan=3.0), "clutter_per_scan: needs view.x"),
    ],
)
def test_a_wrong_parameter_is_named_with_what_would_be_right(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()
