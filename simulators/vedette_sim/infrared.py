"""Simulated infrared frames: hot targets seen through a turbulent atmosphere against a cluttered background."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import (
    Array,
    ConfigError,
    Frame,
    ImagingSensor,
    MotionModel,
    Recording,
    Scan,
    Sensor,
    Source,
    Space,
    Trajectory,
    fields,
)
from vedette.sampling import draw_states

IMAGE = Space.of(x="px", y="px", jx="px", jy="px", width="px", height="px")

Spectrum = NDArray[np.complexfloating[Any, Any]]

_CHUNK = 256
"""Frames whose noise is drawn at once."""

_PIXELS = 2**18
"""Pixels whose background is drawn at once, so that they stay in the cache."""


@final
@frozen
class HotSpot:
    """A circular hot spot of a target: each pixel shows its mean of peak * e^(-r^2 / 2 spread^2)."""

    peak: float = fields.quantity("count", "intensity in its middle; negative for a cold spot")
    spread: float = fields.quantity("px", "standard deviation of its profile", above=0)
    x: float = fields.quantity("px", "place on the target", default=0.0)
    y: float = fields.quantity("px", "place on the target", default=0.0)


@final
@frozen
class HotTarget:
    """A target that moves through the image. It appears at the sum of some axes of its motion; its spots turn about that.

    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> start = {"x": (20.0, 0.0), "y": (15.0, 0.0), "vx": (6.0, 0.0), "vy": (-4.0, 0.0)}
    >>> spots = HotSpot(50.0, 2.0), HotSpot(-20.0, 1.0, 3.0, -4.0)
    >>> target = HotTarget(ImageVelocity(1e-9, 0.0), spots, start, turn_rate=0.8)
    >>> target.box()  # from -4 to 5 across, from -6 to 4 down
    (9.0, 10.0)
    >>> target.path(np.array([0.0, 0.5]), np.random.default_rng(0)).round(6).tolist()
    [[20.0, 15.0, 0.0, 0.0], [23.0, 13.0, 0.0, 0.0]]
    >>> def line(size, at, spread):  # 20 points a pixel
    ...     u = ((np.arange(20 * size) + 0.5) / 20 - 0.5 - at) / spread
    ...     return np.exp(-(u**2) / 2).reshape(-1, 20).mean(axis=1)
    >>> def spot(peak, spread, x, y):
    ...     return peak * np.outer(line(30, y, spread), line(40, x, spread))
    >>> seen, c, s = np.zeros((1, 30, 40)), np.cos(0.4), np.sin(0.4)
    >>> target.add_to(seen, np.array([[20.3, 15.6]]), np.array([0.5]))
    >>> wanted = spot(50.0, 2.0, 20.3, 15.6) + spot(-20.0, 1.0, 20.3 + 3 * c + 4 * s, 15.6 + 3 * s - 4 * c)
    >>> np.allclose(seen[0], wanted, atol=0.02)
    True
    """

    motion: MotionModel = fields.part("how it moves, in px")
    spots: tuple[HotSpot, ...] = fields.part("its hot spots")
    start: dict[str, tuple[float, float]] = fields.table("axis to [mean, standard deviation] at the start", pairs=True)
    jitter_x: tuple[str, ...] = fields.words("axes that are added to x where it appears", default=())
    jitter_y: tuple[str, ...] = fields.words("axes that are added to y where it appears", default=())
    turn_rate: float = fields.quantity("rad/s", "how fast the spots turn, from x towards y", default=0.0)

    def __attrs_post_init__(self) -> None:
        space = self.motion.state
        if sorted(self.start) != sorted(space.names):
            raise ValueError(f"start: must give the axes {', '.join(space.names)}, got {', '.join(self.start) or 'none'}")
        if not self.spots:
            raise ValueError("spots: must hold at least one hot spot, got none")
        for name in ("x", "y", *self.jitter_x, *self.jitter_y):
            if name not in space or space.axes[space.names.index(name)].unit != "px":
                raise ValueError(f"motion: must have the axis {name!r} in px; it has {space}")

    def path(self, times: Array, rng: np.random.Generator) -> Array:
        """Draw x, y without jitter, and the jitter of both, at `times` (s,): (s, 4)."""
        space = self.motion.state
        mean, deviation = np.array([self.start[name] for name in space.names]).T
        states = draw_states(self.motion, mean + deviation * rng.standard_normal(len(space)), times, rng)
        place = states[:, [space.names.index(name) for name in ("x", "y")]]
        jitter = [
            np.sum(states[:, [space.names.index(name) for name in names]], axis=1)
            for names in (self.jitter_x, self.jitter_y)
        ]
        return np.column_stack([place, *jitter])

    def box(self) -> tuple[float, float]:
        """Return the width and height of the box that holds its spots at the start, to twice their spreads."""
        low, high = (
            np.array([[spot.x + side * 2 * spot.spread, spot.y + side * 2 * spot.spread] for spot in self.spots])
            for side in (-1, 1)
        )
        width, height = high.max(axis=0) - low.min(axis=0)
        return float(width), float(height)

    def add_to(self, frames: Array, where: Array, times: Array) -> None:
        """Add the spots to frames (s, h, w) at the apparent places `where` (s, 2)."""
        turn = self.turn_rate * times
        cos, sin = np.cos(turn), np.sin(turn)
        across, down = [], []
        for spot in self.spots:
            x, y = where[:, 0] + cos * spot.x - sin * spot.y, where[:, 1] + sin * spot.x + cos * spot.y
            across.append(_share(frames.shape[2], x, spot.spread))
            down.append(spot.peak * _share(frames.shape[1], y, spot.spread))
        frames += np.stack(down, axis=2) @ np.stack(across, axis=1)


def _share(size: int, at: Array, spread: float) -> Array:
    """Return e^(-u^2 / 2 s^2) averaged over each of `size` pixels, for each place `at` (s,): (s, size)."""
    from scipy.special import ndtr

    edges = (np.arange(size + 1) - 0.5 - at[:, None]) / spread
    return np.sqrt(2.0 * np.pi) * spread * np.diff(ndtr(edges), axis=1)


@final
@frozen
class InfraredScene(Source):
    """Frames of hot targets: their spots, a background that is correlated over space and time, and white pixel noise.

    The background is a stationary Gaussian field with covariance clutter^2 e^(-d^2 / 4 l^2) e^(-t / tau), which the drift of
    the platform carries along with the targets. Dead pixels are NaN. Every target, the background and the noise have a
    random stream of its own: another target changes nothing else.

    >>> from vedette_flir.motion.image_velocity import ImageVelocity
    >>> from vedette_flir.sensors.gaussian_spot import GaussianSpot
    >>> start = {"x": (120.0, 0.0), "y": (230.0, 0.0), "vx": (6.0, 0.0), "vy": (-4.0, 0.0)}
    >>> spot = {"a": HotTarget(ImageVelocity(1e-9, 0.0), (HotSpot(90.0, 2.0, 3.0, 1.0),), start)}
    >>> camera = {"eye": GaussianSpot()}
    >>> settings = {"frames": 3, "rate": 2.0, "sigma": 0.0, "level": 7.0, "drift": [2.0, 5.0]}
    >>> made = InfraredScene(spot, 40, 48, corner=[100.0, 200.0], **settings).open(camera, np.random.default_rng(1))
    >>> made.scans[2].time, made.truth[0].states[2].round(6).tolist()  # moved by 6 + 2 and -4 + 5 px in 1 s
    (1.0, [128.0, 231.0, 0.0, 0.0, 8.0, 8.0])
    >>> light = made.scans[2].frame.pixels - 7.0
    >>> rows, columns = np.arange(48), np.arange(40)
    >>> middle = [light.sum(axis=0) @ columns / light.sum(), light.sum(axis=1) @ rows / light.sum()]
    >>> np.allclose([light.sum(), *middle], [90 * 2 * np.pi * 2.0**2, 31.0, 32.0], rtol=1e-4)
    True
    >>> made.scans[2].frame.corner.tolist()
    [100.0, 200.0]
    >>> noisy = InfraredScene(spot, 64, 64, frames=40, rate=4.0, sigma=3.0, level=50.0, dead=0.2)  # its target is outside
    >>> pixels = np.stack([scan.frame.pixels for scan in noisy.open(camera, np.random.default_rng(1)).scans])
    >>> np.allclose([np.nanmean(pixels), np.nanstd(pixels), np.isnan(pixels).mean()], [50.0, 3.0, 0.2], rtol=0.05)
    True
    >>> clouds = {"clutter": 6.0, "clutter_length": 3.0, "clutter_time": 0.5, "drift": [8.0, -4.0]}  # 2 and -1 px a frame
    >>> cloudy = InfraredScene(spot, 128, 128, frames=120, rate=4.0, sigma=0.0, **clouds)
    >>> z = np.stack([scan.frame.pixels for scan in cloudy.open(camera, np.random.default_rng(1)).scans])
    >>> lags = [np.mean(z * z), np.mean(z * np.roll(z, 3, axis=2)), np.mean(z * np.roll(z, 4, axis=1))]
    >>> lags.append(np.mean(z[1:] * np.roll(z[:-1], (2, -1), axis=(2, 1))))
    >>> np.allclose(np.divide(lags, 36.0), [1.0, np.exp(-9 / 36), np.exp(-16 / 36), np.exp(-0.5)], rtol=0.1)
    True
    """

    kind: ClassVar[str] = "infrared_scene"

    targets: Mapping[str, HotTarget] = fields.part("name to target")
    width: int = fields.integer("pixels of a row", default=64, at_least=8, at_most=512)
    height: int = fields.integer("rows", default=64, at_least=8, at_most=512)
    corner: Array = fields.pair("px", "[x, y] of the first pixel", default=(0.0, 0.0))
    frames: int = fields.integer("number of frames", default=300, at_least=1, at_most=100_000)
    rate: float = fields.quantity("1/s", "frames per second", default=30.0, above=0)
    sigma: float = fields.quantity("count", "standard deviation of the pixels' white noise", default=1.0, at_least=0)
    level: float = fields.quantity("count", "mean of the background", default=0.0)
    clutter: float = fields.quantity("count", "standard deviation of the background", default=0.0, at_least=0)
    clutter_length: float = fields.quantity("px", "scale l of the background's correlation", default=2.0, above=0)
    clutter_time: float = fields.quantity("s", "time after which the background's correlation is 1/e", default=1.0, above=0)
    drift: Array = fields.pair("px/s", "[x, y] of the image's drift by the platform's", default=(0.0, 0.0))
    dead: float = fields.probability("part of the pixels that are dead", default=0.0, below=1)

    def __attrs_post_init__(self) -> None:
        if not self.targets:
            raise ValueError("targets: must hold at least one target, got none")

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all frames, and each target's x, y, jitter jx, jy and box: it appears at x + jx, y + jy."""
        cameras = [name for name, sensor in sensors.items() if isinstance(sensor, ImagingSensor)]
        if len(sensors) != 1 or len(cameras) != 1:
            raise ConfigError.at("sensors", f"frames need one sensor, a camera; got {', '.join(sensors) or 'none'}")
        root = int(rng.integers(2**63))
        times = np.arange(self.frames) / self.rate
        shift = times[:, None] * np.asarray(self.drift)
        paths = {}
        for name, target in self.targets.items():
            paths[name] = target.path(times, np.random.default_rng([root, 1, *name.encode()]))
            paths[name][:, :2] += shift
        scans = []
        for first, block in self._blocks(root, times, shift, paths):
            scans += [
                Scan.image(float(times[first + i]), cameras[0], Frame(image, self.corner)) for i, image in enumerate(block)
            ]
        truth = tuple(
            Trajectory(name, IMAGE, times, np.column_stack([path, np.tile(self.targets[name].box(), (len(times), 1))]))
            for name, path in paths.items()
        )
        return Recording(tuple(scans), truth)

    def _blocks(self, root: int, times: Array, shift: Array, paths: Mapping[str, Array]) -> list[tuple[int, Array]]:
        """Return the first frame's number and the frames (s, h, w) of each chunk."""
        noise, field = (np.random.default_rng([root, stream]) for stream in (2, 3))
        dead = np.random.default_rng([root, 4]).random((self.height, self.width)) < self.dead
        blocks: list[tuple[int, Array]] = []
        state = None
        for first in range(0, self.frames, _CHUNK):
            part = slice(first, min(first + _CHUNK, self.frames))
            images = noise.standard_normal((part.stop - first, self.height, self.width))
            images *= self.sigma
            images += self.level
            if self.clutter > 0:
                state = self._add_background(images, shift[part], state, field)
            for name, target in self.targets.items():
                where = paths[name][part, :2] + paths[name][part, 2:] - self.corner
                target.add_to(images, where, times[part])
            images[:, dead] = np.nan
            blocks.append((first, images))
        return blocks

    def _add_background(self, images: Array, shift: Array, state: Spectrum | None, rng: np.random.Generator) -> Spectrum:
        """Add the drifted field to frames (s, h, w); return the spectrum (h, w/2 + 1) that the next frame starts from.

        The field is on a torus: white noise times the root of its spectrum; a drift is a phase.
        """
        from scipy.fft import irfft2, rfft2

        ky, kx = np.fft.fftfreq(self.height), np.fft.rfftfreq(self.width)
        root = np.exp(-((2.0 * np.pi * self.clutter_length) ** 2) * (ky[:, None] ** 2 + kx**2) / 2.0)
        full = np.exp(
            -((2.0 * np.pi * self.clutter_length) ** 2) * (ky[:, None] ** 2 + np.fft.fftfreq(self.width) ** 2) / 2.0
        )
        root *= self.clutter / np.sqrt(np.mean(full**2))
        keep = np.exp(-1.0 / self.rate / self.clutter_time)
        at_once = max(1, _PIXELS // (self.height * self.width))
        for first in range(0, len(images), at_once):
            part, moved = images[first : first + at_once], shift[first : first + at_once]
            spectra = rfft2(rng.standard_normal(part.shape))
            spectra *= root
            if state is not None:
                spectra[0] = keep * state + np.sqrt(1.0 - keep**2) * spectra[0]
            for before, now in pairwise(spectra):
                now *= np.sqrt(1.0 - keep**2)
                now += keep * before
            state = spectra[-1].copy()
            if moved.any():
                spectra *= np.exp(-2j * np.pi * moved[:, 1, None] * ky)[..., None]
                spectra *= np.exp(-2j * np.pi * moved[:, 0, None] * kx)[:, None, :]
            part += irfft2(spectra, part.shape[1:])
        assert state is not None
        return state
