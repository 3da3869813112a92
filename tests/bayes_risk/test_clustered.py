"""Detection without a base: clusters by hand, and what they have that those of a base have not."""

import numpy as np
import pytest

from vedette import Detections, Scan
from vedette_bayes_risk.clustered import ClusteredDetection
from vedette_bayes_risk.tail import BayesRiskDetection
from vedette_standard.sensors.cartesian_position import CartesianPosition


def scans(**seen):
    return {
        name: Scan(0.0, name, Detections(np.reshape(np.array(z, dtype=float), (-1, 2)), np.ones(len(z), dtype=bool)))
        for name, z in seen.items()
    }


def three(**more):
    return ClusteredDetection({name: CartesianPosition(5.0, 0.9, 1e-5) for name in "abc"}, 20.0, **more)


def test_returns_that_lie_together_are_one_cluster_whichever_sensors_report_them():
    found = three().process(scans(a=[[0, 0], [300, 0]], b=[[6, 0]], c=[[0, 6], [306, 0]]))
    assert found.valid.sum() == 2
    np.testing.assert_allclose(sorted(found.z[found.valid].tolist()), [[2, 2], [303, 0]])
    by_place = dict(zip(found.z[found.valid][:, 0].tolist(), found.noise[found.valid][:, 0, 0].tolist(), strict=True))
    assert by_place == pytest.approx({2.0: 25 / 3, 303.0: 25 / 2})


def test_a_target_that_the_base_misses_is_seen():
    seen = scans(a=[], b=[[0, 0]], c=[[4, 0]])
    assert three().process(seen).valid.sum() == 1
    based = BayesRiskDetection({name: CartesianPosition(5.0, 0.9, 1e-5) for name in "abc"}, "a", 20.0)
    assert based.process(seen).valid.sum() == 0


def test_a_return_alone_is_none_and_so_is_one_too_far():
    assert three().process(scans(a=[[0, 0]], b=[[41, 0]], c=[])).valid.sum() == 0
    assert three().process(scans(a=[], b=[], c=[])).valid.sum() == 0


def test_more_sensors_are_more_evidence_and_the_ratio_is_of_two_or_more():
    log = three().log_weights()
    assert np.all(np.diff(log[2:]) > 0)
    p_false = -np.expm1(-1e-5 * np.pi * 400)
    clutter = np.array([3 * p_false**2 * (1 - p_false), p_false**3])
    target = np.exp(log[2:]) * clutter / clutter.sum()
    assert target.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("sensors", "message"), [(1, "sensors: .* 2")])
def test_one_sensor_is_refused(sensors, message):
    with pytest.raises(ValueError, match=message):
        ClusteredDetection({"a": CartesianPosition(5.0, 0.9, 1e-5)}, 20.0)
