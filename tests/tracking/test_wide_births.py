"""Undetected targets of a wide Gaussian are found, be a sensor nonlinear or its view a part of it, wherever it stands."""

from __future__ import annotations

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Space
from vedette.sampling import Bounds
from vedette_standard import CartesianPosition, ConstantVelocity, ExtendedKalman, RangeBearing
from vedette_standard.births.at_returns import at_returns

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
RADAR = {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01}
DOPPLER = {"kind": "range_bearing_rate", "sigma_range": 10.0, "sigma_bearing": 0.01, "sigma_rate": 1.0, "max_rate": 50.0}


def prior(x, y, deviation):
    return Gaussian(np.array([[x, y, 3.0, -2.0]]), np.diag([deviation, deviation, 10.0, 10.0])[None] ** 2)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (800.0, 600.0), (3000.0, 4000.0)])
def test_a_wide_gaussian_gives_a_return_the_density_that_an_integral_gives(x, y):
    sensor, belief, rng = RangeBearing(10.0, 0.01), prior(x, y, 2000.0), np.random.default_rng(1)
    places = rng.normal([x, y], 1000.0, (200, 2))
    z = sensor.measure(places[np.hypot(*places.T) > 500.0])
    seen = at_returns(belief, STATE, sensor, Detections.of(z))
    # Over range and bearing the density of a place is r N(place); noise this small only blurs it.
    at = z[:, :1] * np.stack([np.cos(z[:, 1]), np.sin(z[:, 1])], axis=-1)
    exact = np.log(z[:, 0]) - np.log(2.0 * np.pi * 2000.0**2) - 0.5 * np.sum((at - [x, y]) ** 2, axis=-1) / 2000.0**2
    assert np.allclose(seen.loglik[0], exact, atol=0.01)
    assert np.allclose(seen.given.mean[0, :, :2], at, atol=5.0)
    assert np.allclose(np.trace(seen.given.cov[0, :, :2, :2], axis1=-2, axis2=-1), 100.0 + (0.01 * z[:, 0]) ** 2, rtol=0.05)


def test_a_narrow_one_is_taken_as_the_filter_takes_it():
    sensor, belief = RangeBearing(10.0, 0.01), prior(3000.0, 4000.0, 5.0)
    seen = Detections.of(sensor.measure(np.array([[3004.0, 4003.0]])))
    ekf, near = ExtendedKalman(ConstantVelocity(0.5)), at_returns(belief, STATE, sensor, seen)
    own = ekf.evaluate(belief, sensor, seen, 1.0)
    assert np.allclose(near.loglik, own.loglik[:, 1:], atol=1e-4)
    after = ekf.update(belief, own, np.array([[0.0, 1.0]]))
    assert np.allclose(near.given.mean[:, 0], after.mean, atol=1e-3)


def test_a_return_has_the_detection_probability_of_its_place_and_not_of_the_middle_of_a_gaussian():
    belief, z = prior(0.0, 0.0, 800.0), np.array([[400.0, 100.0], [-400.0, 100.0]])
    east = CartesianPosition(5.0, 0.9, 1e-6, view={"x": Bounds(100.0, 5000.0)})
    variance = 800.0**2 + 5.0**2
    exact = np.log(0.9) - np.log(2.0 * np.pi * variance) - 0.5 * np.sum(z[0] ** 2) / variance
    told = at_returns(belief, STATE, east, Detections.of(z))
    assert np.allclose(np.exp(told.loglik), [[np.exp(exact), 0.0]], atol=1e-300)
    assert np.allclose(told.given.mean[0, 0], [*z[0] * 800.0**2 / variance, 3.0, -2.0])


@pytest.mark.parametrize("middle", [(0.0, 0.0), (800.0, 600.0), (3000.0, 4000.0)])
@pytest.mark.parametrize("estimator", ["ekf", "ukf"])
@pytest.mark.parametrize("radar", [RADAR, DOPPLER], ids=["range_bearing", "range_bearing_rate"])
def test_targets_of_a_wide_gaussian_are_found(radar, estimator, middle):
    at = {axis: [m, 2000.0] for axis, m in zip("xy", middle, strict=True)} | {"vx": [0, 15], "vy": [0, 15]}
    tracker = vedette.build({
        "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": radar | {"detection_probability": 0.9, "clutter_density": 5 / 8000.0**2}},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "poisson", "appear": [{"at": at, "initial": 3.0, "rate": 0.01}]},
        "lifecycle": {"kind": "existence"},
    })  # fmt: skip
    rng, sensor, state = np.random.default_rng(5), tracker.sensors["radar"], tracker.start(seed=1)
    truth = np.concatenate([rng.normal(middle, 1500.0, (3, 2)), rng.normal(0.0, 15.0, (3, 2))], axis=-1)
    own = STATE.locate(sensor.observes)
    for time in np.arange(0.0, 40.0, 2.0):
        now = truth + time * np.array([truth[:, 2], truth[:, 3], 0 * truth[:, 2], 0 * truth[:, 3]]).T
        false = np.concatenate([rng.uniform(-4000.0, 4000.0, (5, 2)) + middle, rng.normal(0.0, 15.0, (5, 2))], axis=-1)
        x = np.concatenate([now[rng.random(3) < 0.9], false])[:, own]
        z = sensor.measure(x) + rng.normal(size=(len(x), len(sensor.measurement))) * np.sqrt(np.diag(sensor.noise(x[0])))
        state = tracker.step(state, vedette.Scan(time, "radar", Detections.of(z, len(sensor.measurement))))
    found = tracker.estimate(state).mean[state.confirmed][:, :2]
    apart = np.linalg.norm(found[:, None] - now[None, :, :2], axis=-1)
    assert len(found) == 3
    assert np.all(np.min(apart, axis=0) < 150.0)
