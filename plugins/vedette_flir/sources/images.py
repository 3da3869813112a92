"""Grey frames from video files and folders of images, through OpenCV."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import InputError, Problem
from vedette_files import Apart, ApartOpenCV
from vedette_files.images.header import check_pixels, picture_size
from vedette_files.images.jpeg import check_jpeg, is_jpeg
from vedette_files.images.png import check_png, is_png
from vedette_files.input_files import check_regular, inside
from vedette_files.libraries import needed

Grey = NDArray[np.unsignedinteger[Any]]
"""A frame (h, w) of 8 or 16 bit."""

IMAGES = (".png", ".tif", ".tiff", ".pgm", ".jpg", ".jpeg", ".bmp")

ALIKE = 8
"""Counts by which the channels of a grey picture may differ where a codec rounded them."""


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    return needed("cv2", "reading images needs OpenCV", "vision")


@contextmanager
def one_thread() -> Iterator[Any]:
    """Yield `cv2` with one thread: several work on frames for twice the CPU time, and end no sooner."""
    cv2 = opencv()
    usual = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield cv2
    finally:
        cv2.setNumThreads(usual)


def signed(pixels: NDArray[Any], negative: bool) -> NDArray[Any]:
    """Return a frame, or its negative, in its own integer type."""
    return np.asarray(np.iinfo(pixels.dtype).max - pixels) if negative else pixels


WEIGHTS = {"luminance": (0.114, 0.587, 0.299), "blue": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0), "red": (0.0, 0.0, 1.0)}
"""How colours become grey levels: the weights of OpenCV's channels, blue, green and red."""


def grey_of(image: NDArray[Any], grey: str = "luminance") -> Grey:
    """Return an 8 or 16 bit image in grey levels; ValueError for others.

    Three channels that are equal, but for a codec's rounding, count as one. `grey` says what becomes of others: one of
    WEIGHTS, or "equal": they are refused. A channel of opacity beside them is left out.
    """
    if image.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"must have pixels of 8 or 16 bit, got {image.dtype}")
    if image.ndim == 2:
        return image
    if image.shape[2] not in (1, 3, 4):
        raise ValueError(f"must have one channel, or three of a colour, got {image.shape[2]}")
    image = image[..., :3]
    middle = image[..., image.shape[2] // 2]
    apart = max(int(np.max(np.maximum(each, middle) - np.minimum(each, middle))) for each in np.moveaxis(image, 2, 0))
    if apart > ALIKE:
        if grey == "equal":
            raise ValueError(f"is in colour: its channels differ by up to {apart} counts; say by `grey` how to convert it")
        levels: Grey = np.rint(image @ np.array(WEIGHTS[grey])).astype(image.dtype)
        return levels
    return np.ascontiguousarray(middle)


@frozen(eq=False)
class Clip:
    """A clip that was looked through once: `numbers` of its good frames, their common shape and kind of pixels.

    `total` counts the frames, the bad ones too; `rate` is the file's frames per second if it says so; `problems` is what
    could not be used. `raw` decodes a frame anew: one at a time is in memory, however long the clip. `times` of its frames
    in s, by their numbers, where the file states them and they rise.
    """

    numbers: tuple[int, ...]
    shape: tuple[int, int]
    dtype: np.dtype[Any]
    total: int
    rate: float | None
    problems: tuple[Problem, ...]
    raw: Callable[[int], NDArray[Any] | None]
    grey: str = "luminance"
    times: tuple[float, ...] | None = None

    def frame(self, number: int) -> Grey:
        """Return one of the good frames; InputError if the file is not any more what it was."""
        image = self.raw(number)
        try:
            if image is None:
                raise ValueError("cannot be read any more")
            grey = grey_of(image, self.grey)
            if grey.shape != self.shape or grey.dtype != self.dtype:
                raise ValueError("is another one now")
        except ValueError as error:
            raise InputError(f"frame {number}: {error}: the file was changed while it was read") from None
        return grey


def look_through(
    path: Path,
    how: str = "luminance",
    watch: Callable[[Grey], None] = lambda grey: None,
    apart: Apart | None = None,
) -> Clip:
    """Return what a video or a folder of images holds; each frame is decoded once, shown to `watch`, and let go.

    InputError if there is no such file or folder, no frame in it, or the first is in colour. A later frame that is in colour
    or of another size is left out, as are those that a truncated video promises and lacks.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; name a video, or a folder of images")
    problems: list[Problem] = []
    cv2 = opencv() if apart is None else ApartOpenCV(apart)
    store = _Folder(path, problems, cv2) if path.is_dir() else _Video(path, cv2)
    numbers: list[int] = []
    times: list[float] = []
    first: Grey | None = None
    for number in range(store.most):
        image = store.raw(number)
        if image is None:
            if store.ended(number):
                break
            continue
        try:
            grey = grey_of(image, how)
            if first is not None and grey.shape != first.shape:
                rows, columns = first.shape
                raise ValueError(f"must be {columns} x {rows} px as the first, got {grey.shape[1]} x {grey.shape[0]}")
            if first is not None and grey.dtype != first.dtype:
                raise ValueError(f"must have pixels of {first.dtype} as the first, got {grey.dtype}")
        except ValueError as error:
            if first is None:
                raise InputError(f"{path}: frame {number}: {error}") from None
            problems.append(Problem(f"frame {number}", str(error)))
            continue
        first = grey if first is None else first
        numbers.append(number)
        watch(grey)
        times.append(store.time)
    if first is None:
        told = f"; the first problem: {problems[0]}" if problems else ""
        raise InputError(f"{path}: holds no frame that can be read{told}")
    total, lacking = store.count()
    return Clip(
        tuple(numbers),
        (first.shape[0], first.shape[1]),
        first.dtype,
        total,
        store.rate,
        (*problems, *lacking),
        store.raw,
        how,
        _stated(numbers, times, store.rate),
    )


def first_frames(path: Path, most: int = 1, how: str = "luminance") -> list[Grey]:
    """Return the first frames of a video or folder of images, as far as they are alike; InputError if none can be read."""
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; name a video, or a folder of images")
    problems: list[Problem] = []
    store = _Folder(path, problems, opencv()) if path.is_dir() else _Video(path, opencv())
    images: list[NDArray[Any]] = []
    for number in range(min(most, store.most)):
        image = store.raw(number)
        if image is None or (images and (image.shape, image.dtype) != (images[0].shape, images[0].dtype)):
            break
        images.append(image)
    if not images:
        raise InputError(f"{path}: its first frame cannot be read{f': {problems[0]}' if problems else ''}")
    try:
        return [grey_of(image, how) for image in images]
    except ValueError as error:
        raise InputError(f"{path}: frame 0: {error}") from None


def _stated(numbers: list[int], times: list[float], rate: float | None) -> tuple[float, ...] | None:
    """Return the times of frames that a file states, if they rise and are not those of a constant rate."""
    at = np.array(times)
    if not np.all(np.isfinite(at)) or not np.all(np.diff(at) > 0):
        return None
    even = rate is not None and np.allclose(at - at[0], (np.array(numbers) - numbers[0]) / rate, atol=0.25 / rate)
    return None if even else tuple((at - at[0]).tolist())


def in_order(file: Path) -> tuple[list[int | str], str]:
    """Return what puts files in the order of their names, numbers in them by value: f2.png before f10.png."""
    parts = re.split(r"([0-9]+)", file.name)
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], file.name


class _Folder:
    """Images in the order of their names; those that cannot be read are told once, when the folder is looked through."""

    rate, time = None, math.nan

    def __init__(self, path: Path, problems: list[Problem], cv2: Any) -> None:
        self.cv2 = cv2
        self.files = sorted((file for file in path.iterdir() if file.suffix.lower() in IMAGES), key=in_order)
        if not self.files:
            raise InputError(f"{path}: holds no image; their names must end in {', '.join(IMAGES)}")
        self.most = len(self.files)
        self.problems: list[Problem] | None = problems

    def raw(self, number: int) -> NDArray[Any] | None:
        file = self.files[number]
        try:
            check_regular(inside(file.parent, file.name))
            size = picture_size(file)
            if size is None:
                raise ValueError("is no image that can be read")
            check_pixels(*size)
            if is_png(file):
                check_png(file)
            elif is_jpeg(file):
                check_jpeg(file)
            image: NDArray[Any] | None = self.cv2.imread(str(file), self.cv2.IMREAD_UNCHANGED)
            if image is None:
                raise ValueError("is no image that OpenCV can read")
        except (OSError, ValueError, self.cv2.error) as error:
            if self.problems is not None:
                self.problems.append(Problem(f"frame {number}", f"{file.name} {' '.join(str(error).split())}"))
            return None
        return image

    def ended(self, number: int) -> bool:
        return False

    def count(self) -> tuple[int, list[Problem]]:
        """Return how many frames there are, and what is lacking; from now on nothing is told."""
        self.problems = None
        return self.most, []


class _Video:
    """A video that is decoded forwards; a frame before the last one begins it anew."""

    most = 2**31

    def __init__(self, path: Path, cv2: Any) -> None:
        self.path, self.cv2, self.at, self.found = path, cv2, 0, 0
        check_regular(path)
        self.video = self._opened()
        rate = float(self.video.get(self.cv2.CAP_PROP_FPS))
        self.rate, self.time = rate if 0 < rate < 1e9 else None, math.nan

    def _opened(self) -> Any:
        cv2 = self.cv2
        video = cv2.VideoCapture(str(self.path))
        if not video.isOpened():
            raise InputError(f"{self.path}: is no video that OpenCV can read")
        size = int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT))
        try:
            check_pixels(*size)
        except ValueError as error:
            raise InputError(f"{self.path}: its frames {error}") from None
        return video

    def raw(self, number: int) -> NDArray[Any] | None:
        if number < self.at:
            self.video.release()
            self.video, self.at = self._opened(), 0
        while self.at < number:
            if not self.video.grab():
                return None
            self.at += 1
        read, image = self.video.read()
        self.at += 1
        self.time = 1e-3 * float(self.video.get(self.cv2.CAP_PROP_POS_MSEC))
        return image if read else None

    def ended(self, number: int) -> bool:
        self.found = number
        return True

    def count(self) -> tuple[int, list[Problem]]:
        promised = int(self.video.get(self.cv2.CAP_PROP_FRAME_COUNT))
        if not 0 < self.found < promised < self.most:
            return self.found, []
        return promised, [
            Problem("end", f"the video promises {promised} frames and ends after {self.found}", promised - self.found)
        ]
