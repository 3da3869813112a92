"""Targets of recorded infrared clips before the scenes of other clips: is a target held that flies where none of it flew?

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_exchanged [BY ...]

The own light of each segment's target is drawn into the segment `BY` further on, whose own target is taken out, for as long
as both last. Not counted: where that light reaches far beyond the box, so that it is no target's, or covers where the
other was, in more than a tenth of the frames; where a tenth of the frames, or one of the first five, does not show it.
"""

from __future__ import annotations

import argparse

import numpy as np
from attrs import evolve

from benchmarks.flir_cameras import eight
from benchmarks.flir_changed import told
from benchmarks.flir_clips import NEAR, Clip, clips, cut, follow, held, tracker
from benchmarks.flir_looks import own
from vedette import Array

BEYOND, FEWEST, PART = 4.0, 30, 0.1
"""Px by which light may reach beyond 1.3 boxes, the fewest frames, and the part of them that may be otherwise."""

Part = tuple[Clip, int, int]


def wrong(light: Array, box: Array, other: Array | None) -> bool:
    """Return whether light is none, reaches far beyond a box, or covers where another target was."""
    y, x = np.nonzero(light > 0.1 * max(light.max(), 1.0))
    wide = len(x) == 0 or bool(np.any(np.array([np.ptp(x), np.ptp(y)]) > 1.3 * box[2:] + BEYOND))
    return wide or (other is not None and np.hypot(*(box - other)[:2]) < max(box[2:].max(), other[2:].max()))


def exchanged(one: Part, other: Part) -> Clip | None:
    """Return the first segment's target before the scene of the second; None if they do not go together."""
    (frames, boxes), (scenes, others) = cut(*one), cut(*other)
    count = min(len(frames), len(scenes))
    boxes = {k: box for k, box in boxes.items() if k < count}
    if one[0].name == other[0].name or frames.shape[1:] != scenes.shape[1:] or len(boxes) < FEWEST:
        return None
    drawn, odd = scenes[:count].astype(float), 0
    for k in others.keys() & set(range(count)):
        drawn[k] -= own(drawn[k], others[k])
    for k, box in boxes.items():
        light = own(frames[k].astype(float), box)
        odd += wrong(light, box, others.get(k))
        drawn[k] += light
    name = f"{one[0].name} {one[1]} in {other[0].name} {other[1]}"
    return None if odd > PART * count else evolve(one[0], name=name, frames=eight(drawn), boxes=boxes, segments=())


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_exchanged", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("by", nargs="*", type=int, default=[3, 7, 11], metavar="BY")
    made, every = tracker(), []
    parts = [(clip, *part) for which in ("all", "odd") for clip in clips(which) for part in clip.segments]
    for by in parser.parse_args().by:
        for i, part in enumerate(parts):
            clip = exchanged(part, parts[(i + by) % len(parts)])
            if clip is None:
                continue
            one = follow(made, clip, 0, len(clip.frames))
            known = np.isfinite(one.error)
            if one.seen[:5].all() and one.seen[known].mean() >= 1.0 - PART:
                every.append((one, 0))
                if one.lost or held(one).any() or np.mean(one.error[known] <= NEAR) < 0.98:
                    print(f"    {clip.name}: {told([(one, 0)])}", flush=True)
        print(f"up to {by:3}: {told(every)}", flush=True)


if __name__ == "__main__":
    main()
