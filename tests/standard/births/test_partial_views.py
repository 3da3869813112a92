"""Undetected targets where sensors see parts of an area: what is unseen where one looks is what counts."""

import numpy as np
import pytest

from vedette import Detections
from vedette.sampling import Bounds
from vedette_standard import CartesianPosition, ConstantVelocity, Kalman
from vedette_standard.births.cells import moved
from vedette_standard.births.uniform import Uniform

FILTER, RNG = Kalman(ConstantVelocity(0.01)), np.random.default_rng(0)
HALF, CELL, DT, LIFETIME = 5000.0, 50.0, 2.5, 600.0
MIDDLES = np.arange(-HALF + CELL / 2, HALF, CELL)
PLACES = np.stack(np.meshgrid(MIDDLES, MIDDLES, indexing="ij"), axis=-1).reshape(-1, 2)
INITIAL, RATE = 5.0, 0.05


def radar(x, y, far):
    return CartesianPosition(5.0, 0.9, 1e-7, x=x, y=y, max_range=far)


SCENES = {
    "a small view": [(radar(300.0, -200.0, 1300.0), 0)],
    "different views": [(radar(-2500.0, 0.0, 1500.0), 0), (radar(2500.0, 0.0, 2000.0), 0)],
    "one that comes on later": [(radar(-1000.0, 0.0, 2500.0), 0), (radar(1000.0, 0.0, 2500.0), 20)],
    "one that sees the rest": [(radar(-HALF, -HALF, 11000.0), 0), (radar(3800.0, 3800.0, 3000.0), 20)],
}


def born(speed):
    box, spread = {axis: Bounds(-HALF, HALF) for axis in "xy"}, {"vx": speed, "vy": speed}
    return Uniform(box, spread, initial=INITIAL, rate=RATE, lifetime=LIFETIME)


def expected(birth, memory, sensor):
    """Return the number of returns that a birth expects of undetected targets in a look, summed over the view."""
    view = PLACES[np.hypot(*(PLACES - sensor.pose.position).T) <= sensor.max_range]
    density, _ = birth.reveal(memory, FILTER, sensor, Detections.of(view), 1.0)
    return np.sum(density) * CELL**2


@pytest.mark.parametrize("scene", SCENES)
def test_targets_that_stay_are_counted_where_no_sensor_looked(scene):
    birth, known = born(0.0), np.full(len(PLACES), INITIAL / len(PLACES))
    memory = birth.initial_memory(FILTER, RNG)
    for step in range(30):
        if step:
            memory = birth.predict(memory, FILTER, DT, RNG)
            left = np.exp(-DT / LIFETIME)
            known = known * left + RATE * LIFETIME * (1.0 - left) / len(PLACES)
        for sensor, on in SCENES[scene]:
            if step >= on:
                detects = sensor.detects(PLACES)
                np.testing.assert_allclose(expected(birth, memory, sensor), np.sum(known * detects), rtol=0.06)
                memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
                known = known * (1.0 - detects)


def test_targets_that_move_come_in_across_the_edge_of_a_view():
    """Against 430,000 of them, that come straight from afar, as cells do not: .75 of theirs. Without motion it was half."""
    sensor, rng, many, few = radar(300.0, -200.0, 1300.0), np.random.default_rng(1), 200_000, 10_000
    birth = born(10.0)
    memory, x, v, w = birth.initial_memory(FILTER, RNG), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0)
    for step in range(24):
        count, left = (few, np.exp(-DT / LIFETIME)) if step else (many, 1.0)
        came = RATE * LIFETIME * (1.0 - left) if step else INITIAL
        memory = birth.predict(memory, FILTER, DT, RNG) if step else memory
        x = np.concatenate([x + v * DT, rng.uniform(-HALF, HALF, (count, 2))])
        v, w = (
            np.concatenate([v, rng.normal(0.0, 10.0, (count, 2))]),
            np.concatenate([w * left, np.full(count, came / count)]),
        )
        detects = sensor.detects(x)
        told, true = expected(birth, memory, sensor), np.sum(w * detects)
        assert 0.7 < told / true < 1.15
        memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
        w = w * (1.0 - detects)


@pytest.mark.parametrize("sees", ["all alike", "all within its range"])
def test_where_a_sensor_sees_all_there_is_one_number(sees):
    sensor = radar(0.0, 0.0, 8000.0) if sees == "all within its range" else CartesianPosition(5.0, 0.9, 1e-7)
    birth, number = born(10.0), INITIAL
    memory = birth.initial_memory(FILTER, RNG)
    for _ in range(5):
        memory = birth.predict(memory, FILTER, DT, RNG)
        number = number * np.exp(-DT / LIFETIME) + RATE * LIFETIME * -np.expm1(-DT / LIFETIME)
        np.testing.assert_allclose(memory, number, rtol=1e-13)
        memory = birth.update(memory, FILTER, sensor, Detections.of([], 2), np.zeros(0), 1.0)
        number *= 1.0 - 0.9
    assert memory.size == (1 if sees == "all alike" else 64)


def test_cells_mix_alike_in_one_step_and_in_two_and_lose_nothing():
    number, faces = RNG.random((3, 8, 4)), lambda q: 4.0 * q * (1.0 - q)
    whole = moved(number, 0, np.array([0.3, 0.1, 0.0]), faces)
    half = moved(moved(number, 0, np.array([0.1, 0.05, 0.0]), faces), 0, np.array([0.2, 0.05, 0.0]), faces)
    np.testing.assert_allclose(whole, half, rtol=1e-12)
    np.testing.assert_allclose(np.sum(whole, axis=1), np.sum(number, axis=1), rtol=1e-12)
    np.testing.assert_allclose(whole[2], number[2], rtol=1e-12)
    np.testing.assert_allclose(moved(0.0 * number + 2.0, 1, np.full(3, 0.3), faces), 2.0, rtol=1e-12)
