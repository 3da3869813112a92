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
from vedette_flir.sensors.detected_box import DetectedBox

MOST = 60.0
"""Greatest log-likelihood ratio of a match."""

WEAK = 40.0
"""How fast that falls as a match falls below the limit. Faster, and two smeared frames are misses that widen the search."""


@frozen(eq=False)
class Appearance:
    """The appearance of targets; `known` (*b, t) is 0 before their first frame, then 1. Every array leads with (*b, t)."""

    known: Array


L = TypeVar("L", bound=Appearance)


@frozen(eq=False)
class AppearanceBelief(Generic[L]):
    """Position and appearance of the targets, where they `began`, and the `existence` (*b, t) that a frame meets."""

    position: Gaussian
    appearance: L
    began: Gaussian
    existence: Array


@frozen(eq=False)
class AppearanceHypotheses(Generic[L]):
    """Position and appearance updated by a frame, and the share (*b, t) of the appearance that is learned from it."""

    position: Hypotheses
    appearance: L
    learned: Array


@frozen(eq=False)
class Match(Generic[L]):
    """Where one target was found: the residual (2,) in px, log-likelihood ratios, and its appearance there.

    place     that the target is at this place, given that it is in view: it weighs the position
    presence  that the target is in view: it weighs existence; None: the same
    elsewhere whether the place is none that the motion leads to, so that the target starts anew there
    learned   which part of its appearance there is taken; None: as likely as the frame shows the target
    """

    residual: Array
    place: float
    appearance: L
    presence: float | None = None
    elsewhere: bool = False
    learned: float | None = None


@frozen
class AppearanceFilter(OverMotion[AppearanceBelief[L]], Generic[L]):
    """A Kalman filter that takes its measurement from a search for the target: R = sigma^2 I.

    Its process noise says how far to search for a target that turns, so the covariance is larger than that of its errors.
    Two tracks that find their targets in one place, within half the smaller box, are not updated by the frame: both coast
    until the places part.
    """

    declares: ClassVar[Traits] = Traits(takes_frames=True, conservative=True)

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
    def find(self, pixels: Array, where: Array, box: Array, S: Array, existence: float, appearance: L) -> Match[L]:
        """Return one target found again, expected at `where` with covariance S (2, 2), if it still is in view."""

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> AppearanceBelief[L]:
        """Return the prior's marginal over the filter's axes, and no appearance yet."""
        position, tracks = marginal(prior, axes, self.state, self.zero_variance), prior.mean.shape[:-1]
        return AppearanceBelief(position, self.unseen(tracks), position, np.ones(tracks))

    def reframe(self, belief: AppearanceBelief[L], combined: Gaussian) -> AppearanceBelief[L]:
        """Return the position in the motion's frame of the `combined` estimate; the appearance stays."""
        return evolve(belief, position=self.motion.reframe(belief.position, combined))

    def informed(self, belief: AppearanceBelief[L], existence: Array) -> AppearanceBelief[L]:
        """Return the belief with the existence that the next frame meets."""
        return evolve(belief, existence=np.broadcast_to(existence, belief.appearance.known.shape))

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
            own = belief.appearance
            if isinstance(sensor, DetectedBox):
                return self._claiming(plain, sensor, observed, belief)
            return evolve(plain, detail=AppearanceHypotheses(plain.detail, own, np.full(own.known.shape, np.nan)))
        where = self.state.locate(sensor.observes)
        x = belief.position.mean[..., where]
        H = embedded(sensor.jacobian(x), where, len(self.state))
        S = H @ belief.position.cov @ np.swapaxes(H, -1, -2)
        found, appearance = self._find(belief, sensor.measure(x), S, observed)
        tracks = found.shape
        nu = np.array([match.residual for match in found.flat]).reshape(*tracks, 1, 2)
        R = np.broadcast_to(self.sigma**2 * np.eye(2), (*tracks, 1, 2, 2))
        _, distance, log_volume, shift, post = kernels.evaluate(belief.position.cov, nu, H, R)
        place, presence = (
            np.array([getattr(match, name) for match in found.flat], dtype=float).reshape(tracks)
            for name in ("place", "presence")
        )
        made = make_innovation(sensor, x, p_gate, place[..., None], distance, log_volume, None)
        ratio = np.where(np.isnan(presence), np.logaddexp.reduce(made.loglik, axis=-1), presence)
        columns = made.loglik + (ratio - np.logaddexp.reduce(made.loglik, axis=-1))[..., None]
        anew = np.array([match.elsewhere for match in found.flat], dtype=bool).reshape(tracks)
        if anew.any():
            begun = self._anew(belief, H, nu)
            shift = np.where(anew[..., None, None], begun, shift)
            post = np.where(anew[..., None, None, None], belief.began.cov[..., None, :, :], post)
        learned = np.array([match.learned for match in found.flat], dtype=float).reshape(tracks)
        return evolve(made, loglik=columns, detail=AppearanceHypotheses(Hypotheses(shift, post), appearance, learned))

    def _claiming(
        self, plain: Innovation, sensor: DetectedBox, observed: Detections, belief: AppearanceBelief[L]
    ) -> Innovation:
        """Return an innovation by which boxes of a frame are claimed, and say nothing more: the frame itself has said it."""
        scores = np.concatenate([plain.loglik[..., :1], plain.loglik[..., 1:] - np.log(sensor.clutter(observed.z))], axis=-1)
        scores[..., 1:] = np.where(observed.valid[..., None, :], scores[..., 1:], -np.inf)
        detail = AppearanceHypotheses(
            Hypotheses(np.zeros_like(plain.detail.shift), belief.position.cov[..., None, :, :]),
            belief.appearance,
            np.zeros(belief.appearance.known.shape),
        )
        return evolve(plain, loglik=plain.loglik - np.logaddexp.reduce(scores, axis=-1)[..., None], detail=detail)

    def update(self, belief: AppearanceBelief[L], innovation: Innovation, weights: Array) -> AppearanceBelief[L]:
        """Return position and appearance, each updated as likely as the frame shows the target; a first one fully."""
        detail: AppearanceHypotheses[L] = innovation.detail
        step, cov = kernels.mixture(belief.position.cov, detail.position.shift, detail.position.post, weights)
        cov = without_variance(cov, self.state.locate(self.zero_variance))
        part = np.where(np.isnan(detail.learned), 1.0 - weights[..., 0], detail.learned)
        part = np.where((belief.appearance.known > 0) | (detail.learned == 0), part, 1.0)
        appearance = _between(belief.appearance, detail.appearance, part)
        position = Gaussian(self.state.displace(belief.position.mean, step), cov)
        return evolve(belief, position=position, appearance=appearance)

    def _anew(self, belief: AppearanceBelief[L], H: Array, nu: Array) -> Array:
        """Return the shift (*b, t, 1, n) of targets found elsewhere: to there, moving as when they began."""
        shift = belief.began.mean - belief.position.mean
        kept = np.any(H != 0, axis=-2)
        kept[..., self.state.locate(self.zero_variance)] = True
        return np.where(kept[..., None, :], 0.0, shift[..., None, :]) + nu @ np.linalg.pinv(H).swapaxes(-1, -2)

    def moments(self, belief: AppearanceBelief[L]) -> Gaussian:
        """Return the position."""
        return belief.position

    def _find(self, belief: AppearanceBelief[L], expected: Array, S: Array, frame: Frame) -> tuple[Any, L]:
        """Return the match of each track (*b, t) and the new appearances, track by track as grids differ."""
        names = self.state.names
        box = np.stack([belief.position.mean[..., names.index(name)] for name in ("width", "height")], axis=-1)
        tracks = expected.shape[:-1]
        corner = np.zeros(2) if frame.corner is None else frame.corner
        pixels = np.broadcast_to(frame.pixels[..., None, :, :], (*tracks, *frame.pixels.shape[-2:]))
        start = np.broadcast_to(corner[..., None, :], expected.shape)
        found = np.empty(tracks, dtype=object)
        places, earlier = np.array(expected), dict[tuple[int, ...], list[tuple[int, ...]]]()
        appearance = _each(belief.appearance, np.array)
        for one in np.ndindex(tracks):
            where, image = expected[one] - start[one], known_pixels(pixels[one])
            own = _each(appearance, lambda array, one=one: array[one])
            if appearance.known[one] == 0:
                match = Match(np.zeros(2), MOST, self.first(image, where, box[one]))
            else:
                match = self.find(image, where, box[one], S[one], float(belief.existence[one]), own)
            places[one] = expected[one] + match.residual
            for other in earlier.setdefault(one[:-1], []):
                if _same_place(places[one], box[one], places[other], box[other]):
                    match = _unseen(match, own)
                    found[other] = _unseen(found[other], _each(belief.appearance, lambda array, other=other: array[other]))
                    _keep(appearance, other, found[other].appearance)
            earlier[one[:-1]].append(one)
            found[one] = match
            _keep(appearance, one, match.appearance)
        return found, appearance


def _unseen(match: Match[L], before: L) -> Match[L]:
    """Return a match that says nothing: two targets are in one place, and neither can be told from the other."""
    if before.known == 0:
        return match
    return evolve(match, place=-MOST, presence=0.0, elsewhere=False, learned=1.0, appearance=before)


def _keep(appearance: L, one: tuple[int, ...], new: L) -> None:
    for field in attrs.fields(type(appearance)):
        getattr(appearance, field.name)[one] = getattr(new, field.name)


def _same_place(place: Array, box: Array, other: Array, others_box: Array) -> bool:
    return bool(np.all(np.abs(place - other) < 0.5 * np.minimum(box, others_box)))


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
    """Return every array moved by the fraction `part` (*b, t) from `old` to `new`."""

    def between(a: Array, b: Array) -> Array:
        share = part.reshape(part.shape + (1,) * (a.ndim - part.ndim))
        with np.errstate(invalid="ignore"):  # what is infinite stays so
            return np.asarray(np.where(share == 1.0, b, a + share * (b - a)))

    return type(old)(
        **{field.name: between(getattr(old, field.name), getattr(new, field.name)) for field in attrs.fields(type(old))}
    )
