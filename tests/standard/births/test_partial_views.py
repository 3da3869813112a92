"""Undetected targets where sensors see parts of an area: what is unseen where one looks is what counts."""

import numpy as np
import pytest

from vedette import Detections
from vedette.sampling import Bounds
from vedette_standard import CartesianPosition, ConstantVelocity, Kalman
from vedette_standard.births.cells import moved
from vedette_standard.births.poisson import Appearance, Poisson
from vedette_standard.births.uniform import Uniform

FILTER, RNG = Kalman(ConstantVelocity(0.01)), np.random.default_rng(0)
HALF, CELL, DT, LIFETIME = 5000.0, 100.0, 2.5, 600.0
MIDDLES = np.arange(-HALF + CELL / 2, HALF, CELL)
PLACES = np.stack(np.meshgrid(MIDDLES, MIDDLES, indexing="ij"), axis=-1).reshape(-1, 2)
INITIAL, RATE, DEVIATION = 5.0, 0.05, 2500.0
NEAR = np.exp(-0.5 * np.sum(PLACES**2, axis=-1) / DEVIATION**2) * CELL**2 / (2.0 * np.pi * DEVIATION**2)
SHARES = {"uniform": np.full(len(PLACES), 1.0 / len(PLACES)), "poisson": NEAR}


def radar(x, y, far):
    return CartesianPosition(5.0, 0.9, 1e-7, x=x, y=y, max_range=far)


SCENES = {
    "a small view": [(radar(300.0, -200.0, 1300.0), 0)],
    "different views": [(radar(-2500.0, 0.0, 1500.0), 0), (radar(2500.0, 0.0, 2000.0), 0)],
    "one that comes on later": [(radar(-1000.0, 0.0, 2500.0), 0), (radar(1000.0, 0.0, 2500.0), 10)],
    "one that sees the rest": [(radar(-HALF, -HALF, 11000.0), 0), (radar(3800.0, 3800.0, 3000.0), 10)],
}


def born(kind, speed):
    if kind == "poisson":
        at = dict.fromkeys("xy", (0.0, DEVIATION)) | dict.fromkeys(("vx", "vy"), (0.0, speed))
        return Poisson((Appearance(at, INITIAL, RATE),), lifetime=LIFETIME)
    box, spread = {axis: Bounds(-HALF, HALF) for axis in "xy"}, {"vx": speed, "vy": speed}
    return Uniform(box, spread, initial=INITIAL, rate=RATE, lifetime=LIFETIME)


def expected(birth, memory, sensor):
    """Return the number of returns that a birth expects of undetected targets in a look, summed over the view."""
    view = PLACES[np.hypot(*(PLACES - sensor.pose.position).T) <= sensor.max_range]
    density, _ = birth.reveal(memory, FILTER, sensor, Detections.of(view), 1.0)
    return np.sum(density) * CELL**2


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("kind", SHARES)
@pytest.mark.by_turns
def test_targets_that_stay_are_counted_where_no_sensor_looked(kind, scene):
    birth, known = born(kind, 0.01), INITIAL * SHARES[kind]
    memory = birth.initial_memory(FILTER, RNG)
    for step in range(20):
        if step:
            memory = birth.predict(memory, FILTER, DT, RNG)
            left = np.exp(-DT / LIFETIME)
            known = known * left + RATE * LIFETIME * (1.0 - left) * SHARES[kind]
        for sensor, on in SCENES[scene]:
            if step >= on:
                detects = sensor.detects(PLACES)
                np.testing.assert_allclose(expected(birth, memory, sensor), np.sum(known * detects), rtol=0.08)
                memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
                known = known * (1.0 - detects)


@pytest.mark.parametrize("kind", SHARES)
def test_targets_that_move_come_in_across_the_edge_of_a_view(kind):
    """Against 430,000 of them, that come straight from afar, as cells do not: .75 of theirs. Without motion it was half."""
    sensor, rng, many, few = radar(300.0, -200.0, 1300.0), np.random.default_rng(1), 200_000, 10_000
    birth = born(kind, 10.0)
    memory, x, v, w = birth.initial_memory(FILTER, RNG), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0)
    for step in range(24):
        count, left = (few, np.exp(-DT / LIFETIME)) if step else (many, 1.0)
        came = RATE * LIFETIME * (1.0 - left) if step else INITIAL
        memory = birth.predict(memory, FILTER, DT, RNG) if step else memory
        new = rng.uniform(-HALF, HALF, (count, 2)) if kind == "uniform" else rng.normal(0.0, DEVIATION, (count, 2))
        x = np.concatenate([x + v * DT, new])
        v, w = (
            np.concatenate([v, rng.normal(0.0, 10.0, (count, 2))]),
            np.concatenate([w * left, np.full(count, came / count)]),
        )
        detects = sensor.detects(x)
        told, true = expected(birth, memory, sensor), np.sum(w * detects)
        assert 0.7 < told / true < 1.15
        memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
        w = w * (1.0 - detects)


@pytest.mark.parametrize("sensor", [radar(0.0, 0.0, 80000.0), CartesianPosition(5.0, 0.9, 1e-7), radar(1e6, 0.0, 1e3)])
@pytest.mark.parametrize("kind", SHARES)
def test_where_a_sensor_sees_all_or_none_there_is_one_number(kind, sensor):
    birth, number = born(kind, 10.0), INITIAL
    memory = birth.initial_memory(FILTER, RNG)
    for _ in range(5):
        memory = birth.predict(memory, FILTER, DT, RNG)
        number = number * np.exp(-DT / LIFETIME) + RATE * LIFETIME * -np.expm1(-DT / LIFETIME)
        numbers = memory if kind == "uniform" else memory.number
        assert numbers[0].size == 1
        np.testing.assert_allclose(np.sum(numbers), number, rtol=1e-13)
        memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
        number *= 1.0 - sensor.detects(np.zeros(2))


@pytest.mark.parametrize("kind", SHARES)
def test_a_scan_of_cut_cells_may_hold_no_return_or_a_bad_one(kind):
    birth, sensor = born(kind, 10.0), radar(300.0, -200.0, 1300.0)
    memory = birth.update(birth.initial_memory(FILTER, RNG), FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
    assert birth.reveal(memory, FILTER, sensor, Detections.of([], 2), 1.0)[0].shape == (0,)
    bad = Detections(np.array([[300.0, -200.0], [np.nan, np.nan]]), np.array([True, False]))
    alone = birth.reveal(memory, FILTER, sensor, Detections.of([[300.0, -200.0]]), 1.0)[0]
    np.testing.assert_allclose(birth.reveal(memory, FILTER, sensor, bad, 1.0)[0], [*alone, 0.0], rtol=1e-12)


def test_cells_mix_alike_in_one_step_and_in_two_and_lose_nothing():
    number, faces = RNG.random((3, 8, 4)), lambda q: 4.0 * q * (1.0 - q)
    whole = moved(number, 0, np.array([0.3, 0.1, 0.0]), faces)
    half = moved(moved(number, 0, np.array([0.1, 0.05, 0.0]), faces), 0, np.array([0.2, 0.05, 0.0]), faces)
    np.testing.assert_allclose(whole, half, rtol=1e-12)
    np.testing.assert_allclose(np.sum(whole, axis=1), np.sum(number, axis=1), rtol=1e-12)
    np.testing.assert_allclose(whole[2], number[2], rtol=1e-12)
    np.testing.assert_allclose(moved(0.0 * number + 2.0, 1, np.full(3, 0.3), faces), 2.0, rtol=1e-12)


@pytest.mark.parametrize("speed", [0.0, 10.0])
def test_gaussians_that_a_view_cuts_do_not_grow_in_number(speed):
    """Nor does another place get what appeared in one."""
    one, other = (
        dict.fromkeys("xy", (middle, DEVIATION)) | dict.fromkeys(("vx", "vy"), (0.0, speed)) for middle in (0.0, 200.0)
    )
    birth = Poisson((Appearance(one, INITIAL, RATE), Appearance(other, 2.0 * INITIAL, RATE)), lifetime=LIFETIME)
    memory, sensor = birth.initial_memory(FILTER, RNG), radar(0.0, 0.0, 1300.0)
    for _ in range(100):
        memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
        memory = birth.predict(memory, FILTER, DT, RNG)
    assert len(memory.place) < 40
    came = LIFETIME * -np.expm1(-100 * DT / LIFETIME)
    total = INITIAL * np.exp(-100 * DT / LIFETIME) * np.array([1.0, 2.0]) + RATE * came
    left = np.bincount(memory.place, memory.weights)
    assert np.all((0.8 * total < left) & (left < 0.95 * total))
