"""Laws of cameras, on pictures of noise with a bright spot."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.roles import Sensor
from vedette.space import Array
from vedette.supporting import ImagingSensor
from vedette.testing.comparisons import Closed, covariance, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks
from vedette.types import Frame

COLUMN, ROW, SIDE = 13.2, 9.4, 24
STANDS_OUT = 72.0
"""Log ratio of a spot without noise from which on noise makes none negative: its variance is twice that, so 6 sigma."""


def _camera(sensor: Sensor) -> ImagingSensor:
    if not isinstance(sensor, ImagingSensor):
        raise Closed("it is no camera")
    if not all(name in sensor.observes for name in ("x", "y")) or len(sensor.measurement) != 2:
        raise Closed("it does not observe x and y in a picture")
    if set(sensor.observes.names) != {"x", "y", "amplitude", "spread", "background"}:
        raise Closed("it does not look for a spot with amplitude, spread and background, which the kit draws")
    return sensor


def _spot() -> Array:
    rows, columns = np.mgrid[:SIDE, :SIDE]
    return np.asarray(40.0 * np.exp(-((columns - COLUMN) ** 2 + (rows - ROW) ** 2) / 8.0))


def _picture(drawn: Looks) -> Frame:
    return Frame(frozen_copy(_spot() + np.random.default_rng(drawn.seed).normal(size=(SIDE, SIDE))))


def _states(camera: ImagingSensor, column: float, row: float) -> Array:
    """Two tracks (2, n) at a place, one a little aside; other axes are of the size of the spot."""
    usual = {"amplitude": 40.0, "spread": 2.0, "background": 0.1}
    x = np.array([[usual.get(name, 1.0) for name in camera.observes.names]] * 2)
    x[:, camera.observes.names.index("x")] = column + np.array([0.0, 0.6])
    x[:, camera.observes.names.index("y")] = row + np.array([0.0, -0.4])
    return frozen_copy(x)


def pictures_inform(sensor: Sensor, drawn: Looks) -> None:
    """Information is positive semi-definite, the score is the slope of the ratio, and dead pixels say nothing."""
    camera, frame = _camera(sensor), _picture(drawn)
    x = _states(camera, COLUMN + 0.5, ROW - 0.3)
    at = frozen_copy(x + 0.0)
    J, g, _ = camera.information(x, frame, at)
    same("information again", camera.information(x, frame, at)[0], J, 0.0)
    covariance("information", J, definite=False)
    if not J.any():
        raise Closed("no pixel of the kit's picture informs: all are saturated, say")
    where = [camera.observes.names.index(name) for name in ("x", "y")]
    h, slope = 1e-3, np.zeros((2, 2))
    for i, axis in enumerate(where):
        ends = []
        for sign in (-1.0, 1.0):
            moved = np.array(at)
            moved[:, axis] += sign * h
            ends.append(camera.information(x, frame, moved)[2])
        slope[:, i] = (ends[1] - ends[0]) / (2 * h)
    root = np.sqrt(np.maximum(np.trace(J, axis1=-2, axis2=-1), 1e-12))[:, None]
    demand(
        np.all(np.abs(g - slope) <= 0.25 * np.abs(slope).max() + root),
        f"score: must be the slope of llr, {slope.tolist()}, got {g.tolist()}",
    )
    elsewhere = frozen_copy(_states(camera, COLUMN + 1.5, ROW + 1.0))
    demand(
        np.any(np.abs(camera.information(x, frame, elsewhere)[1] - g) > 1e-9),
        "information: must be linearised at `at`, not at the expected place",
    )
    dead = Frame(frozen_copy(np.full((SIDE, SIDE), np.nan)))
    none = camera.information(x, dead, at)
    same("information of dead pixels", none[0], np.zeros_like(none[0]), 1e-12, 1.0)
    same("llr of dead pixels", none[2], np.zeros_like(none[2]), 1e-9, 1.0)


def pictures_show_where(sensor: Sensor, drawn: Looks) -> None:
    """The ratio is largest where the target is, column first; dead pixels and the window's corner change nothing."""
    camera, frame = _camera(sensor), _picture(drawn)

    def ratio(of: Frame, column: float, row: float) -> float:
        x = _states(camera, column, row)
        return float(camera.information(x, of, x)[2][0])

    there = ratio(frame, COLUMN, ROW)
    if abs(ratio(Frame(frozen_copy(_spot())), COLUMN, ROW)) < STANDS_OUT:
        raise Closed("the spot that the kit draws does not stand out from what the camera takes for noise")
    demand(there > 0, f"llr: must be > 0 on a bright target, got {there:.4g}")
    demand(there > ratio(frame, ROW, COLUMN), "llr: is larger at the target's row and column exchanged: x counts columns")
    corner = np.array([100.0, 50.0])
    window = evolve(frame, corner=corner)
    same("llr in a window", np.array(ratio(window, COLUMN + 100.0, ROW + 50.0)), np.array(there), 1e-6, 1.0 + abs(there))
    far = np.array(frame.pixels)
    x = _states(camera, COLUMN, ROW)
    live = camera.information(x, frame, x)[0]
    far[int(ROW), ::2] = np.nan
    dead = camera.information(x, evolve(frame, pixels=frozen_copy(far)), x)
    demand(np.trace(dead[0][0]) < np.trace(live[0]) + 1e-9, "information: dead pixels must not add any")
    lost = np.where(np.isnan(far), frame.pixels, 0.0).sum()
    black = camera.information(x, evolve(frame, pixels=frozen_copy(np.nan_to_num(far))), x)
    demand(lost <= 0 or dead[2][0] > black[2][0], "llr: a dead pixel must not count as a dark one")


def learning_leaves_the_place(sensor: Sensor, drawn: Looks) -> None:
    """A frame teaches how the target looks, not where it is."""
    camera, frame = _camera(sensor), _picture(drawn)
    x = _states(camera, COLUMN, ROW)
    learnt = camera.learn(x, frame)
    where = [camera.observes.names.index(name) for name in ("x", "y")]
    same("place after learning", learnt[:, where], x[:, where], 0.0)


def a_brighter_target_is_seen_no_worse(sensor: Sensor, drawn: Looks) -> None:
    """The noise of a frame does not grow with the amplitude of its target."""
    camera = _camera(sensor)
    x, i = _states(camera, COLUMN, ROW), camera.observes.names.index("amplitude")
    traces = []
    for amplitude in (10.0, 40.0):
        lit = np.array(x)
        lit[:, i] = amplitude
        traces.append(float(np.trace(np.broadcast_to(camera.noise(frozen_copy(lit)), (2, 2, 2))[0])))
    demand(
        traces[1] <= traces[0] * (1 + 1e-9),
        f"noise: grows from {traces[0]:.3g} to {traces[1]:.3g} with 4 times the amplitude",
    )


LAWS = (
    Law(pictures_inform),
    Law(pictures_show_where),
    Law(learning_leaves_the_place),
    Law(a_brighter_target_is_seen_no_worse),
)
