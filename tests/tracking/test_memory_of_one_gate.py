"""Two hundred returns in one gate, scan after scan: no kind takes more than half a gigabyte; who exists then."""

import subprocess
import sys

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan, kernels
from vedette.kernels import clusters
from vedette.tracking import conclusion

MOST_MB = 500

SCRIPT = """
import resource, sys
import numpy as np
import vedette
from vedette import Detections, Scan

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)

tracker = vedette.build({
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
    "sensors": {"radar": {
        "kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 0.1}},
    "associator": {"kind": sys.argv[1]},
    "birth": {"kind": "from_returns", "spread": {"vx": 2.0, "vy": 2.0}},
    "lifecycle": {"kind": "existence"},
})
rng, state, idle = np.random.default_rng(1), tracker.start(), peak()
for time in range(3):
    state = tracker.step(state, Scan(float(time), "radar", Detections.of(rng.normal(0.0, 5.0, (200, 2)))))
print(len(state.ids), peak() - idle)
"""


@pytest.mark.costly
@pytest.mark.parametrize("kind", ["jpda", "m_best_jpda", "n_scan", "k_best", "lmb", "variational"])
def test_it_takes_at_most_half_a_gigabyte(kind):
    pytest.importorskip("resource")
    done = subprocess.run([sys.executable, "-W", "error", "-c", SCRIPT, kind], check=True, capture_output=True, text=True)
    tracks, megabytes = map(float, done.stdout.split())
    assert tracks >= 200
    assert megabytes <= MOST_MB


def crowded(associator, clutter_density):
    radar = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": clutter_density}
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
        "sensors": {"radar": radar},
        "associator": associator,
        "birth": {"kind": "from_returns", "spread": {"vx": 2.0, "vy": 2.0}},
        "lifecycle": {"kind": "existence"},
    })  # fmt: skip


def doubtful():
    """Hypotheses of which it is doubtful which track is a target's, the leaves' own existence, and what they took last."""
    tracker = crowded({"kind": "k_best", "hypotheses": 30}, 1e-3)
    rng, state = np.random.default_rng(1), tracker.start()
    for time in range(5):
        state = tracker.step(state, Scan(float(time), "radar", Detections.of(rng.normal(0.0, 10.0, (12, 2)))))
        of, existence = state.leaves.hypotheses, state.leaves.existence
        yield of, existence, state.leaves.ids[:, None] % 3
        yield of, existence, state.leaves.last


def summed(of, own, last):
    """Existence of each leaf's target, hypothesis by hypothesis: of its track, else of those that took the same returns."""
    total = np.zeros(len(own))
    for h, weight in enumerate(of.weights):
        held = of.leaves[of.starts[h] : of.starts[h + 1]]
        for leaf in range(len(own)):
            track = held[of.track[held] == of.track[leaf]]
            same = track if len(track) else held[np.all(last[held] == last[leaf], axis=-1)]
            total[leaf] += weight * np.sum(own[same])
    return np.minimum(total, 1.0)


@pytest.mark.costly
@pytest.mark.parametrize("twin", [clusters.target_existence, kernels.target_existence], ids=["numpy", "running"])
def test_existence_is_that_of_the_track_or_of_one_which_took_the_same_returns(monkeypatch, twin):
    monkeypatch.setattr(kernels, "target_existence", twin)
    shared = 0
    for of, own, last in doubtful():
        np.testing.assert_allclose(of.existence(own, last), summed(of, own, last), rtol=0, atol=1e-12)
        shared += np.sum(of.existence(own, last) > of.existence(own, np.arange(len(own))[:, None]) + 1e-6)
    assert shared > 20


def test_leaves_are_updated_a_few_at_a_time_as_all_at_once(monkeypatch):
    tracker = crowded({"kind": "lmb", "leaves": 2}, 0.1)

    def after():
        rng, state = np.random.default_rng(1), tracker.start()
        for time in range(2):  # from 30,000 pairs on, leaves meet the returns in their gates alone
            state = tracker.step(state, Scan(float(time), "radar", Detections.of(rng.normal(0.0, 5.0, (180, 2)))))
        return tracker.estimator.moments(state.leaves.belief)

    whole = after()
    monkeypatch.setattr(conclusion, "MOST_AT_ONCE", 100_000)
    parts = after()
    assert len(whole.mean) > 180
    np.testing.assert_array_equal(parts.mean, whole.mean)
    np.testing.assert_array_equal(parts.cov, whole.cov)
