"""A published benchmark of multi-target filters: four targets meet half-way and part. The oracle is not ours."""

import csv
from collections import defaultdict

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import vedette
from support.paths import EXAMPLES, recording

RNG = np.random.default_rng(0)


def expected(name, run):
    """What a filter of the oracle reports in each scan of a run, positions in m."""
    found = defaultdict(list)
    for row in csv.DictReader((recording("mtt") / "expected.csv").read_text().splitlines()):
        if (row["run"], row["filter"]) == (str(run), name):
            found[int(row["scan"])].append((float(row["x"]), float(row["y"])))
    return found


def farthest(associator, name, run):
    """The largest distance in m of what is reported, if its existence is above .4, from the oracle."""
    path = recording("mtt") / f"run{run}.jsonl"
    experiment = vedette.load(EXAMPLES / "crossing.toml", overrides=[f"source.path={path}", f"associator={associator}"])
    tracker, oracle, largest = experiment.tracker, expected(name, run), 0.0
    state, order = tracker.start(), [tracker.state.names.index(axis) for axis in ("x", "y")]
    for k, scan in enumerate(experiment.source.open(tracker.sensors, RNG).scans):
        state = tracker.step(state, scan)
        found = tracker.estimate(state).mean[state.existence > 0.4][:, order]
        if len(found) != len(oracle[k]):
            return np.inf
        if len(found):
            apart = np.linalg.norm(found[:, None] - np.array(oracle[k])[None], axis=-1)
            largest = max(largest, float(np.max(apart[linear_sum_assignment(apart)])))
    return largest


RUNS = range(5)


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    ("associator", "name", "within"),
    [
        ("{kind='k_best', hypotheses=200}", "pmbm", 1e-6),
        ("{kind='k_best', hypotheses=20}", "pmbm20", 1e-6),
        ("{kind='m_best_jpda', m=200}", "pmb_murty", 1e-3),  # 200 of each cluster, the published filter's of all targets
        ("{kind='jpda'}", "pmb_murty", 1e-3),
    ],
)
@pytest.mark.by_turns
def test_the_published_filters_report_the_same(associator, name, within, run):
    assert farthest(associator, name, run) < within


def test_other_kinds_report_something_else():
    assert farthest("{kind='gnn'}", "pmbm", 0) == np.inf
    assert farthest("{kind='k_best', hypotheses=1}", "pmbm", 0) > 1e-3
