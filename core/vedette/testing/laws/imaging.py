"""Laws of cameras, on pictures of a bright spot, and on those that a camera draws of its own target.

Every camera that observes x and y has them: its other axes are of usual size by their names and units.
"""

from __future__ import annotations

import numpy as np
from attrs import evolve, fields

from vedette.roles import Sensor
from vedette.sampling.trajectories import psd_root
from vedette.space import Array
from vedette.supporting import ImagingSensor
from vedette.testing.bands import binomial_band, judge_standard_normal
from vedette.testing.comparisons import Closed, covariance, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks
from vedette.types import Frame

COLUMN, ROW, SHAPE = 21.23, 12.41, (25, 34)
"""Where the target is, in a picture of more columns than rows: its column is no row."""
LESSON, SMALL = (8.23, 7.41), (16, 17)
"""The same of the pictures from which it learns: many are drawn, with the same noise, so that this cancels."""
LIT = 40.0
LOOKS = {"amplitude": LIT, "background": 0.1, "width": 8.0, "height": 8.0}
SIZES = {"px": 2.0, "rad": 0.3, "1": 0.2}
"""Usual values of the axes beyond the position: by name, else by unit, else 0."""
PLAIN = {"x", "y", *LOOKS, "spread"}
"""A camera of no other axes looks for a round spot, such as the kit draws."""
AWAY, MUCH = 1e3, 5.0
"""Pixels from which on a target leaves a picture as it is; a log ratio that noise has in 1 of 148 pictures at most."""
STANDS_OUT = 72.0
"""Log ratio of a spot without noise from which on noise makes none negative: its variance is twice that, so 6 sigma."""


def _camera(sensor: Sensor) -> ImagingSensor:
    if not isinstance(sensor, ImagingSensor):
        raise Closed("it is no camera")
    if not all(name in sensor.observes for name in ("x", "y")) or len(sensor.measurement) != 2:
        raise Closed("it does not observe x and y in a picture")
    if not _measures_px(sensor) and {sensor.observes.axes[i].unit for i in _where(sensor)} != {"px"}:
        raise Closed("neither what it measures nor x and y are in px")
    return sensor


def _measures_px(camera: ImagingSensor) -> bool:
    return all(axis.unit == "px" for axis in camera.measurement.axes)


def _in_px(camera: ImagingSensor, x: Array) -> Array:
    """Return how what it measures changes with the place in px (*b, 2, 2): it may measure a distance and a direction."""
    if _measures_px(camera):
        return np.eye(2)
    return np.asarray(np.broadcast_to(camera.jacobian(x), (*x.shape[:-1], 2, x.shape[-1]))[..., _where(camera)])


def _information(camera: ImagingSensor, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
    """Return J, g and llr over the place in px."""
    J, g, llr = camera.information(x, frame, at)
    turn = np.swapaxes(_in_px(camera, at), -1, -2)
    return turn @ J @ np.swapaxes(turn, -1, -2), (turn @ g[..., None])[..., 0], llr


def _where(camera: ImagingSensor) -> list[int]:
    return [camera.observes.names.index(name) for name in ("x", "y")]


def _steps(camera: ImagingSensor, x: Array) -> Array:
    """Return how x and y change with the apparent position (2, 2) in px."""
    if not _measures_px(camera):
        return np.eye(2)
    slope = np.broadcast_to(camera.jacobian(x), (*x.shape[:-1], 2, x.shape[-1]))[..., 0, :, :][:, _where(camera)]
    if abs(np.linalg.det(slope)) < 1e-6:
        raise Closed("where its target appears does not follow from x and y")
    return np.linalg.inv(slope)


def _moved(camera: ImagingSensor, x: Array, by: Array) -> Array:
    """Return states (*b, n) whose apparent position is moved by px (*b, 2)."""
    out = np.array(x)
    out[..., _where(camera)] += by @ _steps(camera, np.reshape(x, (-1, x.shape[-1]))).T
    return frozen_copy(out)


def _at(camera: ImagingSensor, column: float, row: float) -> Array:
    """Return a state (1, n) that appears there."""
    x = np.array([[LOOKS.get(axis.name, SIZES.get(axis.unit, 0.0)) for axis in camera.observes.axes]])
    x[:, _where(camera)] = column, row
    return _moved(camera, x, np.array([column, row]) - camera.measure(x)) if _measures_px(camera) else x


def _pair(camera: ImagingSensor, column: float, row: float) -> Array:
    """Return two states (2, n), the second a little aside."""
    return _moved(camera, np.repeat(_at(camera, column, row), 2, axis=0), np.array([[0.0, 0.0], [0.6, -0.4]]))


def _spot() -> Array:
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.asarray(LIT * np.exp(-((columns - COLUMN) ** 2 + (rows - ROW) ** 2) / 8.0))


def _drawn_frame(camera: ImagingSensor, x: Array, rng: np.random.Generator, shape: tuple[int, int] = SHAPE) -> Array | None:
    try:
        return np.asarray(camera.draw_frame(x, shape, rng))
    except NotImplementedError:
        return None


def _picture(camera: ImagingSensor, drawn: Looks) -> Frame:
    """Return a picture of its own target, or of the kit's spot in noise; Closed if it says nothing."""
    rng = np.random.default_rng(drawn.seed)
    own = _drawn_frame(camera, _at(camera, COLUMN, ROW), rng)
    pixels = _spot() + rng.normal(size=SHAPE) if own is None else own[0]
    x = _at(camera, COLUMN, ROW)
    J, g, _ = _information(camera, x, Frame(frozen_copy(pixels)), x)
    if not J.any():
        same("score where J = 0", g, np.zeros_like(g), 1e-9, 1.0)
        demand(own is None or pixels.max() >= _saturation(camera), "information: is 0 in a frame of its own target")
        raise Closed("no pixel of the kit's picture informs: all are saturated, or it reads no pictures")
    return Frame(frozen_copy(pixels))


def _saturation(camera: ImagingSensor) -> float:
    """Return from which value on pixels say nothing, by its parameter or that of a part."""
    found = [getattr(part, "saturation", None) for part in (camera, getattr(camera, "camera", None))]
    return float(min((each for each in found if each is not None), default=np.inf))


def _plain(camera: ImagingSensor) -> bool:
    return set(camera.observes.names) <= PLAIN


def _clear(camera: ImagingSensor, drawn: Looks) -> Frame:
    """Return the kit's spot without noise for a camera that looks for one, else its own picture; Closed if none is clear."""
    frame, x = _picture(camera, drawn), _at(camera, COLUMN, ROW)
    if _plain(camera):
        frame = Frame(frozen_copy(_spot()))
    there = _information(camera, x, frame, x)[2][0]
    known = _plain(camera) and "amplitude" in camera.observes
    demand(not known or there > 0, f"llr: must be > 0 on a target as bright as expected, got {there:.4g}")
    if there < (0.0 if _plain(camera) else STANDS_OUT):
        raise Closed("its target does not stand out from what the camera takes for noise")
    return frame


def pictures_inform(sensor: Sensor, drawn: Looks) -> None:
    """Information is positive semi-definite, the score is the slope of the ratio, and dead pixels say nothing."""
    camera, x = _camera(sensor), _pair(_camera(sensor), COLUMN + 0.5, ROW - 0.3)
    none = _information(camera, x, Frame(frozen_copy(np.full(SHAPE, np.nan))), x)
    same("information of dead pixels", none[0], np.zeros_like(none[0]), 1e-12, 1.0)
    same("llr of dead pixels", none[2], np.zeros_like(none[2]), 1e-9, 1.0)
    frame = _picture(camera, drawn)
    J, g, _ = _information(camera, x, frame, x)
    same("information again", _information(camera, x, frame, x)[0], J, 0.0)
    covariance("information", J, definite=False)
    h = 1e-3
    ends = [_information(camera, x, frame, _moved(camera, x, h * step))[2] for step in (*np.eye(2), *-np.eye(2))]
    slope = np.stack([ends[0] - ends[2], ends[1] - ends[3]], axis=-1) / (2 * h)
    root = np.sqrt(np.maximum(np.trace(J, axis1=-2, axis2=-1), 1e-12))[:, None]
    otherwise = f"score: must be the slope of llr, {slope.tolist()}, got {g.tolist()}"
    demand(np.all(np.abs(g - slope) <= 1e-2 * (np.abs(slope).max() + root)), otherwise)
    otherwise = "information: must be linearised at `at`, not at the expected place"
    demand(np.any(np.abs(_information(camera, x, frame, _pair(camera, COLUMN + 1.5, ROW + 1.0))[1] - g) > 1e-9), otherwise)


def pictures_show_where(sensor: Sensor, drawn: Looks) -> None:
    """The ratio is largest where the target is, column first; dead pixels and the window's corner change nothing."""
    camera = _camera(sensor)
    frame = _clear(camera, drawn)

    def seen(of: Frame, column: float = COLUMN, row: float = ROW) -> tuple[Array, Array, Array]:
        x = _at(camera, column, row)
        return _information(camera, x, of, x)

    there = seen(frame)
    turned = Frame(frozen_copy(np.pad(frame.pixels, ((0, SHAPE[1] - SHAPE[0]), (0, 0)), mode="edge")))
    other = seen(turned, ROW, COLUMN)[2][0]
    demand(there[2][0] > other, "llr: is larger at the target's row and column exchanged: x counts columns")
    moved = seen(evolve(frame, corner=np.array([100.0, 50.0])), COLUMN + 100.0, ROW + 50.0)
    for name, got, wanted in zip(("information", "score", "llr"), moved, there, strict=True):
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
    camera = _camera(sensor)
    x = _at(camera, COLUMN, ROW)
    able = getattr(camera, "detection_probability", 1.0) == 0 or np.any(camera.detects(x) > 0)
    demand(able, "detects: is 0 of a target in the middle of a frame")
    axes = [camera.observes.axes[i] for i in _where(camera)]
    if all(axis.unit == "px" for axis in (*axes, *camera.measurement.axes)):
        same("area of a pixel in px^2", np.abs(np.linalg.det(_steps(camera, x))), np.ones(()), 1e-6)
    pixels, most = np.array(_picture(camera, drawn).pixels), _saturation(camera)
    column, row = int(COLUMN), int(ROW)
    dead, bright = pixels.copy(), pixels.copy()
    dead[:, column + 2 :] = dead[row + 2 :] = np.nan
    pairs = [("beyond the edge", dead, pixels[: row + 2, : column + 2])]
    if np.isfinite(most):
        saturated = pixels.copy()
        saturated[row, column : column + 2], bright[row, column : column + 2] = np.nan, most
        pairs.append(("saturated", saturated, bright))
    for what, lost, frame in pairs:
        wanted, found = (_information(camera, x, Frame(frozen_copy(each)), x) for each in (lost, frame))
        for name, got, said in zip(("information", "score", "llr"), found, wanted, strict=True):
            same(f"{name}, {what}", got, said, 1e-9, 1.0 + np.abs(said).max())


def a_step_leads_to_the_target(sensor: Sensor, drawn: Looks) -> None:
    """J^-1 g points from near the target to it, and stays where it is: the pixel in column 3 lies around x = 3."""
    camera = _camera(sensor)
    frame, own = _clear(camera, drawn), _plain(camera)
    for off, allowed in ((np.zeros(2), 0.25), (np.array([0.6, -0.4]), 0.5), (np.array([-0.5, 0.5]), 0.5)):
        x = _moved(camera, _at(camera, COLUMN, ROW), off)
        J, g, _ = (part[0] for part in _information(camera, x, frame, x))
        if np.linalg.eigvalsh(J)[0] < 1e-9:
            raise Closed("its frame says nothing along some direction")
        doubt = 0.0 if own else 6.0 / np.sqrt(np.linalg.eigvalsh(J)[0])
        left = float(np.linalg.norm(off + np.linalg.solve(J, g)))
        otherwise = f"score: from {off.tolist()} px beside the target, J^-1 g ends {left:.3g} px beside it"
        demand(left <= allowed + doubt, otherwise)


def noise_is_what_a_frame_leaves(sensor: Sensor, drawn: Looks) -> None:
    """The noise is about the inverse of the information in a frame of a target that looks as expected."""
    camera = _camera(sensor)
    frame, x = _picture(camera, drawn), _at(camera, COLUMN, ROW)
    J = _information(camera, x, frame, x)[0][0]
    back = np.linalg.inv(_in_px(camera, x)).reshape(2, 2)
    R = back @ np.broadcast_to(camera.noise(x), (1, 2, 2))[0] @ back.T
    share = np.linalg.eigvalsh(psd_root(J) @ R @ psd_root(J).T)
    otherwise = f"noise: must be the inverse of the information in a frame, is {share.tolist()} times that"
    demand(share[-1] >= LEAST_SHARE and share[0] <= 1 / LEAST_SHARE, otherwise)


LEAST_SHARE = 0.35
"""Of the inverse information: pixels of finite size, windows and correlated noise make the frame's own larger or smaller."""


def frames_inform_as_stated(sensor: Sensor, drawn: Looks) -> None:
    """If it draws frames: at the truth the score has mean 0 and covariance J, so that 1 / J is what an estimate is worth."""
    camera = _camera(sensor)
    count = min(drawn.runs, 250)
    x = np.repeat(_at(camera, COLUMN, ROW)[None], count, axis=0)
    pixels = _drawn_frame(camera, x[:, 0], np.random.default_rng(drawn.seed))
    if pixels is None:
        raise Closed("it draws no frames: define `draw_frame`, and J and g are tested against what it sees")
    demand(pixels.shape == (count, *SHAPE), f"draw_frame: must have shape {(count, *SHAPE)}, got {pixels.shape}")
    J, g, _ = _information(camera, x, Frame(frozen_copy(pixels)), x)
    J = np.mean(J[:, 0], axis=0)
    if np.linalg.eigvalsh(J)[0] <= 1e-12 * np.trace(J) or not J.any():
        raise Closed("no pixel of what it draws informs")
    judge_standard_normal("score, in units of J", np.linalg.solve(np.linalg.cholesky(J), g[:, 0].T).T, drawn.alpha)


def noise_speaks_for_no_target(sensor: Sensor, drawn: Looks) -> None:
    """In frames without a target the ratio is hardly ever much above 0: it exceeds L nats in e^-L of them at most."""
    camera, rng, count = _camera(sensor), np.random.default_rng(drawn.seed), min(drawn.runs, 250)
    x = np.repeat(_at(camera, COLUMN, ROW)[None], count, axis=0)
    pixels = _drawn_frame(camera, _moved(camera, x[:, 0], np.full(2, AWAY)), rng)
    pixels = rng.normal(size=(count, *SHAPE)) if pixels is None else pixels
    spoke = int(np.sum(_information(camera, x, Frame(frozen_copy(pixels)), x)[2][:, 0] > MUCH))
    most = count * binomial_band(count, np.exp(-MUCH), drawn.alpha)[1]
    told = f"llr: is above {MUCH:g} in {spoke} of {count} frames without a target, at most {most:.0f} of a likelihood ratio"
    demand(spoke <= most, told)


def a_known_level_changes_nothing(sensor: Sensor, drawn: Looks) -> None:
    """If it observes `background`: counts added to all pixels and to it change neither J, g nor llr."""
    camera = _camera(sensor)
    if "background" not in camera.observes:
        raise Closed("it observes no `background`")
    frame, x = _picture(camera, drawn), _pair(camera, COLUMN, ROW)
    brighter = np.array(x)
    brighter[..., camera.observes.names.index("background")] += 7.0
    found = _information(camera, brighter, Frame(frozen_copy(frame.pixels + 7.0)), frozen_copy(brighter))
    if not found[0].any():
        raise Closed("brighter pixels are saturated")
    for name, got, wanted in zip(("J", "g", "llr"), found, _information(camera, x, frame, x), strict=True):
        same(f"{name} of a brighter frame", got, wanted, 1e-6, 1.0 + np.abs(wanted).max())


def learning_leaves_the_place(sensor: Sensor, drawn: Looks) -> None:
    """A frame teaches how the target looks, not where it is; if the camera draws frames, no look becomes more wrong.

    If it has parameters `gain...`: each is the part of the way to the truth that a look takes in a frame.
    """
    camera = _camera(sensor)
    frame, x, where = _picture(camera, drawn), _pair(camera, COLUMN, ROW), _where(camera)
    learnt = camera.learn(x, frame)
    same("place after learning", learnt[:, where], x[:, where], 0.0)
    gains = [field.name for field in fields(type(camera)) if field.name.startswith("gain")]  # type: ignore[arg-type]
    eager = [name for name in gains if getattr(camera, name) > 0]
    demand(not eager or np.any(learnt != x), f"learn: a frame teaches nothing, and {', '.join(eager)} > 0")
    truth = np.repeat(_at(camera, *LESSON)[None], 2, axis=0)
    if (np.array_equal(learnt, x) and not gains) or _drawn_frame(camera, truth[:1, 0], np.random.default_rng(0)) is None:
        return
    half: ImagingSensor = evolve(camera, **dict.fromkeys(gains, 0.5))  # type: ignore[misc]

    def seen(state: Array) -> Array:
        return np.asarray(camera.draw_frame(state[:, 0], SMALL, np.random.default_rng(drawn.seed)))

    right = seen(truth)
    for i in sorted({*range(truth.shape[-1])} - {*where}):
        way = np.zeros(truth.shape[-1])
        way[i] = 0.002 * max(abs(truth[0, 0, i]), 0.5)
        start, thought = frozen_copy(truth + way), seen(truth + way)
        near, far = (float(np.linalg.norm(np.mean(other - right, axis=0))) for other in (thought, seen(truth + 2 * way)))
        if not 1.9 * near < far < 2.1 * near:
            continue  # its noise is another one where it sees something else
        told, other = (half.learn(start, Frame(frozen_copy(pixels))) for pixels in (right, thought))
        moved = camera.observes.difference(told, other)
        if np.any((told == other)[..., i] & (told != start)[..., i]) or np.ptp(moved[..., i]) > 0.1 * way[i]:
            continue  # noise makes it learn as much as it ever does
        taken = moved + (0.5 if gains else 1.0) * way
        left = float(np.linalg.norm(np.mean(seen(truth + taken) - right, axis=0))) / near
        told_of = f"learn: {camera.observes.names[i]}, {way[i]:.3g} off, {'half ' if gains else ''}learnt"
        demand(left <= (0.025 if gains else 1.05), f"{told_of} ends {left:.3g} of that beside where it should")


def frames_look_as_named(sensor: Sensor, drawn: Looks) -> None:
    """If it draws frames and observes `amplitude` with `spread`, or `spread_x` and `spread_y`: so high and wide is its spot.

    Its variances are those of the spreads, to which that of a pixel may add; with `correlation`, so is their covariance.
    """
    camera = _camera(sensor)
    lit = _at(camera, *LESSON)
    named = dict(zip(camera.observes.names, lit[0].tolist(), strict=True))
    across, down = (named.get(f"spread_{axis}", named.get("spread")) for axis in "xy")
    if "amplitude" not in named or across is None or down is None:
        raise Closed("it observes no `amplitude` with `spread`")
    dark = np.where(np.array(camera.observes.names) == "amplitude", 0.0, lit)
    seen, unlit = (_drawn_frame(camera, x, np.random.default_rng(drawn.seed), SMALL) for x in (lit, dark))
    light = np.full(SMALL, np.nan) if seen is None or unlit is None else seen[0] - unlit[0]
    if not np.all(np.abs(light[0]) < 0.5):
        raise Closed("it draws no frames, or its noise is another one where it sees something else")
    rows, columns = np.indices(light.shape)
    off = np.stack([columns - LESSON[0], rows - LESSON[1]])
    found = np.einsum("hw,ihw,jhw->ij", light, off, off) / np.sum(light)
    cross = named.get("correlation", 0.0) * across * down
    wanted = np.array([[across**2, cross], [cross, down**2]])
    height = np.sum(light) / (2.0 * np.pi * np.sqrt(np.linalg.det(wanted))) / named["amplitude"]
    demand(abs(height - 1.0) < 0.05, f"draw_frame: a spot is {height:.3g} times as high as its `amplitude`")
    more = found - wanted
    fits = abs(more[0, 1]) < 0.1 and np.all((np.diag(more) > -0.1) & (np.diag(more) < 0.2))
    demand(fits, f"draw_frame: a spot has the covariance {found.tolist()} px^2, must be {wanted.tolist()} by its spreads")


def a_brighter_target_is_seen_no_worse(sensor: Sensor, drawn: Looks) -> None:
    """If it observes `amplitude`: the noise of a frame does not grow with it."""
    camera = _camera(sensor)
    if "amplitude" not in camera.observes:
        raise Closed("it observes no `amplitude`")
    x, own = _pair(camera, COLUMN, ROW), np.array(camera.observes.names) == "amplitude"
    lit = [frozen_copy(np.where(own, amplitude, x)) for amplitude in (10.0, LIT)]
    dim, bright = (float(np.trace(np.broadcast_to(camera.noise(each), (2, 2, 2))[0])) for each in lit)
    demand(bright <= dim * (1 + 1e-9), f"noise: grows from {dim:.3g} to {bright:.3g} with 4 times the amplitude")


LAWS = (
    *map(Law, (pictures_inform, pictures_show_where, unseen_pixels_are_as_dead_ones, a_step_leads_to_the_target)),
    Law(noise_is_what_a_frame_leaves),
    Law(frames_inform_as_stated, effort="statistical"),
    Law(noise_speaks_for_no_target, effort="statistical"),
    *map(Law, (a_known_level_changes_nothing, learning_leaves_the_place, a_brighter_target_is_seen_no_worse)),
    Law(frames_look_as_named, effort="long"),
)
