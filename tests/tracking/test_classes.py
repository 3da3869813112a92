"""Classes that many objects share: what they say of pairs, what tracks learn, and what they leave alone."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette.tracking.classes import class_evidence, given_classes
from vedette.tracking.identity import Identity

CONFUSION = np.array([[0.9, 0.1, 0.0], [0.2, 0.7, 0.1], [0.3, 0.3, 0.4]])


def test_the_evidence_of_a_class_is_the_ratio_of_its_probabilities():
    shares = np.array([[1.0, 0.0, 0.0], [0.2, 0.5, 0.3]])
    codes = np.array([0, 2, -1, 7])
    found = class_evidence(shares, codes, CONFUSION, np.array([0.5, 0.25, 0.25]))
    with np.errstate(divide="ignore"):
        wanted = np.log([[0.9 / 0.5, 0.0, 1, 1], [(0.2 * 0.9 + 0.5 * 0.2 + 0.3 * 0.3) / 0.5, 0.17 / 0.25, 1, 1]])
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    own = class_evidence(shares, np.stack([codes, codes]), CONFUSION, np.array([0.5, 0.25, 0.25]))
    np.testing.assert_array_equal(own, found)


def test_a_track_learns_by_bayes_each_return_by_its_weight():
    shares = np.array([[0.5, 0.3, 0.2]])
    sure = given_classes(shares, np.array([[0.0, 1.0]]), np.array([[1]]), CONFUSION)
    wanted = shares[0] * CONFUSION[:, 1]
    np.testing.assert_allclose(sure[0], wanted / wanted.sum(), rtol=1e-12)
    mixed = given_classes(shares, np.array([[0.5, 0.2, 0.3]]), np.array([[1, -1]]), CONFUSION)
    np.testing.assert_allclose(mixed[0], 0.8 * shares[0] + 0.2 * sure[0], rtol=1e-12)
    np.testing.assert_array_equal(given_classes(shares, np.array([[1.0]]), np.zeros((1, 0), dtype=int), CONFUSION), shares)


@pytest.mark.parametrize(
    ("place", "given"),
    [
        ("confusion", {"confusion": [[0.5, 0.5]]}),
        ("confusion", {"confusion": [[0.5, 0.6], [0.5, 0.5]]}),
        ("share", {"confusion": [[0.9, 0.1], [0.5, 0.5]], "share": [0.5, 0.6]}),
        ("false_share", {"confusion": [[0.9, 0.1], [0.5, 0.5]], "false_share": [1.0]}),
        ("share", {"share": [1.0]}),
    ],
)
def test_what_is_no_probability_is_refused(place, given):
    with pytest.raises(ValueError, match=f"^(must|{place})"):
        Identity(**given)


def tracker(associator, **identity):
    return vedette.load(
        {
            "sensors": {"camera": {"kind": "cartesian_position", "sigma": 1.0, "clutter_density": 1e-4}},
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
            "associator": {"kind": associator},
            "lifecycle": {"kind": "existence"},
            "birth": {"kind": "from_returns", "spread": {"vx": 3.0, "vy": 3.0}},
            "identity": identity,
        }
    ).tracker


def crossing(seed):
    """Two objects of unlike classes that come within 1 m of one another and part again, named rightly in .9 of the scans."""
    rng = np.random.default_rng(seed)
    for second in range(40):
        apart = 0.5 + 0.02 * (second - 20) ** 2
        spots = np.array([[2.0 * second, apart], [2.0 * second, -apart]]) + rng.normal(0, 1, (2, 2))
        classes = np.where(rng.random(2) < 0.9, [0, 1], [1, 0])
        yield Scan(float(second), "camera", Detections(spots, np.ones(2, dtype=bool), identity=classes))


CLASSES = {"confusion": [[0.9, 0.1], [0.1, 0.9]]}


@pytest.mark.parametrize("associator", ["jpda", "gnn", "k_best"])
@pytest.mark.by_turns
def test_two_of_one_class_are_two_tracks_and_unlike_classes_keep_tracks_apart(associator):
    swapped = 0
    for seed in range(6):
        one = tracker(associator, **CLASSES)
        state = one.start()
        for scan in crossing(seed):
            state = one.step(state, scan)
        sure = state.existence > 0.9
        assert np.count_nonzero(sure) == 2
        y = one.estimate(state).mean[sure, 1]
        assert sorted(state.identity[sure].tolist()) == [0, 1]
        swapped += state.identity[sure][np.argmax(y)] != 0
    assert swapped == 0
    alike = tracker(associator, **CLASSES)
    state = alike.start()
    for second in range(6):
        spots = [[2.0 * second, 50.0], [2.0 * second, -50.0]]
        state = alike.step(state, Scan(float(second), "camera", Detections(spots, [True, True], identity=[0, 0])))
    assert np.count_nonzero(state.existence > 0.9) == 2
    assert state.identity[state.existence > 0.9].tolist() == [0, 0]
