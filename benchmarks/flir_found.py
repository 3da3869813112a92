"""Targets that nobody marks: how many are found, and how much that is none, by the threshold of `spot_detector`.

    python -m benchmarks.flir_found drawn                      spots over noise by their signal to noise; two minutes
    VEDETTE_DATA=FOLDER python -m benchmarks.flir_found clips  the first 5 s of each segment of recorded clips

Drawn: frames of 256 x 320 px, normal noise of 5 counts over a slope, one spot of spread 2 px that moves by .8 px a frame.
The detector's curve is of single frames; "found" is by examples/flir_found.toml, a track confirmed within 1 s whose place is
the spot's to 3 px. Of clips a track is right if it lies in the true box or within 10 px of its middle; others are
those of real objects without a label (`UNLABELLED`, told apart by eye), and false ones.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from benchmarks.flir_clips import clips
from vedette import Array, Frame, Scan
from vedette_flir.registration import Registration
from vedette_flir.spots_in_frame import spots

EXAMPLE = Path(__file__).parents[1] / "examples" / "flir_found.toml"
SHAPE, NOISE, SPREAD = (256, 320), 5.0, 2.0
THRESHOLDS = (4.0, 5.0, 6.0, 7.0, 8.0, 10.0)
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


def tracked(pixels: list[Array], made: Any, steady: bool = False) -> list[tuple[Array, Array]]:
    """Return of each track that is confirmed in the frames, its numbers of frames from there on, and its places then."""
    tracker, detector = made.tracker, made.preprocessors["spots"]
    state, seen, turned = tracker.start(seed=1), dict[int, list[tuple[int, Array]]](), Registration()
    for k, each in enumerate(pixels):
        corner = turned.take(each).copy() if steady else np.zeros(2)
        frame = Scan.image(k / 30, "camera", Frame(each, corner))
        state = tracker.step(state, frame)
        state = tracker.step(state, Scan(k / 30, "spots", detector.process({"camera": frame})))
        mean = tracker.estimate(state).mean
        for i in np.flatnonzero(state.confirmed):
            seen.setdefault(int(state.ids[i]), []).append((k, mean[i, :2] - corner))
    return [(np.array([k for k, _ in rows]), np.array([at for _, at in rows])) for rows in seen.values()]


def found_in_noise(runs: int) -> None:
    """Print the detector's curve, and how often the tracker finds a spot within a second, and something else."""
    print("SNR   detected / false a frame at `clear` = " + ", ".join(f"{t:g}" for t in THRESHOLDS))
    for snr in (0.0, 4.0, 6.0, 8.0, 12.0):
        print(curve(snr, 10 * runs), flush=True)
    for clear in (4.0, 6.0, 8.0):
        made = vedette.load(EXAMPLE, overrides=[f"preprocessors.spots.clear={clear}"])
        for snr in (0.0, 4.0, 6.0, 8.0):
            right = others = 0
            for run in range(runs):
                frames = [drawn(snr, k, run) for k in range(31)]
                for when, where in tracked([pixels for pixels, _ in frames], made):
                    own = np.abs(where - np.array([frames[k][1] for k in when])).max(axis=1) < 3.0
                    right, others = right + bool(snr and own[0]), others + int(not (snr and own[0]))
            print(
                f"clear = {clear:g}, SNR {snr:g}: found within 1 s in {right} of {runs}; others confirmed {others} in "
                f"{runs * 31 / 30:.0f} s",
                flush=True,
            )


def found_in_clips(clear: float, steady: bool) -> None:
    """Print how often the true target of a segment is found within a second, and what else is confirmed."""
    made = vedette.load(EXAMPLE, overrides=[f"preprocessors.spots.clear={clear}"])
    right, visible, seconds, others = 0, 0, 0.0, {"real": 0, "false": 0}
    for clip in (*clips("all"), *clips("odd")):
        for number, (begin, end) in enumerate(clip.segments):
            first = min(k for k in clip.boxes if k >= begin)
            numbers = list(range(first, min(first + FRAMES, end)))
            hit, seconds = False, seconds + len(numbers) / 30
            for when, where in tracked([clip.frames[k] for k in numbers], made, steady):
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
    print(
        f"clear = {clear:g}: right target within 1 s in {right} of {visible}; in {seconds:.0f} s {others['real']} real ones "
        f"without a label, {others['false']} false: {60 * others['false'] / seconds:.1f} a minute"
    )


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.flir_found", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=["drawn", "clips"])
    parser.add_argument("--steady", action="store_true", help="take out how the camera turns, as `source.steady` does")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--clear", type=float, default=8.0, help="the detector's threshold for clips")
    given = parser.parse_args()
    if given.what == "drawn":
        found_in_noise(given.runs)
    else:
        found_in_clips(given.clear, given.steady)


if __name__ == "__main__":
    main()
