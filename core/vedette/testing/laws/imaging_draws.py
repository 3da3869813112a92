"""Laws of cameras that draw frames, and of how they learn their target's looks."""

from __future__ import annotations

import numpy as np
from attrs import fields

from vedette.roles import Sensor
from vedette.space import Array
from vedette.testing.bands import binomial_band, judge_standard_normal
from vedette.testing.comparisons import Closed, closed_if, demand, frozen_copy, same, varied
from vedette.testing.law import Law
from vedette.testing.laws import imaging_cases as cases
from vedette.testing.laws.imaging_cases import AWAY, COLUMN, LESSON, MUCH, ROW, SHAPE, SMALL
from vedette.testing.laws.sensor_cases import Looks
from vedette.types import Frame


def frames_inform_as_stated(sensor: Sensor, drawn: Looks) -> None:
    """If it draws frames: at the truth the score has mean 0 and covariance J, so that 1 / J is what an estimate is worth.

    If it is `conservative`, that covariance is J at most.
    """
    camera = cases.camera_of(sensor)
    count = min(drawn.runs, 160)
    x = np.repeat(cases.state_at(camera, COLUMN, ROW)[None], count, axis=0)
    pixels = cases.drawn_frame(camera, x[:, 0], np.random.default_rng(drawn.seed))
    if pixels is None:
        raise Closed("it draws no frames: define `draw_frame`, and J and g are tested against what it sees")
    demand(pixels.shape == (count, *SHAPE), f"draw_frame: must have shape {(count, *SHAPE)}, got {pixels.shape}")
    J, g, _ = cases.informed(camera, x, Frame(frozen_copy(pixels)), x)
    J = np.mean(J[:, 0], axis=0)
    closed_if(np.linalg.eigvalsh(J)[0] <= 1e-12 * np.trace(J) or not J.any(), "no pixel of what it draws informs")
    white, cautious = np.linalg.solve(np.linalg.cholesky(J), g[:, 0].T).T, getattr(sensor, "conservative", False)
    judge_standard_normal("score, in units of J", white, drawn.alpha, cautious)


def noise_speaks_for_no_target(sensor: Sensor, drawn: Looks) -> None:
    """In frames without a target the ratio is hardly ever much above 0: it exceeds L nats in e^-L of them at most."""
    camera, rng, count = cases.camera_of(sensor), np.random.default_rng(drawn.seed), min(drawn.runs, 160)
    x = np.repeat(cases.state_at(camera, COLUMN, ROW)[None], count, axis=0)
    pixels = cases.drawn_frame(camera, cases.shifted(camera, x[:, 0], np.full(2, AWAY)), rng)
    pixels = rng.normal(size=(count, *SHAPE)) if pixels is None else pixels
    spoke = int(np.sum(cases.informed(camera, x, Frame(frozen_copy(pixels)), x)[2][:, 0] > MUCH))
    most = count * binomial_band(count, np.exp(-MUCH), drawn.alpha)[1]
    told = f"llr: is above {MUCH:g} in {spoke} of {count} frames without a target, at most {most:.0f} of a likelihood ratio"
    demand(spoke <= most, told)


def learning_leaves_the_place(sensor: Sensor, drawn: Looks) -> None:
    """A frame teaches how the target looks, not where it is; if the camera draws frames, no look becomes more wrong.

    If it has parameters `gain...`: each is the part of the way to the truth that a look takes in a frame.
    """
    camera = cases.camera_of(sensor)
    frame, x, where = cases.picture(camera, drawn), cases.pair(camera, COLUMN, ROW), cases.places(camera)
    learnt = camera.learn(x, frame)
    same("place after learning", learnt[:, where], x[:, where], 0.0)
    looks = set(camera.observes.names) > {"x", "y"}
    gains = [field.name for field in fields(type(camera)) if looks and field.name.startswith("gain")]  # type: ignore[arg-type]
    eager = [name for name in gains if getattr(camera, name) > 0]
    demand(not eager or np.any(learnt != x), f"learn: a frame teaches nothing, and {', '.join(eager)} > 0")
    truth = np.repeat(cases.state_at(camera, *LESSON)[None], 2, axis=0)
    drawn_one = cases.drawn_frame(camera, truth[:1, 0], np.random.default_rng(0))
    if drawn_one is None or (np.array_equal(learnt, x) and not gains):
        return
    half = varied(camera, **dict.fromkeys(gains, 0.5))

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
    camera = cases.camera_of(sensor)
    lit = cases.state_at(camera, *LESSON)
    named = dict(zip(camera.observes.names, lit[0].tolist(), strict=True))
    across, down = (named.get(f"spread_{axis}", named.get("spread")) for axis in "xy")
    if "amplitude" not in named or across is None or down is None:
        raise Closed("it observes no `amplitude` with `spread`")
    dark = np.where(np.array(camera.observes.names) == "amplitude", 0.0, lit)
    seen, unlit = (cases.drawn_frame(camera, x, np.random.default_rng(drawn.seed), SMALL) for x in (lit, dark))
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


LAWS = (
    Law(learning_leaves_the_place, share=2),
    Law(frames_inform_as_stated, effort="statistical"),
    Law(noise_speaks_for_no_target, effort="statistical"),
    Law(frames_look_as_named, effort="long"),
)
