"""A summary says how often association was not exact."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.config import to_config
from vedette.metrics import judge
from vedette_report.summary.words import MUCH, summary
from vedette_study.summary import text as montecarlo_text


def told(*overrides):
    experiment = vedette.load(EXAMPLES / "harbour.toml", overrides=["associator.kind=jpda", *overrides])
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, experiment.tracker.gate.probability)
    return result, summary(experiment, result, score)


@pytest.mark.costly
def test_approximate_weights_are_told_and_exact_ones_are_not():
    result, text = told("associator.exact=1")
    assert result.approximated > 0
    assert f"approximated {result.approximated:,} times: its cluster was too large for exact sums" in " ".join(text.split())
    result, text = told()
    assert result.approximated == 0
    assert "approximated" not in text


@pytest.mark.costly
def test_what_truncated_hypotheses_lack_is_told():
    result, text = told("associator={kind='k_best', hypotheses=2}", "lifecycle={kind='existence'}")
    assert 0 < result.lost < result.approximated
    share = f"{result.lost / result.approximated:.1%}"
    assert f"{result.approximated:,} times" in " ".join(text.split())
    assert share in text
    more, text = told("associator={kind='k_best', hypotheses=1000}", "lifecycle={kind='existence'}")
    assert more.lost < 0.5 * result.lost
    assert "'lmb'" not in text


@pytest.mark.costly
def test_where_much_was_dropped_another_associator_is_named():
    wide = ["sensors.radar.detection_probability=0.5", "birth.spread={ vx = 60, vy = 60, turn_rate = 0.1 }"]
    result, text = told("associator={kind='k_best', hypotheses=1}", "lifecycle={kind='existence'}", *wide)
    assert result.lost > MUCH * result.approximated
    assert "'lmb' drops none" in " ".join(text.split())


@pytest.mark.costly
def test_a_study_tells_it_too():
    def studied(exact):
        overrides = ["associator.kind=jpda", f"associator.exact={exact}", "source.duration=300"]
        return vedette.monte_carlo(to_config(vedette.load(EXAMPLES / "harbour.toml", overrides=overrides)), 2, 1)

    found = studied(1)
    assert np.any(found.figures["approximated"] > 0)
    assert "approximated: how often in a run a track's association weights were not exact" in montecarlo_text(found)
    assert "approximated" not in montecarlo_text(studied(14))
