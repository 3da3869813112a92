"""Births at returns that say something of the velocity, too: a Doppler radar's, a satellite receiver's."""

import numpy as np
import pytest

import vedette
from vedette import ConfigError, Detections, Pose, Scan
from vedette.sampling import Bounds
from vedette_standard import ConstantVelocity, ExtendedKalman, PositionVelocity, RangeBearingRate, Uniform
from vedette_standard.births import anywhere, following

RADAR = RangeBearingRate(5.0, 0.01, 0.5, max_rate=40.0, max_range=2000.0, clutter_per_scan=5.0, detection_probability=0.9)
BOX = {axis: Bounds(-1000.0, 1000.0) for axis in "xy"}
SPREAD = {"vx": 8.0, "vy": 12.0}
FILTER = ExtendedKalman(ConstantVelocity(0.3))
SENSORS = {
    "rate": {
        "kind": "range_bearing_rate", "sigma_range": 5.0, "sigma_bearing": 0.01, "sigma_rate": 0.5, "max_rate": 40.0,
        "max_range": 2000.0, "clutter_per_scan": 5.0, "detection_probability": 0.9,
    },
    "velocity": {
        "kind": "position_velocity", "sigma": 5.0, "sigma_speed": 0.5, "detection_probability": 0.9,
        "clutter_density": 1e-9,
    },
}  # fmt: skip
BIRTHS = {
    "uniform": {"view": {axis: {"low": -1000, "high": 1000} for axis in "xy"}, "spread": SPREAD, "initial": 2.0},
    "two_point": {"max_speed": 20.0},
    "three_point": {"max_speed": 20.0, "max_acceleration": 1.0},
}


def revealed(sensor, z):
    return Uniform(BOX, SPREAD, initial=3.0).reveal(np.full((1, 1, 1), 3.0), FILTER, sensor, Detections.of(z), 1.0)[0]


def integrated(sensor, z):
    """The density by a sum over places, each with all velocities: the rate is linear in them."""
    spot, total = sensor.invert(z).mean[:2], 0.0
    width = 6.0 * np.sqrt(np.linalg.eigvalsh(sensor.invert(z).cov[:2, :2])[-1])
    steps = (np.arange(400) + 0.5) / 400 * 2 * width - width
    x = np.zeros((400 * 400, 4))
    x[:, :2] = spot + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    H = sensor.jacobian(x)[:, :, 2:]
    S = sensor.noise(x) + (H * np.square([*SPREAD.values()])) @ np.swapaxes(H, -1, -2)
    off = sensor.measurement.difference(z, sensor.measure(x))
    square = np.einsum("ij,ij->i", off, np.linalg.solve(S, off[..., None])[..., 0])
    total = np.sum(np.exp(-0.5 * square) / np.sqrt(np.linalg.det(2 * np.pi * S))) * (2 * width / 400) ** 2
    return 3.0 * 0.9 * total / 2000.0**2


@pytest.mark.parametrize("pose", [Pose([0.0, 0.0]), Pose([150.0, -80.0], [6.0, -3.0], 0.7)])
@pytest.mark.parametrize("z", [[300.0, 0.4, -5.0], [700.0, -2.0, 14.0], [450.0, 3.0, 0.0]])
@pytest.mark.by_turns
def test_the_density_is_that_over_all_places_and_velocities(pose, z):
    sensor, z = RADAR.at(pose), np.array(z)
    assert revealed(sensor, [z])[0] == pytest.approx(integrated(sensor, z), rel=0.01)


def test_where_all_is_measured_it_is_exact():
    sensor = PositionVelocity(5.0, 0.5, detection_probability=0.9, clutter_density=1e-9)
    variance = np.square([*SPREAD.values()]) + 0.25
    z = np.array([100.0, 50.0, 6.0, -9.0])
    wanted = np.exp(-0.5 * np.sum(z[2:] ** 2 / variance)) / (2 * np.pi * np.sqrt(np.prod(variance)))
    assert revealed(sensor, [z])[0] == pytest.approx(3.0 * 0.9 / 2000.0**2 * wanted, rel=1e-9)


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("birth", BIRTHS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_targets_are_found(birth, sensor, seed):
    tracker = vedette.build({
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
        "sensors": {"radar": SENSORS[sensor]},
        "associator": {"kind": "jpda"},
        "birth": {"kind": birth, **BIRTHS[birth]},
        "lifecycle": {"kind": "existence"},
    })  # fmt: skip
    rng, made, state = np.random.default_rng(seed), tracker.sensors["radar"], tracker.start()
    x = np.array([[300.0, 400.0, -6.0, 3.0], [-500.0, 200.0, 2.0, -9.0]])
    for time in range(15):
        at = x + time * x[:, [2, 3, 2, 3]] * [1, 1, 0, 0]
        z = made.measure(at) + rng.normal(size=(2, len(made.measurement))) * np.sqrt(np.diag(made.noise(at)))
        false = np.concatenate([rng.uniform([50, -3, -40], [900, 3, 40], (5, 3)), np.zeros((5, 1))], axis=1)
        seen = np.concatenate([z[rng.random(2) < 0.9], false[:, : z.shape[1]]]) if sensor == "rate" else z
        state = tracker.step(state, Scan(float(time), "radar", Detections.of(seen)))
    shown = tracker.estimate(state).mean[state.confirmed]
    apart = np.linalg.norm(shown[:, None, :2] - at[None, :, :2], axis=-1)
    assert len(shown) == 2
    assert np.all(np.min(apart, axis=0) < 30.0)


def test_what_is_observed_beside_the_box_needs_a_spread():
    parts = {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
        "sensors": {"radar": SENSORS["rate"]},
        "associator": {"kind": "jpda"},
        "lifecycle": {"kind": "existence"},
    }
    with pytest.raises(ConfigError, match=r"birth\.spread: must state .* of 'vy', which 'range_bearing_rate' observes"):
        vedette.build({**parts, "birth": {"kind": "uniform", **BIRTHS["uniform"], "spread": {"vx": 8.0}}})


def test_mutants_break_these_laws(monkeypatch):
    monkeypatch.setattr(following, "position_of", lambda sensor: sensor.observes)
    with pytest.raises(ConfigError, match="positions alone"):
        test_targets_are_found("two_point", "rate", 1)
    whole = anywhere.over_places
    monkeypatch.setattr(
        "vedette_standard.births.uniform.over_places", lambda *given: whole(*given[:-1], {"vx": 1e-9, "vy": 1e-9})
    )
    with pytest.raises(AssertionError):
        test_the_density_is_that_over_all_places_and_velocities(Pose([0.0, 0.0]), [300.0, 0.4, -5.0])
