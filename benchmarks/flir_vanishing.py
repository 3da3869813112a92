"""Drawn targets that vanish among things like them, and come back: is the loss told, and is the target found again?

    python -m benchmarks.flir_vanishing [--draws FROM TO] [--roll DEGREES] [--zoom SHARE]

A scene of 200 x 128 px is drawn for each seed: waves, noise of a count, up to 40 standing spots of .7 to 1.3 of the target's
brightness, of about its size; in half of the draws the camera turns, and spots come into view. The target flies for 40
frames, vanishes at once or within ten frames, and comes back after 20 to 40, in half of the draws some 15 px beside its way.
The camera may roll and zoom around the middle of its frames, too, by so much a frame.
Told: existence below one half, from the eleventh frame on; found: held within 4 px, from the fifteenth frame on.
"""

from __future__ import annotations

import argparse

import numpy as np
from attrs import frozen

from benchmarks.flir_clips import Clip, follow, tracker
from vedette import Array

SIZE, FRAMES, GONE = np.array([200, 128]), 100, 40
SKIPPED, SOON, NEAR, BEYOND = 11, 15, 4.0, 60.0


@frozen
class Camera:
    """A camera that turns by `turn` (2,) px a frame, and rolls by `roll` rad and zooms by `zoom` around its middle."""

    turn: Array
    roll: float
    zoom: float

    def scene(self, k: int, pixels: Array) -> Array:
        """Return which places of the scene pixels (..., 2) show in a frame."""
        off: Array = np.exp(-self.zoom * k) * _rotated(pixels - 0.5 * SIZE, self.roll * k)
        return off + 0.5 * SIZE + k * self.turn

    def pixels(self, k: int, scene: Array) -> Array:
        """Return in which pixels a frame shows places (..., 2) of the scene."""
        off: Array = _rotated(scene - k * self.turn - 0.5 * SIZE, -self.roll * k)
        return off * float(np.exp(self.zoom * k)) + 0.5 * SIZE


def _rotated(places: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(places @ np.array([[c, s], [-s, c]]))


def gaussian(at: Array, spread: float) -> Array:
    """Return a frame with a spot of height 1."""
    x, y = (np.exp(-0.5 * ((np.arange(SIZE[k]) - at[k]) / spread) ** 2) for k in (0, 1))
    return np.outer(y, x)


def vanishing(seed: int, roll: float = 0.0, zoom: float = 0.0) -> tuple[Clip, int]:
    """Return a drawn clip, and in which frame its target is back."""
    rng = np.random.default_rng([79, seed])
    spread, peak, back = rng.uniform(1.3, 3.5), rng.uniform(30.0, 80.0), int(rng.integers(60, 80))
    camera = Camera(rng.integers(2) * rng.normal(0.0, 0.5, 2), roll, zoom)
    angle, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.3, 2.0)
    start, beside = 0.5 * SIZE + rng.normal(0.0, 10.0, 2), rng.integers(2) * rng.normal(0.0, 15.0, 2)
    fades, slope, rough = int(rng.integers(2)), rng.choice([0.0, 0.6]), rng.choice([0.8, 4.0])

    def where(k: int) -> Array:
        """Return the place in the frame; slower once it has vanished, so that it stays in it."""
        along = k - 20 if k < GONE else 20 + 0.3 * (k - GONE)
        place = start + speed * along * np.array([np.cos(angle), np.sin(angle)]) + beside * (k >= back)
        return np.clip(place, 8.0, SIZE - 9.0)

    true = np.array([where(k) for k in range(FRAMES)])
    passed = FRAMES * camera.turn
    low, high, most = np.minimum(passed, 0.0), SIZE + np.maximum(passed, 0.0), 40
    if roll or zoom:
        most = int(most * np.prod(high - low + 2.0 * BEYOND) / np.prod(high - low))
        low, high = low - BEYOND, high + BEYOND
    spots = [
        (at, peak * rng.uniform(0.7, 1.3), spread * rng.uniform(0.8, 1.25))
        for at in rng.uniform(low, high, (int(rng.integers(most)), 2))
    ]
    flown = np.array([camera.scene(k, true[k]) for k in range(GONE)])
    spots = [spot for spot in spots if np.hypot(*(spot[0] - flown).T).min() > 5.0 * spread]
    waves = [(*rng.uniform(0.0, 2.0 * np.pi, 2), 2.0 * np.pi / rng.uniform(15.0, 90.0)) for _ in range(7)]
    bright = np.interp(np.arange(FRAMES), [GONE - 10.0 * fades - 1.0, GONE], [peak, 0.0])
    bright[back:] = peak
    frames, every = [], np.stack(np.meshgrid(*(np.arange(side, dtype=float) for side in SIZE)), axis=-1)
    for k in range(FRAMES):
        x, y = np.moveaxis(camera.scene(k, every), -1, 0)
        scene = 60.0 + slope * y + rough * sum(np.sin(w * (x * np.cos(a) + y * np.sin(a)) + phase) for a, phase, w in waves)
        shown = [height * gaussian(camera.pixels(k, at), wide * np.exp(zoom * k)) for at, height, wide in spots]
        shown.append(bright[k] * gaussian(true[k], spread))
        frames.append(scene + np.max(shown, axis=0) + rng.normal(size=SIZE[::-1]))
    box = np.full(2, 4.5 * spread + 1.0)
    boxes = {k: np.concatenate([true[k], box]) for k in range(FRAMES) if k < GONE or k >= back}
    return Clip(f"draw {seed}", np.array(frames), boxes, ()), back


def part(frames: list[Array]) -> str:
    """Return in which part of the frames, and of how many."""
    every = np.concatenate(frames)
    return f"{every.mean():.2f} of {len(every)}"


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_vanishing", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--draws", nargs=2, type=int, default=(0, 24), metavar=("FROM", "TO"))
    parser.add_argument("--roll", type=float, default=0.0, metavar="DEGREES", help="by which the camera rolls in a frame")
    parser.add_argument("--zoom", type=float, default=0.0, metavar="SHARE", help="by which it zooms in a frame")
    asked, made = parser.parse_args(), tracker()
    told: list[Array] = []
    found: list[Array] = []
    for seed in range(*asked.draws):
        clip, back = vanishing(seed, np.deg2rad(asked.roll), asked.zoom)
        one = follow(made, clip, 0, FRAMES)
        told.append(one.doubted[GONE + SKIPPED : back])
        found.append(np.where(one.doubted, 0.0, one.error < NEAR)[back + SOON :])
        print(f"    {clip.name}: told {part(told[-1:])}, found {part(found[-1:])}")
    print(f"{len(told)} draws: told {part(told)}, found {part(found)}")


if __name__ == "__main__":
    main()
