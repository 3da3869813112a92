"""A filter that learns the appearance of its target."""

from __future__ import annotations

from functools import partial
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Gaussian, fields
from vedette_flir.estimators.appearance import AppearanceBelief, AppearanceFilter
from vedette_flir.estimators.earlier import SURELY, Elsewhere, kept_frame, nothing_kept
from vedette_flir.estimators.growth import resized
from vedette_flir.estimators.hints import forgotten, found_elsewhere
from vedette_flir.estimators.judged import LIKELY, Judged, in_negative, judged, likelier_of
from vedette_flir.estimators.leaving import Left, leaving, marked, nothing_leaves, watched
from vedette_flir.estimators.matches import MOST, Match, match_ratio
from vedette_flir.estimators.seen_before import nothing_seen, unremembered
from vedette_flir.estimators.surroundings import BESIDE
from vedette_flir.estimators.template_appearance import TemplateAppearance, with_scene
from vedette_flir.estimators.template_search import NEAR, Look, Matcher
from vedette_flir.estimators.unmarked import unmarked
from vedette_flir.evidence import DIM, LOST, learned, log_odds, presence_ratio
from vedette_flir.initial_box import target_in
from vedette_flir.newcomers import SURE, leaps
from vedette_flir.patches import centroid, contrast, kept, sample
from vedette_flir.scene_changes import BLOCKS, outline
from vedette_flir.sizes import DOUBT, FOLLOWS

LATEST = 0.3
"""Part of how a target looked of late that each frame renews. By hand: from .15 to .6 as many turning targets are held."""

SEEN = 12.0
"""Contrast over the spread around from which on what appears soon in a box that showed nothing is the target. By hand, on
`ir_clips` and the odd clips: what stood in a box grew clearer by 1.8 at most; by 6 a wisp of cloud is taken for a bird.
"""

SLOWER, SLOWEST = 0.2, 0.05
"""How much slower what is usual falls than it rises; the same of the likeness to the first template."""


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
    is a miss, and the track coasts while its covariance, and so the area searched, grows. Where a held target is, `margin`
    sizes around it say, as what stands beside a slow one holds its template; whether it is there, more. And what looks as
    the target did in the last frames is it, however it has turned since its template was learned.
    Whether the target is there at all is judged for itself, by what stands out (`vedette_flir.evidence`). While existence is
    below one half, and where the scene changes, the whole frame is searched, at other sizes too.
    Rogers, Maybeck, Adaptive Tracking of Multiple Hot-Spot Target IR Images, IEEE T-AC 28, 1983, for the smoothed template.

    >>> from vedette import Frame
    >>> from vedette_flir.motion.constant_axes import Carrying
    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> from vedette_flir.sensors.box_centroid import BoxCentroid
    >>> motion, camera = Carrying(ImageVelocity(), {"width": "px", "height": "px"}), BoxCentroid()
    >>> tracker = TemplateFilter(motion, sigma=2.0)
    >>> (y, x), sure = np.mgrid[:90, :100], np.eye(2)[1:]
    >>> def seen(belief, x0, y0, amplitude):
    ...     spot = 100.0 + amplitude * np.exp(-((x - x0) ** 2 + (y - y0) ** 2) / 8.0)
    ...     return tracker.evaluate(belief, camera, Frame(spot), 1.0)
    >>> prior = Gaussian(np.array([[35.0, 45.0, 0.0, 0.0, 9.0, 9.0]]), np.diag([100.0, 100.0, 9.0, 9.0, 0.0, 0.0])[None])
    >>> belief = tracker.start(prior, tracker.state, None)
    >>> belief = tracker.update(belief, seen(belief, 35, 45, 50.0), sure)  # of variance 100, now 100 / 26
    >>> after = tracker.update(belief, seen(belief, 39, 42, 50.0), sure)  # 4 px to the right, 3 up
    >>> np.allclose(after.position.mean[0, :2], np.array([35.0, 45.0]) + 25.0 / 51.0 * np.array([4.0, -3.0]), atol=0.02)
    True
    >>> np.allclose(np.diag(after.position.cov[0])[:2], 100.0 / 51.0)
    True
    >>> bright, faint, dark = (seen(belief, 39, 42, amplitude).loglik[0, 1] for amplitude in (50.0, 5.0, -50.0))
    >>> bool(bright > 0.0 > faint), bool(dark < 0.0)  # the same shape ten times fainter is a miss, as is the wrong sign
    (True, True)
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
    margin: float = fields.quantity("1", "side of what says where a held target is over its own", default=1.3, at_least=0.5)
    opening: float = fields.quantity(
        "1", "side of the structures that are taken out over that of the target", default=2.5, at_least=1
    )
    small: float = fields.quantity(
        "px", "targets up to this size have larger structures taken out", default=40.0, at_least=0
    )

    resize: float = fields.probability(
        "part of the way that the box follows the target's spread each frame; 0: it stays as it was given", default=0.0
    )
    centred: bool = fields.flag(
        "the target's place is its own middle, not that of the box it was first seen in", default=False
    )
    moves: bool = fields.flag(
        "targets move: what stands where it was first seen is part of the scene, until it leaves", default=False
    )
    cut: float = fields.quantity(
        "1",
        "change of a frame over its spread, beyond which it shows another scene and the target is doubted",
        default=0.3,
        above=0,
    )

    @property
    def trusted(self) -> float:
        """Return one half, and `SURE` where targets move: until then a new thing is judged as such."""
        return SURE if self.moves else LOST

    @property
    def _matcher(self) -> Matcher:
        return Matcher(self.cells, self.anchor, self.margin, self.opening, self.small)

    def unseen(self, tracks: tuple[int, ...]) -> TemplateAppearance:
        """Return no template, and NaN as the size."""
        patch, pair, none = np.zeros((*tracks, self.cells, self.cells)), np.zeros((*tracks, 2)), np.zeros(tracks)
        scene = np.zeros((*tracks, BLOCKS, BLOCKS))
        beside = np.zeros((*tracks, BESIDE.cells, BESIDE.cells))
        return TemplateAppearance(
            *(none, patch, patch, patch, none + 1.0, pair, pair + 1.0, none, none, scene, none, beside, pair, none, none),
            *(pair + np.nan, pair, beside, none, *nothing_seen(tracks), *nothing_kept(tracks), *nothing_leaves(tracks)),
        )

    def first(self, pixels: Array, where: Array, box: Array) -> Match[TemplateAppearance]:
        """Find the target in its box, and cut the template around it; whether it is one, only the next frames say."""
        found, by = target_in(pixels, where, box), self._matcher
        step, _ = by.grid(found.size)
        # As much surroundings as a search sees: a structure that is small beside them is not removed.
        middle, cells = where + found.offset, 2 * self.cells
        amplitude = found.sign * max(by.brightness(pixels, middle, found.size, found.sign, cells), 1.0)
        wide = by.apart(pixels, middle, found.size, step, cells, amplitude)
        cut, one, none = self.cells // 2, np.ones(()), np.zeros(())
        patch = kept(wide, amplitude)[cut : cut + self.cells, cut : cut + self.cells]
        values = (one, patch, patch, patch, np.asarray(amplitude), found.offset, found.size, one, one)
        nothing = np.zeros((BESIDE.cells, BESIDE.cells))
        beside = BESIDE.around(pixels, middle, found.size) if self.moves else nothing
        seen = (outline(pixels), np.asarray(np.inf), beside, middle, none, none)
        hint = np.full(2, np.nan), np.zeros(2), nothing, none
        there = nothing_leaves(()) if self.moves else marked(pixels, middle, box)
        made = TemplateAppearance(*values, *seen, *hint, *nothing_seen(()), *nothing_kept(()), *there)
        look = by.look(pixels, middle, NEAR, made)
        made = kept_frame(pixels, evolve(made, usual=np.asarray(max(look.clear, 1.0))), middle, held=True)
        if not self.centred:
            return Match(np.zeros(2), MOST, made, 0.0)
        return Match(found.offset, MOST, evolve(made, offset=np.zeros(2)), 0.0)

    def find(
        self,
        pixels: Array,
        where: Array,
        box: Array,
        S: Array,
        existence: float,
        appearance: TemplateAppearance,
        past: Array,
    ) -> Match[TemplateAppearance]:
        """Find the best place within 3.5 standard deviations and 2 px, or in the whole frame, and update the appearance.

        Where the first frames show next to nothing in the box, the first that shows something tells how the target looks.
        """
        if (seen := self._at_last(pixels, where, box, appearance, past)) is not None:
            return seen
        by, box_at, where = self._matcher.widened(), where, where + appearance.offset
        young = bool(np.isinf(appearance.recent))  # seen once, so its speed is not known
        appearance, cut = with_scene(appearance, pixels, self.cut)
        hidden, there = appearance, Elsewhere(appearance, pixels, where)
        step = by.grid(appearance.size)[0]
        near = int(np.clip(np.ceil((3.5 * np.sqrt(np.max(np.diagonal(S))) + 2.0) / step), NEAR, self.search))
        it = self._expected(by, near, S, existence, past[1], there)
        known, left = leaving(it.appearance, pixels, it.look.place, box_at, box)
        it = evolve(it, appearance=known)
        if left is not None:
            return self._left(pixels, where, left, box, existence, known)
        ratio, told = unmarked(by, pixels, it, existence, past) if self.moves else (it.ratio, None)
        here, best, appearance, anew = it.look, it.look, it.appearance, False
        new = self.moves and not np.isfinite(past[1]).all()
        if not new and (cut or existence < LOST or (existence > LOST and here.likeness < self.limit)):
            other, odds, appearance = found_elsewhere(by, pixels, it, existence, there, cut=cut)
            apart = bool(np.any(np.abs(other.place - here.place) > appearance.size))
            if other is not here and odds > 0 and (apart or it.standing == 0):
                # it need not stand out as before to be held from now on
                usual = np.minimum(appearance.usual, max(other.clear, 1.0))
                best, ratio, appearance, anew = other, odds, forgotten(unremembered(evolve(other.known, usual=usual))), apart
        else:
            appearance = forgotten(appearance)
        jump = float(np.max(np.abs(best.place - where)))
        elsewhere = anew and jump > step * (near + 1)
        if self.moves and existence == LOST and not young and leaps(best.place - where, S):
            told = -MOST  # as one of several alike fades or leaves the picture, the next is found: that is another
        alike = max(here.likeness, it.of_late) * (not it.is_scenery) if best is here else best.likeness
        likely = match_ratio(max(alike, 0.0), self.limit, self.independent)
        share = learned(ratio, existence, likely) * (not best.negative)  # a negative tells nothing of how it looks else
        renewed, place = self._renewed(appearance, best, share) if share > 0 else (appearance, best.place)
        renewed = evolve(renewed, negative=np.asarray(it.negative * (best is here)))
        presence = presence_ratio(ratio, existence, cut=cut and not new, anew=anew)
        if presence > 0 and not best.negative:
            renewed = resized(self._matcher, renewed, pixels, place, box, best.shown, self.resize or FOLLOWS)
        renewed = kept_frame(pixels, renewed, place, held=min(existence - SURELY, ratio) > 0 and not (anew or best.negative))
        residual = place - appearance.offset - box_at
        return Match(residual, likely, renewed, presence, elsewhere, 1.0, best.likeness, told, hidden)

    def _at_last(
        self, pixels: Array, where: Array, box: Array, appearance: TemplateAppearance, past: Array
    ) -> Match[TemplateAppearance] | None:
        """Return the target as this frame is the first to show it in its box; None where one before did, or none does."""
        if self.moves or appearance.usual >= DIM or np.isfinite(past[1]).all() or appearance.least == 0:
            return None
        seen = self._marked(pixels, where, where, box)
        return None if seen.appearance.usual < SEEN else seen

    def _left(
        self, pixels: Array, where: Array, left: Left, box: Array, existence: float, known: TemplateAppearance
    ) -> Match[TemplateAppearance]:
        """Return what left the box that was marked, as if it were marked now."""
        seen = self._marked(pixels, where, left.place, box)
        presence = log_odds(SURE) - (log_odds(existence) if left.now else 0.0)
        return evolve(seen, elsewhere=left.now, presence=presence, appearance=watched(seen.appearance, known))

    def _marked(self, pixels: Array, where: Array, place: Array, box: Array) -> Match[TemplateAppearance]:
        """Return a target, expected at `where`, as if it were marked in this frame: in its box around a place."""
        seen = self.first(pixels, place, box)
        residual = place - where + seen.residual + seen.appearance.offset
        return evolve(seen, residual=residual, appearance=evolve(seen.appearance, offset=np.zeros(2)))

    def _expected(self, by: Matcher, near: int, S: Array, existence: float, past: Array, there: Elsewhere) -> Judged:
        """Judge the best place within so many cells of where the target is expected: as it is known, or in the negative."""
        pixels, where, before = there.pixels, there.where, float(there.appearance.negative)
        W = self.prior_weight * np.linalg.inv(S + 0.3 * np.eye(2))
        at = np.clip(where, 0.0, np.array(pixels.shape[::-1]) - 1.0)
        appearance = evolve(there.appearance, negative=np.zeros(()))
        seek = partial(by.look, pixels, where=where, W=W, close=self._matcher if existence > LOST else None)
        judge = partial(
            judged, by, self._matcher, appearance, pixels, existence=existence, past=past, where=where, elsewhere=there
        )
        it = judge(seek(at, near, appearance))
        if existence != LOST and (it.ratio < 0 or before > LIKELY):
            it = likelier_of(it, judge(in_negative(by, pixels, appearance, seek, at, near)), before)
        return it

    def without(self, pixels: Array, where: Array, appearance: TemplateAppearance) -> Array:
        """Return the frame less the smoothed template at its place."""
        return self._matcher.without(pixels, where + appearance.offset, appearance)

    def _renewed(self, appearance: TemplateAppearance, best: Look, share: float) -> tuple[TemplateAppearance, Array]:
        """Return the appearance after a frame of which a `share` counts, and the target's place there."""
        amplitude, size, place = float(appearance.amplitude), appearance.size, best.place
        (step, inner), sign = self._matcher.grid(size), float(np.sign(amplitude))
        shown = seen = kept(best.shown, amplitude)
        if self.recentre > 0 and np.max(size) <= self.small:
            mask = self._matcher.mask(size)
            drift = self.recentre * (centroid(seen * mask) - centroid(appearance.first_patch * mask))
            place = place + step * drift
            shown = kept(sample(best.shown, drift + 0.5 * (self.cells - 1), 1.0, self.cells), amplitude)
        bright = sign * np.clip(contrast(sign * best.shown, inner), 0.5 * abs(amplitude), 2.0 * abs(amplitude))
        renewed = evolve(
            appearance,
            patch=appearance.patch + share * self.smoothing * (shown - appearance.patch),
            latest=appearance.latest + share * LATEST * (seen - appearance.latest),
            amplitude=np.asarray(amplitude + share * self.brighten * (bright - amplitude)),
            usual=self._usual(appearance.usual, best.clear, share),
            usual_first=np.asarray(
                1.0 + share * (best.first - 1.0)  # the first frame, which is as itself, says nothing of noise
                if appearance.usual_first == 1.0
                else self._usual(appearance.usual_first, best.first, share, SLOWEST)
            ),
        )
        return renewed, place

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

    def _usual(self, usual: Array, now: float, share: float, slower: float = SLOWER) -> Array:
        """Return what is usual after a frame: it rises by `brighten` of the way, and falls more slowly."""
        part = self.brighten if now > usual else slower * self.brighten
        return np.asarray(usual + share * part * (now - usual))
