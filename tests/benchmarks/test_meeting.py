"""The benchmark of targets that meet: both contenders get one scene, and what takes too long or differs is said."""

import numpy as np
import pytest

from benchmarks import meeting


def stalling(targets, density):
    """A contender whose third scan does not end."""
    steps = iter(range(10**9))

    def step(time, z):
        while next(steps) >= 2:
            pass
        return np.ones((targets, 1 + len(z)))

    return step


def test_all_weights_of_all_scans_are_exact_and_sum_to_1():
    own = meeting.timed("vedette", 4, 1e-5, 60.0)
    assert own["not_ended"] is None
    assert len(own["seconds"]) == meeting.SCANS
    scans = meeting.scene(4, 1e-5)[2]
    for weights, z in zip(own["weights"], scans, strict=True):
        table = np.array(weights)
        assert table.shape == (4, 1 + len(z))
        np.testing.assert_allclose(table.sum(axis=1), 1.0)
    shared = [np.count_nonzero(np.count_nonzero(np.array(one)[:, 1:], axis=0) > 1) for one in own["weights"]]
    assert max(shared) >= 3  # they do meet


def test_a_scan_that_does_not_end_is_told(monkeypatch):
    monkeypatch.setitem(meeting.CONTENDERS, "stonesoup", stalling)
    found = meeting.timed("stonesoup", 2, 1e-5, 0.05)
    assert (found["not_ended"], len(found["weights"])) == (2, 2)
    assert "in 1 scans; scan 3 did not end within 0.05 s" in meeting.told(found, 0.05)


def test_weights_that_differ_are_no_result():
    own = meeting.timed("vedette", 2, 1e-5, 60.0)
    other = {**own, "weights": [(np.array(one) + 2e-9).tolist() for one in own["weights"]]}
    assert "| 0e+00 in 200 scans |" in meeting.row(2, 1e-5, own, own, 60.0)
    with pytest.raises(SystemExit, match="weights differ by 2"):
        meeting.row(2, 1e-5, own, other, 60.0)
    assert "left out: no module" in meeting.row(2, 1e-5, own, "no module", 60.0)
