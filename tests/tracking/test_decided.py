"""A decision on which return was a target's makes the target no surer."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan


def tracker(associator):
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.5,
                              "clutter_density": 1e-4}},
        "associator": associator,
        "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
        "lifecycle": {"kind": "existence", "delete": 1e-6},
    })  # fmt: skip


def existence_of_the_first(associator, scans):
    """The existence of the first track after each scan, over all its leaves."""
    built, found = tracker(associator), []
    state = built.start()
    for time, z in enumerate(scans):
        state = built.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
        leaves = state.leaves
        own = leaves.ids == 0
        found.append(float(np.sum(leaves.hypotheses.probability[own] * leaves.existence[own])))
    return found


def test_it_is_as_sure_as_all_hypotheses_have_it():
    """One return a scan: the first decision is in the third scan, on who gave the second's."""
    scans = [[[0.0, 0.0]], [[2.0, 1.0]], [[4.0, 2.0]]]
    every = existence_of_the_first({"kind": "k_best"}, scans)
    decided = existence_of_the_first({"kind": "n_scan", "scans": 1}, scans)
    np.testing.assert_allclose(decided, every, rtol=1e-9)
    assert every[2] < 0.99


@pytest.mark.costly
def test_false_returns_alone_confirm_few():
    """At P_D .5 a young track's likeliest return is often false: three scans later that was certain."""
    rng, shown = np.random.default_rng(0), []
    built = tracker({"kind": "n_scan"})
    state = built.start()
    for time in range(20):
        z = rng.uniform(0.0, 500.0, (rng.poisson(25.0), 2))
        state = built.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
        shown.append(np.count_nonzero(state.confirmed))
    assert np.mean(shown[5:]) < 1.0, shown
