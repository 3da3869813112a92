"""The benchmark of association has every associator that is installed, and scenes that can be drawn."""

import numpy as np
import pytest

import vedette
from benchmarks import association as benchmark
from vedette.config.registry import Registry


def test_it_has_every_associator_of_the_standard_shelf():
    kinds = {each.kind for each in Registry.installed().of_role("associator")}
    assert set(benchmark.KINDS) == kinds - {"bayes_risk"}  # of a paper, for two detections of one target
    assert list(benchmark.trackers(benchmark.config({}))) == list(benchmark.TRACKERS)


@pytest.mark.costly
def test_its_scenes_have_the_groups_that_they_say():
    counts = {}
    for name, scene in benchmark.SCENES.items():
        experiment = vedette.load(benchmark.config(scene))
        counts[name] = len(experiment.source.open(experiment.tracker.sensors, np.random.default_rng(0)).truth)
    assert list(counts.values())[:4] == [3, 3, 2, 2]
    assert counts["examples/fleet.toml"] > 10


def test_every_tracker_but_the_first_of_reference_is_compared_with_one_that_differs_in_one_thing():
    alone = [name for name in benchmark.TRACKERS if benchmark.reference(name) is None]
    assert alone == ["jpda"]
    for name in set(benchmark.TRACKERS) - {"jpda"}:
        one, other = benchmark.TRACKERS[name], benchmark.TRACKERS[benchmark.reference(name)]
        assert sum(one.get(part) != other.get(part) for part in ("associator", "birth")) == 1
