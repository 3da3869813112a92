"""The search for a target by its template: near where it is expected, and in a whole frame."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import evolve, frozen

from vedette import Array
from vedette_flir.estimators.template_appearance import TemplateAppearance
from vedette_flir.evidence import clearness, rival
from vedette_flir.newcomers import ALIKE, AROUND
from vedette_flir.patches import (
    BRIGHTEST,
    HALO,
    alike,
    blurred,
    contrast,
    isolated,
    kept,
    mask_of,
    median,
    peak,
    sample,
    similarity,
    without_large,
)
from vedette_flir.sizes import larger_than

WIDE = 1.6
"""Side of the template over that of the target, at least, where it says whether the target is there, or where a lost one is:
more of what is around tells places apart. This and the smaller one of `margin` were chosen on `ir_clips` and the odd clips.
"""

BESIDE = 1.5
"""How far around the expected place other places are looked at, over the target's size."""

CANDIDATES, NEAR = 2, 3
"""Places of the whole frame that are looked at for their likeness, and the cells around each."""

DULLER = 0.35
"""Part of its usual contrast over what is around below which neither the last frames nor its being new say that a target is
there. By hand, on losses planted in the odd clips: without it a fade is told 18 frames later, and .5 does as well.
"""

NOWHERE = -1.0
"""Likeness of a place that is not looked at."""

FAINT = 0.25
"""Part of a target's brightness below which it is not found again: what is left of another that was taken out. By hand."""


@frozen(eq=False)
class Look:
    """The best place (2,) in px of a part of a frame: its likeness to the templates and to the first of them, the likeness
    of the best other place, its contrast over the spread of what is around it, its patch, and the appearance sought there.
    """

    place: Array
    likeness: float
    first: float
    rival: float
    clear: float
    shown: Array
    known: TemplateAppearance

    @property
    def margin(self) -> float:
        """By how much it is more like the target than any other place near it."""
        return self.likeness - self.rival

    @property
    def dull(self) -> bool:
        """Whether it stands out far less than the target does as a rule."""
        return self.clear < DULLER * float(self.known.usual)

    @property
    def negative(self) -> bool:
        """Whether the target was sought in the negative there."""
        return bool(self.known.negative > 0)


@final
@frozen
class Matcher:
    """Compares frames with templates of `cells` a side; the parameters are those of the template filter."""

    cells: int
    anchor: float
    margin: float
    opening: float
    small: float

    def widened(self) -> Matcher:
        """Return the matcher that compares all that the grid holds."""
        return evolve(self, margin=max(self.margin, WIDE))

    def grid(self, size: Array) -> tuple[float, Array]:
        """Return the step in px, and the target's size in cells."""
        step = max(1.0, (max(self.margin, WIDE) * max(float(np.max(size)), 3.0) + 2.0) / self.cells)
        return step, size / step

    def mask(self, size: Array) -> Array:
        """Return the weights of a template's cells."""
        return mask_of((self.margin * np.maximum(size, 3.0) + 2.0) / self.grid(size)[0], self.cells)

    def apart(
        self, pixels: Array, centre: Array, size: Array, step: float, cells: int | tuple[int, int], amplitude: float
    ) -> Array:
        """Return contrast (cells, cells) around `centre`, without larger structures of the sign of a small target.

        It is that over the median, as an opening leaves half of the contrast of noise everywhere. An opening also leaves a
        bank or a trunk that is narrower than itself. So near the middle, where a target within its size of it is compared,
        what is brighter than the target may be and longer than its template is taken out; farther off, twigs would be left
        that are like targets. `amplitude` is the target's, infinite where it is not known.
        """
        image, side = blurred(sample(pixels, centre, step, cells)), float(np.max(size)) / step
        if np.max(size) > self.small:
            return image - median(image)
        sign = float(np.sign(amplitude))
        image = isolated(sign * image, self.opening * side)
        image -= median(image)
        return sign * without_large(image, BRIGHTEST * abs(amplitude), WIDE * side, (0.5 * WIDE + 1.0) * side + HALO)

    def likeness(self, image: Array, patches: Array, mask: Array) -> tuple[Array, Array]:
        """Return the likeness (h, w) of each place of `image` to both `patches` (2, p, p), and to the second of them.

        The first template counts the less, the less the target still looks like it. The `mask` (p, p) weighs the cells.
        """
        smoothed, first = similarity(image, patches, mask)
        anchor = self._anchor(patches, mask)
        return (smoothed + anchor * first) / (1.0 + anchor), first

    def _anchor(self, patches: Array, mask: Array) -> float:
        """Return the weight of the first template beside the smoothed one."""
        return self.anchor * max(alike(patches[0], patches[1], mask), 0.0)

    def larger(self, appearance: TemplateAppearance, shown: Array) -> tuple[float, float]:
        """Return the logarithm of how much larger what is `shown` is than both templates, and its standard deviation."""
        mask, both = self.mask(appearance.size), appearance.patches
        anchor = self._anchor(both, mask)
        template = (both[0] + anchor * both[1]) / (1.0 + anchor)
        return larger_than(template, kept(shown, float(appearance.amplitude)), mask)

    def look(
        self,
        pixels: Array,
        centre: Array,
        near: int,
        appearance: TemplateAppearance,
        where: Array | None = None,
        W: Array | None = None,
        close: Matcher | None = None,
    ) -> Look:
        """Return the best place within `near` cells of `centre`; with W, less d' W d for its distance d from `where`.

        With `close`, its mask says where the best place is, and this one how like the target it is, there or a cell beside.
        Places beyond the frame are not looked at.
        """
        step, inner = self.grid(appearance.size)
        sign, reach = float(np.sign(appearance.amplitude)), max(near, int(np.ceil(BESIDE * np.max(inner))))
        plain, shown, likeness, first = self.compared(pixels, centre, reach, appearance)
        far = min(near + 1, reach)  # the best place is compared with those beside it
        part, cut = np.s_[reach - far : reach + far + 1], np.s_[reach - far : reach + far + self.cells]
        placed = likeness[part, part]
        if close is not None:
            placed = close.likeness(shown[cut, cut], appearance.patches, close.mask(appearance.size))[0]
        for k in (0, 1):  # what the edge shows is repeated beyond it
            at = centre[k] + step * (np.arange(2 * reach + 1) - reach)
            beyond = (at < -0.5) | (at > pixels.shape[1 - k] - 0.5)
            for each, away in ((likeness, beyond), (placed, beyond[part])):
                np.moveaxis(each, 1 - k, 0)[away] = NOWHERE
        inside = np.s_[far - near : far + near + 1]
        score = placed[inside, inside]
        if where is not None and W is not None:
            off = step * np.arange(-near, near + 1)
            dx, dy = (off + centre[0] - where[0])[None, :], (off + centre[1] - where[1])[:, None]
            score = score - (W[0, 0] * dx * dx + 2.0 * W[0, 1] * dx * dy + W[1, 1] * dy * dy)
        j, i = peak(score)[:2]
        around = placed[_beside(j + far - near, i + far - near)]
        fine = peak(around)[2] if around.shape == (3, 3) and np.argmax(around) == 4 else np.zeros(2)
        j, i = j + reach - near, i + reach - near
        beside = _beside(j, i)
        return Look(
            centre + step * (np.array([i, j]) - reach + fine),
            float(likeness[beside].max()),
            float(first[beside].max()),
            rival(likeness, j, i, inner),
            clearness(sign * plain, np.array([j, i]), self.cells, inner),
            plain[j : j + self.cells, i : i + self.cells],
            appearance,
        )

    def compared(
        self, pixels: Array, centre: Array, reach: int, appearance: TemplateAppearance
    ) -> tuple[Array, Array, Array, Array]:
        """Return the contrast around `centre`, as it is and as parts of the target's, and the likeness of places within
        `reach` cells, to both templates and to the first.
        """
        step, amplitude = self.grid(appearance.size)[0], float(appearance.amplitude)
        plain = self.apart(pixels, centre, appearance.size, step, self.cells + 2 * reach, amplitude)
        shown = kept(plain, amplitude)
        return plain, shown, *self.likeness(shown, appearance.patches, self.mask(appearance.size))

    def of_late(self, look: Look) -> float:
        """Return the likeness of a place to the target as it looked in the last frames; 0 if it does not stand out as usual.

        It is expected to be as bright as its template: what looks alike and is fainter is what is left of one that fades.
        """
        known = look.known
        if look.dull:
            return 0.0
        return alike(kept(look.shown, float(known.amplitude)), self.latest(known), self.mask(known.size))

    def latest(self, known: TemplateAppearance) -> Array:
        """Return how a target looked in the last frames, as bright as its template."""
        mask = self.mask(known.size)
        bright, latest = (float(np.sqrt(np.sum(mask * each**2))) for each in (known.patch, known.latest))
        return known.latest * (bright / max(latest, 1e-9))

    def alone(self, pixels: Array, look: Look) -> float:
        """Return by how much a place is more like the target than the second best of the others within `AROUND` sizes."""
        inner = self.grid(look.known.size)[1]
        reach = int(np.ceil(AROUND * np.max(inner)))
        likeness = self.compared(pixels, look.place, reach, look.known)[2]
        own, others = float(likeness[reach - 1 : reach + 2, reach - 1 : reach + 2].max()), [0.0]
        x, y = (int(np.ceil(max(side, 3.0))) for side in inner)
        j = i = reach
        for _ in range(ALIKE):
            likeness[max(j - y, 0) : j + y + 1, max(i - x, 0) : i + x + 1] = 0.0
            j, i = (int(k) for k in np.unravel_index(np.argmax(likeness), likeness.shape))
            others.append(float(likeness[j, i]))
        return own - others[-1]

    def places(self, pixels: Array, appearance: TemplateAppearance) -> list[Array]:
        """Return the places in the whole frame that are most like the target, seen at half the resolution."""
        step, inner = self.grid(appearance.size)
        amplitude, half = float(appearance.amplitude), self.cells // 2
        last = np.array(pixels.shape[::-1]) - 1.0
        rows, columns = (2 * int(np.ceil(0.25 * side / step)) for side in last[::-1])
        shape = (rows + half, columns + half)
        plain = self.apart(pixels, 0.5 * last, appearance.size, 2.0 * step, shape, np.inf * amplitude)
        even = 2 * half
        patches, weight = (
            each[..., :even, :even].reshape(*each.shape[:-2], half, 2, half, 2).mean(axis=(-1, -3))
            for each in (appearance.patches, self.mask(appearance.size))
        )
        likeness, found = self.likeness(kept(plain, amplitude), patches, weight)[0], []
        y, x = (int(np.ceil(0.5 * max(side, 3.0))) for side in inner[::-1])
        for _ in range(CANDIDATES):
            j, i = (int(k) for k in np.unravel_index(np.argmax(likeness), likeness.shape))
            found.append(np.clip(0.5 * last + step * (2.0 * np.array([i, j]) - np.array([columns, rows])), 0.0, last))
            likeness[max(j - y, 0) : j + y + 1, max(i - x, 0) : i + x + 1] = -1.0
        return found

    def without(self, pixels: Array, place: Array, appearance: TemplateAppearance) -> Array:
        """Return the frame less a target at a place: its template as contrast, within its mask."""
        step, shown = self.grid(appearance.size)[0], self.mask(appearance.size) * appearance.patch
        half = int(np.ceil(0.5 * step * self.cells))
        first = np.rint(place).astype(np.intp) - half
        low, high = np.maximum(first, 0), np.minimum(first + 2 * half + 1, pixels.shape[::-1])
        if np.any(high <= low):
            return pixels
        middle = (first + half - place) / step + 0.5 * (self.cells - 1)
        image = sample(shown, middle, 1.0 / step, 2 * half + 1) * float(appearance.amplitude)
        left, top, right, bottom = *(low - first), *(high - first)
        rest = np.array(pixels, dtype=float)
        rest[low[1] : high[1], low[0] : high[0]] -= image[top:bottom, left:right]
        return rest

    def brightness(self, pixels: Array, place: Array, size: Array, sign: float, cells: int) -> float:
        """Return the contrast of what stands at a place, beside what is within so many `cells`."""
        step, inner = self.grid(size)
        return contrast(sign * self.apart(pixels, place, size, step, cells, sign * np.inf), inner)

    def lit(self, appearance: TemplateAppearance, pixels: Array, place: Array) -> TemplateAppearance:
        """Return the appearance of a target that is as bright as what stands at a place."""
        sign = float(np.sign(appearance.amplitude))
        bright = self.brightness(pixels, place, appearance.size, sign, self.cells)
        return evolve(appearance, amplitude=np.asarray(sign * max(bright, FAINT * abs(float(appearance.amplitude)), 1.0)))

    def scaled(self, appearance: TemplateAppearance, scale: float) -> TemplateAppearance:
        """Return the appearance of a target that is so many times larger in the image."""
        if scale == 1.0:
            return appearance
        size = scale * appearance.size
        ratio = self.grid(size)[0] / (scale * self.grid(appearance.size)[0])
        middle = np.full(2, 0.5 * (self.cells - 1))
        every = (appearance.patch, appearance.first_patch, appearance.latest)
        patch, first, latest = (sample(each, middle, ratio, self.cells) for each in every)
        more = {"growth": appearance.growth + np.log(scale), "scale": appearance.scale + np.log(scale)}
        known = evolve(appearance, patch=patch, first_patch=first, latest=latest, **more)
        return evolve(known, size=size, offset=scale * appearance.offset)


def _beside(j: int, i: int) -> tuple[slice, slice]:
    """Return the places next to a row and a column."""
    return np.s_[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
