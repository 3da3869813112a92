"""Distributed detection by Bayes risk: weights and decisions by hand, and what is refused."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_bayes_risk.configs import DENSE, FILTERS, SIGMA, THRESHOLD
from vedette_bayes_risk.likelihood import CountLikelihoodDetection
from vedette_bayes_risk.printed import BayesRiskPrinted
from vedette_bayes_risk.risk import Costs
from vedette_bayes_risk.tail import BayesRiskDetection
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

KINDS = (BayesRiskDetection, BayesRiskPrinted, CountLikelihoodDetection)
SEVEN = {f"s{i}": CartesianPosition(SIGMA, 1.0, DENSE) for i in range(1, 8)}


def scan(name, z, valid=None):
    z = np.asarray(z, dtype=float).reshape(*np.shape(z)[:-1], 2) if np.size(z) else np.zeros((0, 2))
    return Scan(0.0, name, Detections(z, np.ones(z.shape[:-1], dtype=bool) if valid is None else valid))


def preprocessor(kind=BayesRiskDetection, sensors=3, sigma=5.0, threshold=20.0, **more):
    own = {name: CartesianPosition(sigma, 1.0, 1e-5) for name in "abcdefg"[:sensors]}
    return kind(own, "a", threshold, **more)


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
        (lambda kind: preprocessor(kind, sensors=1), r"sensors: must be at least 2.*got 1"),
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
    with pytest.raises(ValueError, match=r"costs: must make every Bayes.*got R\(\d\) = "):
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
