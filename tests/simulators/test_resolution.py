"""Returns of objects nearer than a resolution cell merge; statistics accept at a false alarm rate of ALPHA."""

import numpy as np
import pytest
from scipy import stats

import vedette_sim as sim
from support.scenes import SENSORS, SHIPS, Polar, rows, scene
from support.statistics import ALPHA, moments_match
from vedette import ConfigError
from vedette.sampling import returns
from vedette_sim.resolution import merged_returns
from vedette_standard.sensors.cartesian_position import CartesianPosition


def groups(h, cells, period):
    """Chains of pairs nearer than the cells, by following them one by one; `period` of the second axis, or None."""
    apart = np.abs(h[:, None] - h[None])
    if period is not None:
        apart[..., 1] = np.minimum(apart[..., 1] % period, -apart[..., 1] % period)
    near = np.all(apart < cells, axis=-1)
    found, left = [], set(range(len(h)))
    while left:
        chain, todo = set(), [min(left)]
        while todo:
            one = todo.pop()
            if one not in chain:
                chain.add(one)
                todo += [j for j in left if near[one, j]]
        left -= chain
        found.append(sorted(chain))
    return found


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("cells", [(30.0, 30.0), (10.0, np.inf), (25.0, 0.3)])
def test_groups_are_the_chains_of_unresolved_detected_objects(seed, cells):
    rng = np.random.default_rng(seed)
    polar = cells[1] == 0.3
    sensor = Polar(p_detect=0.8) if polar else CartesianPosition(1.0, 0.8)
    x = rng.uniform(-150, 150, (25, 2))
    uniform, standard = rng.random(25), rng.standard_normal((25, 2))
    z, seen = merged_returns(sensor, x, uniform, standard, np.array(cells))
    plain, detected = returns(sensor, x, uniform, standard)
    h, rows_ = sensor.measure(x), np.flatnonzero(detected)
    expected = groups(h[rows_], np.array(cells), 2 * np.pi if polar else None)
    assert 1 < len(expected) < len(rows_)
    assert sorted(np.flatnonzero(seen)) == sorted(rows_[chain[0]] for chain in expected)
    for chain in expected:
        own = rows_[chain]
        mean = np.mean(sensor.measurement.difference(h[own], h[own[0]]), axis=0)
        np.testing.assert_allclose(
            sensor.measurement.difference(z[own[0]], plain[own[0]]), sensor.measurement.canonical(mean), atol=1e-9
        )


def test_two_in_one_cell_give_one_return_between_them_with_the_error_of_one():
    count = 4000
    places = np.stack([1000.0 * np.arange(count), np.zeros(count)], axis=-1)
    x = np.concatenate([places, places + [10.0, 0.0]])
    rng = np.random.default_rng(1)
    uniform, standard, cells = rng.random(2 * count), rng.standard_normal((2 * count, 2)), np.array([15.0, 15.0])
    z, seen = merged_returns(CartesianPosition(2.0), x, uniform, standard, cells)
    assert np.count_nonzero(seen) == count
    assert moments_match(z[:count] - places, np.array([5.0, 0.0]), 4.0 * np.eye(2))
    z, seen = merged_returns(CartesianPosition(2.0, 0.6), x, uniform, standard, cells)
    assert not np.any(seen[:count] & seen[count:])
    assert stats.binomtest(int(np.count_nonzero(seen)), count, 1 - 0.4**2).pvalue > ALPHA
    alone = np.sum(uniform.reshape(2, count) < 0.6, axis=0) == 1
    first = np.flatnonzero(seen[:count] & alone)
    assert moments_match((z[:count] - places)[first], np.zeros(2), 4.0 * np.eye(2))


def test_bearings_merge_across_the_seam():
    sensor = Polar(sigma_range=1e-9, sigma_bearing=1e-12, p_detect=1.0)
    x = np.array([[-100.0, 1.0], [-100.0, -1.0], [100.0, 0.0]])
    z, seen = merged_returns(sensor, x, np.zeros(3), np.zeros((3, 2)), np.array([5.0, 0.1]))
    assert seen.tolist() == [True, False, True]
    assert np.isclose(abs(z[0, 1]), np.pi)


def test_a_scene_of_fine_resolution_is_the_scene_without():
    fine = {"lidar": sim.Look(interval=0.7, first=0.3, jitter=0.2, resolution={"x": 1e-6, "y": 1e-6})}
    plain = scene(looks={"lidar": sim.Look(interval=0.7, first=0.3, jitter=0.2)}).open(SENSORS, np.random.default_rng(3))
    same = scene(looks=fine).open(SENSORS, np.random.default_rng(3))
    for a, b in zip(plain.scans, same.scans, strict=True):
        np.testing.assert_array_equal(a.detections.z, b.detections.z)
    coarse = {"lidar": sim.Look(interval=0.7, first=0.3, jitter=0.2, resolution={"x": 1e6, "y": 1e6})}
    one = scene(looks=coarse).open(SENSORS, np.random.default_rng(3))
    assert {len(scan.detections.z) for scan in one.scans} == {0, 1}


def test_boats_side_by_side_merge_and_those_apart_do_not():
    sensor = {"lidar": CartesianPosition(0.5)}
    ships = {
        "a": SHIPS["tug"],
        "b": sim.Ship([300, 312], course=-2, speed=3, appears=11),
        "c": sim.Ship([900, 0], appears=11),
    }
    look = {"lidar": sim.Look(1.0, resolution={"x": 20, "y": 20})}
    recording = scene(ships=ships, drawn={}, looks=look).open(sensor, np.random.default_rng(1))
    assert {len(scan.detections.z) for scan in recording.scans if scan.time >= 11} == {2}
    assert rows(recording, "lidar")


@pytest.mark.parametrize(
    ("looks", "said"),
    [
        ({"lidar": {"resolution": {"range": 3}}}, r"looks.lidar.resolution: range: is not measured"),
        ({"radar": {"resolution": {"bearing": 4}}}, r"looks.radar.resolution: bearing: must be < half.*6.28"),
    ],
)
def test_a_wrong_resolution_is_told(looks, said):
    made = {name: sim.Look(1.0, **table) for name, table in looks.items()}
    with pytest.raises(ConfigError, match=said):
        scene(looks=made).open(SENSORS, np.random.default_rng(1))
    with pytest.raises(ValueError, match="resolution: x: must be > 0, got 0"):
        sim.Look(1.0, resolution={"x": 0})
