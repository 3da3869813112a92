"""Simulated truth and returns: closed forms against integration, draws against the models' own moments.

Every statistical test accepts at a false alarm rate of ALPHA, whatever the seed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import solve_ivp

import vedette
import vedette_sim as sim
from vedette import Array, ConfigError, Gaussian, MotionModel, Pose, Sensor, Space
from vedette.sampling.detections import shuffled
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

ALPHA = 1e-7


# ---- models of this test's own: one with a singular noise, one with an axis that constant velocity lacks, one polar sensor


@frozen
class PulledVelocity(MotionModel):
    """Acceleration constant over each step: a noise of rank 2 over 4 axes."""

    kind: ClassVar[str] = "test_pulled"
    sigma: float = 0.5

    @property
    def state(self) -> Space:
        return Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def move(self, x: Array, dt: float) -> Array:
        return x + dt * np.concatenate([x[..., 2:], np.zeros_like(x[..., 2:])], axis=-1)

    def noise(self, x: Array, dt: float) -> Array:
        gain = np.kron(np.array([[dt**2 / 2], [dt]]), np.eye(2))
        return self.sigma**2 * gain @ gain.T


@frozen
class Weaving(MotionModel):
    """A velocity that turns by an axis of its own, in another order of axes, with noise that grows with the turn rate."""

    kind: ClassVar[str] = "test_weaving"

    @property
    def state(self) -> Space:
        return Space.of(turn_rate="rad/s", vx="m/s", vy="m/s", x="m", y="m")

    def move(self, x: Array, dt: float) -> Array:
        w, vx, vy, px, py = np.moveaxis(x, -1, 0)
        c, s = np.cos(w * dt), np.sin(w * dt)
        return np.stack([w, c * vx - s * vy, s * vx + c * vy, px + dt * vx, py + dt * vy], axis=-1)

    def noise(self, x: Array, dt: float) -> Array:
        return dt * np.abs(x[..., :1, None]) * np.diag([1e-4, 0.1, 0.1, 0.0, 0.0])


@frozen
class Polar(Sensor):
    """Range and bearing from where it stands, relative to its heading; clutter uniform over the ground."""

    kind: ClassVar[str] = "test_polar"
    sigma_range: float = 5.0
    sigma_bearing: float = 0.05
    p_detect: float = 0.9
    density: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0

    @property
    def observes(self) -> Space:
        return Space.of(x="m", y="m")

    @property
    def measurement(self) -> Space:
        return Space.of(range="m", bearing="rad mod 2pi")

    def measure(self, x: Array) -> Array:
        d = x - np.array(self.place)
        return np.stack([np.hypot(d[..., 0], d[..., 1]), np.arctan2(d[..., 1], d[..., 0]) - self.heading], axis=-1)

    def noise(self, x: Array) -> Array:
        return np.diag([self.sigma_range**2, self.sigma_bearing**2])

    def detects(self, x: Array) -> Array:
        return np.where(np.hypot(x[..., 0], x[..., 1]) < 1000.0, self.p_detect, 0.0)

    def clutter(self, z: Array) -> Array:
        return self.density * z[..., 0]

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        raise NotImplementedError

    def at(self, pose: Pose) -> Sensor:
        return evolve(self, place=tuple(pose.position), heading=float(pose.heading))


class Peaked(Polar):
    """Clutter in one spot, narrower than any grid."""

    def clutter(self, z: Array) -> Array:
        return 1e-3 + 1.0 * (np.abs(z[..., 0] - 512.3) < 0.4)


def moments_match(samples: Array, mean: Array, cov: Array) -> bool:
    """Mean by Hotelling, covariance by the likelihood ratio, of N samples (N, n) against N(mean, cov); each at ALPHA."""
    count, n = samples.shape
    white = np.linalg.solve(np.linalg.cholesky(cov), (samples - mean).T)
    scatter = white @ white.T / count
    ratio = count * (np.trace(scatter) - np.linalg.slogdet(scatter)[1] - n)
    return bool(
        count * np.sum(white.mean(axis=1) ** 2) < stats.chi2.isf(ALPHA, n) and ratio < stats.chi2.isf(ALPHA, n * (n + 1) / 2)
    )


# ---- ships


def integrated(ship: sim.Ship, times: Array) -> Array:
    """x, y, vx, vy of a ship by numerical integration, leg after leg."""
    state = np.array([*ship.start, ship.course, ship.speed])
    begin, rows = ship.appears, np.full((len(times), 4), np.nan)
    for leg in (*ship.legs, None):
        speed = state[3]
        rate, accel, seconds = 0.0, 0.0, 1e4
        if leg is not None:
            rate = (
                leg.rate if leg.rate is not None else (leg.lateral_accel / speed if leg.lateral_accel is not None else 0.0)
            )
            accel = leg.accel or 0.0
            seconds = leg.seconds
            if leg.do == "stop":
                accel, seconds = -leg.decel, speed / leg.decel
        here = (times >= begin) & (times <= begin + seconds)

        def motion(_: float, s: Array, rate: float = rate, accel: float = accel) -> list[float]:
            return [s[3] * np.cos(s[2]), s[3] * np.sin(s[2]), rate, accel]

        if seconds > 0:
            at = np.append(times[here], begin + seconds)
            path = solve_ivp(motion, (begin, begin + seconds), state, t_eval=at, rtol=1e-11, atol=1e-9).y.T
            s = path[:-1]
            rows[here] = np.column_stack([s[:, 0], s[:, 1], s[:, 3] * np.cos(s[:, 2]), s[:, 3] * np.sin(s[:, 2])])
            state, begin = path[-1], begin + seconds
            state[3] = 0.0 if leg is not None and leg.do == "stop" else state[3]
    return rows


seconds = st.floats(1.0, 60.0)
legs = st.one_of(
    st.builds(sim.Leg, do=st.just("straight"), seconds=seconds),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, rate=st.floats(-0.2, 0.2)),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, rate=st.sampled_from([0.0, 1e-9, -1e-6])),
    st.builds(sim.Leg, do=st.just("turn"), seconds=seconds, lateral_accel=st.floats(-1.0, 1.0)),
    st.builds(sim.Leg, do=st.just("accelerate"), seconds=seconds, accel=st.floats(0.0, 0.3)),
    st.builds(sim.Leg, do=st.just("accelerate"), seconds=st.floats(1, 10), accel=st.floats(-0.1, 0.0)),
)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(course=st.floats(-4, 4), speed=st.floats(8, 20), before=st.lists(legs, max_size=4), after=st.lists(legs, max_size=1))
def test_a_ship_goes_where_integration_takes_it(course, speed, before, after):
    stop = sim.Leg("stop", decel=0.4)
    after = [leg for leg in after if leg.lateral_accel is None and (leg.accel or 0.0) >= 0]
    ship = sim.Ship(start=[100, -50], course=course, speed=speed, legs=(*before, stop, *after), appears=7.0)
    times = np.linspace(7.0, 400.0, 57)
    np.testing.assert_allclose(ship.states(times), integrated(ship, times), atol=1e-5)


def test_a_turn_by_lateral_acceleration_is_a_circle_of_radius_speed_squared_over_it():
    legs = (sim.Leg("accelerate", 10, accel=0.5), sim.Leg("turn", 100, lateral_accel=0.5))
    states = sim.Ship(start=[-75, 0], course=0.0, speed=5.0, legs=legs).states(np.linspace(10, 110, 33))
    np.testing.assert_allclose(np.hypot(states[:, 0], states[:, 1] - 200.0), 200.0, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(states[:, 2], states[:, 3]), 10.0, rtol=1e-12)


def test_a_ship_that_stopped_rests_and_keeps_its_heading():
    legs = (sim.Leg("stop", decel=0.3), sim.Leg("straight", 20), sim.Leg("accelerate", 5, accel=1))
    ship = sim.Ship(start=[0, 0], course="30 deg", speed="10.1 kn", legs=legs)
    speed = 10.1 * 1852 / 3600
    rest = ship.states(np.array([speed / 0.3, speed / 0.3 + 10, speed / 0.3 + 19]))
    assert np.all(rest[:, 2:] == 0)
    np.testing.assert_allclose(np.hypot(*rest[0, :2]), speed**2 / 0.6)
    assert np.all(rest == rest[0])
    np.testing.assert_allclose(ship.heading(np.array([0.0, speed / 0.3 + 10, 90.0])), np.pi / 6)
    np.testing.assert_allclose(ship.states(np.array([90.0]))[0, 2:], 5 * np.array([np.cos(np.pi / 6), 0.5]))


# ---- draws from motion models


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), data=st.data())
def test_factor_squares_to_the_covariance_whatever_its_rank(seed, n, data):
    rank = data.draw(st.integers(0, n))
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, n, rank)) * 10.0 ** rng.uniform(-4, 4, n)[:, None]
    root[:, rng.random(n) < 0.2] = 0.0
    cov = root @ np.swapaxes(root, -1, -2)
    lower = sim.factor(cov)
    scale = np.sqrt(np.einsum("bii->bi", cov))
    assert np.all(np.abs(lower @ np.swapaxes(lower, -1, -2) - cov) <= 1e-7 * scale[:, :, None] * scale[:, None, :])
    assert np.all(lower[scale == 0] == 0)
    if rank == n and np.all(scale > 0) and np.all(np.linalg.cond(cov / scale[:, :, None] / scale[:, None, :]) < 1e6):
        np.testing.assert_allclose(lower, np.linalg.cholesky(cov), rtol=1e-6, atol=1e-9 * scale.max())


@pytest.mark.parametrize(
    "cov", [[[1.0, 2.0], [2.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]], [[-1.0]], [[1.0, 0.5], [0.0, 1.0]], [[np.nan]]]
)
def test_factor_refuses_what_is_no_covariance(cov):
    with pytest.raises(ValueError, match="symmetric positive semi-definite"):
        sim.factor(np.array(cov))


def test_rounding_adds_no_noise_to_a_singular_covariance():
    cov = np.stack([PulledVelocity().noise(np.zeros(4), dt) for dt in np.linspace(0.01, 30, 500)])
    assert np.all(np.sum(np.any(sim.factor(cov) != 0, axis=-2), axis=-1) == 2)


@pytest.mark.parametrize("model", [ConstantVelocity(0.3), PulledVelocity(), Weaving()], ids=lambda model: model.kind)
def test_a_batch_follows_its_noise_as_each_run_does(model):
    rng = np.random.default_rng(1)
    times, n = np.array([0.0, 1.0, 1.0, 3.5, 4.0]), len(model.state)
    x0, noise = rng.standard_normal((3, 2, n)), rng.standard_normal((3, 2, 4, n))
    batch = sim.follow(model, x0, times, noise)
    assert batch.shape == (3, 2, 5, n)
    assert np.all(batch[..., 1, :] == batch[..., 2, :])
    for i, j in np.ndindex(3, 2):
        x = x0[i, j]
        np.testing.assert_array_equal(batch[i, j, 0], x)
        for k, dt in enumerate(np.diff(times)):
            Q = model.noise(x, dt)
            w, v = np.linalg.eigh(Q)
            move = model.move(x, dt)
            x = batch[i, j, k + 1]
            # The draw is in the span of Q, and lower triangular in the noise.
            assert np.all(np.abs((x - move) @ v[:, w < 1e-12 * max(w.max(), 1e-300)]) < 1e-9)
        np.testing.assert_allclose(batch[i, j], sim.follow(model, x0[i, j], times, noise[i, j]), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("model", [ConstantVelocity(0.3), PulledVelocity()], ids=lambda model: model.kind)
def test_draws_have_the_models_mean_and_covariance(model):
    times, x0 = np.array([2.0, 3.0, 5.5, 6.0]), np.array([10.0, -20.0, 3.0, 1.0])
    states = sim.draw_states(model, x0, times, np.random.default_rng(5), size=(4000,))
    mean, cov = x0, np.zeros((4, 4))
    for dt in np.diff(times):
        F = model.jacobian(mean, dt)
        mean, cov = F @ mean, F @ cov @ F.T + model.noise(mean, dt)
    assert moments_match(states[:, -1], mean, cov)
    assert not moments_match(states[:, -1], mean, 1.2 * cov)
    assert not moments_match(states[:, -1], mean + 0.2 * np.sqrt(np.diag(cov)), cov)


def test_a_gaussian_draw_has_its_mean_and_covariance():
    mean, root = np.array([[1.0, 2.0], [-3.0, 0.5]]), np.array([[2.0, 0.0], [1.5, 0.3]])
    draws = sim.draw_gaussian(mean, root @ root.T, np.random.default_rng(0), size=(4000,))
    assert draws.shape == (4000, 2, 2)
    assert moments_match(draws[:, 1], mean[1], root @ root.T)
    assert abs(np.mean((draws[:, 0] - mean[0]) * (draws[:, 1] - mean[1]) / np.diag(root @ root.T))) < 0.1


TRANSITION = np.array([[0.9, 0.1, 0.0], [0.2, 0.5, 0.3], [0.25, 0.25, 0.5]])


def test_modes_switch_as_often_as_the_matrix_says():
    times = np.arange(21.0)
    uniform = np.random.default_rng(3).random((500, 20))
    modes = sim.switch(TRANSITION, 1, times, uniform)
    assert np.all(modes[:, 0] == 1)
    counts = np.zeros((3, 3))
    np.add.at(counts, (modes[:, :-1].ravel(), modes[:, 1:].ravel()), 1)
    expected = TRANSITION * counts.sum(axis=1, keepdims=True)
    assert counts[0, 2] == 0
    possible = TRANSITION > 0
    misfit = np.sum((counts - expected)[possible] ** 2 / expected[possible])
    assert misfit < stats.chi2.isf(ALPHA, possible.sum() - 3)
    transposed = TRANSITION.T * counts.sum(axis=1, keepdims=True)
    assert np.sum((counts - transposed)[possible] ** 2 / np.maximum(transposed[possible], 1)) > stats.chi2.isf(ALPHA, 5)


def test_nothing_switches_in_no_time():
    flip = np.array([[0.0, 1.0], [1.0, 0.0]])
    modes = sim.switch(flip, 0, np.array([0.0, 1.0, 1.0, 1.0, 2.0]), np.random.default_rng(0).random((5, 4)))
    assert np.all(modes == [0, 1, 1, 1, 0])


def test_jumping_states_equal_one_run_told_by_hand():
    models = (ConstantVelocity(0.3), Weaving())
    assert sim.union_state(models).names == ("x", "y", "vx", "vy", "turn_rate")
    assert sim.common_state(models).names == ("x", "y", "vx", "vy")
    rng = np.random.default_rng(8)
    times = np.array([0.0, 1.0, 2.5, 2.5, 4.0, 5.0, 7.0])
    x0 = rng.standard_normal((6, 5))
    modes = sim.switch(np.array([[0.5, 0.5], [0.5, 0.5]]), np.array([0, 1, 0, 1, 0, 1]), times, rng.random((6, 6)))
    noise, fresh = rng.standard_normal((2, 6, 6, 5))
    states = sim.follow_modes(models, modes, x0, times, noise, fresh)
    assert len({tuple(run) for run in modes}) > 3
    for i in range(6):
        here = dict(zip(sim.union_state(models).names, x0[i], strict=True))
        if modes[i, 0] == 0:
            del here["turn_rate"]
        for k in range(7):
            if k > 0:
                model = models[modes[i, k]]
                here = dict(zip(sim.union_state(models).names, fresh[i, k - 1], strict=True)) | here
                x = np.array([here[name] for name in model.state.names])
                w = np.array(
                    [dict(zip(sim.union_state(models).names, noise[i, k - 1], strict=True))[n] for n in model.state.names]
                )
                x = sim.follow(model, x, times[k - 1 : k + 1], w[None])[1]
                here = dict(zip(model.state.names, x, strict=True))
            told = [here.get(name, np.nan) for name in sim.union_state(models).names]
            np.testing.assert_allclose(states[i, k], told, rtol=1e-12, atol=1e-12)


def test_a_new_axis_starts_as_stated_and_the_others_go_on():
    models, flip = (ConstantVelocity(1e-6), Weaving()), np.array([[0.0, 1.0], [1.0, 0.0]])
    modes, states = sim.draw_jump_markov(
        models, flip, np.array([5.0, 6.0, 0.0, 0.0, 99.0]), 0, np.array([0.0, 1e-9]), np.random.default_rng(2), (4000,),
        starts={"turn_rate": (0.4, 0.1)},
    )  # fmt: skip
    assert modes.shape == (4000, 2)
    assert np.all(np.isnan(states[:, 0, 4]))
    np.testing.assert_allclose(states[:, 1, :2], np.broadcast_to([5.0, 6.0], (4000, 2)), atol=1e-6)
    assert moments_match(states[:, 1, 4:], np.array([0.4]), np.array([[0.01]]))


# ---- draws from sensors


def test_returns_are_noisy_as_stated_and_wrap():
    sensor = Polar()
    x = np.broadcast_to([-300.0, 0.5], (4000, 1, 2))
    seen = sim.draw_detections(sensor, x, np.random.default_rng(4))
    z = seen.z[seen.valid]
    assert np.all((z[:, 1] >= -np.pi) & (z[:, 1] < np.pi))
    assert np.any(z[:, 1] < 0)
    assert np.any(z[:, 1] > 0)
    error = sensor.measurement.difference(z, sensor.measure(x[:1, 0]))
    assert moments_match(error, np.zeros(2), np.diag([25.0, 0.05**2]))


def test_objects_are_detected_as_often_as_the_sensor_says():
    x = np.broadcast_to([[100.0, 0.0], [0.0, 2000.0], [-50.0, 50.0]], (2000, 3, 2))
    _, seen = sim.returns(Polar(), x, np.random.default_rng(4).random((2000, 3)), np.zeros((2000, 3, 2)))
    hits = seen.sum(axis=0)
    assert hits[1] == 0
    for count in (hits[0], hits[2]):
        assert stats.binomtest(int(count), 2000, 0.9).pvalue > ALPHA
    sure = sim.draw_detections(
        evolve(Polar(), p_detect=1.0), x, np.random.default_rng(0), alive=np.array([True, True, False])
    )
    assert np.all(sure.valid.sum(axis=-1) == 1)
    assert np.all(sure.z[..., 0] > 75)


REGION = {"range": sim.Bounds(100, 1000)}


def dispersion_p(counts: Array, mean: float) -> float:
    """The smaller of two p-values that `counts` are Poisson(mean): their sum, and their spread about it."""
    total = stats.poisson(mean * len(counts))
    spread = np.sum((counts - mean) ** 2) / mean
    both = (total.cdf(counts.sum()), total.sf(counts.sum() - 1), stats.chi2.cdf(spread, len(counts)))
    return 2 * min(*both, stats.chi2.sf(spread, len(counts)))


def test_clutter_has_the_density_that_the_sensor_states():
    sensor, runs = Polar(density=3e-6), 1000
    z, valid = sim.draw_clutter(sensor, REGION, np.random.default_rng(6), (runs,))
    expected = 3e-6 * np.pi * (1000.0**2 - 100.0**2)
    counts = valid.sum(axis=-1)
    assert dispersion_p(counts, expected) > ALPHA
    assert dispersion_p(counts, 1.1 * expected) < ALPHA
    distance, bearing = z[valid].T
    assert stats.kstest(distance, lambda r: (r**2 - 100.0**2) / (1000.0**2 - 100.0**2)).pvalue > ALPHA
    assert stats.kstest(distance, lambda r: (r - 100) / 900).pvalue < ALPHA
    assert stats.kstest(bearing, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > ALPHA


def test_uniform_clutter_fills_its_box_and_nothing_else():
    sensor = CartesianPosition(sigma=1.0, clutter_density=1e-4)
    box = {"y": sim.Bounds(0, 500), "x": sim.Bounds(-100, 300)}
    z, valid = sim.draw_clutter(sensor, box, np.random.default_rng(6), (1000,))
    assert dispersion_p(valid.sum(axis=-1), 20.0) > ALPHA
    assert stats.kstest(z[valid][:, 0], stats.uniform(-100, 400).cdf).pvalue > ALPHA
    assert stats.kstest(z[valid][:, 1], stats.uniform(0, 500).cdf).pvalue > ALPHA
    quiet = sim.draw_clutter(CartesianPosition(sigma=1.0), box, np.random.default_rng(6))[1]
    assert quiet.shape == (0,)


def test_a_sector_over_the_seam_stays_a_sector():
    sector = {"range": sim.Bounds(100, 1000), "bearing": sim.Bounds(3.0, 3.5)}
    z, valid = sim.draw_clutter(Polar(density=1e-4), sector, np.random.default_rng(6), (20,))
    bearing = z[valid][:, 1]
    assert np.all(np.abs(bearing) <= np.pi)
    assert np.all((bearing >= 3.0) | (bearing <= 3.5 - 2 * np.pi))
    assert np.any(bearing < 0)


def test_returns_come_in_random_order_and_valid_ones_first():
    z = np.broadcast_to(np.arange(5.0, 9.0)[:, None], (6000, 4, 1))
    valid = np.broadcast_to([True, False, True, True], (6000, 4))
    seen = shuffled(z, valid, np.random.default_rng(9))
    assert seen.z.shape == (6000, 3, 1)
    assert np.all(seen.valid)
    orders, counts = np.unique(seen.z[..., 0], axis=0, return_counts=True)
    assert len(orders) == 6
    assert np.sum((counts - 1000.0) ** 2 / 1000) < stats.chi2.isf(ALPHA, 5)
    ragged = shuffled(z[:2], np.array([[False, True, False, False], [False, True, False, True]]), np.random.default_rng(9))
    assert ragged.valid.tolist() == [[True, False], [True, True]]
    assert ragged.z[0].tolist() == [[6.0], [0.0]]
    assert sorted(ragged.z[1, :, 0]) == [6.0, 8.0]


def test_a_batch_of_scans_is_like_scans_one_by_one():
    sensor = Polar(density=2e-6)
    x = np.array([[200.0, 0.0], [0.0, -700.0]])
    batch = sim.draw_detections(sensor, np.broadcast_to(x, (800, 2, 2)), np.random.default_rng(1), REGION)
    rng = np.random.default_rng(2)
    singles = [sim.draw_detections(sensor, x, rng, REGION) for _ in range(800)]
    assert all(np.all(one.valid) for one in singles)
    assert np.all(np.diff(batch.valid.astype(int), axis=-1) <= 0)
    alone = np.concatenate([one.z for one in singles])
    for axis in range(2):
        assert stats.ks_2samp(batch.z[batch.valid][:, axis], alone[:, axis]).pvalue > ALPHA
    counts = batch.valid.sum(axis=-1), np.array([len(one.z) for one in singles])
    pooled = np.sqrt((np.var(counts[0]) + np.var(counts[1])) / 800)
    assert abs(counts[0].mean() - counts[1].mean()) < stats.norm.isf(ALPHA / 2) * pooled


# ---- scenes


SHIPS = {
    "ferry": sim.Ship(
        start=[-500, 0], course=0.3, speed=8, legs=(sim.Leg("straight", 10), sim.Leg("turn", 20, rate=0.05)), disappears=44.2
    ),
    "tug": sim.Ship(start=[300, 300], course=-2, speed=3, appears=11.0),
}
START = {"x": [0, 100], "y": [0, 100], "vx": [0, 5], "vy": [0, 5]}
DRAWN = {"boat": sim.Drawn((ConstantVelocity(0.3),), START)}


def scene(**changes: object) -> sim.Simulation:
    looks = {"radar": sim.Look(interval=2.5, clutter=REGION), "lidar": sim.Look(interval=0.7, first=0.3, jitter=0.2)}
    return sim.Simulation(**({"duration": 60, "looks": looks, "ships": SHIPS, "drawn": DRAWN} | changes))


SENSORS = {"radar": Polar(density=2e-6), "lidar": CartesianPosition(sigma=0.5, detection_probability=0.8)}


def rows(recording, sensor):
    return {(scan.time, *z) for scan in recording.scans if scan.sensor == sensor for z in scan.detections.z.tolist()}


def test_a_scene_holds_its_looks_in_time_order_and_its_truth_at_each():
    recording = scene().open(SENSORS, np.random.default_rng(1))
    times = [scan.time for scan in recording.scans]
    assert times == sorted(times)
    radar = [scan.time for scan in recording.scans if scan.sensor == "radar"]
    np.testing.assert_allclose(radar, np.arange(25) * 2.5)
    lidar = np.array([scan.time for scan in recording.scans if scan.sensor == "lidar"])
    early = lidar - (0.3 + 0.7 * np.arange(len(lidar)))
    assert len(lidar) == 86
    assert np.all(np.abs(early) <= 0.2)
    assert early.min() < -0.1
    assert early.max() > 0.1
    assert [each.name for each in recording.truth] == ["ferry", "tug", "boat"]
    for each in recording.truth[:2]:
        ship = SHIPS[each.name]
        alive = [t for t in times if ship.appears <= t <= (ship.disappears or 60)]
        assert set(alive) <= set(each.times)
        for time in times:
            if time in alive:
                np.testing.assert_array_equal(each.at(time), ship.states(np.array(time)))
            else:
                assert each.at(time) is None
        assert np.all(np.diff(each.times) > 0)
    assert all(np.all(scan.detections.valid) and scan.pose is None for scan in recording.scans)


def test_objects_give_returns_only_while_they_are_there():
    exact = {"radar": CartesianPosition(sigma=1e-6)}
    recording = scene(looks={"radar": sim.Look(interval=2.5)}, drawn={}).open(exact, np.random.default_rng(1))
    for scan in recording.scans:
        there = [state[:2] for each in recording.truth if (state := each.at(scan.time)) is not None]
        z = np.array(sorted(scan.detections.z.tolist()))
        np.testing.assert_allclose(z, np.array(sorted(map(list, there))), atol=1e-4)
    assert {len(scan.detections.z) for scan in recording.scans} == {1, 2}


def test_another_object_changes_nothing_for_the_rest():
    late = {"late": sim.Ship(start=[100, 0], appears=20)}
    before = scene().open(SENSORS, np.random.default_rng(3))
    after = scene(ships=late | SHIPS).open(SENSORS, np.random.default_rng(3))
    paths = {each.name: each for each in after.truth}
    for each in before.truth:
        np.testing.assert_array_equal(each.times, paths[each.name].times)
        np.testing.assert_array_equal(each.states, paths[each.name].states)
    for name in SENSORS:
        assert rows(before, name) < rows(after, name)
    fewer = scene(drawn={}).open(SENSORS, np.random.default_rng(3))
    assert rows(fewer, "radar") < rows(before, "radar")


def test_two_sensors_err_independently():
    twins = {name: CartesianPosition(sigma=1.0) for name in ("left", "right")}
    looks = {name: sim.Look(interval=0.05) for name in twins}
    recording = scene(looks=looks, ships={}).open(twins, np.random.default_rng(3))
    left, right = (np.array([s.detections.z[0] for s in recording.scans if s.sensor == name]) for name in twins)
    path = recording.truth[0].states[:, :2]
    errors = np.concatenate([left - path, right - path], axis=1)
    assert errors.shape == (1201, 4)
    assert moments_match(errors, np.zeros(4), np.eye(4))


def test_seeds_differ_and_one_seed_repeats():
    first, again, other = (scene().open(SENSORS, np.random.default_rng(seed)) for seed in (3, 3, 4))
    for a, b in zip(first.scans, again.scans, strict=True):
        np.testing.assert_array_equal(a.detections.z, b.detections.z)
    assert not rows(first, "radar") & rows(other, "radar")
    assert not np.any(first.truth[2].states == other.truth[2].states)


PRINT_DIGEST = """
import hashlib, sys
import numpy as np
import vedette_sim as sim
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
box = {"x": sim.Bounds(-500, 500), "y": sim.Bounds(-500, 500)}
start = {"x": [0, 100], "y": [0, 100], "vx": [0, 5], "vy": [0, 5]}
drawn = sim.Drawn((ConstantVelocity(0.1), ConstantVelocity(2.0)), start, [[0.9, 0.1], [0.3, 0.7]])
scene = sim.Simulation(
    duration=30,
    looks={"radar": sim.Look(2.5, clutter=box), "lidar": sim.Look(1.0, jitter=0.2)},
    ships={"a": sim.Ship([0, 0], speed=3), "b": sim.Ship([9, 9], speed=1)},
    drawn={"c": drawn, "d": drawn},
)
sensor = CartesianPosition(5, 0.8, 1e-5)
recording = scene.open({"radar": sensor, "lidar": sensor}, np.random.default_rng(7))
digest = hashlib.sha256()
for scan in recording.scans:
    digest.update(repr((scan.time, scan.sensor)).encode() + scan.detections.z.tobytes())
for each in recording.truth:
    digest.update(each.name.encode() + each.times.tobytes() + each.states.tobytes())
print(digest.hexdigest())
"""


def test_two_processes_with_unlike_hash_seeds_draw_the_same_bits():
    digests = {
        subprocess.run(
            [sys.executable, "-c", PRINT_DIGEST],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "4711")
    }
    assert len(digests) == 1


def test_a_moving_platform_sees_from_where_it_is_and_along_its_bow():
    own = sim.Ship(start=[-200, 100], course=2.0, speed=6, legs=(sim.Leg("turn", 30, rate=-0.1), sim.Leg("stop", decel=1)))
    exact = {"radar": Polar(1e-6, 1e-9, 1.0)}
    ships = {"tug": SHIPS["ferry"]}
    looks = {"radar": sim.Look(interval=2.5)}
    recording = scene(looks=looks, ships=ships, drawn={}, ownship=own).open(exact, np.random.default_rng(1))
    for scan in recording.scans:
        expected = own.states(np.array(scan.time))
        np.testing.assert_array_equal(scan.pose.position, expected[:2])
        np.testing.assert_array_equal(scan.pose.velocity, expected[2:])
        assert scan.pose.heading == own.heading(np.array(scan.time))
        for distance, bearing in scan.detections.z:
            angle = bearing + scan.pose.heading
            seen = scan.pose.position + distance * np.array([np.cos(angle), np.sin(angle)])
            np.testing.assert_allclose(seen, recording.truth[0].at(scan.time)[:2], atol=1e-4)
    assert sum(len(scan.detections.z) for scan in recording.scans) == 18
    resting = recording.scans[-1].pose
    np.testing.assert_allclose(resting.heading, 2.0 - 3.0)
    assert np.all(resting.velocity == 0)


def test_the_scene_may_have_another_sensor_than_the_tracker():
    other = {"lidar": CartesianPosition(sigma=20.0)}
    recording = scene(sensors=other, ships={}).open(SENSORS, np.random.default_rng(1))
    lidar = [scan for scan in recording.scans if scan.sensor == "lidar"]
    assert all(len(scan.detections.z) == 1 for scan in lidar)
    errors = np.array([scan.detections.z[0] - recording.truth[0].at(scan.time)[:2] for scan in lidar])
    assert moments_match(errors, np.zeros(2), 400.0 * np.eye(2))


def test_an_object_that_switches_models_is_seen_by_what_its_models_share():
    jumping = sim.Drawn(
        (ConstantVelocity(0.3), Weaving()),
        START | {"turn_rate": [0, 0.1]},
        [[0.8, 0.2], [0.2, 0.8]],
        appears=3,
        disappears=50,
    )
    recording = scene(ships={}, drawn={"boat": jumping}).open(SENSORS, np.random.default_rng(1))
    path = recording.truth[0]
    assert path.space.names == ("x", "y", "vx", "vy")
    assert np.all(np.isfinite(path.states))
    assert (path.times[0], path.times[-1]) == (3.0, 50.0)


def test_a_drawn_object_starts_where_it_is_said():
    still = {name: [7.0, 0.0] for name in START}
    drawn = {str(i): sim.Drawn((ConstantVelocity(0.3),), START) for i in range(1000)}
    looks = {"lidar": sim.Look(interval=60)}
    recording = scene(looks=looks, ships={}, drawn=drawn).open(SENSORS, np.random.default_rng(1))
    begins = np.array([each.states[0] for each in recording.truth])
    assert moments_match(begins, np.zeros(4), np.diag([1e4, 1e4, 25.0, 25.0]))
    fixed = scene(ships={}, drawn={"boat": sim.Drawn((ConstantVelocity(0.3),), still)}).open(
        SENSORS, np.random.default_rng(1)
    )
    assert fixed.truth[0].states[0].tolist() == [7.0, 7.0, 7.0, 7.0]


SCENE_TOML = """
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.1 }
[associator]
kind = "nearest"
[lifecycle]
kind = "m_of_n"
spread = { vx = 10, vy = 10 }
[sensors.radar]
kind = "cartesian_position"
sigma = 5
clutter_density = 1e-5
[source]
kind = "simulation"
duration = "1 min"
ownship = { start = [0, 0], speed = "5 kn" }
sensors.radar = { kind = "cartesian_position", sigma = 8, clutter_density = 1e-5 }
[source.looks.radar]
interval = 2.5
clutter = { x = { low = -500, high = 500 }, y = { low = -500, high = 500 } }
[source.ships.ferry]
start = [100, -200]
course = "45 deg"
speed = "10 kn"
legs = [{ do = "straight", seconds = 20 }, { do = "turn", seconds = 30, rate = "1 deg/s" }, { do = "stop", decel = 0.1 }]
[source.drawn.boat]
models = [{ kind = "constant_velocity", sigma_accel = 0.1 }, { kind = "constant_velocity", sigma_accel = 2 }]
transition = [[0.9, 0.1], [0.3, 0.7]]
start = { x = [0, 10], y = [0, 10], vx = [0, 5], vy = [0, 5] }
"""


def test_a_config_describes_a_scene_and_the_scene_its_config():
    config = tomllib.loads(SCENE_TOML)
    experiment = vedette.load(config)
    again = vedette.load(vedette.to_config(experiment))
    scans, same = (each.source.open(each.tracker.sensors, np.random.default_rng(1)).scans for each in (experiment, again))
    assert len(scans) == 25
    for a, b in zip(scans, same, strict=True):
        np.testing.assert_array_equal(a.detections.z, b.detections.z)


def test_a_wrong_scene_is_told_with_the_paths_of_its_config():
    config = tomllib.loads(
        SCENE_TOML.replace("1 min", "0 min").replace('"45 deg"', '"45 m"').replace("decel = 0.1", "deccel = 0.1")
    )
    with pytest.raises(ConfigError) as told:
        vedette.load(config)
    for said in (
        "source.duration: must be > 0",
        "source.ships.ferry.course: must be in rad",
        "source.ships.ferry.legs[2].deccel",
    ):
        assert said in str(told.value)


def test_the_plugin_brings_the_scene():
    scenes = [sim.Simulation, sim.InfraredScene, sim.RadarPicturesScene, sim.RadarPointsScene]
    assert list(sim.vedette_components()) == scenes


CV = ConstantVelocity(0.1)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: sim.Leg("swim"), "do: must be one of 'straight', 'turn'"),
        (lambda: sim.Leg("turn", seconds=3), "seconds and rate, or seconds and lateral_accel; got seconds"),
        (lambda: sim.Leg("turn", 3, rate=1, lateral_accel=1), "got seconds and rate and lateral_accel"),
        (lambda: sim.Leg("stop", 3, decel=1), "'stop' takes decel; got seconds and decel"),
        (lambda: sim.Leg("straight"), "'straight' takes seconds; got none of these"),
        (lambda: sim.Leg("stop", decel=-1), "decel: must be > 0, got -1 m/s"),
        (lambda: sim.Leg("straight", seconds=float("nan")), "seconds: must be a finite number"),
        (lambda: sim.Ship([0]), r"start: must be \[x, y\]"),
        (lambda: sim.Ship([0, 0], speed=-1), "speed: must be >= 0, got -1 m/s"),
        (lambda: sim.Ship([0, 0], speed="3 deg"), "speed: must be in m/s or km/h or kn"),
        (lambda: sim.Ship([0, 0], legs=(sim.Leg("turn", 3, lateral_accel=1),)), r"legs\[0\].lateral_accel: the ship rests"),
        (lambda: sim.Ship([0, 0], speed=1, legs=(sim.Leg("accelerate", 3, accel=-1),)), r"legs\[0\].accel: .* 1 to -2 m/s"),
        (lambda: sim.Ship([0, 0], appears=5, disappears=5), "disappears: must be after it appears at 5 s"),
        (lambda: sim.Ship([0, 0], appears=5).states(np.array([4.0])), "no earlier than it appears at 5 s"),
        (lambda: sim.Look(0), "interval: must be > 0"),
        (lambda: sim.Look(2, jitter=1), "jitter: must be < half the interval of 2 s"),
        (lambda: sim.Bounds(3, 3), "high: must be > low = 3, got 3"),
        (lambda: sim.Drawn((), START), "models: must hold at least one"),
        (lambda: sim.Drawn((CV,), {"x": [0, 1]}), "start: must give the axes x, y, vx, vy, got x"),
        (lambda: sim.Drawn((CV,), START | {"x": [0, -1]}), "start: x: the standard deviation must be >= 0"),
        (lambda: sim.Drawn((CV, CV), START), "transition: must be 2 x 2"),
        (lambda: sim.Drawn((CV, CV), START, [[1, 0.5], [0, 1]]), "rows of probabilities that sum to 1"),
        (lambda: sim.Drawn((CV,), START, appears=4, disappears=3), "disappears: must be after it appears at 4 s, got 3 s"),
        (lambda: scene(looks={}), "looks: must hold at least one"),
        (lambda: scene(duration=11), "ships.tug.appears: must be before the end at 11 s"),
        (lambda: scene(drawn={"tug": DRAWN["boat"]}), "drawn.tug: a ship has this name too"),
        (lambda: scene(sensors={"sonar": SENSORS["radar"]}), "sensors.sonar: never looks; there are looks of radar, lidar"),
        (lambda: scene(ownship=SHIPS["tug"]), "ownship: must be there all the time"),
        (lambda: scene(duration=1e12), "looks.radar.interval: makes more than 1000000 scans"),
        (lambda: sim.follow(CV, np.zeros(3), np.arange(2.0), np.zeros((1, 4))), "x0: must have the 4 axes"),
        (lambda: sim.follow(CV, np.zeros(4), np.arange(2.0), np.zeros((2, 4))), "standard: must end in"),
        (lambda: sim.draw_states(CV, np.zeros(4), np.array([1.0, 0.0]), rng()), "times: .* never going back"),
        (lambda: sim.draw_states(CV, np.zeros(4), np.array([np.nan]), rng()), "times: must be finite"),
        (lambda: sim.switch(np.ones((2, 2)), 0, np.arange(2.0), np.zeros(1)), "transition: must be square"),
        (lambda: sim.switch(np.eye(2), 2, np.arange(2.0), np.zeros(1)), "mode0: must be one of the 2 modes, 0 to 1, got 2"),
        (
            lambda: sim.draw_jump_markov((CV, Weaving()), np.eye(2), np.zeros(5), 0, np.arange(2.0), rng()),
            "starts: must give .* of turn_rate",
        ),
        (
            lambda: sim.draw_jump_markov((CV,), np.eye(2), np.zeros(4), 0, np.arange(2.0), rng()),
            "one row for each of the 1 models, got 2",
        ),
        (lambda: sim.draw_detections(Polar(), np.zeros((1, 4)), rng()), "x: must have the 2 axes"),
        (lambda: sim.draw_clutter(Polar(), {}, rng()), "range: must have a low and a high"),
        (lambda: sim.draw_clutter(Polar(), REGION | {"x": sim.Bounds(0, 1)}, rng()), "x: is not measured"),
        (
            lambda: sim.draw_clutter(Polar(), REGION | {"bearing": sim.Bounds(0, 7)}, rng()),
            "bearing: must span at most 6.28319 rad, got 7",
        ),
        (lambda: sim.draw_clutter(Polar(density=1e3), REGION, rng()), "false returns a scan; check"),
        (lambda: sim.draw_clutter(Polar(density=-1e-6), REGION, rng()), "must be finite and >= 0"),
        (lambda: sim.draw_clutter(Peaked(), REGION, rng(), (2000,)), "peaks too sharply"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


@pytest.mark.parametrize(
    ("changes", "sensors", "said"),
    [
        ({}, {"radar": SENSORS["radar"]}, "looks.lidar: there is no such sensor; there are radar"),
        (
            {"sensors": {"lidar": Polar()}},
            SENSORS,
            "sensors.lidar: must measure what the tracker's does, .*x.*, got .*range",
        ),
        (
            {"looks": {"radar": sim.Look(1, clutter={"x": sim.Bounds(0, 1)})}},
            SENSORS,
            "looks.radar.clutter: x: is not measured",
        ),
        (
            {"looks": {"radar": sim.Look(1, clutter=REGION)}},
            {"radar": Polar(density=1e3)},
            "looks.radar: test_polar: .* false returns a scan",
        ),
    ],
)
def test_a_scene_that_does_not_fit_the_sensors_is_said_to(changes, sensors, said):
    with pytest.raises(ConfigError, match=said):
        scene(**changes).open(sensors, np.random.default_rng(0))


def test_a_sensor_that_looks_at_axes_nobody_has_is_refused():
    class Doppler(Polar):
        @property
        def observes(self) -> Space:
            return Space.of(x="m", y="m", vz="m/s")

    with pytest.raises(ConfigError, match=r"looks.radar: it looks at .*vz.*, but 'ferry' has only"):
        scene().open(SENSORS | {"radar": Doppler()}, np.random.default_rng(0))


def test_a_sensor_that_cannot_be_carried_is_refused_on_a_ship():
    class Mast(Polar):
        def at(self, pose: Pose) -> Sensor:
            return Sensor.at(self, pose)

    with pytest.raises(ConfigError, match=r"looks.radar: .*cannot be placed on a moving platform"):
        scene(ownship=sim.Ship([0, 0])).open(SENSORS | {"radar": Mast()}, np.random.default_rng(0))


def test_an_experiment_says_where_in_the_config_its_source_is_wrong():
    with (Path(__file__).parent.parent.parent / "examples" / "harbour.toml").open("rb") as file:
        config = tomllib.load(file)
    config["source"]["looks"]["lidar"] = {"interval": 1.0}
    with pytest.raises(vedette.ConfigError, match=r"^source\.looks\.lidar: there is no such sensor; there are radar$"):
        vedette.load(config).run()
