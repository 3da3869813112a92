"""Whether stated existence is the share of tracks that are of targets, on truth drawn from the tracker's own model."""

import numpy as np
import pytest

from benchmarks import existence


def test_of_two_tracks_beside_a_target_the_likelier_is_its():
    """Oracle: the sum over who has the target, for two tracks of the same density, and one far away."""
    r, u, density = np.array([0.9, 0.1, 0.5]), 1e-5, np.log([[0.04], [0.04], [1e-30]])
    pairings = np.array([
        0.9 * 0.04 * 0.9 * 0.5,  # the first has it
        0.1 * 0.1 * 0.04 * 0.5,  # the second
        0.1 * 0.9 * u * 0.5,  # none
    ])  # fmt: skip
    wanted = [*(pairings[:2] / pairings.sum()), 0.0]
    np.testing.assert_allclose(existence.of_targets(density, r, np.array([u])), wanted, atol=1e-12)


def test_doubt_that_is_left_out_is_found(monkeypatch):
    """A tracker that takes clutter to be a quarter of what it is states too much."""
    right = existence.tracker

    def sure(kind):
        monkeypatch.setattr(existence, "FALSE", existence.FALSE / 4)
        built = right(kind)
        monkeypatch.undo()
        return built

    with monkeypatch.context() as patch:
        patch.setattr(existence, "tracker", sure)
        excess, _ = existence.calibration("jpda", 1, 20)
    assert np.max(existence.deviations(excess)) > 3.5


@pytest.mark.nightly("150 runs of each kind: a minute of CPU")
@pytest.mark.parametrize("kind", ["jpda", "variational", "lmb", "k_best, mean shown"])
def test_stated_existence_is_the_share_of_targets(kind):
    """Ten bins of four kinds within three standard errors: one seed in ten would fail by chance."""
    excess, number = existence.calibration(kind, 2, 150)
    assert np.all(number.sum(axis=0) > 50)
    assert np.max(np.abs(existence.deviations(excess))) <= 3.0
