"""Trackers of many targets whose hypotheses are of clusters: what is far apart is independent, and who is young may win."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette.tracking import memory_limits

KINDS = ["nearest", "gnn", "pda", "jpda", "jpda_star", "m_best_jpda", "k_best", "n_scan", "lmb", "variational"]
CLUTTER = 20 / 4e6
BIRTHS = {
    "from_returns": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "uniform": {
        "kind": "uniform", "spread": {"vx": 10.0, "vy": 10.0}, "initial": 1.0, "rate": 0.1,
        "view": {"x": {"low": -100, "high": 2100}, "y": {"low": -100, "high": 2100}},
    },
}  # fmt: skip


def tracker(associator, birth="from_returns", **more):
    """A tracker of the radar below; birth: the name of one, or a config."""
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9,
                              "clutter_density": CLUTTER}},
        "associator": {"kind": associator},
        "birth": BIRTHS[birth] if isinstance(birth, str) else birth,
        "lifecycle": {"kind": "existence"},
    } | more)  # fmt: skip


def scene(seed, targets, scans, side=2000.0):
    """Returns of targets spread over a square, and clutter; the places of the targets at the end."""
    rng = np.random.default_rng(seed)
    start, speed, returns = rng.uniform(0, side, (targets, 2)), rng.normal(0, 5.0, (targets, 2)), []
    for time in range(scans):
        seen = (start + speed * time)[rng.random(targets) < 0.9]
        false = rng.uniform(0, side, (rng.poisson(CLUTTER * side**2), 2))
        returns.append(np.concatenate([seen + rng.normal(0, 5.0, seen.shape), false]))
    return returns, start + speed * (scans - 1)


def run(built, returns):
    state = built.start()
    for time, z in enumerate(returns):
        state = built.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
    return state


def covered(built, state, targets, radius=30.0):
    """The share of targets with a confirmed track near."""
    order = built.state.locate(built.sensors["radar"].observes)
    shown = built.estimate(state).mean[state.confirmed][:, order]
    apart = np.linalg.norm(shown[:, None] - targets[None], axis=-1)
    return float(np.mean((apart < radius).any(axis=0))) if len(shown) else 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_twelve_scenes_100_km_apart_are_tracked_as_each_is_alone(kind):
    built, scenes = tracker(kind), []
    for number in range(12):
        returns, _ = scene(number, 1, 5, 200.0)
        scenes.append([z + [1e5 * number, 0.0] for z in returns])
    whole = run(built, [np.concatenate(scan) for scan in zip(*scenes, strict=True)])
    estimate = built.estimate(whole)
    for number, returns in enumerate(scenes):
        alone = run(built, returns)
        x = estimate.mean[:, built.state.names.index("x")]
        own = np.flatnonzero(np.abs(x - 1e5 * number) < 5e4)
        assert len(own) == len(alone.ids)
        np.testing.assert_allclose(estimate.mean[own], built.estimate(alone).mean, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(whole.existence[own], alone.existence, rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(whole.confirmed[own], alone.confirmed)


@pytest.mark.parametrize("life", ["existence", "score"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_targets_far_apart_are_confirmed_and_stay_so(kind, life):
    """Of five targets in 30 false returns a scan, on three seeds: the share of all scans from the ninth on."""
    built, found = tracker(kind, lifecycle={"kind": life}), []
    for seed in range(3):
        returns, end = scene(seed, 5, 28)
        speed = np.random.default_rng(seed)
        speed.uniform(0, 2000.0, (5, 2))
        speed, state = speed.normal(0, 5.0, (5, 2)), built.start()
        for time, z in enumerate(returns):
            state = built.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
            if time >= 8:
                found.append(covered(built, state, end + speed * (time - 27)))
    assert np.mean(found) > 0.9


@pytest.mark.parametrize("kind", ["gnn", "nearest", "k_best", "jpda"])
@pytest.mark.by_turns
def test_targets_that_may_appear_anywhere_are_found(kind):
    """A young track's existence is .08 or less: where a hard choice was made by it, clutter always won."""
    built, shares = tracker(kind, "uniform"), []
    for seed in range(3):
        returns, targets = scene(seed, 10, 25)
        shares.append(covered(built, run(built, returns), targets))
    assert np.mean(shares) >= 0.9


@pytest.mark.parametrize("kind", ["gnn", "nearest"])
@pytest.mark.parametrize("initial", [0.06, 0.9])
def test_a_young_track_wins_its_return_whatever_its_existence(kind, initial):
    """The second return is near the first: the track has it for certain, and exists more surely than before."""
    built = tracker(kind, birth={**BIRTHS["from_returns"], "initial": initial})
    state = run(built, [np.array([[0.0, 0.0]]), np.array([[4.0, 3.0]])])
    assert state.weights[0].tolist() == [0.0, 1.0]
    assert state.existence[0] > initial


def split_in_two(kind, scans):
    """One target that becomes two: which of them is the track that was there is never known."""
    built = tracker(kind, lifecycle={"kind": "existence", "confirm": 0.9})
    returns = [np.array([[10.0 * i, 0.0]]) for i in range(8)]
    returns += [np.array([[10.0 * i, 4.0 * (i - 7)], [10.0 * i, -4.0 * (i - 7)]]) for i in range(8, 8 + scans)]
    return run(built, returns)


def test_a_target_is_confirmed_though_it_is_never_known_which_track_it_is():
    """Each of two hypotheses of about one half has another track begin; that there are two targets is sure."""
    state = split_in_two("k_best", 8)
    leaves = state.leaves
    new = leaves.ids > 0
    mass = leaves.hypotheses.probability[new] * leaves.existence[new]
    by_track = [float(mass[leaves.ids[new] == one].sum()) for one in np.unique(leaves.ids[new])]
    assert max(by_track) < 0.9
    assert np.count_nonzero(state.confirmed) == 2


def test_confirm_is_compared_with_the_existence_of_all_hypotheses():
    """A leaf with a hit exists for certain, its track does not: it is shown from when `confirm` allows."""
    confirmed_at = []
    for confirm in (0.5, 0.99999):
        built = tracker("k_best", lifecycle={"kind": "existence", "confirm": confirm})
        state, when = built.start(), None
        for time in range(12):
            state = built.step(state, Scan(float(time), "radar", Detections.of([[5.0 * time, 0.0]], 2)))
            when = time if when is None and state.confirmed.any() else when
        confirmed_at.append(when)
    assert confirmed_at[0] < confirmed_at[-1], confirmed_at


@pytest.mark.parametrize("kind", ["k_best", "n_scan", "lmb", "variational"])
def test_leaves_that_meet_few_returns_each_are_as_those_that_meet_all(kind, monkeypatch):
    """Of many leaves and returns only the pairs within gates are worked on."""
    returns, _ = scene(5, 12, 8, 300.0)
    built = tracker(kind)
    whole = run(built, returns)
    monkeypatch.setattr(memory_limits, "LEAST_PAIRS", 1)
    monkeypatch.setattr("vedette.tracking.meeting.FEW", 0)
    sparse = run(built, returns)
    assert sparse.returns is not None
    assert len(whole.ids) > 3
    np.testing.assert_array_equal(sparse.ids, whole.ids)
    np.testing.assert_allclose(built.estimate(sparse).mean, built.estimate(whole).mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(sparse.existence, whole.existence, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(sparse.hit, whole.hit, atol=1e-12)
    np.testing.assert_allclose(sparse.nis, whole.nis, rtol=1e-9, atol=1e-9)
