"""A filter on pixels whose noise is correlated over time: each frame is whitened by the one before."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import (
    Array,
    Detections,
    Frame,
    Gaussian,
    ImagingSensor,
    Innovation,
    MotionModel,
    Sensor,
    Traits,
    fields,
    kernels,
)
from vedette.filters import Hypotheses, OverMotion, embedded, evaluate_linearised, make_innovation, marginal
from vedette_flir.camera import Window, cut
from vedette_flir.sensors.image_model import FittedImage

MARGIN = 4
"""Pixels beyond the window that are kept of a frame on each side: a target that moves farther finds none of them again."""


@frozen(eq=False)
class Remembered:
    """State now and at the last frame, as one Gaussian (*b, t, 2n); that frame's `pixels` (*b, t, k, k), NaN where unseen,
    the first of them at `corner` (*b, t, 2); `elapsed` s since then (*b, t).
    """

    both: Gaussian
    pixels: Array
    corner: Array
    elapsed: Array


@frozen(eq=False)
class Whitened:
    """The state's hypotheses, and the frame that is remembered from now on; None where there was no frame."""

    own: Hypotheses
    pixels: Array | None
    corner: Array | None


@final
@frozen
class WhitenedFilter(OverMotion[Remembered]):
    """The iterated extended Kalman filter on z_k - r z_{k-1}, r = exp(-dt / memory), pixel by pixel, whose noise is white.

    Noise that is a first-order Gauss-Markov process over time leaves sigma^2 (1 - r^2), for the image h(x_k) - r h(x_{k-1}).
    Both states are estimated together, so the doubt of the last one counts: D = [h'(x_k), -r h'(x_{k-1})]. A pixel that the
    last frame did not show has noise sigma^2 and no part of the last state. For cameras that are white over space and stand
    still: a pixel's noise must stay with its place in the frame.
    Bryson, Henrikson, Estimation Using Sampled Data Containing Sequentially Correlated Noise, J. Spacecraft 5, 1968.

    >>> from vedette_flir.camera import Camera
    >>> from vedette_flir.motion.constant_axes import Carrying
    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> from vedette_flir.sensors.gaussian_spot import GaussianSpot
    >>> from vedette_standard import IteratedExtendedKalman
    >>> motion = Carrying(ImageVelocity(1.0, 2.0), {"amplitude": "count", "spread": "px", "background": "count"})
    >>> camera, noise = GaussianSpot(camera=Camera(20.0, window=12)), np.random.default_rng(1).normal(0.0, 20.0, (40, 40))
    >>> def frame(x, y):  # the same noise in both frames
    ...     return Frame(camera.render(np.array([x, y, 60.0, 1.5, 10.0]), (40, 40)) + 10.0 + noise)
    >>> state = np.array([[20.0, 18.0, 3.0, -2.0, 60.0, 1.5, 10.0]])
    >>> prior, errors = Gaussian(state, np.diag([0.01, 0.01, 4.0, 4.0, 0.0, 0.0, 0.0])[None]), []
    >>> for tracker in (WhitenedFilter(motion, memory=50.0, passes=5, window=12), IteratedExtendedKalman(motion)):
    ...     belief = tracker.start(prior, tracker.state, None)
    ...     belief = tracker.update(belief, tracker.evaluate(belief, camera, frame(20.0, 18.0), 1.0), np.array([[0.0, 1.0]]))
    ...     belief = tracker.predict(belief, 0.5, None)
    ...     seen = tracker.evaluate(belief, camera, frame(22.3, 16.4), 1.0)
    ...     found = tracker.moments(tracker.update(belief, seen, np.array([[0.0, 1.0]])))
    ...     errors.append((abs(found.mean[0, :2] - [22.3, 16.4]).max() < 0.02, np.sqrt(found.cov[0, 0, 0]) < 0.05))
    >>> [tuple(map(bool, one)) for one in errors]  # the filter that takes it for white is far off, and less sure
    [(True, True), (False, False)]
    """

    kind: ClassVar[str] = "whitened_filter"
    declares: ClassVar[Traits] = Traits(takes_frames=True)

    motion: MotionModel = fields.part("how the target moves")
    memory: float = fields.quantity("s", "correlation time of a pixel's noise", above=0)
    passes: int = fields.integer("linearisations of each frame", default=3, at_least=1, at_most=100)
    window: int = fields.integer("pixels along each side of the camera's window", default=8, at_least=4, at_most=64)

    def refuses(self, sensor: Sensor) -> str | None:
        """Refuse cameras without an image model, with another window, or whose noise is correlated over space."""
        if isinstance(sensor, ImagingSensor) and not isinstance(sensor, FittedImage):
            return "it has no model of the target's image, by which this filter whitens a frame"
        if isinstance(sensor, FittedImage) and sensor.camera.correlated > 0:
            return "its noise is correlated over space: this filter whitens over time alone"
        if isinstance(sensor, FittedImage) and sensor.camera.window != self.window:
            return f"its window is {sensor.camera.window} pixels, and this filter's {self.window}"
        return None

    def start(self, prior: Gaussian, axes: Any, rng: np.random.Generator) -> Remembered:
        """Return the prior's marginal over the filter's axes, and no frame."""
        located = marginal(prior, axes, self.state, self.zero_variance)
        side, tracks = self.window + 2 * MARGIN, located.mean.shape[:-1]
        return Remembered(_twice(located), np.full((*tracks, side, side), np.nan), np.zeros((*tracks, 2)), np.zeros(tracks))

    def reframe(self, belief: Remembered, combined: Gaussian) -> Remembered:
        """Return the belief in the motion's frame, with which the last frame's state shares nothing: it is forgotten."""
        reframed = _twice(self.motion.reframe(self.moments(belief), combined))
        return evolve(belief, both=reframed, pixels=np.full_like(belief.pixels, np.nan))

    def predict(self, belief: Remembered, dt: float, rng: np.random.Generator) -> Remembered:
        """Return the state `dt` s later, together with that at the last frame."""
        if dt == 0:
            return belief
        n = len(self.state)
        mean, P = belief.both.mean.copy(), belief.both.cov
        x = mean[..., :n]
        step = np.broadcast_to(np.eye(2 * n), P.shape).copy()
        step[..., :n, :n] = self.motion.jacobian(x, dt)
        noise = np.zeros(P.shape)
        noise[..., :n, :n] = self.motion.mean_noise(x, P[..., :n, :n], dt)
        mean[..., :n] = self.state.canonical(self.motion.move(x, dt))
        return evolve(belief, both=Gaussian(mean, kernels.propagate(P, step, noise)), elapsed=belief.elapsed + dt)

    def cross_covariance(self, belief: Remembered, dt: float) -> Array:
        """Return P F' (*b, t, n, n)."""
        moments = self.moments(belief)
        return moments.cov @ np.swapaxes(self.motion.jacobian(moments.mean, dt), -1, -2)

    def evaluate(self, belief: Remembered, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track: of a frame whitened by the last one, or of returns as they are."""
        if not isinstance(observed, Frame):
            plain = evaluate_linearised(self.moments(belief), self.state, sensor, observed, p_gate)
            return evolve(plain, detail=Whitened(plain.detail, None, None))
        assert isinstance(sensor, FittedImage)
        n, where = len(self.state), self.state.locate(sensor.observes)
        x = belief.both.mean[..., where]
        H = np.zeros((*x.shape[:-1], 4, 2 * n))
        H[..., :2, :n] = H[..., 2:, n:] = embedded(sensor.jacobian(x), where, n)
        cross = belief.both.cov @ np.swapaxes(H, -1, -2)
        S = H @ cross
        window, before = sensor.camera.cut(observed, sensor.measure(x)), belief.both.mean[..., n:][..., where]
        earlier = self._earlier(belief, window)
        at = np.stack([x, before], axis=-2)
        expected = sensor.measure(at).reshape(*x.shape[:-1], 4)
        for _ in range(self.passes):
            J, g, llr = self._information(sensor, window, earlier, at, belief.elapsed)
            away = sensor.measure(at).reshape(expected.shape) - expected
            q = g + (J @ away[..., None])[..., 0]
            shrink = np.linalg.inv(np.eye(4) + J @ S)
            pull = (shrink @ q[..., None])[..., 0]
            shift = (cross @ pull[..., None])[..., 0]
            at = np.stack([x + shift[..., where], before + shift[..., n:][..., where]], axis=-2)
        gain = cross @ shrink
        keep = np.eye(2 * n) - gain @ J @ H
        post = kernels.symmetric(keep @ belief.both.cov @ np.swapaxes(keep, -1, -2) + gain @ J @ np.swapaxes(gain, -1, -2))
        moved = shift[..., :n].copy()
        moved[..., where] += sensor.learn(at[..., 0, :], observed) - at[..., 0, :]
        kept = cut(observed, sensor.measure(at[..., 0, :]), self.window + 2 * MARGIN)
        own = Hypotheses(moved[..., None, :], post[..., None, :n, :n])
        return self._innovation(sensor, x, p_gate, (J, S, q, pull, g, away, llr), Whitened(own, _masked(kept), kept.first))

    def update(self, belief: Remembered, innovation: Innovation, weights: Array) -> Remembered:
        """Return the state's posterior moments, which are also those at the frame that is remembered from now on."""
        detail: Whitened = innovation.detail
        moments = self.moments(belief)
        after = kernels.weighted_update(
            moments.mean, moments.cov, detail.own.shift, detail.own.post, weights, self.state.periods
        )
        if detail.pixels is None or detail.corner is None:
            return evolve(belief, both=_twice(after), pixels=np.full_like(belief.pixels, np.nan))
        return Remembered(_twice(after), detail.pixels, detail.corner, np.zeros(after.mean.shape[:-1]))

    def moments(self, belief: Remembered) -> Gaussian:
        """Return the state now."""
        n = len(self.state)
        return Gaussian(belief.both.mean[..., :n], belief.both.cov[..., :n, :n])

    def _information(
        self, sensor: FittedImage, window: Window, earlier: Array, at: Array, elapsed: Array
    ) -> tuple[Array, Array, Array]:
        """Return J (*b, t, 4, 4) and g (*b, t, 4) over both apparent places, and the log ratio to an empty frame."""
        now, then = at[..., 0, :], at[..., 1, :]
        made, last = (sensor.picture(sensor.looks(one), *window.offsets(sensor.measure(one))) for one in (now, then))
        levels = [sensor.looks(one)[-1][..., None, None] for one in (now, then)]
        known = ~np.isnan(earlier)
        r = np.where(known, np.exp(-elapsed / self.memory)[..., None, None], 0.0)
        empty = window.values - levels[0] - r * (np.where(known, earlier, 0.0) - levels[1] - last.image)
        weight = np.where(window.seen, 1.0 / (sensor.camera.sigma**2 * (1.0 - r**2)), 0.0)
        slopes = np.concatenate([made.slopes, -r[..., None, :, :] * last.slopes], axis=-3)
        D = slopes.reshape(*slopes.shape[:-2], -1)
        rest, flat = (empty - made.image).reshape(*D.shape[:-2], -1), weight.reshape(*D.shape[:-2], -1)
        weighed = D * flat[..., None, :]
        llr = 0.5 * np.sum(weight * (empty**2 - (empty - made.image) ** 2), axis=(-1, -2))
        return kernels.symmetric(weighed @ np.swapaxes(D, -1, -2)), (weighed @ rest[..., None])[..., 0], llr

    def _earlier(self, belief: Remembered, window: Window) -> Array:
        """Return the last frame's pixels in the window (*b, t, w, w), NaN where it shows none."""
        steps, side = np.arange(window.values.shape[-1]), belief.pixels.shape[-1]
        away = np.rint(window.first - belief.corner).astype(np.intp)
        columns, rows = (away[..., i, None] + steps for i in (0, 1))
        inside = ((rows >= 0) & (rows < side))[..., :, None] & ((columns >= 0) & (columns < side))[..., None, :]
        pixels = np.take_along_axis(belief.pixels, rows.clip(0, side - 1)[..., :, None], axis=-2)
        pixels = np.take_along_axis(pixels, columns.clip(0, side - 1)[..., None, :], axis=-1)
        return np.where(inside & window.seen, pixels, np.nan)

    def _innovation(self, sensor: Sensor, x: Array, p_gate: float, parts: tuple[Array, ...], detail: Whitened) -> Innovation:
        """Return the innovation as `vedette.filters.evaluate_frame` makes it."""
        J, S, q, pull, g, away, llr = parts
        log_det = np.linalg.slogdet(np.eye(4) + J @ S)[1]
        spread = np.sum((S @ pull[..., None])[..., 0] * q, axis=-1)
        likely = llr - np.sum((g + 0.5 * (J @ away[..., None])[..., 0]) * away, axis=-1) + 0.5 * spread - 0.5 * log_det
        # Half of it, as J^-1 q has four components where it sees both places, and the gate and NIS reckon with two.
        rank = np.linalg.matrix_rank(J, hermitian=True)
        distance = np.sum((np.linalg.pinv(J, hermitian=True) @ q[..., None])[..., 0] * pull, axis=-1)
        distance = distance * 2.0 / np.maximum(rank, 2)
        in_view = np.any(J != 0, axis=(-1, -2))
        volume = 0.5 * (log_det - kernels.safe_log(np.linalg.det(J[..., :2, :2])))
        return make_innovation(sensor, x, p_gate, likely[..., None], distance[..., None], volume[..., None], detail, in_view)


def _twice(moments: Gaussian) -> Gaussian:
    """Return one state as two that are equal: (*b, t, n) -> (*b, t, 2n)."""
    twin = np.concatenate([moments.cov, moments.cov], axis=-1)
    return Gaussian(np.concatenate([moments.mean, moments.mean], axis=-1), np.concatenate([twin, twin], axis=-2))


def _masked(window: Window) -> Array:
    return np.where(window.seen, window.values, np.nan)
