"""Distributed detection by Bayes risk: its probabilities against draws, its parts by hand, and what may be claimed."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette import Detections, Gaussian, Scan
from vedette_bayes_risk.associator import BayesRisk
from vedette_bayes_risk.configs import CONTESTED, DENSE, FILTERS, SIGMA, THRESHOLD
from vedette_bayes_risk.counting import Confirmation, number_of
from vedette_bayes_risk.likelihood import CountLikelihoodDetection
from vedette_bayes_risk.outcome import WINDOWS
from vedette_bayes_risk.parallel import ParallelKalmanPrinted
from vedette_bayes_risk.printed import BayesRiskPrinted
from vedette_bayes_risk.reproduction import DENSE_REACH, REACH, BayesRiskReproduction, contest, draw, record
from vedette_bayes_risk.risk import Costs
from vedette_bayes_risk.tail import BayesRiskDetection
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

EXAMPLES = Path(__file__).parents[2] / "examples" / "bayes_risk"
FILES = {
    "proposed": "proposed",
    "proposed, printed": "printed",
    "IMM/MSPDA tuned": "imm_tuned",
    "IMM/MSPDA soft": "imm_soft",
    "printed weights, printed P": "dense_printed",
    "printed weights, with spread": "dense_printed_weights",
    "corrected weights, printed P": "dense_printed_covariance",
    "corrected weights, with spread": "dense_proposed",
    "likelihood ratio, with spread": "dense_likelihood",
    "likelihood ratio, PDA": "dense_pda",
}
KINDS = (BayesRiskDetection, BayesRiskPrinted, CountLikelihoodDetection)
SEVEN = {f"s{i}": CartesianPosition(SIGMA, 1.0, DENSE) for i in range(1, 8)}
PROFILE = settings(max_examples=60, deadline=None, derandomize=True)


def scan(name, z, valid=None):
    z = np.asarray(z, dtype=float).reshape(*np.shape(z)[:-1], 2) if np.size(z) else np.zeros((0, 2))
    return Scan(0.0, name, Detections(z, np.ones(z.shape[:-1], dtype=bool) if valid is None else valid))


def preprocessor(kind=BayesRiskDetection, sensors=3, sigma=5.0, threshold=20.0, **more):
    own = {name: CartesianPosition(sigma, 1.0, 1e-5) for name in "abcdefg"[:sensors]}
    return kind(own, "a", threshold, **more)


# Probabilities.


@PROFILE
@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_how_many_happen(probabilities):
    """Against the sum over all outcomes."""
    expected = np.zeros(len(probabilities) + 1)
    for outcome in product([0, 1], repeat=len(probabilities)):
        expected[sum(outcome)] += np.prod([p if yes else 1 - p for p, yes in zip(probabilities, outcome, strict=True)])
    np.testing.assert_allclose(number_of(np.array(probabilities)), expected, atol=1e-14)


def drawn_counts(true_base, runs, rng):
    """How many sensors see a return at the base, the target's or a false one, six more in clutter: counted, not computed."""
    reach = 4 * THRESHOLD
    k = np.ones(runs, dtype=int)
    base = SIGMA * rng.standard_normal((runs, 2)) if true_base else np.zeros((runs, 2))
    for _ in range(6):
        number = rng.poisson(DENSE * (2 * reach) ** 2, runs)
        most = number.max()
        z = rng.uniform(-reach, reach, (runs, most, 2)) + base[:, None]
        near = np.any(
            (np.sum((z - base[:, None]) ** 2, axis=-1) <= THRESHOLD**2) & (np.arange(most) < number[:, None]), axis=1
        )
        if true_base:
            near |= np.sum((SIGMA * rng.standard_normal((runs, 2)) - base) ** 2, axis=-1) <= THRESHOLD**2
        k += near
    return np.bincount(k, minlength=8)[1:] / runs


def test_the_count_given_a_target_and_given_clutter():
    """All 14 frequencies of 200,000 draws within 5 standard errors: 8e-6. Eq. 2, with independent distances, is far off."""
    found = Confirmation.of(SEVEN, "s1")
    rng = np.random.default_rng(1)
    for true_base, expected in ((True, found.given_target(THRESHOLD)), (False, found.given_clutter(THRESHOLD))):
        seen = drawn_counts(true_base, 200_000, rng)
        error = np.sqrt(np.maximum(expected * (1 - expected), 1e-5) / 200_000)
        assert np.all(np.abs(seen - expected) < 5 * error), (seen, expected)
        np.testing.assert_allclose(expected.sum(), 1.0)
        if true_base:
            p = 1 - found.miss(THRESHOLD)
            independent = number_of(1 - (1 - p) * (1 - found.false_alarm(THRESHOLD)))
            assert abs(seen[-1] - independent[-1]) > 20 * error[-1]


@PROFILE
@given(st.floats(1e-9, 1e-2), st.floats(1, 1e3), st.floats(0.1, 100), st.floats(0.05, 1))
def test_probabilities_are_probabilities(density, threshold, sigma, p_detect):
    """Whatever the clutter, where the printed P_FA = A_v/(lambda A_1) is 94 for the paper's own."""
    found = Confirmation.of({n: CartesianPosition(sigma, p_detect, density) for n in "abcd"}, "a")
    for p in (found.false_alarm(threshold), found.miss(threshold)):
        assert np.all((p >= 0) & (p <= 1))
    for p in (found.given_target(threshold), found.given_clutter(threshold)):
        assert np.all(p >= -1e-15)
        np.testing.assert_allclose(p.sum(), 1.0, rtol=1e-9)


def test_the_published_clutter():
    """.3e-6 /m^2 and 4 sigma: 6.8e-4, to first order lambda A_v; printed it is 94."""
    area = np.pi * THRESHOLD**2
    found = Confirmation.of({n: CartesianPosition(SIGMA, 1.0, 0.3e-6) for n in "ab"}, "a")
    np.testing.assert_allclose(found.false_alarm(THRESHOLD), 0.3e-6 * area, rtol=1e-3)
    np.testing.assert_allclose(found.miss(THRESHOLD), np.exp(-4))
    assert area / (0.3e-6 * 8e7) > 90


# Risk and weights.


def test_the_weights_of_two_sensors_by_hand():
    made = preprocessor(sensors=2, costs=Costs(miss=2.0, false_alarm=3.0, prior=0.25))
    target, clutter = made.confirmation.given_target(20.0)[1], made.confirmation.given_clutter(20.0)[1]
    risks = [3.0 * 0.75, 2.0 * (1 - target) * 0.25 + 3.0 * clutter * 0.75]
    np.testing.assert_allclose(np.exp(made.log_weights()), np.cumsum(1 / np.array(risks)), rtol=1e-12)


def test_the_printed_weights_are_nearly_a_straight_line():
    """Decided for a target when few sensors confirm; tail sums make the weights fall off as they should."""
    published = {n: CartesianPosition(SIGMA, 1.0, 0.3e-6) for n in SEVEN}
    printed = np.exp(BayesRiskPrinted(published, "s1", THRESHOLD).log_weights())
    np.testing.assert_allclose(printed / printed[-1], [0.124, 0.248, 0.372, 0.496, 0.620, 0.752, 1], atol=5e-4)
    corrected = np.exp(BayesRiskDetection(published, "s1", THRESHOLD).log_weights())
    assert corrected[0] / corrected[-1] < 1e-3
    assert corrected[1] / corrected[-1] < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_more_confirmations_never_weigh_less(kind):
    assert np.all(np.diff(kind(SEVEN, "s1", THRESHOLD).log_weights()[1:]) > 0)


def test_the_likelihood_ratio_is_of_confirmed_returns():
    made = CountLikelihoodDetection(SEVEN, "s1", THRESHOLD)
    clutter = made.confirmation.given_clutter(THRESHOLD)[1:]
    target = np.exp(made.log_weights()[1:]) * clutter / clutter.sum()
    np.testing.assert_allclose(target.sum(), 1.0, rtol=1e-9)


# Detection.


@pytest.mark.parametrize("kind", KINDS)
def test_detection_by_hand(kind):
    """Two returns are confirmed, by two sensors and by one; a third stands alone and goes."""
    made = preprocessor(kind, sensors=3)
    seen = made.process(
        {
            "a": scan("a", [[0, 0], [500, 0], [1000, 0]]),
            "b": scan("b", [[6, 0], [9, 0], [1000, 18]]),
            "c": scan("c", [[0, 12], [500, 21]]),
        }
    )
    assert seen.valid.tolist() == [True, True]
    np.testing.assert_allclose(seen.z, [[2, 4], [1000, 9]])
    np.testing.assert_allclose(seen.noise, [25 / 3 * np.eye(2), 25 / 2 * np.eye(2)])
    np.testing.assert_allclose(seen.evidence, made.log_weights()[[2, 1]])


def test_unlike_sensors_are_weighted_by_their_information():
    made = BayesRiskDetection({"a": CartesianPosition(1.0), "b": CartesianPosition(2.0, 0.9, 1e-6)}, "a", 10.0)
    seen = made.process({"a": scan("a", [[0, 0]]), "b": scan("b", [[5, 0]])})
    np.testing.assert_allclose(seen.z, [[1, 0]])
    np.testing.assert_allclose(seen.noise, [0.8 * np.eye(2)])


def test_a_batch_is_a_loop_and_padding_counts_for_nothing():
    rng = np.random.default_rng(4)
    made = preprocessor(sensors=4, threshold=30.0)
    z = {name: rng.uniform(0, 150, (6, 5, 2)) for name in made.sensors}
    valid = {name: rng.random((6, 5)) < 0.7 for name in made.sensors}
    both = made.process({name: scan(name, z[name], valid[name]) for name in made.sensors})
    for run in range(6):
        alone = made.process({name: scan(name, z[name][run][valid[name][run]]) for name in made.sensors})
        mine = both.valid[run]
        np.testing.assert_allclose(both.z[run][mine], alone.z[alone.valid], rtol=1e-12)
        np.testing.assert_allclose(both.noise[run][mine], alone.noise[alone.valid], rtol=1e-12)
        np.testing.assert_allclose(both.evidence[run][mine], alone.evidence[alone.valid], rtol=1e-12)


@pytest.mark.parametrize(
    "scans",
    [
        {"b": [[0, 0]], "c": [[0, 0]]},
        {"a": [], "b": [[0, 0]], "c": [[0, 0]]},
        {"a": [[0, 0]], "b": [], "c": []},
        {"a": [[0, 0]]},
    ],
    ids=["no scan of the base", "nothing at the base", "nothing elsewhere", "no other scan"],
)
def test_nothing_is_left(scans):
    seen = preprocessor(sensors=3).process({name: scan(name, z) for name, z in scans.items()})
    assert seen.z.shape == (0, 2)
    assert seen.noise.shape == (0, 2, 2)
    assert seen.evidence.shape == (0,)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda kind: preprocessor(kind, sensors=1), "sensors: must be at least 2, for one to confirm the other, got 1"),
        (lambda kind: kind(SEVEN, "s8", 20.0), "base: must be one of 's1'.*got 's8'"),
        (lambda kind: preprocessor(kind, threshold=0.0), "threshold: must be > 0, got 0 m"),
        (lambda kind: preprocessor(kind, threshold=float("inf")), "threshold: must be a finite number"),
        (lambda kind: preprocessor(kind, threshold=float("nan")), "threshold: must be a finite number"),
        (lambda kind: kind({"a": RangeBearing(1.0, 0.1), "b": SEVEN["s1"]}, "b", 9.0), "sensors.a: must report positions"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_what_cannot_detect_is_refused(kind, make, message):
    with pytest.raises(ValueError, match=message):
        make(kind)


@pytest.mark.parametrize("kind", [BayesRiskDetection, BayesRiskPrinted])
@pytest.mark.parametrize("costs", [Costs(0, 0), Costs(miss=-5.0), Costs(miss=1, false_alarm=-1.0), Costs(detection=-3.0)])
def test_costs_that_make_no_risk_are_refused(kind, costs):
    with pytest.raises(ValueError, match=r"costs: must make every Bayes risk > 0, got R\(\d\) = "):
        preprocessor(kind, costs=costs)


def test_a_config_tells_where_the_costs_are_wrong():
    config = FILTERS["proposed"]
    costs = {"miss": -5}
    wrong = config | {"preprocessors": {"fused": config["preprocessors"]["fused"] | {"costs": costs}}}
    with pytest.raises(vedette.ConfigError, match=r"preprocessors.fused.costs: must make every Bayes risk > 0"):
        vedette.load(wrong)


def test_the_printed_form_needs_clutter():
    with pytest.raises(ValueError, match="sensors: must have clutter and detect"):
        BayesRiskPrinted({n: CartesianPosition(5.0) for n in "ab"}, "a", 20.0)


# Weights and mixture.


def test_weights_follow_the_evidence_of_what_is_in_the_gate():
    scores = np.array([[[0.0, 5.0, -np.inf, -9.0]], [[0.0, -np.inf, -np.inf, -np.inf]]])
    evidence = np.log([[[1.0, 7.0, 3.0]], [[1.0, 7.0, 3.0]]])
    weights = BayesRisk().associate(scores, evidence)
    np.testing.assert_allclose(weights[0], [[0, 0.25, 0, 0.75]])
    np.testing.assert_array_equal(weights[1], [[1, 0, 0, 0]])  # nothing is left: the track coasts
    np.testing.assert_allclose(BayesRisk().associate(scores[:1], None)[0], [[0, 0.5, 0, 0.5]])
    np.testing.assert_array_equal(BayesRisk().associate(np.zeros((2, 3, 1)), None), np.ones((2, 3, 1)))


def test_the_printed_covariance_is_the_mixtures_less_the_spread_of_the_means():
    motion, sensor = ConstantVelocity(1.0), CartesianPosition(5.0)
    belief = Gaussian(np.zeros((1, 4)), np.diag([90.0, 80, 10, 10])[None])
    detections = Detections.of([[10.0, 0], [-20, 5]])
    weights = np.array([[0.2, 0.5, 0.3]])
    printed, right = ParallelKalmanPrinted(motion), Kalman(motion)
    innovation = right.evaluate(belief, sensor, detections, 0.99)
    ours = printed.update(belief, printed.evaluate(belief, sensor, detections, 0.99), weights)
    mixture = right.update(belief, innovation, weights)
    means = np.concatenate([np.zeros((1, 4)), innovation.detail.shift[0]])
    apart = means - weights[0] @ means
    np.testing.assert_allclose(ours.mean, mixture.mean, rtol=1e-12)
    np.testing.assert_allclose(mixture.cov[0] - ours.cov[0], np.einsum("i,ia,ib->ab", weights[0], apart, apart), atol=1e-9)


# The study.


@pytest.mark.parametrize("name", FILES)
def test_the_example_is_the_studys_filter(name):
    example = vedette.load(EXAMPLES / f"{FILES[name]}.toml")
    assert vedette.to_config(example) == vedette.to_config(vedette.load((FILTERS | CONTESTED)[name]))
    assert {path.stem for path in EXAMPLES.glob("*.toml")} == set(FILES.values())


def test_the_path_is_table_1():
    truth, times, _ = draw(vedette.load(FILTERS["proposed"]), 2, 100.0, np.random.default_rng(0))
    assert times.tolist() == list(range(91))
    velocity = {20: (100, 100), 30: (50, 150), 50: (50, 150), 70: (-50, 50), 90: (50, 150)}
    for time, v in velocity.items():
        np.testing.assert_allclose(truth[time, 2:], v, atol=1e-9)
    np.testing.assert_allclose(truth[90, :2], [3750, 10250], rtol=1e-12)
    np.testing.assert_allclose(np.diff(truth[:, :2], axis=0), (truth[1:, 2:] + truth[:-1, 2:]) / 2, atol=1e-9)


def test_the_error_is_3_2_to_3_8_m_and_the_same_in_both_windows():
    """At 500 runs 3.53 +- .03 and 3.51 +- .013, their ratio .993 +- .009 against .95: 5 standard errors each."""
    experiment = vedette.load(FILTERS["proposed"])
    made = record(experiment, *draw(experiment, 500, REACH, np.random.default_rng(40)))
    rms = [np.sqrt(np.mean(made.squares[:, WINDOWS[window]])) for window in ("21-30 s", "51-90 s")]
    assert min(rms) > 3.2
    assert max(rms) < 3.8
    assert abs(rms[0] / rms[1] - 1) < 0.05


def test_where_returns_compete_the_printed_covariance_is_twice_too_small(pytestconfig):
    """At 100 times the clutter 2.33 +- .04 (1000 runs at night: .03); with corrected weights 1.58. Below 1e-6."""
    runs = 1000 if pytestconfig.getoption("vedette_profile") == "nightly" else 600
    experiments = {name: vedette.load(config) for name, config in CONTESTED.items()}
    scene = draw(experiments["printed weights, printed P"], runs, DENSE_REACH, np.random.default_rng(50))
    size = {}
    for name in ("printed weights, printed P", "printed weights, with spread", "corrected weights, with spread"):
        size[name] = np.mean(contest(experiments[name], *scene).contested)
    assert size["printed weights, printed P"] > 2 * size["printed weights, with spread"]
    assert 1.4 < size["corrected weights, with spread"] < 2.2


def test_the_study_claims_no_gain_and_is_the_same_again():
    first, again = (BayesRiskReproduction().run(6, 5, lambda items, about: items) for _ in range(2))
    assert first.tables == again.tables
    assert first.claims == again.claims
    verdicts = {claim.text: claim.verdict for claim in first.claims}
    assert verdicts["The proposed filter is 2 to 25 % better than IMM/MSPDA in manoeuvres"] == "not reproduced"
    assert "reproduced" not in verdicts.values()
