"""A camera that sees several hot spots of one rigid target."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, fields, kernels
from vedette_flir.sensors.image_model import FittedImage, Picture
from vedette_flir.spots import bivariate, elliptic, oval, slopes_overlap

QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])
"""A quarter turn from x towards y: the derivative of a rotation at 0."""

TURNS = (-np.inf, np.inf, 0.3)
"""In rad; the largest turn learnt from one frame."""

LEAST_DETAIL = 1e-6
"""Least integral of squared slopes along any direction, over the peaks' squares: pi / 2 for a circular spot."""


@final
@frozen
class Spot:
    """One spot as it lies on the target before it turns: an ellipse by its spreads and their correlation."""

    spread_x: float = fields.quantity("px", "standard deviation across", above=0.2, at_most=100.0, tried=(1.0, 1.5, 2.0))
    spread_y: float = fields.quantity("px", "standard deviation down", above=0.2, at_most=100.0, tried=(1.0, 1.5, 2.0))
    correlation: float = fields.quantity(
        "1", "of the two, within -.95 and .95", default=0.0, at_least=-0.95, at_most=0.95, tried=(0.0, 0.5, -0.5)
    )
    peak: float = fields.quantity("1", "its middle over the target's amplitude; negative: cold", default=1.0)
    x: float = fields.quantity("px", "place on the target", default=0.0, tried=(-2.0, 0.0, 3.0))
    y: float = fields.quantity("px", "place on the target", default=0.0, tried=(-2.0, 0.0, 3.0))

    @property
    def ellipse(self) -> Array:
        """Its spreads and their correlation, (3,)."""
        return np.array([self.spread_x, self.spread_y, self.correlation])


def _turned(turn: Array) -> Array:
    T: Array = np.cos(turn)[..., None, None] * np.eye(2) + np.sin(turn)[..., None, None] * QUARTER
    return T


def _placed(spot: Spot, T: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return columns and rows (*b, w) relative to a spot of the turned target, and the spot's covariance (*b, 2, 2)."""
    away = T @ np.array([spot.x, spot.y])
    return x - away[..., 0, None], y - away[..., 1, None], T @ bivariate(*spot.ellipse) @ np.swapaxes(T, -1, -2)


def _detail(self: HotSpots) -> Array:
    """Return the integral of s s' over the plane, s the slopes of the target with amplitude 1, (2, 2)."""
    places = np.array([[spot.x, spot.y] for spot in self.spots]).reshape(-1, 2)
    ellipses = np.array([bivariate(*spot.ellipse) for spot in self.spots]).reshape(-1, 2, 2)
    peaks = np.array([spot.peak for spot in self.spots])
    among = slopes_overlap(ellipses[:, None], ellipses, places[:, None] - places)
    return np.asarray(np.einsum("i,j,ijab", peaks, peaks, among))


@final
@frozen(kw_only=True)
class HotSpots(FittedImage):
    """z_ij = background + amplitude * sum_k peak_k * mean over pixel ij of e^(-d' C_k^-1 d / 2) + noise.

    Spot k is at p + T o_k, and C_k = T C T': T turns the rigid target by `turn`, from x towards y. Amplitude, turn and
    background are axes of the state, which this sensor may learn; the derivative to the turn covers places and ellipses.
    Maybeck, Rogers, Adaptive Tracking of Multiple Hot-Spot Target IR Images, IEEE T-AC 28, 1983.

    >>> from vedette import Frame
    >>> from vedette_flir.camera import Camera
    >>> two = Spot(2.5, 1.6, 0.4), Spot(1.2, 1.2, peak=-0.5, x=3.0, y=-1.0)
    >>> camera = HotSpots(camera=Camera(2.0, window=16), spots=two, gain_turn=0.5)
    >>> x, fine = np.array([[7.6, 7.3, 40.0, 0.5, 10.0]]), (np.arange(320) + 0.5) / 20 - 0.5  # 20 points a pixel
    >>> C = np.array([[2.5**2, 0.4 * 2.5 * 1.6], [0.4 * 2.5 * 1.6, 1.6**2]])
    >>> def image(px, py, turn=0.5):
    ...     T = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    ...     total = 0.0
    ...     for peak, at, cov in ((40.0, [0.0, 0.0], C), (-20.0, [3.0, -1.0], 1.2**2 * np.eye(2))):
    ...         away = np.stack(np.meshgrid(fine - px, fine - py), axis=-1) - T @ at
    ...         total = total + peak * np.exp(-np.sum(away @ np.linalg.inv(T @ cov @ T.T) * away, axis=-1) / 2)
    ...     return total.reshape(16, 20, 16, 20).mean(axis=(1, 3)).ravel()
    >>> z, h = 10.0 + image(7.9, 7.2), image(7.6, 7.3)
    >>> J, g, llr = camera.information(x, Frame(z.reshape(16, 16)), x)
    >>> D = np.array([image(7.601, 7.3) - image(7.599, 7.3), image(7.6, 7.301) - image(7.6, 7.299)]) / 0.002
    >>> np.allclose(J[0], D @ D.T / 4, rtol=1e-3), np.allclose(g[0], D @ (z - 10 - h) / 4, rtol=1e-3)
    (True, True)
    >>> np.allclose(llr[0], h @ (z - 10 - h / 2) / 4, rtol=1e-3)
    True
    >>> np.allclose(np.linalg.inv(camera.noise(x)[0]), J[0], rtol=0.1)
    True
    >>> learnt = camera.learn(x, Frame(10.0 + image(7.6, 7.3, 0.52).reshape(16, 16)))  # half of .02
    >>> np.allclose(learnt, [[7.6, 7.3, 40.0, 0.51, 10.0]], atol=1e-3)
    True
    """

    kind: ClassVar[str] = "hot_spots"

    spots: tuple[Spot, ...] = fields.part(
        "the target's spots", tried=((Spot(1.0, 1.0), Spot(0.8, 1.5, 0.5, x=3.0)), (Spot(1.2, 1.0, -0.3, y=-1.0),))
    )
    gain_amplitude: float = fields.probability("part of a step that the amplitude takes each frame", default=0.0)
    gain_turn: float = fields.probability("part of a step that the turn takes each frame", default=0.0)
    gain_background: float = fields.probability("part of a step that the background takes each frame", default=0.0)

    _detail: Array = field(init=False, repr=False, eq=False, default=Factory(_detail, takes_self=True))

    def __attrs_post_init__(self) -> None:
        if not self.spots:
            raise ValueError("spots: must hold at least one spot, got none")
        half = 0.5 * self.camera.window
        for i, spot in enumerate(self.spots):
            for name in ("spread_x", "spread_y", "x", "y"):
                if abs(value := getattr(spot, name)) > half:
                    told = f"must be within half of the camera's window, {half:g} px, got {value:g} px"
                    raise ValueError(f"spots[{i}].{name}: {told}")

        if np.linalg.eigvalsh(self._detail)[0] <= LEAST_DETAIL * sum(spot.peak**2 for spot in self.spots):
            raise ValueError("spots: must show where the target is, got ones that cancel each other")

    def appearance(self) -> dict[str, str]:
        """Return the axes of amplitude, turn and background."""
        return {"amplitude": "count", "turn": "rad mod 2pi", "background": "count"}

    def gains(self) -> Array:
        """Return the gains (3,)."""
        return np.array([self.gain_amplitude, self.gain_turn, self.gain_background])

    def bounds(self) -> Array:
        """Return the bounds (3, 3)."""
        free = (-np.inf, np.inf, np.inf)
        return np.array([free, TURNS, free])

    def noise(self, x: Array) -> Array:
        """Return R in px^2, (*b, n) -> (*b, 2, 2): that of one frame, from the information in all spots together, turned."""
        amplitude, turn, _ = self.looks(x)
        narrowest = min(np.linalg.det(bivariate(*spot.ellipse)) ** 0.25 for spot in self.spots)
        variance = self.camera.spot_variance(amplitude, np.asarray(narrowest))
        T = _turned(turn)
        still = 0.5 * np.pi * np.linalg.inv(self._detail)
        return kernels.symmetric(variance[..., None, None] * (T @ still @ np.swapaxes(T, -1, -2)))

    def image(self, looks: tuple[Array, ...], x: Array, y: Array) -> Array:
        """Return the sum of the spots."""
        amplitude, turn, _ = looks
        T = _turned(turn)
        parts = [spot.peak * oval(*_placed(spot, T, x, y)) for spot in self.spots]
        return np.asarray(amplitude[..., None, None] * np.sum(parts, axis=0))

    def picture(self, looks: tuple[Array, ...], x: Array, y: Array) -> Picture:
        """Return the sum of the spots."""
        amplitude, turn, _ = looks
        T = _turned(turn)
        parts = [spot.peak * self._one(spot, T, x, y) for spot in self.spots]
        whole = np.sum(parts, axis=0) if len(parts) > 1 else parts[0]
        strength = amplitude[..., None, None]
        image, slopes, turned = whole[..., 0, :, :], whole[..., 1:3, :, :], whole[..., 3, :, :]
        basis = np.stack([image, strength * turned, np.ones_like(image)], axis=-3)
        return Picture(strength * image, strength[..., None] * slopes, basis)

    def _one(self, spot: Spot, T: Array, x: Array, y: Array) -> Array:
        """Return image, slopes to the place and derivative to the turn of one spot of peak 1, (*b, 4, w, w)."""
        columns, rows, C = _placed(spot, T, x, y)
        image, slopes, bends = elliptic(columns, rows, C)
        # dC / dturn = Q C + C Q', and half of u' dC u is u' Q C u.
        QC = QUARTER @ C
        swung = np.stack([QC[..., 0, 0], QC[..., 0, 1] + QC[..., 1, 0], QC[..., 1, 1]], axis=-1)
        carried = T @ np.array([spot.x, spot.y]) @ QUARTER.T
        turned = np.sum(bends * swung[..., None, None], axis=-3) + np.sum(slopes * carried[..., None, None], axis=-3)
        return np.concatenate([image[..., None, :, :], slopes, turned[..., None, :, :]], axis=-3)
