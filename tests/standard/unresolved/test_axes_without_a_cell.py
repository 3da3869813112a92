"""A sensor that is coarse on some of its axes: on the others its cell is larger than anything, however large."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_standard.sensors import coarse
from vedette_standard.unresolved import close

RADAR = {"kind": "range_bearing_rate", "sigma_range": 8.0, "sigma_bearing": 0.004, "sigma_rate": 1.0}
RADAR |= {"detection_probability": 0.9, "clutter_density": 1e-7, "max_rate": 60.0, "crossing_speed": 10.0}


def estimates(kind, by, largest, monkeypatch):
    """Two targets a few metres apart, of which a cell of 30 m and .02 rad makes one return in most scans."""
    monkeypatch.setattr(coarse, "ANY", largest)
    made = vedette.build(
        {
            "estimator": {"kind": kind, "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
            "sensors": {"radar": {"kind": "coarse", "of": RADAR, "cells": {"range": 30.0, "bearing": 0.02}}},
            "associator": {"kind": by},
            "birth": {"kind": "from_returns"},
            "lifecycle": {"kind": "existence"},
        }
    )
    rng, state = np.random.default_rng(1), made.start(seed=1)
    for k in range(20):
        x = np.array([[900.0 + 5 * k, 400.0], [905.0 + 5 * k, 480.0 - 6 * k if k < 12 else 408.0]])
        v = np.array([[5.0, 0.0], [5.0, -6.0 if k < 12 else 0.0]])
        r = np.hypot(*x.T)
        z = np.stack([r, np.arctan2(x[:, 1], x[:, 0]), np.sum(x * v, axis=1) / r], axis=-1)
        z = z if k < 9 or k % 4 == 0 else z.mean(axis=0, keepdims=True)
        state = made.step(state, Scan(float(k), "radar", Detections.of(z + rng.normal(0, [8.0, 0.004, 1.0], z.shape))))
    assert state.confirmed.sum() == 2
    return made.estimate(state)


@pytest.mark.parametrize(("kind", "by"), [("ekf", "jpda"), ("srkf", "jpda"), ("ekf", "k_best"), ("srkf", "k_best")])
@pytest.mark.by_turns
def test_how_large_no_cell_is_changes_nothing(kind, by, monkeypatch):
    large, larger = (estimates(kind, by, size, monkeypatch) for size in (1e6, 1e9))
    np.testing.assert_allclose(larger.mean, large.mean, rtol=1e-7, atol=1e-6)
    np.testing.assert_allclose(larger.cov, large.cov, rtol=1e-6, atol=1e-6)


def test_what_a_merged_return_says_in_full_precision():
    """C - C (C + S)^-1 C by fractions of whole numbers: the noise is positive definite, and right to 1e-9."""
    from fractions import Fraction

    S, R, C = np.diag([9.0, 4.0]), np.diag([2.0, 1.0]), np.diag([25.0, 1e18])
    _, noise = close._told(S[None], R[None], C[None], np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1, dtype=int))
    for axis in range(2):
        s, r, c = (Fraction(float(M[axis, axis])) for M in (S, R, C))
        w, v = c / (c + s), c - c * c / (c + s)
        told = 1 / (1 / (c + s) + (1 - w / 2) ** 2 / (r + v / 4))
        assert noise[0, axis, axis] == pytest.approx(float(told), rel=1e-9)
