"""How well `template_filter` follows the recorded infrared clips, and how much that depends on its settings.

    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips segments     20 segments, each from its first true box; ten seconds
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips starts       the same from eleven starts each; two minutes
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips settings     27 settings, and one clip left out; four minutes
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips anew         five starts within each segment, also backwards; minutes
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips whole        whole clips: lost, told, found again; half a minute
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_clips beside       the segments by OpenCV's CSRT and KCF too; a minute

`--set limit=0.7` and the like changes the estimator of examples/flir_clip.toml. FOLDER holds ir_clips: NAME.mp4,
NAME_truth.csv, segments.csv; `--clips odd` or `even` takes those clips of ir_clips_more. A target
is lost in a frame if it is off by more than 15 px and than its box, and held within
5 px or .35 of its box. CSRT and KCF are those of opencv-contrib-python-headless, in place of opencv-python-headless; without
it, `beside` leaves them out and says so.
"""

from __future__ import annotations

import argparse
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import cv2
import numpy as np
from attrs import evolve, frozen

import vedette
from vedette import Array, Frame, Gaussian, Scan
from vedette_flir.evidence import half_ring_spread
from vedette_flir.sources.boxes import read_boxes
from vedette_flir.sources.images import look_through
from vedette_report.pixels import LAST, NEAR

CONFIG = tomllib.loads((Path(__file__).parents[1] / "examples" / "flir_clip.toml").read_text(encoding="utf-8"))

SETTINGS = tuple(product((1.5, 2.0, 3.0), (1.3, 1.5, 1.7), (0.55, 0.65, 0.72)))
"""Values of opening, margin and limit."""

SHIFT, STRETCH = 0.12, 0.2
"""Parts of its side by which a start is moved, and by which it is made larger or smaller."""

SKIPPED = 10
"""Frames of a loss that are not asked for."""

SEEN = 2.0
"""A target is seen in a frame if the brightest of its true box, in the frame blurred by .8 px, is so many spreads above the
calmest half of the ring around: by label and pixels alone, whatever a tracker finds there.
"""


@frozen(eq=False)
class Clip:
    """Frames (k, h, w), true boxes by their frame, centre and size in px, and segments from a first to before a last."""

    name: str
    frames: Array
    boxes: Mapping[int, Array]
    segments: tuple[tuple[int, int], ...]


@frozen(eq=False)
class Followed:
    """What became of one start: error (k,) in px, NaN without a target; true and estimated box (k, 4); doubt (k,); whether
    the frame shows the target (k,).
    """

    clip: str
    error: Array
    true: Array
    found: Array
    doubted: Array
    seen: Array

    @property
    def lost(self) -> bool:
        """Whether all of the last frames are farther off than 10 px and than the box."""
        known = np.isfinite(self.error)
        far = self.error[known] > np.maximum(NEAR, self.true[known, 2:].max(axis=1))
        return bool(far[-LAST:].all())


def clips(which: str = "all") -> list[Clip]:
    """Read the clips that segments.csv of ir_clips names, or the "odd" or "even" ones of ir_clips_more, by their numbers."""
    given, own = os.environ.get("VEDETTE_DATA"), "ir_clips" if which == "all" else "ir_clips_more"
    if given is None or not (folder := Path(given) / own).is_dir():
        raise SystemExit(f"VEDETTE_DATA: must name the folder that holds {own}")
    rows = [row.split(",") for row in (folder / "segments.csv").read_text().split()[1:]]
    if which != "all":
        rows = [row for row in rows if int(row[0].rsplit("_", 1)[1]) % 2 == (which == "odd")]
    found = []
    for name, offset in {row[0]: int(row[1]) for row in rows}.items():
        source = look_through(folder / f"{name}.mp4")
        boxes = {k - offset: box for k, box in read_boxes(folder / f"{name}_truth.csv", 1.0).items()}
        parts = tuple((int(row[2]), int(row[3])) for row in rows if row[0] == name)
        found.append(Clip(name, np.array([source.frame(k) for k in source.numbers]), boxes, parts))
    return found


def cut(clip: Clip, begin: int, end: int) -> tuple[Array, dict[int, Array]]:
    """Return a segment's frames from its first box on, and copies of their boxes."""
    start = min(k for k in clip.boxes if k >= begin)
    frames = clip.frames[start : min(end, len(clip.frames))]
    return frames, {k - start: box.copy() for k, box in clip.boxes.items() if start <= k < start + len(frames)}


def exact(box: Array) -> Array:
    """Return the box as it is."""
    return box


def starts() -> Iterator[Callable[[Array], Array]]:
    """Yield eleven ways to draw a box: exact, moved along an axis, of another size, and both."""
    for dx, dy, scale in (
        *((0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)),
        *((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1)),
    ):
        yield (
            lambda box, dx=dx, dy=dy, scale=scale: np.array(  # type: ignore[misc]
                [*(box[:2] + SHIFT * np.array([dx, dy]) * box[2:]), *((1.0 + STRETCH * scale) * box[2:])]
            )
        )


def follow(
    tracker: Any, clip: Clip, begin: int, end: int, start: Callable[[Array], Array] = exact, rate: float = 30.0
) -> Followed:
    """Follow the target of a clip from its first true box on."""
    first = min(k for k in clip.boxes if k >= begin)
    names, rows = tracker.state.names, []
    prior, spread = np.zeros((1, len(names))), {"x": 1.0, "y": 1.0, "vx": 100.0, "vy": 100.0}
    prior[0, [names.index(name) for name in ("x", "y", "width", "height")]] = start(clip.boxes[first])
    cov = np.diag([spread.get(name, 0.0) ** 2 for name in names])
    state, where = (
        tracker.start(Gaussian(prior, cov[None]), first / rate),
        [names.index(n) for n in ("x", "y", "width", "height")],
    )
    for k in range(first, min(end, len(clip.frames))):
        state = tracker.step(state, Scan.image(k / rate, "camera", Frame(clip.frames[k])))
        true = clip.boxes.get(k, np.full(4, np.nan))
        rows.append([*tracker.estimate(state).mean[0, where], *true, state.existence[0], is_seen(clip.frames[k], true)])
    table = np.array(rows)
    error = np.hypot(*(table[:, :2] - table[:, 4:6]).T)
    return Followed(clip.name, error, table[:, 4:8], table[:, :4], table[:, 8] < 0.5, table[:, 9] > 0)


def is_seen(pixels: Array, box: Array) -> bool:
    """Return whether a frame shows a target in its true box, centre and size in px; not where the box is NaN."""
    if not np.isfinite(box).all():
        return False
    smooth = cv2.GaussianBlur(pixels.astype(np.float32), (0, 0), 0.8)
    low = np.maximum(np.rint(box[:2] - 0.5 * box[2:]).astype(int), 0)
    high = np.maximum(np.rint(box[:2] + 0.5 * box[2:]).astype(int), low) + 1
    level, spread = half_ring_spread(smooth, box[:2], box[2:])
    return bool(smooth[low[1] : high[1], low[0] : high[0]].max(initial=-np.inf) > level + SEEN * spread)


def tracker(**options: Any) -> Any:
    """Return the tracker of the example with other settings of its estimator."""
    return vedette.load(CONFIG, overrides=[f"estimator.{name}={value}" for name, value in options.items()]).tracker


def overlap(one: Followed) -> Array:
    """Return the intersection over the union of found and true box, in the frames with a target (k,)."""
    a, b = (box[np.isfinite(one.error)] for box in (one.found, one.true))
    low = np.maximum(a[:, :2] - 0.5 * a[:, 2:], b[:, :2] - 0.5 * b[:, 2:])
    high = np.minimum(a[:, :2] + 0.5 * a[:, 2:], b[:, :2] + 0.5 * b[:, 2:])
    both = np.prod(np.maximum(high - low, 0.0), axis=1)
    return both / (np.prod(a[:, 2:], axis=1) + np.prod(b[:, 2:], axis=1) - both)


def told(found: list[Followed]) -> str:
    """Return the figures of many runs in a line."""
    error = np.concatenate([one.error[np.isfinite(one.error)] for one in found])
    return (
        f"within 10 px {np.mean(error <= NEAR):.4f}, lost {sum(one.lost for one in found)} of {len(found)}, "
        f"median {np.median(error):.3f} px, 90 % {np.percentile(error, 90):.2f} px, "
        f"overlap {np.mean(np.concatenate([overlap(one) for one in found])):.3f} of frames, "
        f"{np.mean([np.mean(overlap(one)) for one in found]):.3f} of segments"
    )


def on_segments(recorded: list[Clip], options: Mapping[str, Any], start: Callable[[Array], Array] = exact) -> list[Followed]:
    """Follow every segment."""
    made = tracker(**options)
    return [follow(made, clip, *part, start) for clip in recorded for part in clip.segments]


def segments(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print the figures of the segments, and the CPU time of a frame."""
    before = process_time()
    found = on_segments(recorded, options)
    took = 1e3 * (process_time() - before) / sum(len(one.error) for one in found)
    print(f"{told(found)}; {doubted(found)}; {took:.2f} ms of CPU a frame")


def beside(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print the figures of the segments by this tracker and by OpenCV's, each started from the same true box."""
    made = tracker(**options)
    contenders: dict[str, Callable[[Clip, int, int], Followed]] = {"template_filter": lambda *part: follow(made, *part)}
    for name in ("CSRT", "KCF"):
        if hasattr(cv2, f"Tracker{name}_create"):
            contenders[name] = lambda *part, name=name: by_opencv(getattr(cv2, f"Tracker{name}_create")(), *part)  # type: ignore[misc]
        else:
            print(f"{name}: not in this OpenCV {cv2.__version__}; opencv-contrib-python-headless has it")
    for name, of_part in contenders.items():
        before = process_time()
        found = [of_part(clip, *part) for clip in recorded for part in clip.segments]
        took = 1e3 * (process_time() - before) / sum(len(one.error) for one in found)
        good = np.concatenate([held(one) for one in found]).mean()
        print(f"{name}: {told(found)}; good frames doubted {good:.4f}; {took:.2f} ms of CPU a frame", flush=True)


def by_opencv(made: Any, clip: Clip, begin: int, end: int) -> Followed:
    """Follow the target of a clip by a tracker of OpenCV; where it gives no box, the last one stands, doubted."""
    first = min(k for k in clip.boxes if k >= begin)
    frames = clip.frames[first : min(end, len(clip.frames))]
    limits = (0.0, 255.0) if frames.dtype == np.uint8 else np.percentile(frames, (0.1, 99.9))
    x, y, w, h = clip.boxes[first]
    box, rows = (x - 0.5 * (w - 1), y - 0.5 * (h - 1), w, h), []
    for k, pixels in enumerate(frames, first):
        grey = np.clip(255.0 * (pixels - limits[0]) / (limits[1] - limits[0]), 0, 255).astype(np.uint8)
        image, held_still = np.repeat(grey[..., None], 3, axis=2), True
        if k == first:
            made.init(image, tuple(round(side) for side in box))
        else:
            held_still, given = made.update(image)
            box = given if held_still else box
        middle = (box[0] + 0.5 * (box[2] - 1), box[1] + 0.5 * (box[3] - 1), box[2], box[3])
        rows.append([*middle, *clip.boxes.get(k, np.full(4, np.nan)), float(held_still), 1.0])
    table = np.array(rows)
    error = np.hypot(*(table[:, :2] - table[:, 4:6]).T)
    return Followed(clip.name, error, table[:, 4:8], table[:, :4], table[:, 8] < 0.5, table[:, 9] > 0)


def from_starts(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print the figures of each way to start, and of all."""
    every = []
    for number, start in enumerate(starts()):
        found = on_segments(recorded, options, start)
        print(f"start {number:2}: {told(found)}", flush=True)
        every += found
    print(f"all      : {told(every)}")


def anew(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print the figures of starts at five frames of each segment, drawn by a fixed seed, but for its last twenty: from the
    true box, from one off by up to a tenth of its sides, and from the true one on backwards to the segment's start.
    """
    made, runs = tracker(**options), dict[str, list[Followed]](exact=[], jittered=[], backwards=[])
    for number, (clip, begin, last) in enumerate((each, *part) for each in recorded for part in each.segments):
        rng, end = np.random.default_rng([2611, number]), min(last, len(clip.frames))
        known = [k for k in sorted(clip.boxes) if begin <= k < end]
        frames = np.sort(rng.choice(known[:-20] if len(known) > 40 else known[: len(known) // 2], 5, replace=False))
        for k, off in zip(frames, rng.uniform(-0.1, 0.1, (5, 4)), strict=True):
            runs["exact"].append(follow(made, clip, k, end))
            runs["jittered"].append(follow(made, clip, k, end, lambda box, off=off: _moved(box, off)))  # type: ignore[misc]
            if k - begin >= 19:
                boxes = {k - j: clip.boxes[j] for j in sorted(clip.boxes, reverse=True) if begin <= j <= k}
                back = evolve(clip, frames=clip.frames[begin : k + 1][::-1], boxes=boxes)
                runs["backwards"].append(follow(made, back, 0, len(back.frames)))
    for name, found in runs.items():
        lost = ", ".join(one.clip for one in found if one.lost)
        print(f"{name}: {told(found)}; {doubted(found)}; lost are {lost or 'none'}", flush=True)


def _moved(box: Array, off: Array) -> Array:
    return np.array([*(box[:2] + off[:2] * box[2:]), *(box[2:] * np.exp(off[2:]))])


def settings(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print the figures of each setting, and what the best on the other clips gives on each; ties: nearest the middle."""
    tried = _tried(recorded, options)
    for title, pick in (("the first of equals", _best), ("the median of equals", _middle)):
        print(f"one clip left out, {title}: {_left_out(tried, pick)}")


def _tried(recorded: list[Clip], options: Mapping[str, Any]) -> dict[str, Array]:
    """Return by clip, of each setting (27, 3), frames held, frames and targets lost."""
    counts: dict[str, list[Array]] = {clip.name: [] for clip in recorded}
    for opening, margin, limit in SETTINGS:
        found = on_segments(recorded, {**options, "opening": opening, "margin": margin, "limit": limit})
        print(f"opening {opening}, margin {margin}, limit {limit}: {told(found)}", flush=True)
        for name, own in counts.items():
            own.append(np.array(_counted([one for one in found if one.clip == name])))
    return {name: np.array(own) for name, own in counts.items()}


def _counted(found: list[Followed]) -> list[int]:
    error = np.concatenate([one.error for one in found])
    return [int(np.sum(error <= NEAR)), int(np.isfinite(error).sum()), sum(one.lost for one in found)]


def _left_out(tried: Mapping[str, Array], pick: Callable[[Array], int]) -> str:
    """Tell what the setting that is picked on the other clips does on each clip."""
    left = [
        own[pick(np.sum([each[:, 0] for name, each in tried.items() if name != out], axis=0))] for out, own in tried.items()
    ]
    near, frames, lost = np.sum(left, axis=0)
    return f"within 10 px {near / frames:.4f}, lost {lost}"


def _best(count: Array) -> int:
    return int(np.argmax(count))


def _middle(count: Array) -> int:
    """Return the setting nearest, in steps of the grid, to the mean of those within a thousandth of the best."""
    steps = np.array(list(product(range(3), repeat=3)), dtype=float)
    alike = count >= 0.999 * count.max()
    off = np.sum((steps - steps[alike].mean(axis=0)) ** 2, axis=1)
    return int(np.argmin(np.where(alike, off, np.inf)))


def losses(one: Followed) -> list[Array]:
    """Return of each loss or absence whether its frames beyond the first ten are doubted."""
    gone = ~(one.error <= np.maximum(15.0, one.true[:, 2:].max(axis=1)))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], gone.astype(int), [0]]))).reshape(-1, 2)
    return [one.doubted[a + SKIPPED : b] for a, b in edges if b - a > SKIPPED]


def held(one: Followed, *, seen: bool = False) -> Array:
    """Return whether frames in which the target is held well are doubted; of those alone that show it, if it is `seen`."""
    well = one.error <= np.maximum(5.0, 0.35 * one.true[:, 2:].max(axis=1))
    return one.doubted[well & one.seen if seen else well]


def doubted(found: list[Followed]) -> str:
    """Return how many of the frames in which targets are held well are doubted, and of those that show them."""
    every, shown = (np.concatenate([held(one, seen=seen) for one in found]) for seen in (False, True))
    return f"good frames doubted {every.sum()} of {len(every)}; of those that show the target {shown.sum()} of {len(shown)}"


def doubts(found: list[Followed]) -> tuple[float, float, float]:
    """Return the part of lost frames that is doubted, the mean of that over episodes, and the part of good frames."""
    gone = [each for one in found for each in losses(one)]
    good = np.concatenate([held(one) for one in found])
    if not gone:
        return np.nan, np.nan, float(good.mean())
    return float(np.concatenate(gone).mean()), float(np.mean([np.mean(each) for each in gone])), float(good.mean())


def whole(recorded: list[Clip], options: Mapping[str, Any]) -> None:
    """Print what was told of the losses of clips run whole, and how often a target was found within 15 frames of a cut."""
    made = tracker(**options)
    runs = [follow(made, clip, 0, len(clip.frames)) for clip in recorded]
    back = []
    for clip, one in zip(recorded, runs, strict=True):
        parts = ", ".join(f"{each.mean():.2f} of {len(each)}" for each in losses(one)) or "none"
        print(f"{one.clip}: lost frames doubted {parts}; good ones {held(one).sum()} of {len(held(one))}")
        first = min(clip.boxes)
        well = (one.error <= np.maximum(NEAR, 0.5 * one.true[:, 2:].max(axis=1))) & ~one.doubted
        back += [bool(well[start - first : start - first + 16].any()) for start, _ in clip.segments[1:]]
    print(f"{_told(doubts(runs))}; found again within 15 frames in {sum(back)} of {len(back)} cuts; {told(runs)}")
    print(doubted(runs))


def _told(figures: tuple[float, float, float]) -> str:
    return "lost frames doubted {:.3f}, mean of episodes {:.3f}, good ones {:.4f}".format(*figures)


def main() -> None:
    """Run what is asked for."""
    known = {
        "segments": segments,
        "beside": beside,
        "starts": from_starts,
        "settings": settings,
        "anew": anew,
        "whole": whole,
    }
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_clips", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", nargs="+", choices=known)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the estimator")
    about = "all of ir_clips, or those of ir_clips_more with an odd or even number"
    parser.add_argument("--clips", choices=["all", "odd", "even"], default="all", help=about)
    given = parser.parse_args()
    recorded = clips(given.clips)
    for name in given.what:
        known[name](recorded, dict(assigned.split("=", 1) for assigned in given.set))


if __name__ == "__main__":
    main()
