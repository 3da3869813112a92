"""The global decision of section 2: for a target from the count on at which the Bayes risk is least."""

import numpy as np

from vedette import Detections, Scan
from vedette_bayes_risk.configs import CLUTTER, SIGMA, THRESHOLD
from vedette_bayes_risk.decision import BayesRiskDecision
from vedette_bayes_risk.risk import Costs
from vedette_standard.sensors.cartesian_position import CartesianPosition

SEVEN = {f"s{i}": CartesianPosition(SIGMA, 1.0, CLUTTER) for i in range(1, 8)}


def test_the_risk_is_that_of_deciding_from_so_many_on():
    """R(k) by its definition, from the chances of each count; k = 1 decides for whatever the base reports."""
    made = BayesRiskDecision(SEVEN, "s1", THRESHOLD, Costs(miss=2.0, false_alarm=3.0, prior=0.25))
    target, clutter = made.confirmation.given_target(THRESHOLD), made.confirmation.given_clutter(THRESHOLD)
    expected = [2.0 * 0.25 * target[:k].sum() + 3.0 * 0.75 * clutter[k:].sum() for k in range(7)]
    np.testing.assert_allclose(made.risks(), expected, rtol=1e-9, atol=1e-12)
    assert made.best == 1 + int(np.argmin(expected))


def test_dearer_false_alarms_need_more_sensors():
    cheap, dear = (BayesRiskDecision(SEVEN, "s1", THRESHOLD, Costs(false_alarm=cost)).best for cost in (1e-4, 1e6))
    assert 2 <= cheap < dear <= 7


def test_what_too_few_report_is_dropped():
    """Three sensors report one place and two another: g = 1 for the first alone where the best count is 3."""
    made = BayesRiskDecision(SEVEN, "s1", THRESHOLD)
    assert made.best == 3
    spots = {"s1": [[0.0, 0], [500, 0]], "s2": [[1.0, 0], [501, 0]], "s3": [[0.0, 1]]}
    scans = {name: Scan(0.0, name, Detections(np.array(z), np.ones(len(z), dtype=bool))) for name, z in spots.items()}
    found = made.process(scans)
    assert found.valid.sum() == 1
    np.testing.assert_allclose(found.z[found.valid], [[1 / 3, 1 / 3]])
