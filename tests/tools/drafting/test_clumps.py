"""Drafts of files whose objects give several returns a scan."""

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vedette
from vedette_tools.drafting.clumps import clumped
from vedette_tools.drafting.config import draft_config

HALF = 200.0


def drawn(each, seed=1, scans=150, clutter=5.0, apart=60.0):
    """Return scans of returns (k, 2): so many of each of six cars in a column on average, and clutter."""
    rng = np.random.default_rng(seed)
    place = apart * np.stack(np.divmod(np.arange(6), 2), axis=-1) - apart + rng.uniform(-5.0, 5.0, (6, 2))
    ways = rng.uniform(-np.pi, np.pi)
    ahead = np.array([[np.cos(ways), np.sin(ways)], [-np.sin(ways), np.cos(ways)]])
    spots = []
    for k in range(scans):
        of = np.repeat(np.arange(6), rng.poisson(each, 6))
        on = rng.uniform(-0.5, 0.5, (len(of), 2)) * [4.4, 1.8] @ ahead + rng.normal(0.0, 0.2, (len(of), 2))
        z = place[of] + 0.8 * k * ahead[0] + on
        spots.append(rng.permutation(np.concatenate([z, rng.uniform(-HALF, HALF, (rng.poisson(clutter), 2))])))
    return spots


def written(path, spots, polar=False):
    """Write a row for each return."""
    rows = ["time,range,azimuth" if polar else "time,x,y"]
    for k, places in enumerate(spots):
        told = np.stack([np.hypot(*places.T), np.degrees(np.arctan2(*places.T)) % 360], axis=-1) if polar else places
        rows += [f"{0.1 * k:.1f},{a:.3f},{b:.3f}" for a, b in told.tolist()]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@given(st.integers(0, 2**32), st.floats(2.0, 12.0))
@pytest.mark.costly
def test_a_link_joins_what_is_of_one_object_and_leaves_the_others_apart(seed, each):
    assert 1.5 < clumped(drawn(each, seed, scans=60)) < 15.0


@given(st.integers(0, 2**32), st.sampled_from([3, 10, 50, 300]))
@pytest.mark.costly
def test_returns_anywhere_are_in_no_clumps(seed, count):
    rng = np.random.default_rng(seed)
    assert clumped([rng.uniform(0.0, 1000.0, (rng.poisson(count), 2)) for _ in range(60)]) is None


def test_of_nothing_nothing_is_told():
    assert clumped([]) is None
    assert clumped([np.zeros((0, 2)), np.zeros((1, 2))]) is None
    assert clumped([np.zeros((5, 2))] * 9) is None


@pytest.mark.costly
@pytest.mark.parametrize(("each", "polar"), [(3.0, False), (8.0, True)])
def test_objects_of_several_returns_are_drafted_with_one_of_each_and_tracked(each, polar, tmp_path):
    """Drafts said that nothing fits, as several tracks shared the same returns."""
    path = written(tmp_path / "cars.csv", drawn(each, clutter=2.0), polar)
    text = draft_config(path)
    config = tomllib.loads(text)
    assert config["preprocessors"]["sensor"]["kind"] == "grouped_returns"
    assert 1.5 < config["preprocessors"]["sensor"]["link"] < 15.0
    assert "sensor: objects give several returns a scan" in text
    assert "nothing fits" not in text
    tracks = vedette.load(config | {"source": config["source"] | {"path": str(path)}}).run().tracks
    assert sum(np.sum(track.confirmed) > 100 for track in tracks) == 6


@pytest.mark.costly
def test_pairs_that_fly_together_are_left_two(tmp_path):
    rng, spots = np.random.default_rng(3), []
    place, speed = rng.uniform(-60.0, 60.0, (3, 2)), rng.uniform(-10.0, 10.0, (3, 2))
    for k in range(120):
        z = np.concatenate([place + 0.1 * k * speed, place + 0.1 * k * speed + [6.0, 2.0]])
        spots.append(rng.permutation(z + rng.normal(0.0, 0.5, z.shape)))
    assert clumped(spots) is not None
    assert "preprocessors" not in tomllib.loads(draft_config(written(tmp_path / "pairs.csv", spots)))


@pytest.mark.costly
def test_each_of_two_sensors_is_asked_by_itself(tmp_path):
    """A lidar gives several returns of a car, the radar beside it one."""
    rows, rng = ["time,sensor,x,y"], np.random.default_rng(5)
    for k, lidar in enumerate(drawn(6.0, scans=80, clutter=1.0, apart=90.0)):
        place = 90.0 * np.stack(np.divmod(np.arange(6), 2), axis=-1) - 90.0 + [0.5 * k, 200.0]
        radar = rng.normal(place, 1.5)[rng.random(6) < 0.9]
        for name, time, spots in (("lidar", 0.2 * k, lidar), ("radar", 0.2 * k + 0.1, radar)):
            rows += [f"{time:.1f},{name},{x:.2f},{y:.2f}" for x, y in spots.tolist()]
    (tmp_path / "both.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    assert list(tomllib.loads(draft_config(tmp_path / "both.csv"))["preprocessors"]) == ["lidar"]
