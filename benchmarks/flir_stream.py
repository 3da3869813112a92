"""Memory and CPU time of a run through a long infrared video, `python -m benchmarks.flir_stream [--minutes N]`.

A video of 320 x 256 px at 30 frames a second is drawn into a temporary folder, a gigabyte an hour, with two warm targets
before a sky and trees. The example's tracker follows one of them as `vedette run` does from a source `video_stream`. Printed
are the resident memory along the run, what it grew by from the first tenth on, and the CPU time of a frame: of the tracker,
and of all, which holds decoding and writing.
"""

from __future__ import annotations

import argparse
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time
from typing import TypeVar

import cv2
import numpy as np

import vedette
from benchmarks.endurance import resident
from vedette_report.running.streaming import stream

T = TypeVar("T")

EXAMPLE = Path(__file__).parents[1] / "examples" / "flir_clip.toml"

WIDE, HIGH, RATE = 320, 256, 30.0

ROUND = 900
"""Frames after which the scene repeats."""

SAMPLES = 20


def scene() -> Iterator[np.ndarray]:
    """Yield the frames of one round: a target of 12 x 8 px on a closed path, one of 6 px, a bright skyline, noise."""
    y, x = np.mgrid[:HIGH, :WIDE]
    dice = np.random.default_rng(1)
    skyline = np.interp(np.arange(WIDE), np.linspace(0, WIDE, 40), dice.uniform(170, 210, 40))
    ground = np.where(y > skyline, 150.0, 60.0 + 0.1 * y) + np.where(y > skyline, dice.normal(0.0, 12.0, y.shape), 0.0)
    for k in range(ROUND):
        turn = 2.0 * np.pi * k / ROUND
        image = ground + dice.normal(0.0, 1.5, y.shape)
        for (a, b), (wide, high), warm in (((1, 2), (5.0, 3.0), 90.0), ((2, 1), (2.5, 2.5), 40.0)):
            at = 160.0 + 90.0 * np.cos(a * turn), 85.0 + 45.0 * np.sin(b * turn)
            image += warm * np.exp(-0.5 * (((x - at[0]) / wide) ** 2 + ((y - at[1]) / high) ** 2))
        yield image.clip(0, 255).astype(np.uint8)


def draw(path: Path, frames: int) -> None:
    """Write a video of so many frames."""
    pictures = [cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) for image in scene()]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE, (WIDE, HIGH))
    for k in range(frames):
        writer.write(pictures[k % ROUND])
    writer.release()


def main() -> None:
    """Draw the video, follow the target, and print what it took."""
    parser = argparse.ArgumentParser("python -m benchmarks.flir_stream", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    frames, held = int(60.0 * RATE * parser.parse_args().minutes), list[float]()

    def watched(scans: Sequence[T], about: str, /) -> Iterator[T]:
        for i, scan in enumerate(scans):
            if i % max(frames // SAMPLES, 1) == 0:
                held.append(resident())
            yield scan

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.avi"
        draw(path, frames)
        config = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
        config["source"] = {"kind": "video_stream", "address": str(path), "box": [238, 79, 26, 16]}
        experiment = vedette.load(config)
        before = process_time()
        done = stream(experiment, Path(folder) / "out", progress=watched)
        took = process_time() - before
    count = done.result.intake.scans
    print(f"{count:,} frames of {WIDE} x {HIGH} px; resident {', '.join(f'{size:.0f}' for size in held)} MB")
    print(f"grown by {held[-1] / held[len(held) // 10] - 1.0:+.1%} after the first tenth")
    print(f"CPU {1e3 * done.result.seconds / count:.2f} ms a frame for tracking, {1e3 * took / count:.2f} ms in all")


if __name__ == "__main__":
    main()
