"""A camera, a stream or a long file as a source of frames that come once."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from time import monotonic
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import (
    Array,
    ConfigError,
    Frame,
    InputError,
    LazyScans,
    Recording,
    Scan,
    Sensor,
    Source,
    Trajectory,
    fields,
)
from vedette.display import without_passwords
from vedette_files.images.header import check_pixels
from vedette_files.input_files import check_regular, user_path
from vedette_files.json_values import short
from vedette_flir.registration import Registration
from vedette_flir.sources.boxes import BOX, four, fours, given_boxes
from vedette_flir.sources.images import WEIGHTS, grey_of, opencv, signed
from vedette_flir.sources.video import camera_of

ENDLESS = 10**9
"""Frames of a stream whose end is not said: a year's at 30 a second."""

MOST_CAMERA = 9999
"""OpenCV adds the number of its backend in hundreds; no machine has that many cameras."""

URL = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)


@final
@frozen
class VideoStream(Source):
    """Frames of what OpenCV opens, each read when it is asked for and let go: a camera, a stream, a file of any length.

    The targets are given by their boxes in the first frame, x, y, w, h in px, the corner counted from `first_pixel`; nothing
    is judged. Frames come once and in order, so no picture shows them after the run. The run ends when no further frame
    comes. A frame in colour or of another size counts as unknown pixels, with a warning.
    """

    kind: ClassVar[str] = "video_stream"
    draws: ClassVar[bool] = False

    address: str = fields.text("the number of a camera, a URL, or a file", default="")
    box: Array | None = fields.array("px", "[x, y, w, h] of the target in the first frame", ndim=1, default=None, check=four)
    boxes: Array | None = fields.array(
        "px", "a box for each of several targets in the first frame, [[x, y, w, h], ...]", ndim=2, default=None, check=fours
    )
    first_pixel: float = fields.quantity("px", "what a box calls the first pixel", default=1.0)
    clock: str = fields.choice(
        "a frame's time: its number over the rate, or when it came, after the first", ("rate", "arrival"), default="rate"
    )
    rate: float | None = fields.quantity("1/s", "frames per second; default: the stream's, or 30", default=None, above=0)
    frames: int | None = fields.integer("frames after which the run ends; default: none", default=None, at_least=1)
    grey: str = fields.choice(
        "how colours become grey levels; equal: colours are refused", ("equal", *WEIGHTS), default="luminance"
    )
    automatic: bool = fields.flag("no target is given: the tracker finds them", default=False)
    negative: bool = fields.flag("take the frames' negative: hot is dark", default=False)
    steady: bool = fields.flag(
        "measure how the camera turns and take it out: x and y are counted from the first frame's first pixel", default=False
    )

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Open the stream, read its first frame, and return the frames as they will come."""
        camera = camera_of(sensors)
        if self.box is None and self.boxes is None and not self.automatic:
            raise ConfigError.at("box", "is missing: [x, y, w, h] in px, of the target in the first frame")
        video = self._opened()
        frames = _Frames(self._told, video, self.grey, self.negative, self.steady)
        rate = self.rate or frames.rate or 30.0
        try:
            starts = given_boxes(self.box, self.boxes, self.first_pixel, frames.first.shape)
        except ConfigError:
            video.release()
            raise

        def make(i: int) -> Scan:
            pixels, age, corner = frames.read(i)
            return Scan.image(i / rate if self.clock == "rate" else age, camera, Frame(pixels, corner))

        given = [Trajectory(f"box {i}", BOX, np.zeros(1), box[None]) for i, box in enumerate(starts)]
        height, width = frames.first.shape
        notes = {"frames": f"as they come from {self._told}, {width} x {height} px, {frames.first.dtype}"}
        return Recording(LazyScans(self.frames or ENDLESS, make, once=True), notes=notes, starts=tuple(given))

    @property
    def _told(self) -> str:
        """The address as notes and messages tell it."""
        return without_passwords(self.address)

    def _opened(self) -> Any:
        """Return OpenCV's capture; ConfigError without an address, InputError where there is nothing to read."""
        if not self.address:
            raise ConfigError.at("address", "is missing: the number of a camera, a URL, or a file")
        cv2, at = opencv(), self.address
        if at.isdecimal() and int(at) > MOST_CAMERA:
            raise ConfigError.at("address", f"must be the number of a camera, up to {MOST_CAMERA}, got {short(at)}")
        if not at.isdecimal() and not URL.match(at):
            try:
                path = user_path(at)
            except ValueError as error:
                raise ConfigError.at("address", str(error)) from None
            if path.is_dir():
                raise InputError(f"{path}: is a folder; the source 'video' takes one of images")
            if not path.is_file():
                there = "is no regular file" if path.exists() else "there is no such file"
                raise InputError(f"{path}: {there}; name a camera by its number, a URL, or a file")
            check_regular(path)
            at = str(path)
        video = cv2.VideoCapture(int(at) if at.isdecimal() else at)
        if not video.isOpened():
            raise InputError(f"{without_passwords(at)}: is no camera, stream or file that OpenCV can open")
        try:
            check_pixels(int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT)))
        except ValueError as error:
            raise InputError(f"{without_passwords(at)}: its frames {error}") from None
        return video


@final
class _Frames:
    """The frames of a capture, of which it holds the last one, `at`; the first is read at once."""

    def __init__(self, address: str, video: Any, grey: str, negative: bool, steady: bool) -> None:
        self.video, self.grey, self.negative, self.at = video, grey, negative, 0
        rate = float(video.get(opencv().CAP_PROP_FPS))
        self.rate = rate if 0 < rate < 1e9 else None
        read, image = video.read()
        if not read:
            video.release()
            raise InputError(f"{address}: gives no frame")
        try:
            self.first = signed(grey_of(image, grey), negative)
        except ValueError as error:
            video.release()
            raise InputError(f"{address}: frame 0: {error}") from None
        self.motion = Registration() if steady else None
        self.began, self.last = monotonic(), (self.first, 0.0, self._corner(self.first))

    def read(self, number: int) -> tuple[NDArray[Any], float, Array | None]:
        """Return the last frame or one after it, its age in s when it came, after the first, and its first pixel's place.

        IndexError at the end.
        """
        if number < self.at:
            raise InputError(f"frame {number} of a stream was read already: its frames come once")
        image: Any = None
        while self.at < number:
            read, image = self.video.read()
            if not read:
                self.video.release()
                raise IndexError(f"the stream ended after {self.at + 1} frames")
            self.at += 1
        if image is not None:
            age = monotonic() - self.began
            pixels = self._usable(image, number)
            self.last = pixels, age, self._corner(pixels)
        return self.last

    def _corner(self, pixels: NDArray[Any]) -> Array | None:
        """Return where a frame's first pixel lies; None where the camera's motion is not asked for."""
        return None if self.motion is None else self.motion.take(pixels)

    def _usable(self, image: NDArray[Any], number: int) -> NDArray[Any]:
        """Return a frame in grey levels; unknown pixels, with a warning, for one in colour or of another size or kind."""
        try:
            pixels = signed(grey_of(image, self.grey), self.negative)
            if (pixels.shape, pixels.dtype) != (self.first.shape, self.first.dtype):
                (height, width), (rows, columns) = self.first.shape, pixels.shape
                raise ValueError(
                    f"must be {width} x {height} px, {self.first.dtype}, got {columns} x {rows}, {pixels.dtype}"
                )
        except ValueError as error:
            warnings.warn(f"frame {number}: {error}; its pixels count as unknown", RuntimeWarning, stacklevel=2)
            return np.full(self.first.shape, np.nan)
        return pixels
