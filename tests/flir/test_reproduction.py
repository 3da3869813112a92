"""The study of the infrared paper: its bounds against a textbook's, its verdicts, and that its seed decides."""

import numpy as np
import pytest

from vedette_flir import reproduction as study
from vedette_flir.matched import bound, information, record
from vedette_flir.reproduction import FlirReproduction


def test_the_bound_is_the_riccati_equation_s():
    from scipy.linalg import solve_discrete_are

    for jitter, spread, snr in ((0.2, 1.0, 2.0), (0.2, 2.0, 10.0), (0.5, 3.0, 20.0)):
        F = np.diag([np.exp(-1 / 60), np.exp(-1 / 30 / 0.076)])
        settled = np.diag([9.0, jitter**2])
        H = np.ones((1, 2))
        before = solve_discrete_are(F.T, H.T, settled - F @ settled @ F.T, np.array([[1.0 / information(spread, snr)]]))
        P = np.linalg.inv(np.linalg.inv(before) + information(spread, snr) * H.T @ H)
        expected = np.sqrt([P[0, 0], P[1, 1], P.sum()])
        np.testing.assert_allclose(bound(spread, snr, jitter), expected, rtol=1e-6)


def test_one_frame_s_bound_nears_that_of_continuous_light():
    """sqrt(2 / pi) / SNR, whatever the spread, where the window holds the spot and a pixel is small beside it."""
    assert information(3.0, 10.0, window=32) ** -0.5 == pytest.approx(np.sqrt(2 / np.pi) / 10, rel=0.02)


def test_the_seed_decides():
    again = [record(1, 1.0, 10.0, 0.2, 2, np.random.default_rng(seed)) for seed in (5, 5, 6)]
    np.testing.assert_array_equal(again[0].apparent, again[1].apparent)
    assert not np.array_equal(again[0].apparent, again[2].apparent)


def test_verdicts_follow_the_figures(monkeypatch):
    monkeypatch.setattr(study, "CASES", ((0.2, 1.0, 10.0), (0.2, 2.0, 10.0)))
    result = FlirReproduction().run(30, 3, lambda items, about: items)
    assert [claim.verdict for claim in result.claims] == ["reproduced", "not reproduced", "remark"]
    once, iterated = (table.cell("jitter 0.2, spread 1, SNR 10", "NEES/4").measured for table in result.tables)
    assert once > 1.8 > 1.15 > iterated
