"""Recorded images as a source of frames."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, cast, final

import numpy as np
from attrs import frozen

from vedette import (
    Array,
    ConfigError,
    Frame,
    ImagingSensor,
    InputError,
    LazyScans,
    Problem,
    Recording,
    Rows,
    Scan,
    Sensor,
    Source,
    Trajectory,
    fields,
)
from vedette_files import Apart
from vedette_files.input_files import inside, user_path
from vedette_flir.registration import Registration
from vedette_flir.sources.boxes import (
    BOX,
    Segment,
    boxes_and_absences,
    four,
    fours,
    given_boxes,
    in_sight,
    meets,
    read_segment,
)
from vedette_flir.sources.images import WEIGHTS, Grey, look_through, signed

TURNED = 5.0
"""Px by which the camera turns from which on it is told. By hand."""


@final
@frozen
class VideoSource(Source):
    """Frames of a video file or of a folder of images, 8 or 16 bit, grey; the target's boxes where they are known.

    Frames are decoded when they are asked for: one is in memory, however long the video. Files of boxes and segments lie in
    the folder that holds the clip.

    The first true box is where the target is: earlier frames are skipped. `box`, or one of `boxes` for each target, says it
    instead, in the first frame; without a file of true boxes nothing is judged. Boxes are x, y, w, h in px, the corner
    counted from `first_pixel`. A `segment` is a part of the clip without a cut, from a file segments.csv with the columns
    clip, label_offset, start, end_excl. Unreadable frames and those of another size are refused, one by one.
    """

    kind: ClassVar[str] = "video"
    draws: ClassVar[bool] = False

    path: str = fields.text(
        "a video, a TIFF file of pages, or a folder of images in the order of their names and numbers", default=""
    )
    truth: str = fields.text(
        "file of true boxes, frame,x,y,w,h; default: NAME_truth.csv beside NAME, if it is there", default=""
    )
    box: Array | None = fields.array(
        "px", "[x, y, w, h] of the target in the first frame; default: the first true box", ndim=1, default=None, check=four
    )
    boxes: Array | None = fields.array(
        "px", "a box for each of several targets in the first frame, [[x, y, w, h], ...]", ndim=2, default=None, check=fours
    )
    segment: int | None = fields.integer("which segment of the clip, counted from 0; default: the whole clip", default=None)
    segments: str = fields.text("file of segments; default: segments.csv beside the clip", default="")
    rate: float | None = fields.quantity(
        "1/s", "frames per second; default: the times that the file states, or 30", default=None, above=0
    )
    first_pixel: float = fields.quantity("px", "what a box calls the first pixel", default=1.0)
    grey: str = fields.choice(
        "how colours become grey levels; equal: colours are refused", ("equal", *WEIGHTS), default="luminance"
    )
    apart: Apart | None = fields.part(
        "limits of a process of its own that decodes the frames; default: none, this process decodes", default=None
    )
    automatic: bool = fields.flag("no target is given: the tracker finds them", default=False)
    negative: bool = fields.flag("take the frames' negative: hot is dark", default=False)
    steady: bool = fields.flag(
        "measure how the camera turns and take it out: x and y are counted from the first frame's first pixel", default=False
    )

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """All frames from the first box on, and its trajectory as the truth: x, y, width, height."""
        camera = camera_of(sensors)
        if not self.path:
            raise ConfigError.at("path", "is missing: a video file, or a folder of images")
        try:
            path = user_path(self.path)
        except ValueError as error:
            raise ConfigError.at("path", str(error)) from None
        camera_motion, corners = Registration(), list[Array]()

        def watch(grey: Grey) -> None:
            if self.steady:
                corners.append(camera_motion.take(grey))

        clip = look_through(path, self.grey, watch, self.apart)
        corner = dict(zip(clip.numbers, corners, strict=False))  # empty where the camera's motion is not asked for
        rate = self.rate or clip.rate or 30.0
        part = Segment(0, clip.numbers[-1] + 1, 0)
        if self.segment is not None:
            part = read_segment(self._beside(path, "segments", "segments.csv"), path.stem, self.segment)
        times = {number: number / rate for number in range(clip.numbers[-1] + 1)}
        if self.rate is None and clip.times is not None:
            times = dict(zip(clip.numbers, clip.times, strict=True))
        starts = given_boxes(self.box, self.boxes, self.first_pixel, clip.shape)
        known, absent, labels = self._boxes(path, part)
        boxes = {number: box for number, box in known.items() if meets(box, clip.shape)}
        size = f"{clip.shape[1]} x {clip.shape[0]} px"
        outside = [
            Problem(f"box of frame {number}", f"is outside the image of {size}") for number in sorted({*known} - {*boxes})
        ]
        if outside and not boxes:
            raise InputError(f"{path}: all {len(outside)} true boxes are outside the image of {size}")
        begin = part.start if starts or self.automatic else min(boxes)
        kept = [number for number in clip.numbers if begin <= number < part.end]
        if not kept:
            raise InputError(f"{path}: has no frame from {begin} to {part.end - 1}; it has {len(clip.numbers)}")

        def make(i: int) -> Scan:
            pixels = cast(Array, signed(clip.frame(kept[i]), self.negative))
            return Scan.image(times[kept[i]], camera, Frame(pixels, corner.get(kept[i])))

        def placed(box: Array, number: int) -> Array:
            """Return a box of a frame where it is in the scene."""
            return box + np.pad(corner.get(number, np.zeros(2)), (0, 2))

        seen = [[k for k in own if k in times] for own in in_sight(boxes, absent)]
        seen = [own for own in seen if own]
        truth = [
            Trajectory(
                f"target {i}" if len(seen) > 1 else "target",
                BOX,
                np.array([times[k] for k in own]),
                np.array([placed(boxes[k], k) for k in own]),
            )
            for i, own in enumerate(seen, 1)
        ]
        given = [
            Trajectory(f"box {i}", BOX, np.array([times[kept[0]]]), placed(box, kept[0])[None])
            for i, box in enumerate(starts)
        ]
        told = "" if self.rate or clip.rate or clip.times is not None else f", taken as {rate:g} a second: set source.rate"
        notes = {"frames": f"{kept[0]} to {kept[-1]} of {path.name}, {size}, {clip.dtype}{told}"}
        if (far := max((float(np.hypot(*at)) for at in corners), default=0.0)) >= TURNED:
            doubt = "drifting clouds look so, too: if the camera stands, source.steady = false"
            notes["camera"] = f"turns by up to {far:.0f} px, and places are those of the first frame; {doubt}"
        lost = sum(problem.rows for problem in clip.problems)
        rows = {"frames": Rows(clip.total, len(kept), lost, len(clip.numbers) - len(kept))}
        if labels:
            used = len(boxes.keys() & set(kept))
            rows["true boxes"] = Rows(labels, used, len(outside), labels - used - len(outside))
        frames, problems = LazyScans(len(kept), make), (*clip.problems, *outside)
        return Recording(frames, tuple(truth), problems, notes, rows=rows, starts=tuple(given))

    def _beside(self, path: Path, parameter: str, name: str) -> Path:
        """Return the file that a parameter names, or else `name`, in the clip's folder; ConfigError if it lies elsewhere."""
        given = getattr(self, parameter)
        try:
            return inside(path.parent, str(user_path(given).absolute()) if given else name)
        except ValueError as error:
            raise ConfigError.at(parameter, str(error)) from None

    def _boxes(self, path: Path, part: Segment) -> tuple[dict[int, Array], set[int], int]:
        """Frame number to the true centre, width and height, of this part, frames without target, and boxes in the file.

        None without a file, where boxes are given.
        """
        name = f"{path.stem}_truth.csv"
        file = self._beside(path, "truth", name)
        if not self.truth and not file.exists():
            if self._given:
                return {}, set(), 0
            raise ConfigError.at("box", f"is missing: [x, y, w, h] in px, as there is no file {name}")
        labels, absent = boxes_and_absences(file, self.first_pixel)
        boxes = {number - part.label_offset: box for number, box in labels.items()}
        inside = {number: box for number, box in boxes.items() if part.start <= number < part.end}
        if not inside and not self._given:
            raise InputError(f"{file}: has no box from frame {part.start} to {part.end - 1}")
        return inside, {number - part.label_offset for number in absent}, len(labels)

    @property
    def _given(self) -> bool:
        return self.automatic or self.box is not None or self.boxes is not None


def camera_of(sensors: Mapping[str, Sensor]) -> str:
    """Return the name of the one sensor that a video needs, a camera; ConfigError if there are others."""
    cameras = [name for name, sensor in sensors.items() if isinstance(sensor, ImagingSensor)]
    if len(cameras) != 1 or len(sensors) != 1:
        raise ConfigError.at("sensors", f"a video needs one sensor, a camera; got {', '.join(sensors) or 'none'}")
    return cameras[0]
