"""Two hundred returns in one gate, scan after scan: no kind takes more than half a gigabyte."""

import subprocess
import sys

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan, hypotheses

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
    done = subprocess.run([sys.executable, "-c", SCRIPT, kind], check=True, capture_output=True, text=True)
    tracks, megabytes = map(float, done.stdout.split())
    assert tracks >= 200
    assert megabytes <= MOST_MB


def existences():
    """Existences of leaves in clusters of which it is doubtful which track is a target's."""
    radar = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-3}
    tracker = vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.2}},
        "sensors": {"radar": radar},
        "associator": {"kind": "k_best", "hypotheses": 30},
        "birth": {"kind": "from_returns", "spread": {"vx": 2.0, "vy": 2.0}},
        "lifecycle": {"kind": "existence"},
    })  # fmt: skip
    rng, state = np.random.default_rng(1), tracker.start()
    for time in range(5):
        state = tracker.step(state, Scan(float(time), "radar", Detections.of(rng.normal(0.0, 10.0, (12, 2)))))
        of, existence = state.leaves.hypotheses, state.leaves.existence
        yield of.existence(existence, state.leaves.ids[:, None] % 3)


def test_pairs_of_leaves_give_the_same_a_few_at_a_time(monkeypatch):
    whole = list(existences())
    monkeypatch.setattr(hypotheses, "MOST_AT_ONCE", 7)
    for found, expected in zip(existences(), whole, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert sum(map(len, whole)) > 100
    monkeypatch.setattr(
        hypotheses, "MIXED", hypotheses.MIXED * 0
    )  # every leaf took the same returns: it must change something
    assert any(not np.allclose(found, expected) for found, expected in zip(existences(), whole, strict=True))
