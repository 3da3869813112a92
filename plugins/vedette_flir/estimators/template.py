"""A filter that learns the appearance of its target."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Gaussian, fields
from vedette_flir.estimators.appearance import (
    MOST,
    Appearance,
    AppearanceBelief,
    AppearanceFilter,
    Match,
    match_ratio,
)
from vedette_flir.initial_box import target_in
from vedette_flir.patches import blurred, centroid, contrast, isolated, mask_of, peak, sample, similarity
from vedette_flir.scene_changes import BLOCKS, FADING, change, is_cut, outline
from vedette_flir.sizes import DOUBT, grown, spread_of

BRIGHTEST = 1.5
"""Contrast beyond this multiple of the target's own is clipped: a bright background matches no better than the target."""

LESS, SLOWER = 0.9, 0.2
"""Part of its usual contrast below which a dim target is doubted; how much slower that falls than it rises."""

DOUBTING, DOUBTED = 0.15, 0.75
"""Part by which each frame moves a target's doubt, and the doubt beyond which it counts: nine frames from none."""

SEARCHED = 0.5
"""Doubt beyond which a target is sought in the whole frame, if that is asked for: below DOUBTED, so that one that is found
far away settles first.
"""

RING = (0.9, 3.0)
"""What is around a target: from so many times its size to so many."""


@frozen(eq=False)
class TemplateAppearance(Appearance):
    """Patches (*b, t, p, p) as fractions of the signed amplitude (*b, t) in count; the target's offset from the box's
    centre and its size (*b, t, 2) in px; how far it stands out as a rule, and the share of late
    in which it did not (*b, t); the outline of the last frame (*b, t, 16, 16) and its recent changes (*b, t) in count;
    the spread that it had first (*b, t) in px, 0 before it is known, and the logarithm of its growth (*b, t).
    """

    of_frame = ("doubt", "scene", "recent")

    patch: Array
    first_patch: Array
    amplitude: Array
    offset: Array
    size: Array
    usual: Array
    doubt: Array
    scene: Array
    recent: Array
    first_spread: Array
    growth: Array


@final
@frozen
class TemplateFilter(AppearanceFilter[TemplateAppearance]):
    """Finds a smoothed template again and filters its position. For a target of unknown shape in a box.

    The first frame shows where in the box the target is, how large it is, and its polarity (`target_in`), and so gives the
    template. A grey opening removes structures that are larger than a small target; contrast of the wrong
    sign or beyond 1.5 times the target's own is clipped. The best place maximises s - prior_weight d^2, d^2 the squared
    distance from the prediction, s = 2 cov / (var + var) the similarity of contrast to template and first template: it falls
    where the same shape is much fainter, as a correlation coefficient would not. The log-likelihood ratio is (n / 2)
    log[(1 - limit^2) / (1 - s^2)] of n independent cells, at most 60, and 40 (s / limit - 1) below the limit: a weak match
    is a miss, and the track coasts while its covariance, and so the area searched, grows.
    Where no contrast stands out, similarity does not show a target: with c the contrast over the spread of what is around
    it, and k the smaller of `clear` and .9 times what c is as a rule, the ratio is at most 60 (c / k - 1), once c has been
    below k for nine frames, as a codec may erase a target for a few, or the whole frame shows another scene. From then on k
    is at least `again` times what c was as a rule, until it is reached.
    Rogers, Maybeck, Adaptive Tracking of Multiple Hot-Spot Target IR Images, IEEE T-AC 28, 1983, for the smoothed template.
    """

    kind: ClassVar[str] = "template_filter"

    smoothing: float = fields.probability("part of the template that each frame renews", default=0.05)
    anchor: float = fields.quantity("1", "weight of the first template beside the smoothed one", default=0.3, at_least=0)
    recentre: float = fields.probability(
        "part of a small target's drift, by its centroid, taken back each frame", default=0.0
    )
    brighten: float = fields.probability("part of the way that the amplitude follows each frame", default=0.1)
    limit: float = fields.probability("likeness below which a match is none", default=0.6, above=0, below=1)
    independent: float = fields.quantity("1", "independent cells of a template", default=20.0, above=0)
    prior_weight: float = fields.quantity(
        "1", "likeness that one squared standard deviation costs", default=0.05, at_least=0
    )
    cells: int = fields.integer("side of the template's grid", default=36, at_least=8, at_most=128)
    search: int = fields.integer("cells searched to each side, at most", default=40, at_least=3, at_most=128)
    margin: float = fields.quantity("1", "side of the template over that of the target", default=1.6, at_least=0.5)
    opening: float = fields.quantity(
        "1", "side of the structures that are taken out over that of the target", default=2.5, at_least=1
    )
    small: float = fields.quantity(
        "px", "targets up to this size have larger structures taken out", default=40.0, at_least=0
    )

    clear: float = fields.quantity(
        "1",
        "contrast over the spread of what is around it, below which a target is doubted; 0: it never is",
        default=0.0,
        at_least=0,
    )
    again: float = fields.quantity(
        "1",
        "part of what it was before, to which that must return until a lost target is found again",
        default=0.5,
        at_least=0,
    )
    resize: float = fields.probability(
        "part of the way that the box follows the target's spread each frame; 0: it stays as it was given", default=0.0
    )
    everywhere: bool = fields.flag("search the whole frame for a target that is lost", default=False)
    cut: float = fields.quantity(
        "1",
        "change of a frame over its spread, beyond which it shows another scene and the target is doubted",
        default=0.3,
        above=0,
    )

    def unseen(self, tracks: tuple[int, ...]) -> TemplateAppearance:
        """Return no template, and NaN as the size."""
        patch, pair, none = np.zeros((*tracks, self.cells, self.cells)), np.zeros((*tracks, 2)), np.zeros(tracks)
        scene = np.zeros((*tracks, BLOCKS, BLOCKS))
        return TemplateAppearance(none, patch, patch, none + 1.0, pair, pair + 1.0, none, none, scene, none, none, none)

    def first(self, pixels: Array, where: Array, box: Array) -> TemplateAppearance:
        """Find the target in its box, and cut the template around it."""
        found = target_in(pixels, where, box)
        step, inner, _ = self._grid(found.size)
        # As much surroundings as a search sees: a structure that is small beside them is not removed.
        wide = self._apart(pixels, where + found.offset, found.size, step, 2 * self.cells, found.sign)
        amplitude = found.sign * max(contrast(found.sign * wide, inner), 1.0)
        cut = self.cells // 2
        patch = _kept(wide, amplitude)[cut : cut + self.cells, cut : cut + self.cells]
        usual = self._outstanding(pixels, where + found.offset, found.size, step, found.sign) if self.clear > 0 else 0.0
        values = (np.ones(()), patch, patch, np.asarray(amplitude), found.offset, found.size, np.asarray(usual))
        return TemplateAppearance(*values, np.zeros(()), outline(pixels), np.asarray(np.inf), np.zeros(()), np.zeros(()))

    def find(
        self, pixels: Array, where: Array, box: Array, S: Array, appearance: TemplateAppearance
    ) -> Match[TemplateAppearance]:
        """Find the best place within 3.5 standard deviations and 2 px, and update the appearance there."""
        step, inner, mask = self._grid(appearance.size)
        amplitude, where = float(appearance.amplitude), where + appearance.offset
        last = np.array(pixels.shape[::-1]) - 1.0
        everywhere = self.everywhere and appearance.doubt > SEARCHED
        centre = 0.5 * last if everywhere else np.clip(where, 0.0, last)
        reach = int(np.clip(np.ceil((3.5 * np.sqrt(np.max(np.diagonal(S))) + 2.0) / step), 3, self.search))
        reach = int(np.ceil(0.5 * last.max() / step)) if everywhere else reach
        plain = self._apart(pixels, centre, appearance.size, step, self.cells + 2 * reach, np.sign(amplitude))
        image = _kept(plain, amplitude)
        both = similarity(image, np.stack([appearance.patch, appearance.first_patch]), mask)
        likeness = (both[0] + self.anchor * both[1]) / (1.0 + self.anchor)
        off = step * (np.arange(2 * reach + 1) - reach)
        W = np.linalg.inv(S + 0.3 * np.eye(2))
        dx, dy = (off + centre[0] - where[0])[None, :], (off + centre[1] - where[1])[:, None]
        weight = 0.0 if everywhere else self.prior_weight
        score = likeness - weight * (W[0, 0] * dx * dx + 2.0 * W[0, 1] * dx * dy + W[1, 1] * dy * dy)
        j, i, _ = peak(score)
        near = likeness[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
        fine = peak(near)[2] if near.shape == (3, 3) and np.argmax(near) == 4 else np.zeros(2)
        now, sign = 0.0, float(np.sign(amplitude))
        if self.clear > 0:
            now = self._outstanding(pixels, centre + step * (np.array([i, j]) - reach + fine), appearance.size, step, sign)
            appearance = self._with_scene(appearance, pixels)
        usual, doubt, least = self._doubted(appearance, now)
        shown = plain[j : j + self.cells, i : i + self.cells]
        if self.recentre > 0 and np.max(appearance.size) <= self.small:
            drift = self.recentre * (centroid(_kept(shown, amplitude) * mask) - centroid(appearance.first_patch * mask))
            fine = fine + drift
            shown = sample(plain, np.array([i, j]) + drift + 0.5 * (self.cells - 1), 1.0, self.cells)
        place = centre + step * (np.array([i, j]) - reach + fine)
        if self.resize > 0 and now >= least:
            appearance = self._resized(appearance, pixels, place, box, sign)
        bright = np.clip(contrast(sign * shown, inner), 0.5 * abs(amplitude), 2.0 * abs(amplitude))
        amplitude += self.brighten * (sign * bright - amplitude)
        ratio = match_ratio(max(float(likeness[j, i]), 0.0), self.limit, self.independent)
        if doubt > DOUBTED:
            ratio = min(ratio, MOST * (now / least - 1.0))
        renewed = evolve(
            appearance,
            patch=appearance.patch + self.smoothing * (_kept(shown, amplitude) - appearance.patch),
            amplitude=np.asarray(amplitude),
            usual=np.asarray(usual),
            doubt=np.asarray(doubt) if ratio > 0 else appearance.doubt,
        )
        return Match(place - where, ratio, renewed)

    def moments(self, belief: AppearanceBelief[TemplateAppearance]) -> Gaussian:
        """Return the position, and the box as it has grown, whose sides are uncertain by a part of them once it was seen."""
        if self.resize == 0:
            return belief.position
        sides = [self.state.names.index(name) for name in ("width", "height")]
        mean, cov = belief.position.mean.copy(), belief.position.cov.copy()
        mean[..., sides] *= np.exp(belief.appearance.growth)[..., None]
        known = belief.appearance.known[..., None] > 0
        cov[..., sides, sides] = np.where(known, (DOUBT * mean[..., sides]) ** 2, cov[..., sides, sides])
        return Gaussian(mean, cov)

    def _resized(
        self, appearance: TemplateAppearance, pixels: Array, place: Array, box: Array, sign: float
    ) -> TemplateAppearance:
        """Return the appearance with the growth that the target's spread in this frame speaks for."""
        growth, first = float(appearance.growth), float(appearance.first_spread)
        spread = spread_of(pixels, place, box * np.exp(growth), sign)
        if not spread > 0:
            return appearance
        first = first or spread
        growth = grown(growth, spread, first, self.resize)
        return evolve(appearance, first_spread=np.asarray(first), growth=np.asarray(growth))

    def _with_scene(self, appearance: TemplateAppearance, pixels: Array) -> TemplateAppearance:
        """Return the appearance with the outline of this frame, and full doubt if that shows another scene."""
        scene, recent = outline(pixels), float(appearance.recent)
        changed = change(appearance.scene, scene)
        doubt = np.ones(()) if is_cut(appearance.scene, changed, recent, self.cut) else appearance.doubt
        recent = changed if recent == np.inf else max(changed, FADING * recent)
        return evolve(appearance, scene=scene, recent=np.asarray(recent), doubt=doubt)

    def _doubted(self, appearance: TemplateAppearance, now: float) -> tuple[float, float, float]:
        """Return how far a target stands out as a rule, its doubt, and the least contrast that lowers that.

        A target that is lost must stand out as it did before.
        """
        usual, doubt = float(appearance.usual), float(appearance.doubt)
        least = max(min(self.clear, LESS * usual), 1e-3 * (self.clear > 0))
        if doubt > DOUBTED:
            least = max(least, self.again * usual)
        else:
            usual += (self.brighten if now > usual else SLOWER * self.brighten) * (now - usual)
        return usual, doubt + DOUBTING * (float(now < least) - doubt), least

    def _outstanding(self, pixels: Array, at: Array, size: Array, step: float, sign: float) -> float:
        """Return the contrast at a place over the spread of what is around it, no less than a count."""
        cells, inner = 2 * self.cells, size / step
        wide = sign * self._apart(pixels, np.clip(at, 0.0, np.array(pixels.shape[::-1]) - 1.0), size, step, cells, sign)
        steps = np.arange(cells) - 0.5 * (cells - 1)
        off = np.hypot(steps / max(inner[0], 1.0), steps[:, None] / max(inner[1], 1.0))
        return contrast(wide, inner) / (float(np.std(wide[(off > RING[0]) & (off < RING[1])])) + 1.0)

    def _grid(self, size: Array) -> tuple[float, Array, Array]:
        """Return the step in px, the target's size in cells, and the template's mask."""
        wide = self.margin * np.maximum(size, 3.0) + 2.0
        step = max(1.0, float(np.max(wide)) / self.cells)
        return step, size / step, mask_of(wide / step, self.cells)

    def _apart(self, pixels: Array, centre: Array, size: Array, step: float, cells: int, sign: float) -> Array:
        """Return contrast (cells, cells) around `centre`, without larger structures of the sign of a small target."""
        image = blurred(sample(pixels, centre, step, cells))
        if np.max(size) > self.small:
            return image - float(np.median(image))
        return sign * isolated(sign * image, self.opening * float(np.max(size)) / step)


def _kept(image: Array, amplitude: float) -> Array:
    """Return contrast of the target's sign as a fraction of its amplitude, from 0 to `BRIGHTEST`."""
    kept: Array = np.clip(image / amplitude, 0.0, BRIGHTEST)
    return kept
