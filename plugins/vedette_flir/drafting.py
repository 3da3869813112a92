"""A config for a video or a folder of images of one's own."""

from __future__ import annotations

import json
import statistics
import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, ConfigError, Frame, Problem, Scan
from vedette_flir.preprocessors.spot_detector import SpotDetector
from vedette_flir.registration import Registration
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sources.boxes import centred, within
from vedette_flir.sources.images import Grey, frames_of
from vedette_flir.sources.stored import IMAGES, PAGED

VIDEOS = (".mp4", ".avi", ".mov", ".mkv", ".m4v", ".mpg", ".mpeg", ".webm", ".wmv", ".ts", ".gif", *PAGED)
"""How the names of videos, and of files of pages, end, in small letters."""

CAMERA = """kind = "box_centroid"
detection_probability = 0.95  # a codec smears or erases a dim target now and then
"""

RATE = """
# rate = 30.0  # frames a second: taken, as images tell none; state your own"""

GIVEN = """
[birth]
kind = "given"
spread = {{ x = 1.0, y = 1.0, vx = {speed}, vy = {speed}, width = 0.0, height = 0.0 }}

[lifecycle]
kind = "reappearing_target"  # its existence says whether it is held, or lost and sought
"""

SIDE, SPEED, ACCEL, SHAKE, OFF = 320.0, 100.0, 400.0, 20.0, 4.0
"""Longer side of the frames, in px, on which the px of a draft's motion were chosen; those of larger ones are as many times
more: by the same camera a target is so many times as fast.
"""

LOOKED, AGREED, APART, ALIKE = 60, 0.5, 12, 0.9
"""Of so many frames, which part of a frame's corners must agree on how the camera turns, in the median: of 23 clips .55 and
more do but for one (.49), of four drawn slopes in noise .46 and less. Or frames so many apart differ, with the turn taken
out, by less than such a part of what they do as they are. By hand.
"""

AUTOMATIC = """automatic = true  # no target is given: the tracker finds them
steady = {steady}     # x and y count from the first frame, however the camera turns; false if it stands, and clouds drift"""

FOUND = """
[sensors.spots]
kind = "detected_box"

[preprocessors.spots]  # what is small and stands out in a frame starts a track
kind = "spot_detector"
clear = 8.0  # contrast over the spread of what is around; less finds dimmer targets, and more that are none
polarity = {polarity}

[preprocessors.spots.sensors.camera]
{camera}
[birth]
kind = "detected"
sensors = ["spots"]
spread = {{ vx = {speed}, vy = {speed} }}

[lifecycle]
kind = "sought_target"  # confirmed by the frames that follow, kept for a while where it is lost
"""

TEXT = """# A draft for {name}: {about}
#
#   vedette run THIS.toml

title = {title}
seed = 1

[source]
kind = "video"
path = {path}{rate}
grey = "luminance"  # what becomes of colours: or "red", "green", "blue"
{start}

[sensors.camera]
{camera}
[estimator]
kind = "template_filter"
resize = 0.05  # the box follows the target's spread; without, it stays as it was found
anchor = 1.0    # the first template counts as much as the smoothed one, and a tenth of the drift from it is taken back
recentre = 0.1  # in each frame: else the template slides along a vapour trail
moves = {centred}  # whether what stands where it was first seen is a part of the scene, until it leaves
centred = {centred}  # whether the target's place is its own middle, not that of the box it was first seen in

[estimator.motion]
kind = "carrying"
carries = {{ width = "px", height = "px" }}

[estimator.motion.motion]
kind = "image_velocity"
sigma_accel = {accel}  # a bird or a drone turns within a few frames; a helicopter does less
shake = {shake}         # a camera in the hand: some {off} px from frame to frame

[gate]
probability = 0.9999

[associator]
kind = "pda"
{begin}
[judge]
cover_radius = 10.0  # px here, as every "m" of the judge
"""


def draft(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Return a config that tracks the targets of a video or a folder of images, None for anything else.

    ConfigError if one of the boxes that are wished for is none.
    """
    if not _shows_images(path):
        return None
    frames = frames_of(path)
    first = next(frames)  # what cannot be read is refused before a config is written
    boxes = _picked(path.name, first) if wishes.get("pick") else _stated(wishes.get("box", ()), first.shape)
    scale = max(max(first.shape) / SIDE, 1.0)
    speed, accel, shake, off = (round(scale * each, 1) for each in (SPEED, ACCEL, SHAKE, OFF))
    begin = GIVEN.format(speed=speed)
    if not boxes:
        steady, some = _shows_turns(chain([first], islice(frames, LOOKED - 1)))
        start, begin = (
            AUTOMATIC.format(steady=str(steady).lower()),
            FOUND.format(camera=CAMERA, polarity=_polarity(some), speed=speed),
        )
        about = "targets are found where they stand out and move"
    elif len(boxes) == 1:
        start, about = f"box = {boxes[0]}", "one target is followed from its box"
    else:
        start, about = f"boxes = {boxes}", f"{len(boxes)} targets are followed from their boxes"
    return TEXT.format(
        name=path.name,
        about=about,
        title=json.dumps(f"Targets in {path.name}"),
        path=json.dumps(str(path)),
        rate=RATE if path.is_dir() or path.suffix.lower() in PAGED else "",
        start=start,
        camera=CAMERA,
        centred="false" if boxes else "true",
        begin=begin,
        accel=accel,
        shake=shake,
        off=f"{off:g}",
    )


def _shows_images(path: Path) -> bool:
    if path.is_dir():  # a run's holds pictures, too
        return not (path / "config.json").exists() and any(file.suffix.lower() in IMAGES for file in path.iterdir())
    return path.suffix.lower() in VIDEOS


def _polarity(frames: Sequence[Grey]) -> str:
    """Return which targets count, and why: hot ones, but if frames show none of them, and most of them dark ones."""

    def found(polarity: str) -> list[int]:
        detector = SpotDetector({"": BoxCentroid()}, polarity=polarity)
        return [len(detector.process({"": Scan.image(0.0, "", Frame(one))}).z) for one in frames]

    if not any(found("hot")) and statistics.median(found("dark")) > 0:
        return '"both"  # nothing hot stands out in its first frames, and dark things do; or "hot", "dark"'
    return '"hot"  # or "dark", "both"'


def _shows_turns(frames: Iterable[Grey]) -> tuple[bool, list[Grey]]:
    """Return whether frames show by what to tell how the camera turns, as noise would turn it; and some of the frames."""
    motion, agreed, some = Registration(), [], list[tuple[Array, Grey]]()
    for k, pixels in enumerate(frames):
        at = motion.take(pixels)
        agreed.append(motion.agreed)
        if k % APART == 0:
            some.append((at, pixels))
    unlike = np.sum(
        [np.zeros(2), *(_unlike(was, now, np.rint(b - a).astype(int)) for (a, was), (b, now) in pairwise(some))], 0
    )
    steady = len(agreed) > 1 and bool(statistics.median(agreed[1:]) >= AGREED or unlike[1] < ALIKE * unlike[0])
    return steady, [pixels for _, pixels in some]


def _unlike(before: Grey, now: Grey, turned: Array) -> Array:
    """Return by how many counts two frames (h, w) differ in what both show, as they are, and with what the camera has
    `turned` by since (2,), whole px, taken out: (2,).
    """
    (x, y), (h, w) = turned, now.shape
    if abs(x) >= w or abs(y) >= h:
        return np.zeros(2)
    shared = np.s_[max(-y, 0) : h - max(y, 0), max(-x, 0) : w - max(x, 0)]
    there = before[max(y, 0) : h + min(y, 0), max(x, 0) : w + min(x, 0)]
    return np.array([np.abs(then.astype(float) - now[shared]).mean() for then in (before[shared], there)])


def _picked(name: str, first: Grey) -> list[list[float]]:
    """Return the boxes that somebody draws in the first frame, their corners counted from 1 as those of `box`."""
    from vedette_report.watching.picking import Picking  # a server, which other drafts do without

    with Picking(name, Frame(first)) as page:
        print(f"draw a box around each target: {page.address}", file=sys.stderr, flush=True)
        return [[round(x + 1.0, 1), round(y + 1.0, 1), round(w, 1), round(h, 1)] for x, y, w, h in page.boxes()]


def _stated(given: Sequence[str], shape: tuple[int, ...]) -> list[list[float]]:
    """Return x, y, w, h of each box as given, such as "120,80,20,12", in a frame of `shape`."""
    boxes, problems = [], []
    for text in given:
        try:
            box = [float(part) for part in text.split(",")]
        except ValueError:
            problems.append(Problem("--box", f"must be X,Y,W,H in px, got {text!r}"))
            continue
        try:
            within(centred(box, 1.0), shape)
        except ValueError as error:
            problems.append(Problem("--box", str(error)))
        boxes.append(box)
    if problems:
        raise ConfigError(problems)
    return boxes
