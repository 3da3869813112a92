"""Recorded infrared clips, changed in ways that leave their labels right: is what is followed there followed here, too?

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_changed [KIND ...] [--clips odd] [--losses] [--set NAME=VALUE]

Each segment is changed, and followed from its first true box; without KIND all changes are run, a minute each. With
`--losses` one of the losses of `benchmarks.flir_losses` is planted into each segment before it is changed, another for each
pair of segment and change. Lengths are told in px of the clip as it was recorded.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from attrs import evolve

from benchmarks.flir_cameras import Change, Changed, eight, still, turned, zooms
from benchmarks.flir_clips import NEAR, Clip, Followed, clips, cut, follow, held, losses, tracker
from benchmarks.flir_looks import LOOKS
from benchmarks.flir_losses import KINDS, again, cleaned
from vedette import Array


def _boxes(boxes: dict[int, Array], of: Callable[[int, Array], Array]) -> dict[int, Array]:
    return {k: of(k, box) for k, box in boxes.items()}


def as_it_is(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
    return Changed(frames, boxes)


def mirrored(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
    last = frames.shape[2] - 1
    return Changed(frames[:, :, ::-1].copy(), _boxes(boxes, lambda _, b: np.array([last - b[0], *b[1:]])))


def transposed(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
    return Changed(frames.transpose(0, 2, 1).copy(), _boxes(boxes, lambda _, b: b[[1, 0, 3, 2]]))


def backwards(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
    return Changed(frames[::-1].copy(), {len(frames) - 1 - k: boxes[k] for k in sorted(boxes, reverse=True)})


def negative(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
    return Changed(255 - frames, boxes)


def grey(power: float) -> Change:
    return lambda frames, boxes, rng: Changed(eight(255.0 * (frames / 255.0) ** power), boxes)


def levels(gain: float, level: float, kind: type = np.uint8) -> Change:
    return lambda frames, boxes, rng: Changed(np.rint(gain * frames + level).astype(kind), boxes)


def scaled(by: float) -> Change:
    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        how = cv2.INTER_AREA if by < 1 else cv2.INTER_CUBIC
        sized = np.array([cv2.resize(each, None, fx=by, fy=by, interpolation=how) for each in frames])
        ratio = np.array(sized.shape[:0:-1]) / np.array(frames.shape[:0:-1])
        return Changed(sized, _boxes(boxes, lambda _, b: np.array([*((b[:2] + 0.5) * ratio - 0.5), *(b[2:] * ratio)])), by)

    return change


def noisy(sigma: float) -> Change:
    return lambda frames, boxes, rng: Changed(eight(frames + sigma * rng.normal(size=frames.shape)), boxes)


def blurred(sigma: float) -> Change:
    return lambda frames, boxes, rng: Changed(np.array([cv2.GaussianBlur(f, (0, 0), sigma) for f in frames]), boxes)


def still_images(quality: int) -> Change:
    def one(frame: Array) -> Array:
        coded = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))

    return lambda frames, boxes, rng: Changed(np.array([one(each) for each in frames]), boxes)


def coded(step: float) -> Change:
    """Return what a codec of low rate shows: changes since the frame before, in steps of 8 x 8 cosines."""

    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        y, x = np.mgrid[:8, :8]
        C = np.cos((2 * x + 1) * y * np.pi / 16) * np.where(y == 0, np.sqrt(1 / 8), 0.5)
        h, w = (side // 8 * 8 for side in frames.shape[1:])
        shown, out = frames[0].astype(float), [frames[0]]
        for each in frames[1:]:
            off = (each - shown)[:h, :w].reshape(h // 8, 8, w // 8, 8).transpose(0, 2, 1, 3)
            steps = np.trunc((C @ off @ C.T) / step)
            shown = shown.copy()
            shown[:h, :w] += (C.T @ (steps * step) @ C).transpose(0, 2, 1, 3).reshape(h, w)
            out.append(eight(shown))
        return Changed(np.array(out), boxes)

    return change


def every_second(rate: float) -> Change:
    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        return Changed(frames[::2], {k // 2: box for k, box in boxes.items() if k % 2 == 0}, rate=rate)

    return change


def fainter(share: float) -> Change:
    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        out = [
            share * f + (1 - share) * cleaned(f.astype(float), boxes[k], rng) if k in boxes else f
            for k, f in enumerate(frames)
        ]
        return Changed(eight(out), boxes)

    return change


def planted(kind: str) -> Change:
    def change(frames: Array, boxes: dict[int, Array], rng: np.random.Generator) -> Changed:
        own, kept = [each.astype(float) for each in frames], {k: box.copy() for k, box in boxes.items()}
        if len(own) > 60:
            KINDS[kind](own, kept, rng, None)  # type: ignore[arg-type]
        return Changed(eight(own), kept)

    return change


CHANGES: dict[str, Change] = {
    "as it is": as_it_is,
    "mirrored": mirrored,
    "transposed": transposed,
    "backwards": backwards,
    "negative": negative,
    "gamma .5": grey(0.5),
    "gamma 2": grey(2.0),
    "gain .5": levels(0.5, 60.0),
    "gain .25": levels(0.25, 90.0),
    "14 bit": levels(40.0, 2000.0, np.uint16),
    "size .5": scaled(0.5),
    "size .7": scaled(0.7),
    "size 1.5": scaled(1.5),
    "size 2": scaled(2.0),
    "noise 3": noisy(3.0),
    "noise 8": noisy(8.0),
    "blur 1": blurred(1.0),
    "blur 2": blurred(2.0),
    "jpeg 20": still_images(20),
    "codec 12": coded(12.0),
    "codec 24": coded(24.0),
    "every second": every_second(15.0),
    "every second, not told": every_second(30.0),
    "turned 2": turned(2.0, 0.3),
    "turned 4": turned(4.0, 1.0),
    "followed": still(False),
    "hovers": still(True),
    "target .5": fainter(0.5),
    "trees": planted("trees"),
    "crosses": planted("crosses"),
    "halts": planted("halts"),
}
CHANGES |= LOOKS | {"zooms": zooms(0.005, 1.5), "zooms fast": zooms(0.02, 2.0)}  # the order seeds what is drawn


def changed(recorded: list[Clip], kind: str, *, losing: bool = False) -> list[tuple[Clip, int, float, float]]:
    """Return clips of one changed segment each, in which frame the target is back, 0 for none, the scale and the rate."""
    parts = [(clip, *part) for clip in recorded for part in clip.segments]
    made, number = [], list(CHANGES).index(kind)
    for i, (clip, begin, end) in enumerate(parts):
        frames, boxes = cut(clip, begin, end)
        rng, back = np.random.default_rng([number, i, losing]), 0
        if losing:
            if len(frames) < 150:
                continue
            loss, own = LOSSES[(i + number) % len(LOSSES)], [each.astype(float) for each in frames]
            found = KINDS[loss](own, boxes, rng, parts[(i + len(parts) // 2) % len(parts)][0])
            if found is None:
                continue
            frames, back = eight(own), found
        new = CHANGES[kind](frames, boxes, rng)
        if losing and kind == "backwards":
            continue
        back = back // 2 if len(new.frames) <= len(frames) // 2 + 1 else back
        name = f"{clip.name} {begin}" + (f" {loss}" if losing else "")
        made.append((evolve(clip, name=name, frames=new.frames, boxes=new.boxes, segments=()), back, new.scale, new.rate))
    return made


LOSSES = ("another", "moved", "fades", "gone", "pole", "exit", "tip", "passes")


def in_recorded_px(one: Followed, scale: float) -> Followed:
    return evolve(one, error=one.error / scale, true=one.true / scale, found=one.found / scale)


def part(values: Array) -> float:
    """Return the mean of what is true or not, NaN of nothing."""
    return float(values.mean()) if len(values) else np.nan


def told(runs: list[tuple[Followed, int]]) -> str:
    """Return the figures of runs in a line."""
    error = np.concatenate([one.error[np.isfinite(one.error)] for one, _ in runs])
    gone = np.concatenate([each for one, _ in runs for each in losses(one)] or [np.zeros(0)])
    good, shown = (np.concatenate([held(one, seen=seen) for one, _ in runs]) for seen in (False, True))
    found = [seen for one, back in runs if (seen := again(one, back)) is not None]
    return (
        f"{len(runs):3} runs, within 10 px {np.mean(error <= NEAR):.4f}, lost {sum(one.lost for one, _ in runs):2}, told "
        f"{part(gone):.2f} of {len(gone):4}, good doubted {part(good):.4f}, "
        f"shown {part(shown):.4f}, again {sum(found)} of {len(found)}"
    )


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_changed", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", metavar="KIND")
    parser.add_argument("--clips", choices=["all", "odd", "both"], default="both")
    parser.add_argument("--losses", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the estimator")
    given = parser.parse_args()
    made: Any = tracker(**dict(assigned.split("=", 1) for assigned in given.set))
    recorded = [clip for which in (("all", "odd") if given.clips == "both" else (given.clips,)) for clip in clips(which)]
    for kind in given.kinds or CHANGES:
        runs = []
        for clip, back, scale, rate in changed(recorded, kind, losing=given.losses):
            runs.append((one := in_recorded_px(follow(made, clip, 0, len(clip.frames), rate=rate), scale), back))
            near = float(np.mean(one.error[np.isfinite(one.error)] <= NEAR))
            if near < 0.98 or one.lost or held(one).any():
                print(f"    {clip.name}: {told([(one, back)])}", flush=True)
        print(f"{kind:22} {told(runs)}", flush=True)


if __name__ == "__main__":
    main()
