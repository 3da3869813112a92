"""What may be claimed of the study of distributed detection."""

import numpy as np
import pytest

import vedette
from vedette_bayes_risk.configs import CONTESTED, FILTERS
from vedette_bayes_risk.outcome import WINDOWS
from vedette_bayes_risk.reproduction import DENSE_REACH, REACH, BayesRiskReproduction, contest, draw, record


# The study.
@pytest.mark.costly
def test_the_path_is_table_1():
    truth, times, _ = draw(vedette.load(FILTERS["proposed"]), 2, 100.0, np.random.default_rng(0))
    assert times.tolist() == list(range(91))
    velocity = {20: (100, 100), 30: (50, 150), 50: (50, 150), 70: (-50, 50), 90: (50, 150)}
    for time, v in velocity.items():
        np.testing.assert_allclose(truth[time, 2:], v, atol=1e-9)
    np.testing.assert_allclose(truth[90, :2], [3750, 10250], rtol=1e-12)
    np.testing.assert_allclose(np.diff(truth[:, :2], axis=0), (truth[1:, 2:] + truth[:-1, 2:]) / 2, atol=1e-9)


@pytest.mark.costly
def test_the_error_is_3_2_to_3_8_m_and_the_same_in_both_windows():
    """At 500 runs 3.53 +- .03 and 3.51 +- .013, their ratio .993 +- .009 against .95: 5 standard errors each."""
    experiment = vedette.load(FILTERS["proposed"])
    made = record(experiment, *draw(experiment, 500, REACH, np.random.default_rng(40)))
    rms = [np.sqrt(np.mean(made.squares[:, WINDOWS[window]])) for window in ("21-30 s", "51-90 s")]
    assert min(rms) > 3.2
    assert max(rms) < 3.8
    assert abs(rms[0] / rms[1] - 1) < 0.05


@pytest.mark.nightly("a thousand runs: 15 s")
def test_where_returns_compete_the_printed_covariance_is_twice_too_small():
    """At 100 times the clutter 2.33 +- .03 in 1000 runs; with corrected weights 1.58. Below 1e-6."""
    experiments = {name: vedette.load(config) for name, config in CONTESTED.items()}
    scene = draw(experiments["printed weights, printed P"], 1000, DENSE_REACH, np.random.default_rng(50))
    size = {}
    for name in ("printed weights, printed P", "printed weights, with spread", "corrected weights, with spread"):
        size[name] = np.mean(contest(experiments[name], *scene).contested)
    assert size["printed weights, printed P"] > 2 * size["printed weights, with spread"]
    assert 1.4 < size["corrected weights, with spread"] < 2.2


@pytest.mark.costly
def test_the_same_seed_gives_the_same_study():
    first, again, other = (BayesRiskReproduction().run(6, seed, lambda items, about: items) for seed in (5, 5, 6))
    assert first.tables == again.tables
    assert first.claims == again.claims
    assert first.tables != other.tables
