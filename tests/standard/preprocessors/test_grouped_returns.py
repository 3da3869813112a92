"""Several returns of an object as one: which are joined, and what becomes of what they bring."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from vedette import Detections, Pose, Scan
from vedette_standard import BearingOnly, CartesianPosition, Partial, PositionVelocity, RangeBearing, RangeBearingRate
from vedette_standard.preprocessors.grouped_returns import GroupedReturns

PLANE = CartesianPosition(0.5)
CARS = GroupedReturns({"raw": PLANE}, link=3.0)


def made(of, seen, pose=None):
    return of.process({"raw": Scan(0.0, "raw", seen, pose)})


def drawn(seed, cars=6, each=4):
    """Return returns (k, 2) of cars at least 30 m apart, and the middle of those of each car."""
    rng = np.random.default_rng(seed)
    at = 30.0 * rng.permutation(36)[:cars, None] // 6 * [1.0, 0.0] + 30.0 * rng.permutation(36)[:cars, None] % 6 * [0.0, 1.0]
    at += 30.0 * np.arange(cars)[:, None] * [10.0, 0.0]
    groups = [place + np.cumsum(rng.uniform(-1.0, 1.0, (1 + rng.poisson(each), 2)), axis=0) for place in at]
    return groups, np.array([np.mean(group, axis=0) for group in groups])


@given(st.integers(0, 2**32), st.floats(-np.pi, np.pi))
def test_each_group_gives_its_mean_however_the_scene_lies_and_its_returns_are_ordered(seed, angle):
    groups, middles = drawn(seed)
    turn, rng = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), np.random.default_rng(seed)
    z = rng.permutation(np.concatenate(groups)) @ turn.T + [1e5, -1e5]
    found = made(CARS, Detections.of(z)).z
    back = (found - [1e5, -1e5]) @ turn
    assert np.allclose(back[np.lexsort(back.T)], middles[np.lexsort(middles.T)], atol=1e-8)


@given(st.integers(0, 2**32))
def test_returns_apart_are_as_they_were(seed):
    rng = np.random.default_rng(seed)
    z = 30.0 * rng.permutation(50)[:, None] * [1.0, -1.0] + rng.uniform(-1.0, 1.0, (50, 2))
    own = np.eye(2) * rng.uniform(1.0, 2.0, (50, 1, 1))
    seen = Detections(z, np.ones(50, dtype=bool), rng.standard_normal(50), own, None, np.arange(50), np.zeros(50))
    same = made(CARS, seen)
    for name in ("z", "valid", "evidence", "noise", "identity", "time"):
        assert np.array_equal(getattr(same, name), getattr(seen, name)), name


@given(st.integers(0, 2**32))
def test_runs_together_give_what_each_gives_alone(seed):
    z = [np.concatenate(drawn(seed + run)[0]) for run in range(3)]
    most = max(map(len, z))
    padded = np.stack([np.pad(each, ((0, most - len(each)), (0, 0))) for each in z])
    together = made(CARS, Detections(padded, np.arange(most) < [[len(each)] for each in z]))
    for run, each in enumerate(z):
        assert np.array_equal(together.z[run][together.valid[run]], made(CARS, Detections.of(each)).z)


def test_what_returns_bring_goes_with_their_mean():
    z, own = [[0.0, 0.0], [2.0, 0.0], [50.0, 0.0]], np.eye(2) * np.array([1.0, 3.0, 7.0])[:, None, None]
    seen = Detections(np.array(z), np.ones(3, dtype=bool), [1.0, 5.0, -2.0], own, None, None, [-0.4, -0.2, 0.0])
    joined = made(CARS, seen)
    assert joined.z.tolist() == [[1.0, 0.0], [50.0, 0.0]]
    assert joined.noise.tolist() == (np.eye(2) * np.array([2.0, 7.0])[:, None, None]).tolist()
    assert joined.evidence.tolist() == [5.0, -2.0]
    assert np.allclose(joined.time, [-0.3, 0.0])


def test_names_keep_returns_apart():
    named = Detections(np.zeros((4, 2)), np.ones(4, dtype=bool), identity=[7, 8, 7, -1])
    assert made(CARS, named).identity.tolist() == [7, 8, -1]


def test_bearings_are_averaged_through_the_wrap_and_from_where_the_radar_is():
    radar = RangeBearing(sigma_range=0.5, sigma_bearing=0.01)
    near = GroupedReturns({"raw": radar}, link=3.0)
    z = [[100.0, np.pi - 0.01], [100.0, -np.pi + 0.01], [10.0, 1.0], [10.0, 1.2], [100.0, 1.0], [100.0, 1.2]]
    joined = made(near, Detections.of(z), Pose(np.array([500.0, 0.0]), heading=1.0)).z
    assert np.allclose(joined, [[100.0, -np.pi], [10.0, 1.1], [100.0, 1.0], [100.0, 1.2]])
    rates = GroupedReturns({"raw": RangeBearingRate(0.5, 0.01, 0.1)}, link=3.0)
    assert np.allclose(made(rates, Detections.of([[50.0, 0.0, 3.0], [51.0, 0.0, 4.0]])).z, [[50.5, 0.0, 3.5]])


def test_a_group_too_long_is_two_objects_and_few_returns_are_none():
    side_by_side = np.array([[0.0, 0.0], [0.5, 0.2], [1.0, 0.0], [3.5, 0.0], [4.0, 0.2], [4.5, 0.0]])
    assert len(made(CARS, Detections.of(side_by_side)).z) == 1
    assert np.allclose(made(evolve(CARS, longest=2.0), Detections.of(side_by_side)).z, [[0.5, 0.2 / 3], [4.0, 0.2 / 3]])
    alone = np.concatenate([side_by_side, [[90.0, 0.0]]])
    assert len(made(evolve(CARS, fewest=2), Detections.of(alone)).z) == 1


def test_what_tells_no_place_is_refused():
    with pytest.raises(ValueError, match=r"sensors.raw: must tell places, but one return of 'bearing_only'"):
        GroupedReturns({"raw": BearingOnly(0.01)}, link=3.0)
    with pytest.raises(ValueError, match="sensors: must hold one sensor, got 2"):
        GroupedReturns({"a": PLANE, "b": PLANE}, link=3.0)


def test_returns_that_lack_a_velocity_are_grouped_by_place_and_count_where_none_has_more():
    sensor = Partial(PositionVelocity(1.0, 0.5), {"vx": 40.0, "vy": 40.0})
    z = np.array([[0, 0, 5, 1], [1, 0, 7, 7], [2, 0, 9, 3], [50, 0, 7, 7], [52, 0, 7, 7], [90, 0, 4, 4]], dtype=float)
    missing = np.zeros((6, 4), dtype=bool)
    missing[[1, 3, 4], 2:] = True
    found = made(GroupedReturns({"raw": sensor}, link=3.0), Detections(z, np.ones(6, dtype=bool), missing=missing))
    assert found.missing.tolist() == missing[[0, 3, 5]].tolist()
    assert found.z[~found.missing].tolist() == [1, 0, 7, 2, 51, 0, 90, 0, 4, 4]


def test_a_return_without_its_range_joins_none_and_is_no_lone_one():
    sensor = Partial(RangeBearing(5.0, 0.01), {"range": 900.0})
    z = np.array([[100, 0], [np.nan, 0.0], [101, 0], [np.nan, 0.0], [500, 0]], dtype=float)
    groups = GroupedReturns({"raw": sensor}, link=3.0, fewest=2)
    found = made(groups, Detections(z, np.ones(5, dtype=bool), missing=np.isnan(z)))
    assert found.z[:, 1].tolist() == [0, 0, 0]
    assert found.missing[:, 0].tolist() == [False, True, True]
