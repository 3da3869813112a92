"""A summary says how often association was not exact."""

import vedette
from support.paths import EXAMPLES
from vedette.metrics import judge
from vedette.report.summary import summary


def told(*overrides):
    experiment = vedette.load(EXAMPLES / "harbour.toml", overrides=["associator.kind=jpda", *overrides])
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, experiment.tracker.gate.probability)
    return result, summary(experiment, result, score)


def test_approximate_weights_are_told_and_exact_ones_are_not():
    result, text = told("associator.exact=1")
    assert result.approximated > 0
    assert f"approximated {result.approximated:,} times: its cluster was too large for exact sums" in " ".join(text.split())
    result, text = told()
    assert result.approximated == 0
    assert "approximated" not in text
