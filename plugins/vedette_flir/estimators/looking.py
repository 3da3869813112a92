"""What the filters share that know their target by how it looks, and measure where it is found again."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, TypeVar

import attrs
import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, fields, kernels
from vedette.filters.gaussian import Hypotheses, joined, linearised, own_part, without_variance

MOST = 60.0
"""The largest log-likelihood ratio that a match gives."""


@frozen(eq=False)
class Look:
    """How targets look; `known` (*b, t) is 0 before their first frame, then 1. Every array leads with (*b, t)."""

    known: Array


L = TypeVar("L", bound=Look)


@frozen(eq=False)
class LookBelief(Generic[L]):
    """Where the targets are, and how they look."""

    spot: Gaussian
    look: L


@frozen(eq=False)
class LookHypothesis(Generic[L]):
    """What a frame does to position and look."""

    spot: Hypotheses
    look: L


@frozen(eq=False)
class Match(Generic[L]):
    """Where one target was found, as the residual (2,) in px, the log-likelihood ratio, and how it looks now."""

    residual: Array
    ratio: float
    look: L


@frozen
class LookingFilter(Estimator[LookBelief[L]], Generic[L]):
    """A Kalman filter behind a search for the target: R = sigma^2 I."""

    motion: MotionModel = fields.part("how the target moves; its zero-variance axes hold `width` and `height`")
    sigma: float = fields.quantity("px", "standard deviation of a match", default=1.0, above=0)

    def __attrs_post_init__(self) -> None:
        for name in ("width", "height"):
            if name not in self.motion.zero_variance:
                raise ValueError(f"motion: must carry the axis {name!r} in px, as the motion 'carrying' does")

    @abstractmethod
    def unseen(self, tracks: tuple[int, ...]) -> L:
        """The look of targets that were not seen yet."""

    @abstractmethod
    def first(self, pixels: Array, where: Array, box: Array) -> L:
        """The look of one target in its box: `pixels` (h, w), `where` and `box` (2,) in px; without leading axes."""

    @abstractmethod
    def again(self, pixels: Array, where: Array, box: Array, S: Array, look: L) -> Match[L]:
        """One target found again, expected at `where` with covariance S (2, 2)."""

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> LookBelief[L]:
        """The prior's own axes, and no look yet."""
        return LookBelief(own_part(prior, axes, self.state, self.zero_variance), self.unseen(prior.mean.shape[:-1]))

    def predict(
        self, belief: LookBelief[L], dt: float, rng: np.random.Generator, combined: Gaussian | None = None
    ) -> LookBelief[L]:
        """The position `dt` s later; the look stays."""
        if dt == 0:
            return belief
        spot = self.motion.reframe(belief.spot, belief.spot if combined is None else combined)
        x = spot.mean
        cov = kernels.propagate(spot.cov, self.motion.jacobian(x, dt), self.motion.noise(x, dt))
        return evolve(belief, spot=Gaussian(self.motion.move(x, dt), cov))

    def evaluate(self, belief: LookBelief[L], sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Where each target is found again, as one return; returns that are no frames say nothing of the look."""
        if not isinstance(observed, Frame):
            plain = linearised(belief.spot, self.state, sensor, observed, p_gate)
            return evolve(plain, detail=LookHypothesis(plain.detail, belief.look))
        where = self.state.locate(sensor.observes)
        x = belief.spot.mean[..., where]
        slope = sensor.jacobian(x)
        H = np.zeros((*slope.shape[:-1], len(self.state)))
        H[..., where] = slope
        nu, llr, look = self._find(belief, sensor.measure(x), H @ belief.spot.cov @ np.swapaxes(H, -1, -2), observed)
        R = np.broadcast_to(self.sigma**2 * np.eye(2), (*llr.shape, 1, 2, 2))
        _, distance, log_volume, shift, post = kernels.evaluate(belief.spot.cov, nu[..., None, :], H, R)
        made = joined(sensor, x, p_gate, (llr[..., None], distance, log_volume, shift, post))
        return evolve(made, detail=LookHypothesis(made.detail, look))

    def update(self, belief: LookBelief[L], innovation: Innovation, weights: Array) -> LookBelief[L]:
        """Position and look, each as far as the frame is believed to show the target; a first look wholly."""
        detail: LookHypothesis[L] = innovation.detail
        step, cov = kernels.mixture(belief.spot.cov, detail.spot.shift, detail.spot.post, weights)
        cov = without_variance(cov, self.state.locate(self.zero_variance))
        part = np.where(belief.look.known > 0, 1.0 - weights[..., 0], 1.0)
        look = _joined(belief.look, detail.look, part)
        return LookBelief(Gaussian(self.state.displace(belief.spot.mean, step), cov), look)

    def moments(self, belief: LookBelief[L]) -> Gaussian:
        return belief.spot

    def _find(self, belief: LookBelief[L], spot: Array, S: Array, frame: Frame) -> tuple[Array, Array, L]:
        """Residuals (*b, t, 2), log-likelihood ratios (*b, t) and new looks, track by track: each has a grid of its own."""
        names = self.state.names
        box = np.stack([belief.spot.mean[..., names.index(name)] for name in ("width", "height")], axis=-1)
        tracks = spot.shape[:-1]
        corner = np.zeros(2) if frame.corner is None else frame.corner
        pixels = np.broadcast_to(frame.pixels[..., None, :, :], (*tracks, *frame.pixels.shape[-2:]))
        start = np.broadcast_to(corner[..., None, :], spot.shape)
        nu, llr = np.zeros(spot.shape), np.full(tracks, MOST)
        look = _each(belief.look, np.array)
        for one in np.ndindex(tracks):
            where, image = spot[one] - start[one], known_pixels(pixels[one])
            if look.known[one] == 0:
                found = self.first(image, where, box[one])
            else:
                match = self.again(image, where, box[one], S[one], _each(look, lambda array, one=one: array[one]))
                nu[one], llr[one], found = match.residual, match.ratio, match.look
            for field in attrs.fields(type(look)):
                getattr(look, field.name)[one] = getattr(found, field.name)
        return nu, llr, look


def known_pixels(pixels: Array) -> Array:
    """The frame with the median where a pixel is unknown; 0 where all are."""
    if not np.issubdtype(pixels.dtype, np.floating) or not np.isnan(pixels).any():
        return pixels
    known = ~np.isnan(pixels)
    return np.where(known, pixels, np.median(pixels[known]) if known.any() else 0.0)


def match_ratio(match: float, limit: float, independent: float) -> float:
    """(n / 2) log[(1 - limit^2) / (1 - match^2)], n cells, at most 60; below the limit 60 (match / limit - 1)."""
    if match < limit:
        return MOST * (match / limit - 1.0)
    ratio = 0.5 * independent * float(np.log((1.0 - limit**2) / max(1.0 - match**2, 1e-12)))
    return min(ratio, MOST)


def _each(look: L, change: Any) -> L:
    """`change` applied to every array of a look."""
    return type(look)(**{field.name: change(getattr(look, field.name)) for field in attrs.fields(type(look))})


def _joined(old: L, new: L, part: Array) -> L:
    """Every array `part` (*b, t) of the way from `old` to `new`."""

    def between(a: Array, b: Array) -> Array:
        share = part.reshape(part.shape + (1,) * (a.ndim - part.ndim))
        return np.asarray(a + share * (b - a))

    names = [field.name for field in attrs.fields(type(old))]
    return type(old)(**{name: between(getattr(old, name), getattr(new, name)) for name in names})
