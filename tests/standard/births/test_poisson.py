"""The Poisson birth: by closed forms, and in a tracker against a published benchmark's filter."""

import csv
from collections import defaultdict

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.special import ndtr

import vedette
from support.paths import EXAMPLES, recording
from vedette import Detections
from vedette.sampling import Bounds
from vedette_standard.births.poisson import Appearance, Poisson
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing

FILTER, RADAR = Kalman(ConstantVelocity(0.3)), CartesianPosition(2.0, 0.8, 1e-4)
AT = {"x": [10.0, 30.0], "y": [-20.0, 40.0], "vx": [0.0, 2.0], "vy": [0.0, 3.0]}
RNG = np.random.default_rng(0)


def revealed(birth, z, dt=0.0):
    memory = birth.predict(birth.initial_memory(FILTER, RNG), FILTER, dt, RNG)
    return memory, birth.reveal(memory, FILTER, RADAR, Detections.of(z), 1.0)


def density(z, mean, variance):
    return np.prod(np.exp(-0.5 * (z - mean) ** 2 / variance) / np.sqrt(2 * np.pi * variance))


def test_a_new_track_exists_by_its_rate_against_the_clutter_and_has_the_posterior():
    birth, z = Poisson((Appearance(AT, initial=1.5),)), np.array([25.0, -10.0])
    _, (rate, found) = revealed(birth, [z])
    expected = 1.5 * 0.8 * density(z, np.array([10.0, -20.0]), np.array([904.0, 1604.0]))
    np.testing.assert_allclose(rate, [expected])
    newborn = birth.begin(found, FILTER, RADAR, "radar", Detections.of([z]), np.array([0.25]))
    np.testing.assert_allclose(newborn.existence, [0.75 * expected / (expected + 1e-4)])
    gain = np.array([900.0 / 904.0, 1600.0 / 1604.0])
    order = [FILTER.state.names.index(name) for name in ("x", "y")]
    np.testing.assert_allclose(newborn.prior.mean[0, order], [10.0, -20.0] + gain * (z - [10.0, -20.0]))
    np.testing.assert_allclose(np.diag(newborn.prior.cov[0])[order], 4.0 * gain)


@pytest.mark.parametrize(("place", "spread"), [(0.0, 800.0), (400.0, 150.0), (1e5, 800.0)])
def test_a_radar_beside_a_place_counts_no_turns_of_its_bearing(place, spread):
    """At 50 m from a radar, the tangent of a bearing goes round and round before it is as far off as the place."""
    radar, estimator = RangeBearing(2.0, 0.002, 1e-6), ExtendedKalman(ConstantVelocity(0.3))
    birth = Poisson((Appearance({"x": [place, spread], "y": [0.0, spread], "vx": [0.0, 2.0], "vy": [0.0, 2.0]}, 1.0),))
    bearing = np.linspace(-3.0, 3.0, 40)
    x, y = 50.0 * np.cos(bearing), 50.0 * np.sin(bearing)
    seen = Detections.of(np.column_stack([np.full(40, 50.0), bearing]))
    rate, _ = birth.reveal(birth.initial_memory(estimator, RNG), estimator, radar, seen, 1.0)
    by_area = np.exp(-0.5 * ((x - place) ** 2 + y**2) / spread**2) / (2 * np.pi * spread**2)  # errors are far smaller
    np.testing.assert_allclose(rate, by_area * 50.0, rtol=2e-2)


def test_a_return_without_its_velocity_starts_a_track_as_that_of_a_sensor_without_one():
    """So does the clutter count over the components that it has: over all, false returns were targets."""
    z, some, none = np.array([[25.0, -10.0, 0.0, 0.0]]), np.array([True]), np.zeros(1)
    whole = Partial(PositionVelocity(2.0, 0.5, 0.8, clutter_density=1e-4 / 60.0), {"vx": 6.0, "vy": 10.0})
    birth, begun = Poisson((Appearance(AT, initial=1.5),)), []
    partly = Detections(z, some, missing=np.array([[False, False, True, True]]))
    for radar, seen in ((whole, partly), (RADAR, Detections(z[:, :2], some))):
        rate, found = birth.reveal(birth.initial_memory(FILTER, RNG), FILTER, radar, seen, 1.0)
        new = birth.begin(found, FILTER, radar, "radar", seen, none)
        begun.append([rate, new.existence, new.prior.mean, new.prior.cov])
    for one, other in zip(*begun, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_what_is_not_detected_is_thinned_and_what_comes_is_added():
    birth = Poisson((Appearance(AT, initial=2.0, rate=0.1),), lifetime=50.0)
    memory, _ = revealed(birth, [[0.0, 0.0]], dt=5.0)
    np.testing.assert_allclose(memory.weights, [2.0 * np.exp(-0.1), 0.1 * 50.0 * (1.0 - np.exp(-0.1))])
    np.testing.assert_allclose(
        birth.update(memory, FILTER, RADAR, Detections.of([], 2), np.zeros(0), 0.9).weights, memory.weights * (1 - 0.72)
    )


@pytest.mark.parametrize("edge", [-30.0, 10.0, 55.0])
def test_a_look_at_a_part_of_a_place_leaves_what_is_in_the_other(edge):
    birth = Poisson((Appearance(AT, initial=2.0),))
    west = CartesianPosition(2.0, 0.8, 1e-4, view={"x": Bounds(-1e4, edge)})
    left = birth.update(birth.initial_memory(FILTER, RNG), FILTER, west, Detections.of([], 2), np.zeros(0), 0.9)
    np.testing.assert_allclose(left.weights, 2.0 * (1.0 - 0.72 * ndtr((edge - 10.0) / 30.0)), atol=0.1)


def test_several_places_are_matched_in_their_moments():
    far = AT | {"x": [60.0, 30.0]}
    birth, z = Poisson((Appearance(AT, initial=1.0), Appearance(far, initial=3.0))), np.array([30.0, -20.0])
    _, (_, found) = revealed(birth, [z])
    newborn = birth.begin(found, FILTER, RADAR, "radar", Detections.of([z]), np.zeros(1))
    variance = np.array([904.0, 1604.0])
    likely = np.array([density(z, np.array([10.0, -20.0]), variance), 3 * density(z, np.array([60.0, -20.0]), variance)])
    share, each = likely / likely.sum(), np.array([10.0, 60.0]) + 900 / 904 * (30.0 - np.array([10.0, 60.0]))
    x = FILTER.state.names.index("x")
    np.testing.assert_allclose(newborn.prior.mean[0, x], share @ each)
    np.testing.assert_allclose(newborn.prior.cov[0, x, x], 4 * 900 / 904 + share @ (each - share @ each) ** 2)


def test_what_is_missing_is_told():
    birth = Poisson((Appearance({"x": [0, 1]}, initial=1.0),))
    with pytest.raises(ValueError, match=r"appear\[0\].at: must state \[mean, standard deviation\] of 'y', 'vx', 'vy'"):
        birth.initial_memory(FILTER, RNG)
    with pytest.raises(ValueError, match="appear: must hold at least one"):
        Poisson(())


@pytest.mark.parametrize("run", range(2))
def test_with_exact_marginals_the_tracker_is_the_published_filter(run):
    """Two of the benchmark's runs, 81 scans each: the targets reported are the oracle's, within 3 mm.

    The oracle leaves P_D as it is where the gate, at a squared distance of 20, takes 5e-5 of it, and gates its births.
    """
    folder, expected = recording("mtt"), defaultdict(list)
    for row in csv.DictReader((folder / "expected.csv").read_text().splitlines()):
        if (row["run"], row["filter"]) == (str(run), "pmb_murty"):
            expected[int(row["scan"])].append((float(row["x"]), float(row["y"])))
    experiment = vedette.load(EXAMPLES / "crossing.toml", overrides=[f"source.path={folder / f'run{run}.jsonl'}"])
    tracker = experiment.tracker
    state, order = tracker.start(), [tracker.state.names.index(name) for name in ("x", "y")]
    for k, scan in enumerate(experiment.source.open(tracker.sensors, RNG).scans):
        state = tracker.step(state, scan)
        found = tracker.estimate(state).mean[state.existence > 0.4][:, order]
        assert len(found) == len(expected[k]), k
        if len(found):
            apart = np.linalg.norm(found[:, None] - np.array(expected[k])[None], axis=-1)
            assert np.max(apart[linear_sum_assignment(apart)]) < 3e-3, k
    assert state.approximated == 0
