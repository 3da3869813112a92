"""Targets that nobody marks: how many are found, and how much that is none, by the threshold of `spot_detector`.

    python -m benchmarks.flir_found drawn                      spots over noise by their signal to noise; ten minutes
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_found clips  the first 5 s of each segment of recorded clips
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_found empty  no target: whole segments, backwards too, and drawn turns

Drawn: frames of 256 x 320 px, normal noise of 5 counts over a slope, one spot of spread 2 px that moves by .8 px a frame.
The detector's curve is of single frames; "found" is by examples/flir_found.toml, a track confirmed within 1 s whose place is
the spot's to 3 px; false ones are confirmed in as many times 3 s of noise alone. Of clips a track is right if it lies in
the true box or within 10 px of its middle; others are those of real objects without a label (`UNLABELLED`, told apart by
eye), and false ones. Empty: what is confirmed in whole segments beside the target, forwards and backwards, and where a
camera of 240 x 192 px turns, by up to 2 px a frame, and shakes, by half a pixel, over stills of the clips, and where it
stands, the target painted out, with noise of a count. In brackets: Poisson's 95 %.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.stats import chi2

import vedette
from benchmarks.flir_clips import Clip, clips
from benchmarks.flir_losses import cleaned
from vedette import Array, Frame, Scan
from vedette_flir.registration import Registration
from vedette_flir.spots_in_frame import spots

EXAMPLE = Path(__file__).parents[1] / "examples" / "flir_found.toml"
SHAPE, NOISE, SPREAD = (256, 320), 5.0, 2.0
THRESHOLDS = (2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
WINDOW = (240, 192)
SIDES, MOST, FRAMES = (7, 15, 31, 61), 6, 150

UNLABELLED = {
    ("IR_AIRPLANE_064", 1): [((310.0, 25.0), "a bird that enters above")],
    ("IR_DRONE_043", 0): [((72.0, 15.0), "a flock of birds"), ((238.0, 114.0), "a speck that passes the drone")],
    ("IR_DRONE_149", 0): [((106.0, 83.0), "a speck that moves steadily")],
}


def drawn(snr: float, k: int, run: int) -> tuple[Array, Array]:
    """Return frame k of a run, and where its spot is."""
    rng = np.random.default_rng([run, k])
    at = np.random.default_rng(run).uniform((60.0, 60.0), (250.0, 190.0)) + k * np.array([0.7, 0.4])
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    spot = snr * NOISE * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2.0 * SPREAD**2))
    return 80.0 + 0.1 * x + spot + rng.normal(0.0, NOISE, SHAPE), at


def curve(snr: float, frames: int) -> str:
    """Return the part of the frames in which the spot is detected, and false detections a frame, by threshold."""
    hits, false = [], list[float]()
    for k in range(frames):
        pixels, at = drawn(snr, 0, k)
        found = spots(pixels, 1.0, SIDES, THRESHOLDS[0], MOST, before_edges=True)
        near = np.all(np.abs(found.place - at) < 3.0, axis=1) if len(found.place) else np.zeros(0, dtype=bool)
        hits.append(float(found.clear[near].max(initial=0.0)))
        false += found.clear[~near].tolist() if snr else found.clear.tolist()
    points = [f"{np.mean(np.array(hits) >= t):.2f} / {np.sum(np.array(false) >= t) / frames:.3f}" for t in THRESHOLDS]
    return f"{snr:4.0f}  " + "  ".join(f"{point:>13}" for point in points)


def tracked(pixels: list[Array], made: Any) -> list[tuple[Array, Array]]:
    """Return of each track that is confirmed in the frames, its numbers of frames from there on, and its places then."""
    tracker, detector = made.tracker, made.preprocessors["spots"]
    state, seen, turned = tracker.start(seed=1), dict[int, list[tuple[int, Array]]](), Registration()
    for k, each in enumerate(pixels):
        corner = turned.take(each).copy() if made.source.steady else np.zeros(2)
        frame = Scan.image(k / 30, "camera", Frame(each, corner))
        state = tracker.step(state, Scan(k / 30, "spots", detector.process({"camera": frame})))
        state = tracker.step(state, frame)
        mean = tracker.estimate(state).mean
        for i in np.flatnonzero(state.confirmed):
            seen.setdefault(int(state.ids[i]), []).append((k, mean[i, :2] - corner))
    return [(np.array([k for k, _ in rows]), np.array([at for _, at in rows])) for rows in seen.values()]


def found_in_noise(runs: int) -> None:
    """Print the operating curves, of the detector in single frames and of tracks: found, and false, by the threshold."""
    print("SNR   detected / false a frame at `clear` = " + ", ".join(f"{t:g}" for t in THRESHOLDS))
    for snr in (0.0, 4.0, 6.0, 8.0, 12.0):
        print(curve(snr, 10 * runs), flush=True)
    for clear in THRESHOLDS:
        made = vedette.load(EXAMPLE, overrides=[f"preprocessors.spots.clear={clear}"])
        found = [f"SNR {snr:g} {found_drawn(made, snr, runs):.2f}" for snr in (3.0, 4.0, 6.0, 8.0)]
        false = sum(len(tracked([drawn(0.0, k, run)[0] for k in range(90)], made)) for run in range(runs))
        told(f"clear = {clear:g}: found within 1 s at {', '.join(found)}; confirmed in noise", false, runs / 20)


def found_drawn(made: Any, snr: float, runs: int) -> float:
    """Return the part of drawn spots that a confirmed track is on within a second."""
    right = 0
    for run in range(runs):
        frames = [drawn(snr, k, run) for k in range(31)]
        tracks = tracked([pixels for pixels, _ in frames], made)
        right += any(np.abs(where[0] - frames[when[0]][1]).max() < 3.0 for when, where in tracks)
    return right / runs


def found_in_clips(overrides: list[str]) -> None:
    """Print how often the true target of a segment is found within a second, and what else is confirmed."""
    made = vedette.load(EXAMPLE, overrides=overrides)
    right, visible, seconds, others = 0, 0, 0.0, {"real": 0, "false": 0}
    for clip in (*clips("all"), *clips("odd")):
        for number, (begin, end) in enumerate(clip.segments):
            first = min(k for k in clip.boxes if k >= begin)
            numbers = list(range(first, min(first + FRAMES, end)))
            hit, seconds = False, seconds + len(numbers) / 30
            for when, where in tracked([clip.frames[k] for k in numbers], made):
                box = np.array([clip.boxes.get(first + k, np.full(4, np.nan)) for k in when])
                own = np.abs(where - box[:, :2]) < np.maximum(10.0, 0.5 * box[:, 2:])
                hit = hit or bool(own[when <= 30].all(axis=1).any())
                if not own.all(axis=1).any():
                    real = UNLABELLED.get((clip.name, number), [])
                    what = "".join(told for at, told in real if np.abs(where[0] - at).max() < 20.0)
                    kind = "real" if what else "false"
                    others[kind] += 1
                    print(f"{clip.name} {number}: {kind} from frame {when[0]} at {where[0].round()} {what}", flush=True)
            visible, right = visible + 1, right + hit
            if not hit:
                print(f"{clip.name} {number}: the target is not found within 1 s", flush=True)
    print(
        f"right target within 1 s in {right} of {visible}; in {seconds:.0f} s {others['real']} real ones "
        f"without a label, {others['false']} false: {60 * others['false'] / seconds:.1f} a minute"
    )


def turning(clip: Clip, rng: np.random.Generator, count: int, *, turns: bool = True) -> list[Array]:
    """Return frames of a camera that turns, or stands, over a still of a clip without its target."""
    k = int(rng.choice([k for k in clip.boxes if k < len(clip.frames)]))
    still = cleaned(clip.frames[k].astype(float), clip.boxes[k], rng).astype(np.float32)
    most = np.array(still.shape[::-1]) - WINDOW
    at, step, frames = rng.uniform(0.0, most), rng.uniform(-1.0, 1.0, 2), list[Array]()
    for _ in range(count if turns else 0):
        step = np.clip(step + rng.normal(0.0, 0.1, 2), -2.0, 2.0)
        step = np.where((at + step < 0.0) | (at + step > most), -step, step)
        at = np.clip(at + step, 0.0, most)
        x, y = at + rng.normal(0.0, 0.5, 2)
        move = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y]])
        frame = cv2.warpAffine(still, move, WINDOW, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        frames.append(frame)
    frames = frames or count * [still[int(at[1]) :, int(at[0]) :][: WINDOW[1], : WINDOW[0]]]
    return [np.rint(np.clip(frame + rng.normal(0.0, 1.0, frame.shape), 0, 255)) for frame in frames]


def told(what: str, count: int, minutes: float) -> None:
    """Print how many were confirmed, and the rate a minute with its 95 % interval."""
    low, high = chi2.ppf((0.025, 0.975), (2 * count, 2 * count + 2)) / 2.0 / minutes
    print(
        f"{what}: {count} in {minutes:.1f} min, {count / minutes:.2f} a minute ({np.nan_to_num(low):.2f} to {high:.2f})",
        flush=True,
    )


def found_in_empty(overrides: list[str], runs: int) -> None:
    """Print what is confirmed where no target is."""
    made, recorded = vedette.load(EXAMPLE, overrides=overrides), (*clips("all"), *clips("odd"))
    totals = {"forwards": 0, "backwards": 0}
    parts = [(clip, number, part) for clip in recorded for number, part in enumerate(clip.segments)]
    for way in totals:
        for clip, number, (begin, end) in parts:
            numbers = list(range(begin, min(end, len(clip.frames))))[:: 1 if way == "forwards" else -1]
            boxes = np.array([clip.boxes.get(k, np.full(4, np.nan)) for k in numbers])
            for when, where in tracked([clip.frames[k] for k in numbers], made):
                own = np.abs(where - boxes[when, :2]) < np.maximum(10.0, 0.5 * boxes[when, 2:])
                if not own.all(axis=1).any():
                    totals[way] += 1
                    print(f"{way} {clip.name} {number}: frame {numbers[when[0]]} at {where[0].round()}", flush=True)
        told(f"recorded, {way}, real ones among them", totals[way], sum(end - begin for *_, (begin, end) in parts) / 1800)
    for turns, what in ((True, "a camera that turns over stills"), (False, "one that stands")):
        count = 0
        for run in range(runs):
            rng = np.random.default_rng([7 if turns else 8, run])
            clip = recorded[run % len(recorded)]
            for when, where in tracked(turning(clip, rng, 300, turns=turns), made):
                count += 1
                print(f"run {run}, {clip.name}: frame {when[0]} at {where[0].round()}", flush=True)
        told(what, count, runs / 6)


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_found", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=["drawn", "clips", "empty"])
    parser.add_argument("--runs", type=int, default=20)
    about = "a parameter of the example, such as source.steady=false, for clips"
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help=about)
    given = parser.parse_args()
    if given.what == "drawn":
        found_in_noise(given.runs)
    elif given.what == "clips":
        found_in_clips(given.set)
    else:
        found_in_empty(given.set, given.runs)


if __name__ == "__main__":
    main()
