"""A filter that learns what its target looks like."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, fields, kernels
from vedette.gaussian import Hypotheses, joined, linearised, own_part, without_variance
from vedette_flir.patches import BRIGHTEST, blurred, contrast, correlation, local_median, mask_of, peak, sample

MOST = 60.0
"""The largest log-likelihood ratio that a match gives."""


@frozen(eq=False)
class Appearance:
    """How targets look: patch and first (*b, t, p, p); amplitude (*b, t) in count, signed, 0 before the first frame."""

    patch: Array
    first: Array
    amplitude: Array


@frozen(eq=False)
class TemplateBelief:
    """Where the targets are, and how they look."""

    spot: Gaussian
    look: Appearance


@frozen(eq=False)
class TemplateHypothesis:
    """What a frame does to position and look."""

    spot: Hypotheses
    look: Appearance


@final
@frozen
class TemplateFilter(Estimator[TemplateBelief]):
    """Finds a smoothed template by correlation, and filters where it was found. For a target of unknown shape in a box.

    The first frame gives the template, over the box that the axes `width` and `height` state, and the target's polarity.
    A local median is subtracted from small targets, and contrast of the wrong sign or beyond the target's own is cut off.
    The best place maximises rho - prior_weight d^2: correlation with template and first template, less the distance from
    the prediction. The log-likelihood ratio is (n / 2) log[(1 - limit^2) / (1 - rho^2)] of n independent cells, at most 60,
    and 60 (rho / limit - 1) below the limit: a weak match is a miss, and the track coasts while its covariance, and so the
    area searched, grows.
    Rogers, Maybeck, Adaptive Tracking of Multiple Hot-Spot Target IR Images, IEEE T-AC 28, 1983, for the smoothed template.
    """

    kind: ClassVar[str] = "template_filter"

    motion: MotionModel = fields.part("how the target moves; its carried axes hold `width` and `height`")
    smoothing: float = fields.probability("part of the template that each frame renews", default=0.05)
    anchor: float = fields.quantity("1", "weight of the first template beside the smoothed one", default=0.3, at_least=0)
    sigma: float = fields.quantity("px", "standard deviation of a match", default=1.0, above=0)
    limit: float = fields.probability("correlation below which a match is none", default=0.35, above=0, below=1)
    independent: float = fields.quantity("1", "independent cells of a template", default=20.0, above=0)
    prior_weight: float = fields.quantity(
        "1", "correlation that one squared standard deviation costs", default=0.05, at_least=0
    )
    cells: int = fields.integer("side of the template's grid", default=36, at_least=8, at_most=128)
    search: int = fields.integer("cells searched to each side, at most", default=40, at_least=3, at_most=128)
    margin: float = fields.quantity("1", "side of the template over that of the box", default=0.7, at_least=0.3)
    flat_below: float = fields.quantity(
        "px", "boxes up to this size have a local median subtracted", default=40.0, at_least=0
    )

    def __attrs_post_init__(self) -> None:
        for name in ("width", "height"):
            if name not in self.motion.carried:
                raise ValueError(f"motion: must carry the axis {name!r} in px, as the motion 'carrying' does")

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def carried(self) -> Space:
        return self.motion.carried

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> TemplateBelief:
        """The prior's own axes, and no template yet."""
        tracks = prior.mean.shape[:-1]
        nothing = np.zeros((*tracks, self.cells, self.cells))
        return TemplateBelief(
            own_part(prior, axes, self.state, self.carried), Appearance(nothing, nothing, np.zeros(tracks))
        )

    def predict(
        self, belief: TemplateBelief, dt: float, rng: np.random.Generator, combined: Gaussian | None = None
    ) -> TemplateBelief:
        """The position `dt` s later; the look stays."""
        if dt == 0:
            return belief
        spot = self.motion.settle(belief.spot, belief.spot if combined is None else combined)
        x = spot.mean
        cov = kernels.propagate(spot.cov, self.motion.jacobian(x, dt), self.motion.noise(x, dt))
        return evolve(belief, spot=Gaussian(self.motion.move(x, dt), cov))

    def innovate(self, belief: TemplateBelief, sensor: Sensor, seen: Detections | Frame, p_gate: float) -> Innovation:
        """Where each target is found again, as one return; returns that are no frames say nothing of the look."""
        if not isinstance(seen, Frame):
            plain = linearised(belief.spot, self.state, sensor, seen, p_gate)
            return evolve(plain, detail=TemplateHypothesis(plain.detail, belief.look))
        where = self.state.locate(sensor.looks_at)
        x = belief.spot.mean[..., where]
        slope = sensor.jacobian(x)
        H = np.zeros((*slope.shape[:-1], len(self.state)))
        H[..., where] = slope
        nu, llr, look = self._find(belief, sensor.measure(x), H @ belief.spot.cov @ np.swapaxes(H, -1, -2), seen)
        R = np.broadcast_to(self.sigma**2 * np.eye(2), (*llr.shape, 1, 2, 2))
        _, distance, log_volume, shift, post = kernels.innovate(belief.spot.cov, nu[..., None, :], H, R)
        made = joined(sensor, x, p_gate, (llr[..., None], distance, log_volume, shift, post))
        return evolve(made, detail=TemplateHypothesis(made.detail, look))

    def absorb(self, belief: TemplateBelief, innovation: Innovation, weights: Array) -> TemplateBelief:
        """Position and look, each as far as the frame is believed to show the target."""
        detail: TemplateHypothesis = innovation.detail
        step, cov = kernels.mixture(belief.spot.cov, detail.spot.shift, detail.spot.post, weights)
        cov = without_variance(cov, self.state.locate(self.carried))
        hit, old, new = 1.0 - weights[..., 0], belief.look, detail.look
        known = (old.amplitude != 0)[..., None, None]
        part = np.where(known, hit[..., None, None], 1.0)
        look = Appearance(
            old.patch + part * (new.patch - old.patch),
            np.where(known, old.first, new.first),
            np.where(old.amplitude != 0, old.amplitude, new.amplitude),
        )
        return TemplateBelief(Gaussian(self.state.displace(belief.spot.mean, step), cov), look)

    def moments(self, belief: TemplateBelief) -> Gaussian:
        return belief.spot

    def _find(self, belief: TemplateBelief, spot: Array, S: Array, frame: Frame) -> tuple[Array, Array, Appearance]:
        """Residuals (*b, t, 2), log-likelihood ratios (*b, t) and new looks, track by track: each has a grid of its own."""
        box = np.stack(
            [belief.spot.mean[..., i] for i in (self.state.names.index("width"), self.state.names.index("height"))], -1
        )
        tracks = spot.shape[:-1]
        corner = np.zeros(2) if frame.corner is None else frame.corner
        pixels = np.broadcast_to(frame.pixels[..., None, :, :], (*tracks, *frame.pixels.shape[-2:]))
        start = np.broadcast_to(corner[..., None, :], spot.shape)
        nu, llr = np.zeros(spot.shape), np.zeros(tracks)
        look = Appearance(belief.look.patch.copy(), belief.look.first.copy(), belief.look.amplitude.copy())
        for one in np.ndindex(tracks):
            where = spot[one] - start[one]
            if look.amplitude[one] == 0:
                found: Any = self._first_look(pixels[one], where, box[one])
                look.amplitude[one], look.patch[one], llr[one] = found[0], found[1], MOST
                look.first[one] = look.patch[one]
            else:
                own = (look.patch[one], look.first[one], float(look.amplitude[one]))
                nu[one], llr[one], seen = self._again(pixels[one], where, box[one], S[one], own)
                look.patch[one] += self.smoothing * (seen - look.patch[one])
        return nu, llr, look

    def _grid(self, box: Array) -> tuple[float, Array, Array]:
        """Step in px, box in cells, and the template's mask."""
        wide = self.margin * np.maximum(box, 5.0) + 2.0
        step = max(1.0, float(np.max(wide)) / self.cells)
        return step, box / step, mask_of(wide / step, self.cells)

    def _prepared(self, pixels: Array, centre: Array, box: Array, step: float, cells: int) -> Array:
        """Contrast (cells, cells) around `centre`; the background's median is gone where the target is small."""
        image = sample(_known(pixels), centre, step, cells)
        small = np.max(box) <= self.flat_below
        flat = image - (local_median(image, 1.8 * float(np.max(box)) / step) if small else np.median(image))
        return blurred(flat)

    def _first_look(self, pixels: Array, centre: Array, box: Array) -> tuple[float, Array]:
        """Amplitude and template (p, p)"""
        step, inner, _ = self._grid(box)
        wide = self._prepared(pixels, centre, box, step, self.cells + 2 * self.cells // 2)
        amplitude = contrast(wide, inner) or 1.0
        cut = (len(wide) - self.cells) // 2
        return amplitude, _kept(wide, amplitude)[cut : cut + self.cells, cut : cut + self.cells]

    def _again(
        self, pixels: Array, where: Array, box: Array, S: Array, own: tuple[Array, Array, float]
    ) -> tuple[Array, float, Array]:
        """Residual (2,) in px, log-likelihood ratio, and what is seen there (p, p)."""
        patch, first, amplitude = own
        step, _, mask = self._grid(box)
        centre = np.clip(where, 0.0, np.array(pixels.shape[::-1]) - 1.0)
        reach = int(np.clip(np.ceil((3.5 * np.sqrt(np.max(np.diagonal(S))) + 2.0) / step), 3, self.search))
        image = _kept(self._prepared(pixels, centre, box, step, self.cells + 2 * reach), amplitude)
        rho = correlation(image, patch, mask)
        both = (rho + self.anchor * correlation(image, first, mask)) / (1.0 + self.anchor)
        off = step * (np.arange(2 * reach + 1) - reach)
        W = np.linalg.inv(S + 0.3 * np.eye(2))
        dx, dy = (off + centre[0] - where[0])[None, :], (off + centre[1] - where[1])[:, None]
        score = both - self.prior_weight * (W[0, 0] * dx * dx + 2.0 * W[0, 1] * dx * dy + W[1, 1] * dy * dy)
        j, i, _ = peak(score)
        near = both[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
        fine = peak(near)[2] if near.shape == (3, 3) and np.argmax(near) == 4 else np.zeros(2)
        moved = step * (np.array([i, j]) - reach + fine)
        # The mean of the two correlations decides, as it does where to look.
        match = max(float(both[j, i]), 0.0)
        if match < self.limit:
            ratio = MOST * (match / self.limit - 1.0)
        else:
            ratio = 0.5 * self.independent * float(np.log((1.0 - self.limit**2) / max(1.0 - match**2, 1e-12)))
        seen = image[j : j + self.cells, i : i + self.cells]
        return centre + moved - where, min(ratio, MOST), seen


def _known(pixels: Array) -> Array:
    """The frame with the median where a pixel is unknown; 0 where all are."""
    if not np.issubdtype(pixels.dtype, np.floating) or not np.isnan(pixels).any():
        return pixels
    known = ~np.isnan(pixels)
    return np.where(known, pixels, np.median(pixels[known]) if known.any() else 0.0)


def _kept(image: Array, amplitude: float) -> Array:
    """Contrast of the target's sign, in parts of its amplitude, from 0 to `BRIGHTEST`."""
    kept: Array = np.clip(image / amplitude, 0.0, BRIGHTEST)
    return kept
