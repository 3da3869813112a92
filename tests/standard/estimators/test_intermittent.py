"""A filter of a target that hides, in a tracker: existence, and being in sight, as by the chain of all three states."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Scan
from vedette_standard.estimators import intermittent
from vedette_standard.estimators.intermittent import Intermittent

IN_SIGHT, HIDDEN, LIFETIME, DETECTED, DT = 3.0, 1.5, 40.0, 0.9, 0.4
SEEN = (1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 0, 0, 0)


def tracker(associator):
    motion = {"kind": "constant_velocity", "sigma_accel": 0.3}
    return vedette.build(
        {
            "sensors": {
                "eye": {
                    "kind": "cartesian_position",
                    "sigma": 2.0,
                    "detection_probability": DETECTED,
                    "clutter_density": 1e-10,
                }
            },
            "estimator": {
                "kind": "intermittent",
                "in_sight": IN_SIGHT,
                "hidden": HIDDEN,
                "of": {"kind": "kalman", "motion": motion},
            },
            "gate": {"probability": 0.9999},
            "associator": {"kind": associator},
            "birth": {"kind": "from_returns", "initial": 0.4, "spread": {"vx": 1.0, "vy": 1.0}},
            "lifecycle": {"kind": "existence", "lifetime": LIFETIME, "delete": 1e-9},
        }
    )


def followed(associator):
    """Return existence after each scan of one target that stands, by the tracker, and the ratios of its returns."""
    made, existence, likely = tracker(associator), [], []
    state = made.start()
    for k, seen in enumerate(SEEN):
        z = np.array([[10.0, 20.0]])[: 1 if seen else 0]
        if k:
            belief = made.estimator.predict(state.belief, DT, np.random.default_rng(0))
            inner = made.estimator.of.evaluate(belief.belief, made.sensors["eye"], Detections.of(z, 2), 0.9999)
            likely.append(np.exp(inner.loglik[0, 1] - np.log(1e-10)) if seen else np.nan)
        state = made.step(state, Scan(DT * k, "eye", Detections.of(z, 2)))
        existence.append(float(state.existence[0]))
    return np.array(existence), likely


def by_chain(first, likely):
    """The oracle: gone, in sight or hidden, by Bayes' rule over the three states."""
    a, b = 1 / IN_SIGHT, 1 / HIDDEN
    left = np.exp(-(a + b) * DT)
    stays = np.array([[(b + a * left), (a - a * left)], [(b - b * left), (a + b * left)]]) / (a + b)
    state, told = np.array([1 - first, first, 0.0]), [first]
    for seen, ratio in zip(SEEN[1:], likely, strict=True):
        there = state[1:] @ stays * np.exp(-DT / LIFETIME)
        state = np.array([1 - there.sum(), *there])
        state *= [1.0, ratio, 0.0] if seen else [1.0, 1.0 - 0.9999 * DETECTED, 1.0]
        state /= state.sum()
        told.append(1 - state[0])
    return np.array(told)


@pytest.mark.parametrize("associator", ["pda", "jpda", "lmb"])
def test_existence_is_that_of_the_chain(associator):
    """A return beyond any doubt, as of one target far from clutter: whether it is clutter is settled."""
    existence, likely = followed(associator)
    np.testing.assert_allclose(existence, by_chain(existence[0], likely), rtol=0, atol=2e-5)
    assert existence[-1] > 0.5, "four misses are no proof"


def always_seen(self, belief, innovation, weights):
    """The mutant: a miss tells nothing of whether the target is in sight."""
    after = self.of.update(belief.belief, evolve(innovation, detail=innovation.detail.detail), weights)
    return intermittent.InSight(after, np.ones_like(belief.probability))


def test_the_law_bites(monkeypatch):
    monkeypatch.setattr(Intermittent, "update", always_seen)
    existence, likely = followed("pda")
    assert np.max(np.abs(existence - by_chain(existence[0], likely))) > 1e-3


@pytest.mark.parametrize("associator", ["gnn", "n_scan", "jpda_star", "variational", "m_best_jpda"])
def test_a_track_outlives_misses_by_any_associator(associator):
    alone = tracker(associator).estimator.of
    assert followed(associator)[0][-1] > 0.5
    plain = evolve(tracker(associator), estimator=alone)
    state = plain.start()
    for k, seen in enumerate(SEEN):
        state = plain.step(state, Scan(DT * k, "eye", Detections.of(np.array([[10.0, 20.0]])[:seen], 2)))
    assert not len(state.existence) or float(state.existence[0]) < 0.1
