"""Filters that know their target by its appearance in an image, and measure where it is found again."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Generic, TypeVar

import attrs
import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, Traits, fields, kernels
from vedette.filters import (
    Hypotheses,
    OverMotion,
    embedded,
    evaluate_linearised,
    make_innovation,
    marginal,
    without_variance,
)

MOST = 60.0
"""Greatest log-likelihood ratio of a match."""

WEAK = 40.0
"""How fast that falls as a match falls below the limit. Faster, and two smeared frames are misses that widen the search."""


@frozen(eq=False)
class Appearance:
    """The appearance of targets; `known` (*b, t) is 0 before their first frame, then 1. Every array leads with (*b, t).

    What `of_frame` names is renewed by each frame, whether or not it shows the target.
    """

    of_frame: ClassVar[tuple[str, ...]] = ()

    known: Array


L = TypeVar("L", bound=Appearance)


@frozen(eq=False)
class AppearanceBelief(Generic[L]):
    """Position and appearance of the targets."""

    position: Gaussian
    appearance: L


@frozen(eq=False)
class AppearanceHypotheses(Generic[L]):
    """Position and appearance updated by a frame."""

    position: Hypotheses
    appearance: L


@frozen(eq=False)
class Match(Generic[L]):
    """Where one target was found: the residual (2,) in px, the log-likelihood ratio, and its appearance there."""

    residual: Array
    ratio: float
    appearance: L


@frozen
class AppearanceFilter(OverMotion[AppearanceBelief[L]], Generic[L]):
    """A Kalman filter that takes its measurement from a search for the target: R = sigma^2 I."""

    declares: ClassVar[Traits] = Traits(takes_frames=True)

    motion: MotionModel = fields.part("how the target moves; its zero-variance axes hold `width` and `height`")
    sigma: float = fields.quantity("px", "standard deviation of a match", default=1.0, above=0)

    def __attrs_post_init__(self) -> None:
        for name in ("width", "height"):
            if name not in self.motion.zero_variance:
                raise ValueError(f"motion: must carry the axis {name!r} in px, as the motion 'carrying' does")

    @abstractmethod
    def unseen(self, tracks: tuple[int, ...]) -> L:
        """Return the appearance of targets that have not been seen yet."""

    @abstractmethod
    def first(self, pixels: Array, where: Array, box: Array) -> L:
        """Return the appearance of one target, without leading axes: `pixels` (h, w), its place and box (2,) in px."""

    @abstractmethod
    def find(self, pixels: Array, where: Array, box: Array, S: Array, appearance: L) -> Match[L]:
        """Return one target found again, expected at `where` with covariance S (2, 2)."""

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> AppearanceBelief[L]:
        """Return the prior's marginal over the filter's axes, and no appearance yet."""
        return AppearanceBelief(marginal(prior, axes, self.state, self.zero_variance), self.unseen(prior.mean.shape[:-1]))

    def reframe(self, belief: AppearanceBelief[L], combined: Gaussian) -> AppearanceBelief[L]:
        """Return the position in the motion's frame of the `combined` estimate; the appearance stays."""
        return evolve(belief, position=self.motion.reframe(belief.position, combined))

    def predict(self, belief: AppearanceBelief[L], dt: float, rng: np.random.Generator) -> AppearanceBelief[L]:
        """Return the position `dt` s later; the appearance stays."""
        if dt == 0:
            return belief
        x = belief.position.mean
        cov = kernels.propagate(belief.position.cov, self.motion.jacobian(x, dt), self.motion.noise(x, dt))
        return evolve(belief, position=Gaussian(self.motion.move(x, dt), cov))

    def evaluate(
        self, belief: AppearanceBelief[L], sensor: Sensor, observed: Detections | Frame, p_gate: float
    ) -> Innovation:
        """Find each target again, and return that as one detection; detections carry no appearance."""
        if not isinstance(observed, Frame):
            plain = evaluate_linearised(belief.position, self.state, sensor, observed, p_gate)
            return evolve(plain, detail=AppearanceHypotheses(plain.detail, belief.appearance))
        where = self.state.locate(sensor.observes)
        x = belief.position.mean[..., where]
        H = embedded(sensor.jacobian(x), where, len(self.state))
        nu, llr, appearance = self._find(
            belief, sensor.measure(x), H @ belief.position.cov @ np.swapaxes(H, -1, -2), observed
        )
        R = np.broadcast_to(self.sigma**2 * np.eye(2), (*llr.shape, 1, 2, 2))
        _, distance, log_volume, shift, post = kernels.evaluate(belief.position.cov, nu[..., None, :], H, R)
        detail = AppearanceHypotheses(Hypotheses(shift, post), appearance)
        return make_innovation(sensor, x, p_gate, llr[..., None], distance, log_volume, detail)

    def update(self, belief: AppearanceBelief[L], innovation: Innovation, weights: Array) -> AppearanceBelief[L]:
        """Return position and appearance, each updated as likely as the frame shows the target; a first one fully."""
        detail: AppearanceHypotheses[L] = innovation.detail
        step, cov = kernels.mixture(belief.position.cov, detail.position.shift, detail.position.post, weights)
        cov = without_variance(cov, self.state.locate(self.zero_variance))
        part = np.where(belief.appearance.known > 0, 1.0 - weights[..., 0], 1.0)
        appearance = _between(belief.appearance, detail.appearance, part)
        return AppearanceBelief(Gaussian(self.state.displace(belief.position.mean, step), cov), appearance)

    def moments(self, belief: AppearanceBelief[L]) -> Gaussian:
        """Return the position."""
        return belief.position

    def _find(self, belief: AppearanceBelief[L], expected: Array, S: Array, frame: Frame) -> tuple[Array, Array, L]:
        """Return residuals (*b, t, 2), log-likelihood ratios (*b, t) and new appearances, track by track as grids differ."""
        names = self.state.names
        box = np.stack([belief.position.mean[..., names.index(name)] for name in ("width", "height")], axis=-1)
        tracks = expected.shape[:-1]
        corner = np.zeros(2) if frame.corner is None else frame.corner
        pixels = np.broadcast_to(frame.pixels[..., None, :, :], (*tracks, *frame.pixels.shape[-2:]))
        start = np.broadcast_to(corner[..., None, :], expected.shape)
        nu, llr = np.zeros(expected.shape), np.full(tracks, MOST)
        appearance = _each(belief.appearance, np.array)
        for one in np.ndindex(tracks):
            where, image = expected[one] - start[one], known_pixels(pixels[one])
            if appearance.known[one] == 0:
                found = self.first(image, where, box[one])
            else:
                match = self.find(image, where, box[one], S[one], _each(appearance, lambda array, one=one: array[one]))
                nu[one], llr[one], found = match.residual, match.ratio, match.appearance
            for field in attrs.fields(type(appearance)):
                getattr(appearance, field.name)[one] = getattr(found, field.name)
        return nu, llr, appearance


def known_pixels(pixels: Array) -> Array:
    """Return the frame with the median where a pixel is unknown; 0 where all are."""
    if not np.issubdtype(pixels.dtype, np.floating) or not np.isnan(pixels).any():
        return pixels
    known = ~np.isnan(pixels)
    return np.where(known, pixels, np.median(pixels[known]) if known.any() else 0.0)


def match_ratio(match: float, limit: float, independent: float) -> float:
    """Return (n / 2) log[(1 - limit^2) / (1 - match^2)], n cells, at most 60; below the limit 40 (match / limit - 1)."""
    if match < limit:
        return WEAK * (match / limit - 1.0)
    ratio = 0.5 * independent * float(np.log((1.0 - limit**2) / max(1.0 - match**2, 1e-12)))
    return min(ratio, MOST)


def _each(appearance: L, change: Any) -> L:
    """Return an appearance with `change` applied to every array."""
    return type(appearance)(
        **{field.name: change(getattr(appearance, field.name)) for field in attrs.fields(type(appearance))}
    )


def _between(old: L, new: L, part: Array) -> L:
    """Return every array moved by the fraction `part` (*b, t) from `old` to `new`; those `of_frame` are new."""

    def between(a: Array, b: Array) -> Array:
        share = part.reshape(part.shape + (1,) * (a.ndim - part.ndim))
        return np.asarray(a + share * (b - a))

    values = {field.name: (getattr(old, field.name), getattr(new, field.name)) for field in attrs.fields(type(old))}
    return type(old)(**{name: each[1] if name in old.of_frame else between(*each) for name, each in values.items()})
