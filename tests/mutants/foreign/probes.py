"""A few calls of each role: what a component answers, what it does to its inputs, and whether it answers so again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

import vedette
import vedette_standard as standard

NEAR = np.array([[3.0, -4.0], [120.0, 80.0], [-300.0, 900.0], [50.0, -30.0], [5000.0, 100.0], [0.0, 0.0]])


def leaves(value: Any) -> Iterator[Any]:
    """Yield the arrays and plain values that a value holds."""
    if attrs.has(type(value)) and not isinstance(value, vedette.Component):
        for field in attrs.fields(type(value)):
            yield from leaves(getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield from leaves(list(value.items()))
    elif isinstance(value, tuple | list | vedette.LazyScans):
        yield len(value)
        for part in value:
            yield from leaves(part)
    elif isinstance(value, vedette.Component):
        yield "a component"
    elif isinstance(value, np.ndarray):
        yield value.copy()
    else:
        yield value


def answer(call: Callable[..., Any], *inputs: Any) -> list[Any]:
    """Return what a call gives, or which error, what it makes of its inputs, and what it gives when called again."""
    with np.errstate(all="ignore"):
        try:
            return [*leaves(call(*inputs)), *leaves(inputs), *leaves(call(*inputs))]
        except Exception as error:  # any error is an answer
            return [type(error).__name__]


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def motion(m: Any) -> Iterator[list[Any]]:
    n = len(m.state)
    for dt in (0.0, 0.5, 2.0, 30.0):
        for scale in (0.0, 0.2, 5.0):
            x = scale * np.sin(np.arange(3 * n, dtype=float) + 1).reshape(3, n)
            for method in (m.move, m.jacobian, m.noise):
                yield answer(lambda x, method=method, dt=dt: method(x, dt), x.copy())


def sensor(s: Any, poses: bool = True) -> Iterator[list[Any]]:
    n = len(s.observes)
    x = np.concatenate([NEAR, np.sin(np.arange(6.0 * 8)).reshape(6, 8)], axis=-1)[:, :n]
    for method in (s.measure, s.jacobian, s.noise, s.detects):
        yield answer(method, x.copy())
    yield answer(s.measure, x[:1].copy())
    z = np.array([[10.0, 0.3, 0.2], [900.0, -3.0, 1.0], [9000.0, 3.1, -70.0]])[:, : len(s.measurement)]
    yield answer(s.clutter, z[None])
    yield answer(s.invert, z.copy())
    yield answer(s.invert, z.copy(), 0.3 * np.eye(z.shape[-1]))
    if poses:
        d = 3 if "z" in s.observes else 2
        for p in (np.array([70.0, -20.0, 5.0])[:d], np.array([[70.0, -20.0, 5.0]] * 5 + [[1.0, 2.0, 3.0]])[:, :d]):
            pose = vedette.Pose(p, np.array([3.0, 4.0, 1.0])[:d], 0.4)
            yield [
                part for results in answer(lambda pose: list(sensor(s.at(pose), False)), pose) for part in leaves(results)
            ]


def associator(a: Any) -> Iterator[list[Any]]:
    spread = 3.0 * np.sin(np.arange(2.0 * 4 * 5)).reshape(2, 4, 5)
    gated = np.where((spread < -1.5) & (np.arange(5) > 0), -np.inf, spread)
    strong = np.array([[0.0, 900.0, 900.0], [-800.0, -np.inf, -900.0], [2.0, 2.0, 1.0]])
    greedy = np.array([[0.0, 10.0, 9.0], [0.0, 9.0, -5.0]])
    crowd = np.array([[-9.0, 5.0], [-9.0, 4.0], [-9.0, 3.0]])
    chain = np.random.default_rng(2).normal(3.0, 2.0, (12, 13))
    for scores in (
        spread,
        gated,
        strong,
        greedy,
        crowd,
        chain,
        np.zeros((0, 3)),
        np.zeros((2, 1)),
        np.array([[0.0, 1.0, 1.0]]),
    ):
        yield answer(a.associate, scores.copy(), None)
        yield answer(a.associate, scores.copy(), np.cos(np.arange(scores.shape[-1] - 1.0))[None])


def scans_of(sensor: Any) -> Iterator[tuple[Any, Any]]:
    m = len(sensor.measurement)
    z = np.array([[60.0, -3.1, 2.0], [90.0, 0.6, 1.0]])[:, :m]
    own, lacks = np.array([0.5, 2.0])[:, None, None] * np.eye(m), np.arange(m) > np.array([[5], [0]])
    yield sensor, vedette.Detections.of(z)
    yield sensor, vedette.Detections.of([], m)
    yield sensor, vedette.Detections(z, np.ones(2, dtype=bool), None, own)
    yield sensor, vedette.Detections(z, np.ones(2, dtype=bool), None, None, lacks)
    yield sensor, vedette.Detections(z, np.array([True, False]))


def estimator(e: Any) -> Iterator[list[Any]]:
    n = len(e.state)
    mean = np.array([[-100.0, -5.0, 4.0, -2.0, 0.2], [70.0, 50.0, -3.0, 1.0, -0.1]])
    cov = (
        np.diag([400.0, 300.0, 20.0, 10.0, 0.01]) + 3.0 * np.ones((5, 5)) * (np.arange(5) < 4) * (np.arange(5) < 4)[:, None]
    )
    axes = vedette.Space((*e.state.axes[2:4], *e.state.axes[:2], *e.state.axes[4:]))
    order = [2, 3, 0, 1, 4][:n]
    prior = vedette.Gaussian(mean[:, order], np.broadcast_to(cov, (2, 5, 5))[:, order][:, :, order])
    yield answer(lambda p: e.start(p, axes, rng()), prior)
    weights = np.array([[0.2, 0.5, 0.3], [0.6, 0.1, 0.3]])
    radar = standard.RangeBearing(5.0, 0.05, detection_probability=0.9, max_range=95.0, clutter_per_scan=3.0)
    position = standard.CartesianPosition(5.0, 0.9, 1e-6)
    seen = vedette.Detections.of([[-100.0, -20.0], [80.0, 30.0]])
    before = e.predict(e.start(prior, axes, rng()), 3.0, np.random.default_rng(11))
    belief = e.update(before, e.evaluate(before, position, seen, 0.98), weights)
    for dt in (0.0, 1.5, 4.0):
        yield answer(lambda b, dt=dt: e.predict(b, dt, np.random.default_rng(8)), belief)
        if dt:
            yield answer(lambda b, dt=dt: e.cross_covariance(b, dt), belief)
            later = e.update(ahead := e.predict(belief, dt, rng()), e.evaluate(ahead, position, seen, 0.98), weights)
            yield answer(lambda b, dt=dt, later=later: e.smooth_step(b, later, dt, rng()), belief)
    ahead = e.predict(e.predict(belief, 2.0, np.random.default_rng(9)), 1.0, np.random.default_rng(10))
    yield answer(e.moments, ahead)
    yield answer(e.mode_prob, ahead)
    for sensed, scan in (*scans_of(radar), *scans_of(position)):
        w = weights if len(scan.valid) else np.ones((2, 1))
        yield answer(lambda b, s=sensed, d=scan: attrs.evolve(e.evaluate(b, s, d, 0.98), detail=None), ahead)
        yield answer(
            lambda b, s=sensed, d=scan, w=w: e.update(b, e.evaluate(b, s, d, 0.98), w), e.predict(ahead, 0.5, rng())
        )


def birth(b: Any) -> Iterator[list[Any]]:
    filter_, radar = (
        standard.Kalman(standard.ConstantVelocity(0.5)),
        standard.RangeBearing(5.0, 0.02, clutter_per_scan=5.0, max_range=4e3),
    )
    yield [b.starts_from("radar"), b.starts_from("sonar")]
    for sensor_, scan in (*scans_of(radar), *scans_of(standard.BearingOnly(0.02))):
        memory = b.initial_memory(filter_, rng())
        claimed, other = np.array([0.7, 0.1])[: len(scan.valid)], np.array([0.2, 0.3])[: len(scan.valid)]

        def born(memory, s=sensor_, d=scan, c=claimed):
            density, found = b.reveal(memory, filter_, s, d, 0.99)
            return density, b.begin(found, filter_, s, "radar", d, c)

        for dt in (0.0, 2.0, 300.0):
            yield answer(lambda m, dt=dt: b.predict(m, filter_, dt, rng()), memory)
        yield answer(born, memory)
        yield answer(lambda m, born=born, s=sensor_, d=scan, c=other: born(m, s, d, c), memory)
        yield answer(lambda m, s=sensor_, d=scan, c=claimed: b.update(m, filter_, s, d, c, 0.99), memory)
    ended = vedette.Gaussian(np.ones((1, 4)), 9.0 * np.eye(4)[None])
    yield answer(lambda m: b.recycle(m, filter_, ended, np.array([0.3])), b.initial_memory(filter_, rng()))


def lifecycle(life: Any) -> Iterator[list[Any]]:
    existence = np.array([0.2, 0.9, 0.5, 0.6])
    yield answer(life.predict, existence.copy(), 3.0)
    yield answer(life.predict, existence.copy(), 300.0)
    yield answer(life.start, existence.copy())
    memory = life.start(existence)
    for k in range(40):
        seen = np.array([k % 2, 1.0, k < 3, 0.3]) * 0.95
        review = vedette.Review(
            1.7,
            np.array([0.4, 0.99, 0.1, 0.5]) * (1.0 - 0.02 * k),
            seen,
            np.array([0.9, 0.5, 0.0 if k > 8 else 0.9, 0.9]),
            np.array([9.0, 99.0, 250.0, 50.0]),
        )
        yield answer(life.review, memory, review if life.needs_spread else attrs.evolve(review, spread=None))
        try:
            memory = life.review(memory, review)[0]
        except Exception:  # the answer above says so
            return


def imaging(camera: Any) -> Iterator[list[Any]]:
    pixels = rng().normal(size=(24, 24)) + 40 * np.exp(
        -((np.arange(24) - 11.4) ** 2 + (np.arange(24)[:, None] - 8.2) ** 2) / 8
    )
    dead = np.where(rng().uniform(size=pixels.shape) < 0.2, np.nan, pixels)
    x = np.array([[11.0, 9.0, 38.0, 2.1, 0.2], [500.0, 9.0, 38.0, 2.1, 0.2]])
    for frame in (vedette.Frame(pixels), vedette.Frame(dead), vedette.Frame(pixels, np.array([2.0, 1.0]))):
        yield answer(camera.information, x.copy(), frame, x + [0.3, 0.2, 0, 0, 0])
        yield answer(camera.learn, x.copy(), frame)
    yield answer(camera.noise, x.copy())


def preprocessor(p: Any) -> Iterator[list[Any]]:
    name, radar = next(iter(p.sensors.items()))
    yield [p.measurement]
    for _, scan in scans_of(radar):
        for pose in (None, vedette.Pose([5.0, 6.0], None, 0.2)):
            yield answer(p.process, {name: vedette.Scan(1.0, name, scan, pose)})


def source(s: Any) -> Iterator[list[Any]]:
    sensors = {"radar": standard.CartesianPosition(5.0, 0.9, 3e-6)}
    for seed in (1, 2):
        yield answer(lambda seed=seed: s.open(sensors, np.random.default_rng(seed)))


PROBES: dict[str, Callable[[Any], Iterator[list[Any]]]] = {
    f.__name__: f for f in (motion, sensor, associator, estimator, birth, lifecycle, imaging, preprocessor, source)
}


def declarations(component: vedette.Component, role: type) -> list[Any]:
    """Return what a component declares."""
    names = [name for name in dir(role) if not name.startswith("_") and not callable(getattr(role, name))]
    return [getattr(component, name, None) for name in names if name not in ("kind", "sensors", "twin")]
