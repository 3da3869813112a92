"""Laws of estimators that take frames, on pictures of a target with two bright ends, which moves."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields, kernels
from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.space import Array, Space
from vedette.supporting import ImagingSensor
from vedette.testing.comparisons import closed_if, demand, finite, frozen_copy
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike, not_refused
from vedette.testing.states import sizes
from vedette.types import Frame, Gaussian

SHAPE, LEVEL, DARK, LIT, SPREAD = (32, 60), 100.0, 3.0, 40.0, 1.2
"""Rows and columns; counts of the background, in noise of 1, of a dark patch in it and of a bright end; its spread in px."""
SHARES, SIDES = np.array([[1.0], [0.6]]), np.array([[-1.0], [1.0]])
"""How bright the ends are, and on which side."""
LOOKS = {"width": 24.0, "height": 10.0, "amplitude": LIT, "spread": SPREAD, "background": LEVEL}
FRAMES, STEP, NEAR = 5, np.array([2.4, -1.2]), (1.0, 5.0)
"""Frames, what the target moves from one to the next, and how near a track must be, or a `conservative` one, in px."""


@final
@frozen(eq=False)
class Picture(ImagingSensor):
    """A camera that knows how the kit's target looks, and sees it at x, y."""

    kind: ClassVar[str] = "kit_picture"
    linear: ClassVar[bool] = True
    measurement: ClassVar[Space] = Space.of(x="px", y="px")

    observes: Space = fields.part("x and y")
    reach: float = fields.quantity("px", "columns from the middle of the target to its ends", at_least=0)

    def measure(self, x: Array) -> Array:
        return x

    def jacobian(self, x: Array) -> Array:
        return np.eye(2)

    def noise(self, x: Array) -> Array:
        return np.asarray(2.0 / (np.pi * LIT**2 * np.sum(SHARES**2)) * np.eye(2))

    def detects(self, x: Array) -> Array:
        return np.asarray(0.9)

    def picture(self, at: Array) -> tuple[Array, Array]:
        """Return the target without background (*b, h, w), and its slopes to x and y (*b, 2, h, w)."""
        rows, columns = (np.arange(side) for side in SHAPE)
        dy, dx = rows - at[..., 1:], columns - at[..., :1, None] - self.reach * SIDES
        down, ends = LIT * np.exp(-(dy**2) / (2 * SPREAD**2)), SHARES * np.exp(-(dx**2) / (2 * SPREAD**2))
        across, along = ends.sum(axis=-2), (dx * ends).sum(axis=-2)
        slopes = [down[..., None] * along[..., None, :], (dy * down)[..., None] * across[..., None, :]]
        return down[..., None] * across[..., None, :], np.stack(slopes, axis=-3) / SPREAD**2

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        empty = frame.pixels[..., None, :, :] - LEVEL
        seen, (image, slopes) = ~np.isnan(empty), self.picture(at)
        empty, rest = (np.where(seen, each, 0.0) for each in (empty, empty - image))
        D = (slopes * seen[..., None, :, :]).reshape(*at.shape, -1)
        llr = 0.5 * np.sum(empty**2 - rest**2, axis=(-1, -2))
        return D @ np.swapaxes(D, -1, -2), (D @ rest.reshape(*at.shape[:-1], -1, 1))[..., 0], llr


def _begin(estimator: Estimator[Any], drawn: Scene) -> tuple[Picture, Gaussian, Array]:
    """Return the kit's camera, where a track of each run (2, 1) starts, and where its target is in each frame (f, 2, 2)."""
    state, rng = estimator.state, drawn.rng()
    closed_if(not all(name in state for name in ("x", "y")), "its state has no x and y, where the kit's camera would see it")
    camera = Picture(Space(tuple(state.axes[state.names.index(name)] for name in ("x", "y"))), (8.5, 0.0)[drawn.seed % 2])
    not_refused(estimator, camera, "camera")
    moves = STEP * ("vx" in state)
    path = np.array([26.0, 16.0]) + rng.uniform(-2.0, 2.0, (2, 2)) + moves * np.arange(FRAMES)[:, None, None]
    mean, deviation = np.zeros((2, 1, len(state))), 1e-3 * sizes(state)
    for i, name in enumerate(state.names):
        mean[..., i] = LOOKS.get(name, 0.0)
        if name in ("x", "y"):
            mean[:, 0, i], deviation[i] = path[0, :, "xy".index(name)] + rng.uniform(-0.6, 0.6, 2), 1.0
        elif name in ("vx", "vy"):
            mean[..., i], deviation[i] = moves["xy".index(name[1])] / drawn.dt, 0.2 / drawn.dt
    deviation[state.locate(estimator.zero_variance)] = 0.0
    cov = np.broadcast_to(np.diag(deviation**2), (2, 1, *[len(state)] * 2))
    return camera, Gaussian(frozen_copy(mean), frozen_copy(cov)), path


def _after(estimator: Estimator[Any], camera: Picture, belief: Any, pixels: Array) -> tuple[Any, Array]:
    """Return the belief after a frame, weighted by what it says, and the log ratio (b, t) of seen to missed."""
    found = estimator.evaluate(belief, camera, Frame(frozen_copy(pixels)), P_GATE)
    whole = not np.isnan(found.loglik).any() and np.all(np.isfinite(found.loglik[..., 0]))
    demand(whole, f"loglik: is {found.loglik.tolist()}")
    after = estimator.update(belief, found, kernels.softmax(found.loglik))
    finite("mean after a frame", estimator.moments(after).mean)
    return after, found.loglik[..., 1] - found.loglik[..., 0]


def frames_show_the_target(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it takes frames: it follows a target that they show, says so, and of one that they do not show says otherwise.

    Runs in one batch are as each alone, and a frame without a known pixel says nothing.
    """
    camera, prior, path = _begin(estimator, drawn)
    noise = drawn.rng().standard_normal((FRAMES + 1, 2, *SHAPE)) + LEVEL
    start = np.mgrid[: SHAPE[0], : SHAPE[1]] - path[0, 0, ::-1, None, None]
    dark = DARK * np.exp(-np.sum(start**2, axis=0) / 200.0)  # where it starts, and where it soon leaves
    pixels = noise[:-1] + camera.picture(path)[0] - dark
    ends = []
    for own in (slice(0, 2), slice(0, 1)):
        rng = drawn.rng()
        belief = estimator.start(Gaussian(prior.mean[own], prior.cov[own]), estimator.state, rng)
        for frame in range(FRAMES):
            belief = predicted(estimator, belief, drawn.dt, rng) if frame else belief
            belief, ratio = _after(estimator, camera, belief, pixels[frame, own])
            ends.append(estimator.moments(belief))
            if own.stop == frame == 1:
                alike(estimator, Gaussian(ends[1].mean[:1], ends[1].cov[:1]), ends[-1], 1e-6, "of two runs, the first: ")
                return
        end = ends[-1]
        _, empty = _after(estimator, camera, belief, noise[-1])
        told = f"loglik: speaks no more for the target that a frame shows, {ratio.tolist()}, than without, {empty.tolist()}"
        demand(np.all(empty < ratio), told)
        away = end.mean[:, 0, estimator.state.locate(camera.observes)] - path[-1]
        told = f"mean: after {FRAMES} frames is {away.tolist()} px from the target"
        demand(np.all((np.abs(away) < NEAR[estimator.traits.conservative]) | (ratio < 0)), told)
        dead, _ = _after(estimator, camera, belief, np.full((2, *SHAPE), np.nan))
        alike(estimator, dead, end, 1e-6, "after a frame of unknown pixels: ")


def frames_are_compared_with_the_first(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it takes frames: a fainter copy of one says no more for the target, and an empty one after a flat one none."""
    camera, prior, path = _begin(estimator, drawn)
    begin = estimator.start(prior, estimator.state, drawn.rng())
    one, other = drawn.rng().standard_normal((2, 2, *SHAPE)) + LEVEL
    target = camera.picture(path[0])[0]
    belief, _ = _after(estimator, camera, begin, one + target)
    again, faint = (_after(estimator, camera, belief, other + share * target)[1] for share in (1.0, 0.8))
    told = f"loglik: speaks more for the target when it is fainter, {faint.tolist()}, than before, {again.tolist()}"
    demand(np.all(faint <= again), told)
    belief, _ = _after(estimator, camera, begin, np.full((2, *SHAPE), LEVEL))
    _, ratio = _after(estimator, camera, belief, other)
    demand(np.all(ratio <= 0), f"loglik: after a flat frame an empty one speaks for the target, by {ratio.tolist()}")


# Pictures cost much, and show a fault in nearly every example: a quarter of the examples caught the same mutants.
_TWO = (frames_show_the_target, frames_are_compared_with_the_first)
LAWS = tuple(Law(law, needs="traits.takes_frames", share=4) for law in _TWO)
