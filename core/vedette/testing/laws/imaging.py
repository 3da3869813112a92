"""Laws of cameras, on pictures of a bright spot or of their own target."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.roles import Sensor
from vedette.sampling import psd_root
from vedette.space import Array
from vedette.supporting import ImagingSensor
from vedette.testing.comparisons import closed_if, covariance, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws import imaging_cases as cases
from vedette.testing.laws import imaging_draws
from vedette.testing.laws.imaging_cases import COLUMN, LIT, ROW, SHAPE
from vedette.testing.laws.sensor_cases import Looks
from vedette.types import Frame

LEAST_SHARE = 0.35
"""Of the inverse information: pixels of finite size, windows and correlated noise make the frame's own larger or smaller."""


def pictures_inform(sensor: Sensor, drawn: Looks) -> None:
    """Information is positive semi-definite, the score the slope of the ratio; both are 0 without it, as of dead pixels."""
    if isinstance(sensor, ImagingSensor):  # of no looks, it is asked whatever it measures
        x = drawn.x if set(sensor.observes.names) == {"x", "y"} else cases.pair(cases.camera_of(sensor), COLUMN, ROW)
        for pixels in (np.full(SHAPE, np.nan), np.ones(SHAPE)):
            none = sensor.information(x, Frame(frozen_copy(pixels)), x)
            silent = ~none[0].any(axis=(-2, -1))
            demand(silent.all() or np.isfinite(pixels).all(), "information: must be 0 of dead pixels")
            for name, got in zip(("score", "llr"), none[1:], strict=True):
                same(f"{name} where J = 0", got[silent], np.zeros_like(got[silent]), 1e-9, 1.0)
        if not cases.measures_px(sensor) and {sensor.observes.axes[i].unit for i in cases.places(sensor)} != {"px"}:
            return
    camera, x = cases.camera_of(sensor), cases.pair(cases.camera_of(sensor), COLUMN + 0.5, ROW - 0.3)
    frame = cases.picture(camera, drawn)
    J, g, _ = cases.informed(camera, x, frame, x)
    same("information again", cases.informed(camera, x, frame, x)[0], J, 0.0)
    covariance("information", J, definite=False)
    h = 1e-3
    ends = [cases.informed(camera, x, frame, cases.shifted(camera, x, h * step))[2] for step in (*np.eye(2), *-np.eye(2))]
    slope = np.stack([ends[0] - ends[2], ends[1] - ends[3]], axis=-1) / (2 * h)
    root = np.sqrt(np.maximum(np.trace(J, axis1=-2, axis2=-1), 1e-12))[:, None]
    otherwise = f"score: must be the slope of llr, {slope.tolist()}, got {g.tolist()}"
    demand(np.all(np.abs(g - slope) <= 1e-2 * (np.abs(slope).max() + root)), otherwise)
    elsewhere = cases.informed(camera, x, frame, cases.pair(camera, COLUMN + 1.5, ROW + 1.0))[1]
    otherwise = "information: must be linearised at `at`, not at the expected place"
    demand(np.any(np.abs(elsewhere - g) > 1e-9), otherwise)


def pictures_show_where(sensor: Sensor, drawn: Looks) -> None:
    """The ratio is largest where the target is, column first; a window says what its picture does."""
    camera = cases.camera_of(sensor)
    frame = cases.clear_picture(camera, drawn)

    def seen(of: Frame, column: float = COLUMN, row: float = ROW) -> tuple[Array, Array, Array]:
        x = cases.state_at(camera, column, row)
        return cases.informed(camera, x, of, x)

    there = seen(frame)
    turned = Frame(frozen_copy(np.pad(frame.pixels, ((0, SHAPE[1] - SHAPE[0]), (0, 0)), mode="edge")))
    other = seen(turned, ROW, COLUMN)[2][0]
    demand(there[2][0] > other, "llr: is larger at the target's row and column exchanged: x counts columns")
    wide = np.pad(frame.pixels, ((50, 0), (100, 0)), constant_values=np.nan)  # noise may depend on the place in a picture
    at = COLUMN + 100.0, ROW + 50.0
    whole, window = (seen(of, *at) for of in (Frame(frozen_copy(wide)), evolve(frame, corner=np.array([100.0, 50.0]))))
    for name, got, wanted in zip(("information", "score", "llr"), window, whole, strict=True):
        same(f"{name} in a window", got, wanted, 1e-6, 1.0 + np.abs(wanted).max())
    holed = np.array(frame.pixels)
    row, column = np.unravel_index(np.argmax(np.abs(holed - np.median(holed))), SHAPE)
    holed[row, column % 2 :: 2] = np.nan
    dead = seen(evolve(frame, pixels=frozen_copy(holed)))
    demand(np.trace(dead[0][0]) < np.trace(there[0][0]) + 1e-9, "information: dead pixels must not add any")
    lost = np.where(np.isnan(holed), frame.pixels, 0.0).sum()
    black = seen(evolve(frame, pixels=frozen_copy(np.nan_to_num(holed))))
    known = "amplitude" in camera.observes  # else it does not know how bright the target is
    demand(not known or lost <= 0 or dead[2][0] > black[2][0], "llr: a dead pixel must not count as a dark one")


def unseen_pixels_are_as_dead_ones(sensor: Sensor, drawn: Looks) -> None:
    """What lies beyond the edge of a frame, or is saturated, says as little as dead pixels; a target in it is detected."""
    camera = cases.camera_of(sensor)
    x = cases.state_at(camera, COLUMN, ROW)
    able = getattr(camera, "detection_probability", 1.0) == 0 or np.any(camera.detects(x) > 0)
    demand(able, "detects: is 0 of a target in the middle of a frame")
    axes = [camera.observes.axes[i] for i in cases.places(camera)]
    if all(axis.unit == "px" for axis in (*axes, *camera.measurement.axes)):
        same("area of a pixel in px^2", np.abs(np.linalg.det(cases.steps(camera, x))), np.ones(()), 1e-6)
    pixels, most = np.array(cases.picture(camera, drawn).pixels), cases.saturation(camera)
    column, row = int(COLUMN), int(ROW)
    dead, bright = pixels.copy(), pixels.copy()
    dead[:, column + 2 :] = dead[row + 2 :] = np.nan
    pairs = [("beyond the edge", dead, pixels[: row + 2, : column + 2])]
    if np.isfinite(most):
        saturated = pixels.copy()
        saturated[row, column : column + 2], bright[row, column : column + 2] = np.nan, most
        pairs.append(("saturated", saturated, bright))
    for what, lost, frame in pairs:
        wanted, found = (cases.informed(camera, x, Frame(frozen_copy(each)), x) for each in (lost, frame))
        for name, got, said in zip(("information", "score", "llr"), found, wanted, strict=True):
            same(f"{name}, {what}", got, said, 1e-9, 1.0 + np.abs(said).max())


def a_step_leads_to_the_target(sensor: Sensor, drawn: Looks) -> None:
    """J^-1 g points from near the target to it, and stays where it is: the pixel in column 3 lies around x = 3."""
    camera = cases.camera_of(sensor)
    frame, own = cases.clear_picture(camera, drawn), cases.plain(camera)
    for off, allowed in ((np.zeros(2), 0.25), (np.array([0.6, -0.4]), 0.5), (np.array([-0.5, 0.5]), 0.5)):
        x = cases.shifted(camera, cases.state_at(camera, COLUMN, ROW), off)
        J, g, _ = (part[0] for part in cases.informed(camera, x, frame, x))
        closed_if(np.linalg.eigvalsh(J)[0] < 1e-9, "its frame says nothing along some direction")
        doubt = 0.0 if own else 6.0 / np.sqrt(np.linalg.eigvalsh(J)[0])
        left = float(np.linalg.norm(off + np.linalg.solve(J, g)))
        otherwise = f"score: from {off.tolist()} px beside the target, J^-1 g ends {left:.3g} px beside it"
        # Where it draws, J is held to its draws; and where a residual of many deviations counts little, a step is short.
        demand(left <= (allowed if own else max(allowed, float(np.linalg.norm(off)))) + doubt, otherwise)


def noise_is_what_a_frame_leaves(sensor: Sensor, drawn: Looks) -> None:
    """The noise is about the inverse of the information in a frame of a target that looks as expected."""
    camera = cases.camera_of(sensor)
    frame, x = cases.picture(camera, drawn), cases.state_at(camera, COLUMN, ROW)
    J = cases.informed(camera, x, frame, x)[0][0]
    back = np.linalg.inv(cases.in_px(camera, x)).reshape(2, 2)
    R = back @ np.broadcast_to(camera.noise(x), (1, 2, 2))[0] @ back.T
    share = np.linalg.eigvalsh(psd_root(J) @ R @ psd_root(J).T)
    otherwise = f"noise: must be the inverse of the information in a frame, is {share.tolist()} times that"
    demand(share[-1] >= LEAST_SHARE and share[0] <= 1 / LEAST_SHARE, otherwise)


def a_known_level_changes_nothing(sensor: Sensor, drawn: Looks) -> None:
    """If it observes `background`: counts added to all pixels and to it change neither J, g nor llr."""
    camera = cases.camera_of(sensor)
    closed_if("background" not in camera.observes, "it observes no `background`")
    frame, x = cases.picture(camera, drawn), cases.pair(camera, COLUMN, ROW)
    brighter = np.array(x)
    brighter[..., camera.observes.names.index("background")] += 7.0
    found = cases.informed(camera, brighter, Frame(frozen_copy(frame.pixels + 7.0)), frozen_copy(brighter))
    closed_if(not found[0].any(), "brighter pixels are saturated")
    for name, got, wanted in zip(("J", "g", "llr"), found, cases.informed(camera, x, frame, x), strict=True):
        same(f"{name} of a brighter frame", got, wanted, 1e-6, 1.0 + np.abs(wanted).max())


def a_brighter_target_is_seen_no_worse(sensor: Sensor, drawn: Looks) -> None:
    """If it observes `amplitude`: the noise of a frame does not grow with it."""
    camera = cases.camera_of(sensor)
    closed_if("amplitude" not in camera.observes, "it observes no `amplitude`")
    x, own = cases.pair(camera, COLUMN, ROW), np.array(camera.observes.names) == "amplitude"
    lit = [frozen_copy(np.where(own, amplitude, x)) for amplitude in (10.0, LIT)]
    dim, bright = (float(np.trace(np.broadcast_to(camera.noise(each), (2, 2, 2))[0])) for each in lit)
    demand(bright <= dim * (1 + 1e-9), f"noise: grows from {dim:.3g} to {bright:.3g} with 4 times the amplitude")


LAWS = (
    *map(Law, (pictures_inform, a_brighter_target_is_seen_no_worse)),
    *(Law(law, share=2) for law in (
        pictures_show_where, unseen_pixels_are_as_dead_ones, a_step_leads_to_the_target, noise_is_what_a_frame_leaves,
        a_known_level_changes_nothing,
    )),
    *imaging_draws.LAWS,
)  # fmt: skip
