"""Offsets of sensors that all have some: two radars at different places tell them, and two at one place do not."""

import numpy as np
import pytest
from scipy import stats

import vedette
from vedette import ConfigError, Detections, Scan

DEVIATION = {"bearing": float(np.radians(1.0)), "range": 60.0, "x": 80.0}
UNIT = {"bearing": "rad", "range": "m", "x": "m"}
MOVES = {"x": "offset"}


def tracker(places, names=("bearing", "range"), reach=60_000.0):
    """A tracker of radars at these places along x, the offsets of each its own."""
    sensors, spread = {}, {}
    for radar, x in places.items():
        of = {"kind": "range_bearing", "sigma_range": 8.0, "sigma_bearing": "0.3 deg", "detection_probability": 0.9}
        of |= {"max_range": reach, "clutter_per_scan": 0.01, "clutter_uniform_over": "range", "x": x}
        own = {f"{name}_{radar}": DEVIATION[name] for name in names}
        tables = {table: {name: f"{name}_{radar}" for name in names if MOVES.get(name, "add") == table}
                  for table in ("add", "offset")}  # fmt: skip
        sensors[radar], spread = {"kind": "biased", "of": of, "spread": own, **tables}, spread | own
    still = [{"kind": "random_walk", "axes": [name], "unit": UNIT[name[:-2]], "sigma": 1e-9} for name in spread]
    motion = {"kind": "product", "models": [{"kind": "constant_velocity", "sigma_accel": 0.05}, *still]}
    return vedette.build(
        {
            "sensors": sensors,
            "estimator": {"kind": "ekf", "motion": motion},
            "associator": {"kind": "jpda"},
            "gate": {"probability": 0.9999},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0} | spread},
            "lifecycle": {"kind": "existence", "confirm": 0.999},
            "registration": {"offsets": spread},
        }
    )


def seen(made, seed, looks="ab", scans=50, targets=4):
    """The state after scans of two radars 20 km apart in turn, their true offsets, and the targets' places in the end."""
    rng = np.random.default_rng(seed)
    off = {name: rng.normal(0.0, deviation) for name, deviation in made.registration.offsets.items()}
    start, v = rng.uniform([-5e3, -15e3], [25e3, 15e3], (targets, 2)), rng.uniform(-10, 10, (targets, 2))
    state, x = made.start(seed=seed), start
    for k in range(scans):
        radar, x = looks[k % len(looks)], start + v * 2.0 * k
        d = x - [made.sensors[radar].of.x, 0.0]
        z = np.stack([np.hypot(*d.T), np.arctan2(d[:, 1], d[:, 0])], axis=1) + [
            off[f"range_{radar}"],
            off[f"bearing_{radar}"],
        ]
        z = (z + rng.normal(0, 1, z.shape) * [8.0, np.radians(0.3)])[rng.random(targets) < 0.9]
        state = made.step(state, Scan(2.0 * k, radar, Detections.of(z, 2)))
    return state, np.array(list(off.values())), x


@pytest.mark.costly
def test_two_radars_far_apart_tell_their_bearings_and_ranges():
    """A false alarm in a thousand; nothing else tells where targets are, and they are found to 60 m all the same."""
    made, nees, runs = tracker({"a": 0.0, "b": 20e3}), 0.0, 6
    for seed in range(runs):
        state, off, x = seen(made, seed)
        error = state.offsets.mean - off
        nees += error @ np.linalg.solve(state.offsets.cov, error)
        assert np.all(np.sqrt(np.diag(state.offsets.cov)) < 0.2 * np.array(list(made.registration.offsets.values())))
        found = made.estimate(state).mean[state.confirmed, :2]
        assert len(found) == 4
        assert np.max(np.min(np.linalg.norm(found[:, None] - x, axis=-1), axis=0)) < 60.0
    low, high = stats.chi2.ppf([0.0005, 0.9995], 4 * runs)
    assert low <= nees <= high


def test_tracks_that_one_of_them_sees_tell_nothing():
    made = tracker({"a": 0.0, "b": 20e3})
    state, _, _ = seen(made, 1, looks="a", scans=12)
    assert np.count_nonzero(state.confirmed) == 4
    before = np.square(list(made.registration.offsets.values()))
    np.testing.assert_allclose(state.offsets.cov, np.diag(before), rtol=1e-9)


@pytest.mark.parametrize(
    ("places", "kept"),
    [
        ({"a": 0.0}, {}),
        ({"a": 0.0, "b": 0.0}, {}),  # both turn alike
        ({"a": 0.0, "b": 20e3}, {"names": ("bearing", "x")}),  # both, and all targets, may lie further east
        ({"a": 0.0, "b": 20e3}, {"reach": 9e3}),  # no target is seen by both
    ],
)
def test_sensors_that_cannot_tell_are_refused_before_any_run(places, kept):
    with pytest.raises(ConfigError) as error:
        tracker(places, **kept)
    assert [problem.place for problem in error.value.problems] == ["registration.offsets"]


@pytest.mark.parametrize(
    ("places", "names", "sets"),
    [
        ({"a": 0.0, "b": 20e3}, ("bearing", "range"), [[0], [1, 2]]),
        ({"a": 0.0, "b": 20e3, "c": 20e3}, ("bearing", "range"), [[0], [1, 2], [1, 3]]),
    ],
)
def test_what_links_a_track_is_a_sensor_without_offsets_or_a_set_that_tells_them(places, names, sets):
    common = tracker(places, names)._plan.offsets
    assert [np.flatnonzero(one).tolist() for one in common.sets] == sets
    ids, codes = np.array([3, 5, 8]), np.concatenate([common.codes(np.array([3, 4]), "a"), common.codes(np.array([3]), "b")])
    kept, tell = common.tell(ids, np.append(codes, common.codes(np.array([8]))))
    assert tell.tolist() == [True, False, True]
    assert kept.tolist() == [common.codes(3, "a"), common.codes(3, "b"), common.codes(8, "ais")]
