"""Filters that know their target by its appearance in an image, and measure where it is found again."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Generic

import attrs
import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, Mask, MotionModel, Sensor, Space, Traits, fields, kernels
from vedette.filters import (
    Hypotheses,
    OverMotion,
    embedded,
    evaluate_linearised,
    make_innovation,
    marginal,
    without_variance,
)
from vedette_flir.estimators.matches import L, Match, known_pixels
from vedette_flir.estimators.sharing import Expected, Sharing
from vedette_flir.evidence import CORRELATED, LAG, LOST

CALMEST, SETTLING = 0.005, 0.2
"""Least share of the squared innovations that are expected, and the part of the way that it goes in a frame."""


@frozen(eq=False)
class AppearanceBelief(Generic[L]):
    """Position and appearance of the targets, where they `began`, and the `existence` (*b, t) that a frame meets.

    calm   squared innovations of late over those expected (*b, t), 1 at most: how much calmer the target is than the motion
           allows for
    links  the probability (*b, t) that the places of the last frame and the one before are of one target: less than 1 where
           targets met and may have been exchanged, NaN where a track coasts until they part
    held   whether a target ever existed rather than not (*b, t): only then it can be lost, and is sought elsewhere
    past   the places (*b, t, 1 + LAG, 2) where the target was found first, there or elsewhere, and those of the last frames,
           the oldest first; NaN before
    """

    position: Gaussian
    appearance: L
    began: Gaussian
    existence: Array
    calm: Array
    links: Array
    held: Mask
    past: Array


@frozen(eq=False)
class AppearanceHypotheses(Generic[L]):
    """Position and appearance updated by a frame, the share (*b, t) of the appearance that is learned from it, how calm the
    targets are by it, their links and past places, as those of the belief.
    """

    position: Hypotheses
    appearance: L
    learned: Array
    calm: Array
    links: Array
    past: Array


@frozen
class AppearanceFilter(OverMotion[AppearanceBelief[L]], Generic[L]):
    """A Kalman filter that takes its measurement from a search for the target: R = sigma^2 I.

    Its process noise says how far to search for a target that turns, so the covariance is larger than that of its errors.
    Targets near each other share the frame out (`vedette_flir.estimators.sharing`), each taken to be as calm as it has been.
    """

    declares: ClassVar[Traits] = Traits(takes_frames=True, conservative=True)

    motion: MotionModel = fields.part("how the target moves; its zero-variance axes hold `width` and `height`")
    sigma: float = fields.quantity("px", "standard deviation of a match", default=1.0, above=0)

    def __attrs_post_init__(self) -> None:
        for name in ("width", "height"):
            if name not in self.motion.zero_variance:
                raise ValueError(f"motion: must carry the axis {name!r} in px, as the motion 'carrying' does")

    @property
    def trusted(self) -> float:
        """Return the existence from which on a track is held for a target's, and can be lost."""
        return LOST

    @abstractmethod
    def unseen(self, tracks: tuple[int, ...]) -> L:
        """Return the appearance of targets that have not been seen yet."""

    @abstractmethod
    def first(self, pixels: Array, where: Array, box: Array) -> Match[L]:
        """Return one target seen for the first time, without leading axes: `pixels` (h, w), its place and box (2,) in px."""

    @abstractmethod
    def find(
        self, pixels: Array, where: Array, box: Array, S: Array, existence: float, appearance: L, past: Array
    ) -> Match[L]:
        """Return one target found again, expected at `where` with covariance S (2, 2), if it still is in view.

        `past` (2, 2): the places where it was found first, and at which it was `LAG` frames ago, in px of this frame; NaN if
        that is not known.
        """

    def without(self, pixels: Array, where: Array, appearance: L) -> Array:
        """Return the frame without a target at its place, so that it is not found again for another; by default as it is."""
        return pixels

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> AppearanceBelief[L]:
        """Return the prior's marginal over the filter's axes, and no appearance yet."""
        position, tracks = marginal(prior, axes, self.state, self.zero_variance), prior.mean.shape[:-1]
        one = np.ones(tracks)
        past = np.full((*tracks, 1 + LAG, 2), np.nan)
        return AppearanceBelief(position, self.unseen(tracks), position, one, one, one, np.zeros(tracks, dtype=bool), past)

    def reframe(self, belief: AppearanceBelief[L], combined: Gaussian) -> AppearanceBelief[L]:
        """Return the position in the motion's frame of the `combined` estimate; the appearance stays."""
        return evolve(belief, position=self.motion.reframe(belief.position, combined))

    def informed(self, belief: AppearanceBelief[L], existence: Array) -> AppearanceBelief[L]:
        """Return the belief with the existence that the next frame meets."""
        existence = np.broadcast_to(existence, belief.appearance.known.shape)
        return evolve(belief, existence=existence, held=belief.held | (existence >= self.trusted))

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
            own, one = belief.appearance, np.ones(belief.calm.shape)
            if sensor.claims:
                return self._claiming(plain, sensor, observed, belief)
            detail = AppearanceHypotheses(plain.detail, own, np.nan * one, belief.calm, one, belief.past)
            return evolve(plain, detail=detail)
        where = self.state.locate(sensor.observes)
        x = belief.position.mean[..., where]
        H = embedded(sensor.jacobian(x), where, len(self.state))
        S = H @ belief.position.cov @ np.swapaxes(H, -1, -2)
        found, appearance, links = self._find(belief, sensor.measure(x), S, observed)
        tracks = found.shape
        nu = np.array([match.residual for match in found.flat]).reshape(*tracks, 1, 2)
        R = np.broadcast_to(self.sigma**2 * np.eye(2), (*tracks, 1, 2, 2))
        _, distance, log_volume, shift, post = kernels.evaluate(belief.position.cov, nu, H, R)
        place, presence, odds = (
            np.array([getattr(match, name) for match in found.flat], dtype=float).reshape(tracks)
            for name in ("place", "presence", "odds")
        )
        believed = np.clip(belief.existence, 1e-9, 1.0 - 1e-9)
        presence = np.where(np.isnan(odds), presence, (odds - np.log(believed / (1.0 - believed))) / CORRELATED)
        made = make_innovation(sensor, x, p_gate, place[..., None], distance, log_volume, None)
        ratio = np.where(np.isnan(presence), np.logaddexp.reduce(made.loglik, axis=-1), presence)
        columns = made.loglik + (ratio - np.logaddexp.reduce(made.loglik, axis=-1))[..., None]
        anew = np.array([match.elsewhere for match in found.flat], dtype=bool).reshape(tracks)
        if anew.any():
            begun = self._anew(belief, H, nu)
            shift = np.where(anew[..., None, None], begun, shift)
            post = np.where(anew[..., None, None, None], belief.began.cov[..., None, :, :], post)
        learned = np.array([match.learned for match in found.flat], dtype=float).reshape(tracks)
        seen = np.where(
            (place > 0) & ~anew & (belief.appearance.known > 0), np.minimum(0.5 * distance[..., 0], 1.0), belief.calm
        )
        calm = np.maximum(belief.calm + SETTLING * (seen - belief.calm), CALMEST)
        found_at, first = sensor.measure(x) + nu[..., 0, :], anew | ~(belief.appearance.known > 0)
        began = np.where(first[..., None], found_at, belief.past[..., 0, :])
        before = np.where(first[..., None, None], np.nan, belief.past[..., 2:, :])
        past = np.concatenate([began[..., None, :], before, found_at[..., None, :]], axis=-2)
        detail = AppearanceHypotheses(Hypotheses(shift, post), appearance, learned, calm, links, past)
        return evolve(made, loglik=columns, detail=detail)

    def _claiming(self, plain: Innovation, sensor: Sensor, observed: Detections, belief: AppearanceBelief[L]) -> Innovation:
        """Return an innovation by which boxes of a frame are claimed, and say nothing more: the frame itself has said it."""
        scores = np.concatenate([plain.loglik[..., :1], plain.loglik[..., 1:] - np.log(sensor.clutter(observed.z))], axis=-1)
        scores[..., 1:] = np.where(observed.valid[..., None, :], scores[..., 1:], -np.inf)
        detail = AppearanceHypotheses(
            Hypotheses(np.zeros_like(plain.detail.shift), belief.position.cov[..., None, :, :]),
            belief.appearance,
            np.zeros(belief.calm.shape),
            belief.calm,
            np.ones(belief.calm.shape),
            belief.past,
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
        return evolve(
            belief, position=position, appearance=appearance, calm=detail.calm, links=detail.links, past=detail.past
        )

    def _anew(self, belief: AppearanceBelief[L], H: Array, nu: Array) -> Array:
        """Return the shift (*b, t, 1, n) of targets found elsewhere: to there, moving as when they began."""
        shift = belief.began.mean - belief.position.mean
        kept = np.any(H != 0, axis=-2)
        kept[..., self.state.locate(self.zero_variance)] = True
        return np.where(kept[..., None, :], 0.0, shift[..., None, :]) + nu @ np.linalg.pinv(H).swapaxes(-1, -2)

    def moments(self, belief: AppearanceBelief[L]) -> Gaussian:
        """Return the position."""
        return belief.position

    def _find(self, belief: AppearanceBelief[L], expected: Array, S: Array, frame: Frame) -> tuple[Any, L, Array]:
        """Return the match of each track (*b, t), the new appearances, and the links (*b, t)."""
        names, existence = self.state.names, np.where(belief.held, belief.existence, LOST)
        box = np.stack([belief.position.mean[..., names.index(name)] for name in ("width", "height")], axis=-1)
        tracks = expected.shape[:-1]
        start = np.zeros(2) if frame.corner is None else frame.corner[..., None, :]
        past = belief.past[..., :2, :] - np.expand_dims(start, -2)
        where, pixels = expected - start, np.broadcast_to(frame.pixels, (*tracks[:-1], *frame.pixels.shape[-2:]))
        found, links = np.empty(tracks, dtype=object), np.ones(tracks)
        appearance = _each(belief.appearance, np.array)
        for run in np.ndindex(tracks[:-1]):
            image = known_pixels(pixels[run])
            seen = [(*run, t) for t in range(tracks[-1]) if belief.appearance.known[(*run, t)] > 0]
            for one in ((*run, t) for t in range(tracks[-1])):
                if one not in seen:
                    found[one] = self.first(image, where[one], box[one])
            who = [
                Expected(
                    where[one],
                    box[one],
                    belief.calm[one] * S[one],
                    bool(existence[one] >= LOST),
                    _each(belief.appearance, lambda array, one=one: array[one]),
                )
                for one in seen
            ]

            def find(i: int, image: Array, at: Array, seen: Any = seen, who: Any = who) -> Match[L]:
                one = seen[i]
                return self.find(image, at, box[one], S[one], float(existence[one]), who[i].appearance, past[one])

            matches, links_of_run = Sharing(image, who, find, self.without).found()
            for one, match, link in zip(seen, matches, links_of_run, strict=True):
                found[one], links[one] = match, link
            for one in ((*run, t) for t in range(tracks[-1])):
                _keep(appearance, one, found[one].appearance)
        return found, appearance, links


def _keep(appearance: L, one: tuple[int, ...], new: L) -> None:
    for field in attrs.fields(type(appearance)):
        getattr(appearance, field.name)[one] = getattr(new, field.name)


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

    if new is old or (part == 1.0).all():  # nothing was seen of them, as in returns without a picture, or all is taken
        return new
    return type(old)(
        **{field.name: between(getattr(old, field.name), getattr(new, field.name)) for field in attrs.fields(type(old))}
    )
