"""What laws of cameras are tried on: pictures of a bright spot, and those that a camera draws of its own target.

Every camera that observes x and y has them: its other axes are of usual size by their names and units.
"""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array
from vedette.supporting import ImagingSensor
from vedette.testing.comparisons import Closed, closed_if, demand, frozen_copy
from vedette.testing.laws.sensor_cases import Looks
from vedette.types import Frame

COLUMN, ROW, SHAPE = 21.23, 12.41, (25, 34)
"""Where the target is, in a picture of more columns than rows: its column is no row."""
LESSON, SMALL = (8.23, 7.41), (16, 17)
"""The same of the pictures from which it learns: many are drawn, with the same noise, so that this cancels."""
LIT = 40.0
LOOKS = {"amplitude": LIT, "background": 0.1, "width": 8.0, "height": 8.0}
SIZES = {"px": 2.0, "rad": 0.3, "1": 0.2, "count": LIT}
"""Usual values of the axes beyond the position: by name, else by unit, else 0."""
PLAIN = {"x", "y", *LOOKS, "spread"}
"""A camera of no other axes, which is told how bright it is or draws none, looks for a round spot, such as the kit draws."""
AWAY, MUCH = 1e3, 5.0
"""Pixels from which on a target leaves a picture as it is; a log ratio that noise has in 1 of 148 pictures at most."""
STANDS_OUT = 72.0
"""Log ratio of a spot without noise from which on noise makes none negative: its variance is twice that, so 6 sigma."""


def camera_of(sensor: Sensor) -> ImagingSensor:
    assert isinstance(sensor, ImagingSensor)
    if not all(name in sensor.observes for name in ("x", "y")) or len(sensor.measurement) != 2:
        raise Closed("it does not observe x and y in a picture")
    if not measures_px(sensor) and {sensor.observes.axes[i].unit for i in places(sensor)} != {"px"}:
        raise Closed("neither what it measures nor x and y are in px")
    return sensor


def measures_px(camera: ImagingSensor) -> bool:
    return all(axis.unit == "px" for axis in camera.measurement.axes)


def in_px(camera: ImagingSensor, x: Array) -> Array:
    """Return how what it measures changes with the place in px (*b, 2, 2): it may measure a distance and a direction."""
    if measures_px(camera):
        return np.eye(2)
    return np.asarray(np.broadcast_to(camera.jacobian(x), (*x.shape[:-1], 2, x.shape[-1]))[..., places(camera)])


def informed(camera: ImagingSensor, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
    """Return J, g and llr over the place in px."""
    J, g, llr = camera.information(x, frame, at)
    turn = np.swapaxes(in_px(camera, at), -1, -2)
    return turn @ J @ np.swapaxes(turn, -1, -2), (turn @ g[..., None])[..., 0], llr


def places(camera: ImagingSensor) -> list[int]:
    return [camera.observes.names.index(name) for name in ("x", "y")]


def steps(camera: ImagingSensor, x: Array) -> Array:
    """Return how x and y change with the apparent position (2, 2) in px."""
    if not measures_px(camera):
        return np.eye(2)
    slope = np.broadcast_to(camera.jacobian(x), (*x.shape[:-1], 2, x.shape[-1]))[..., 0, :, :][:, places(camera)]
    closed_if(abs(np.linalg.det(slope)) < 1e-6, "where its target appears does not follow from x and y")
    return np.linalg.inv(slope)


def shifted(camera: ImagingSensor, x: Array, by: Array) -> Array:
    """Return states (*b, n) whose apparent position is moved by px (*b, 2)."""
    out = np.array(x)
    out[..., places(camera)] += by @ steps(camera, np.reshape(x, (-1, x.shape[-1]))).T
    return frozen_copy(out)


def state_at(camera: ImagingSensor, column: float, row: float) -> Array:
    """Return a state (1, n) that appears there."""
    x = np.array([[LOOKS.get(axis.name, SIZES.get(axis.unit, 0.0)) for axis in camera.observes.axes]])
    x[:, places(camera)] = column, row
    return shifted(camera, x, np.array([column, row]) - camera.measure(x)) if measures_px(camera) else x


def pair(camera: ImagingSensor, column: float, row: float) -> Array:
    """Return two states (2, n), the second a little aside."""
    return shifted(camera, np.repeat(state_at(camera, column, row), 2, axis=0), np.array([[0.0, 0.0], [0.6, -0.4]]))


def spot() -> Array:
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.asarray(LIT * np.exp(-((columns - COLUMN) ** 2 + (rows - ROW) ** 2) / 8.0))


def drawn_frame(camera: ImagingSensor, x: Array, rng: np.random.Generator, shape: tuple[int, int] = SHAPE) -> Array | None:
    try:
        return np.asarray(camera.draw_frame(x, shape, rng))
    except NotImplementedError:
        return None


def picture(camera: ImagingSensor, drawn: Looks) -> Frame:
    """Return a picture of its own target, or of the kit's spot in noise; Closed if it says nothing."""
    rng = np.random.default_rng(drawn.seed)
    own = drawn_frame(camera, state_at(camera, COLUMN, ROW), rng)
    pixels = spot() + rng.normal(size=SHAPE) if own is None else own[0]
    x = state_at(camera, COLUMN, ROW)
    if not informed(camera, x, Frame(frozen_copy(pixels)), x)[0].any():
        demand(own is None or pixels.max() >= saturation(camera), "information: is 0 in a frame of its own target")
        raise Closed("no pixel of the kit's picture informs: all are saturated, or it reads no pictures")
    return Frame(frozen_copy(pixels))


def saturation(camera: ImagingSensor) -> float:
    """Return from which value on pixels say nothing, by its parameter or that of a part."""
    found = [getattr(part, "saturation", None) for part in (camera, getattr(camera, "camera", None))]
    return float(min((each for each in found if each is not None), default=np.inf))


def plain(camera: ImagingSensor) -> bool:
    draws = type(camera).draw_frame is not ImagingSensor.draw_frame
    return set(camera.observes.names) <= PLAIN and ("amplitude" in camera.observes or not draws)


def clear_picture(camera: ImagingSensor, drawn: Looks) -> Frame:
    """Return the kit's spot without noise for a camera that looks for one, else its own picture; Closed if none is clear."""
    frame, x = picture(camera, drawn), state_at(camera, COLUMN, ROW)
    if plain(camera):
        frame = Frame(frozen_copy(spot()))
    there = informed(camera, x, frame, x)[2][0]
    known = plain(camera) and "amplitude" in camera.observes
    demand(not known or there > 0, f"llr: must be > 0 on a target as bright as expected, got {there:.4g}")
    if there < (0.0 if plain(camera) else STANDS_OUT):
        raise Closed("its target does not stand out from what the camera takes for noise")
    return frame
