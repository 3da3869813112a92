"""What the scans held back say: which values are better there, and which way they pull each of them."""

import numpy as np
import pytest

from support.tuned import RANGES, TRUTH, recorded
from vedette.config import load
from vedette_tools.tuning.evaluation import evaluate, open_data
from vedette_tools.tuning.parameters import read_free
from vedette_tools.tuning.validation import judge

SIGMA = "sensors.radar.sigma"


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    config = recorded(tmp_path_factory.mktemp("data") / "recording.jsonl", seed=3, duration=60.0)
    return open_data(load(config), 0.5)


def judged(data, value, error=0.02):
    free = read_free(data.experiment, [f"{SIGMA}={RANGES[SIGMA]}"])
    return judge(data, free, [value], np.array([[error**2]]))


@pytest.mark.parametrize(("factor", "advice", "way"), [(2.5, "keep", -1), (0.2, "keep", 1)])
def test_values_worse_on_the_scans_held_back_are_advised_against_and_pulled_back(data, factor, advice, way):
    found = judged(data, factor * TRUTH[SIGMA])
    assert found.advice == advice
    assert way * found.pull[0] > 0


def test_better_ones_are_taken(data, tmp_path):
    """Data of a sensor 2.5 times worse than the config says: the right value gains there, too."""
    config = recorded(tmp_path / "recording.jsonl", seed=4, duration=60.0)
    found = judged(open_data(load(config, overrides=[f"{SIGMA}={2.5 * TRUTH[SIGMA]}"]), 0.5), TRUTH[SIGMA])
    assert found.advice == "take"
    assert found.held.difference > 2 * found.held.by_scans


def test_the_pull_is_the_difference_over_one_error_either_way(data):
    free = read_free(data.experiment, [f"{SIGMA}={RANGES[SIGMA]}"])
    place, error = float(free[0].position(14.0)), 0.02
    held = [
        np.sum(
            evaluate(data, free, [float(free[0].value(np.asarray(place + sign * error)))], whole=True).loglik[data.tuned :]
        )
        for sign in (1, -1)
    ]
    assert judged(data, 14.0).pull[0] == pytest.approx(0.5 * (held[0] - held[1]), rel=1e-9)
