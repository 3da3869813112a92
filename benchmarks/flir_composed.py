"""Targets of recorded infrared clips before other clips' scenes, with what no clip shows: which kind of it is hard?

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_composed [--seeds FROM TO] [--half odd] [KIND ...]

Two clips of up to 120 frames are composed of each seed, the second coded coarsely, too. A target's own light (`flir_looks`)
flies its own way in the frames of another segment, whose own target is taken out and whose camera turns as it was recorded.
The target is opaque: what is hotter than it, it hides. Its kind is one of

nears, leaves, turns, flaps   the target's look: it grows by .01 to .03 a frame, shrinks, turns by 2 to 6 degrees, beats
trees, cloud, ground, houses  it flies before them in mid-clip: crowns, a soft cloud, land hotter than it, lit windows
hides                         trees as hot as it hide it for some 20 frames
glare                         the sun stands beside its way
twin                          its like crosses its way
text, dead                    a cross-hair and letters over its way; pixels that are stuck, or blink
gain, frozen, interlaced      gain and level jump; frames are repeated for 2 to 8; even rows are of the frame before
jerks, smears, zooms, noise   the camera swings by 8 to 30 px within two frames, shakes and smears, zooms by 1.5 in 5 frames;
                              columns and pixels are noisy

Found: held within 15 frames after it was hidden, or the camera swung.
"""

from __future__ import annotations

import argparse
from functools import cache
from typing import Any

import cv2
import numpy as np
from attrs import evolve, frozen

from benchmarks.flir_cameras import eight
from benchmarks.flir_changed import coded, told
from benchmarks.flir_clips import NEAR, Clip, clips, cut, follow, held, is_seen, tracker
from benchmarks.flir_defects import DEFECTS
from benchmarks.flir_exchanged import PART, Part, wrong
from benchmarks.flir_looks import LOOKS, own
from benchmarks.flir_scenery import SCENERY, Draft
from vedette import Array
from vedette_flir.registration import Registration

LONGEST, SHORTEST, EVEN, FULL = 120, 80, 2.5, 0.7
"""Frames of a clip, at most and at least; how many times as bright or as faint as usual a target's light may be, and which
part of where it is looked for it may fill, so that it is its own, but for `PART` of the frames.
"""

HOTTEST, SHOWN = 235.0, 0.8
"""Count of the hottest scenery; part of the frames, and the first five, that must show a target (`is_seen`)."""


OF_LOOKS = {
    "nears": ("nearer", "nearer fast"),
    "leaves": ("farther", "farther"),
    "turns": ("turns 2", "turns 6"),
    "flaps": ("beats", "yaws fast"),
}
KINDS = [*OF_LOOKS, *SCENERY, *DEFECTS]


@frozen(eq=False)
class Own:
    """A target's own light in a frame, of a part whose first pixel is `low` (2,), and whether it is its own and whole."""

    low: Array
    light: Array
    sure: bool

    def on(self, frame: Array, sign: float) -> None:
        """Add it to a frame, or take it out."""
        (x, y), (h, w) = self.low, self.light.shape
        frame[y : y + h, x : x + w] += sign * self.light


def cutout(frame: Array, box: Array) -> Own:
    """Return a target's own light in a frame (h, w), looked for near its box."""
    half = 2.0 * float(box[2:].max()) + 10.0
    low, high = np.clip(np.rint(box[:2] - half), 0, None).astype(int), np.rint(box[:2] + half).astype(int) + 1
    at = box - [*low, 0.0, 0.0]
    light = own(np.ascontiguousarray(frame[low[1] : high[1], low[0] : high[0]], dtype=float), at).astype(np.float32)
    moments = cv2.moments(light)
    middle = np.array([moments["m10"], moments["m01"]]) / max(moments["m00"], 1.0)
    beside = np.any(np.abs(middle - at[:2]) > 0.3 * box[2:] + 1.0)
    full = np.sum(light > 0.1 * light.max()) > FULL * np.prod(1.2 * box[2:] + 2.0)  # that is noise, or scenery
    return Own(low, light, not (beside or full or wrong(light, at, None)))


@cache
def flown(part: Part, look: str = "") -> tuple[dict[int, Array], dict[int, Own], float] | None:
    """Return a segment's boxes, the target's own light and how bright that is; None where it is not its own throughout."""
    frames, boxes = cut(*part)
    boxes = {k: box for k, box in boxes.items() if k < LONGEST}
    if look:
        changed = LOOKS[look](frames[:LONGEST], boxes, np.random.default_rng(0))
        frames, boxes = changed.frames, changed.boxes
    lights = {k: cutout(frames[k], box) for k, box in boxes.items()}
    tops = np.array([each.light.max() for each in lights.values()])
    bright = float(np.median(tops))
    sure = np.array([each.sure for each in lights.values()]) & (tops < EVEN * bright) & (tops > bright / EVEN)
    whole = len(boxes) >= SHORTEST and all(k in boxes and lights[k].light.any() for k in range(5))
    return (boxes, lights, bright) if whole and sure.mean() >= 1.0 - PART else None


@cache
def scene(part: Part) -> tuple[Array, Array, dict[int, Array]]:
    """Return a segment's frames, where their first pixel is in the first (k, 2), and its boxes."""
    (frames, boxes), camera = cut(*part), Registration()
    frames = frames[:LONGEST]
    return frames, np.array([camera.take(frame) for frame in frames]), boxes


def draft(one: Part, other: Part, look: str, rng: np.random.Generator) -> Draft | None:
    """Return the first segment's target beside the scene of the second; None if they do not go together."""
    if one[0].name == other[0].name or min(part[2] - part[1] for part in (one, other)) < SHORTEST:
        return None
    target, (scenes, at, others) = flown(one, look), scene(other)
    if target is None:
        return None
    drawn = scenes.astype(np.float32)
    boxes = {k: box for k, box in target[0].items() if k < len(drawn)}
    met = [
        k in others and bool(np.hypot(*(box - others[k])[:2]) < max(box[2:].max(), others[k][2:].max()))
        for k, box in boxes.items()
    ]
    if len(boxes) < SHORTEST or np.mean(met) > PART:
        return None
    for k in others.keys() & set(range(len(drawn))):
        cutout(drawn[k], others[k]).on(drawn[k], -1.0)
    lights = np.zeros_like(drawn)
    for k in boxes:
        target[1][k].on(lights[k], 1.0)
    x, y = np.rint(boxes[0][:2]).astype(int)
    level = float(np.median(drawn[0][max(y - 15, 0) : y + 16, max(x - 15, 0) : x + 16]))
    return Draft(drawn, at[: len(drawn)], lights, boxes, level, target[2], rng)


def bounded(it: Draft) -> None:
    """Make a target so faint that scenery 1.8 times as hot is below the hottest count."""
    most = max(HOTTEST - it.level, 0.0) / 1.8
    it.lights *= min(most / it.bright, 1.0)
    it.bright = min(it.bright, most)


def kind_of(seed: int, number: int) -> str:
    """Return the kind of a seed's first or second clip."""
    return KINDS[(seed // 2 + number * len(KINDS) // 2) % len(KINDS)]


def composed(seed: int, number: int, parts: list[Part]) -> tuple[Clip, int]:
    """Return a seed's first or second clip, and in which frame its target is back, 0 for none."""
    kind, rng = kind_of(seed, number), np.random.default_rng([97, seed, number])
    while True:
        one, other = (parts[i] for i in rng.integers(len(parts), size=2))
        it = draft(one, other, OF_LOOKS[kind][number] if kind in OF_LOOKS else "", rng)
        if it is None:
            continue
        if kind in SCENERY:
            bounded(it)
            SCENERY[kind](it)
        frames = it.drawn()
        back = DEFECTS[kind](frames, it.boxes, rng) if kind in DEFECTS else it.back
        shown = [is_seen(frames[k], box) for k, box in sorted(it.boxes.items())]
        if not shown or not all(shown[:5]) or np.mean(shown) < SHOWN:
            continue
        if number:
            frames = coded(8.0)(np.clip(frames, 0.0, 255.0), it.boxes, rng).frames
        name = f"{seed} {kind}: {one[0].name} {one[1]} in {other[0].name} {other[1]}"
        return evolve(one[0], name=name, frames=eight(frames), boxes=it.boxes, segments=()), back


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_composed", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", metavar="KIND")
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 100), metavar=("FROM", "TO"))
    parser.add_argument("--half", choices=["odd", "even"], default="odd")
    given, made = parser.parse_args(), tracker()
    parts = [(clip, *part) for which in ("all", "odd") for clip in clips(which) for part in clip.segments]
    runs: dict[str, list[Any]] = {kind: [] for kind in given.kinds or KINDS}
    for seed in range(*given.seeds):
        for number in (0, 1):
            kind = kind_of(seed, number)
            if seed % 2 != (given.half == "odd") or kind not in runs:
                continue
            clip, back = composed(seed, number, parts)
            one = follow(made, clip, 0, len(clip.frames))
            runs[kind].append((one, back))
            near = np.mean(one.error[np.isfinite(one.error)] <= NEAR)
            if one.lost or held(one).any() or near < 0.98:
                print(f"    {clip.name}: {told([(one, back)])}", flush=True)
    for kind, own_runs in runs.items():
        if own_runs:
            print(f"{kind:10} {told(own_runs)}", flush=True)
    print(f"{'all':10} {told([one for each in runs.values() for one in each])}")


if __name__ == "__main__":
    main()
