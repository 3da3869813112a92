"""Grey frames of video files and folders of images, through OpenCV."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import InputError, Problem
from vedette_files import Apart, ApartOpenCV
from vedette_files.libraries import needed
from vedette_flir.sources.stored import stored

Grey = NDArray[np.unsignedinteger[Any]]
"""A frame (h, w) of 8 or 16 bit."""

ALIKE = 8
"""Counts by which the channels of a grey picture may differ where a codec rounded them."""


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    return needed("cv2", "reading images needs OpenCV", "vision")


_USUAL, _ONE_AT_A_TIME = list[int](), Lock()
"""OpenCV's own number of threads, once for each block that has it at one: the process has a single such number."""


@contextmanager
def one_thread() -> Iterator[Any]:
    """Yield `cv2` with one thread: several work on frames for twice the CPU time, and end no sooner.

    When the last block ends, of all Python's threads, OpenCV has as many as before.
    """
    cv2 = opencv()
    with _ONE_AT_A_TIME:
        _USUAL.append(_USUAL[0] if _USUAL else cv2.getNumThreads())
        cv2.setNumThreads(1)
    try:
        yield cv2
    finally:
        with _ONE_AT_A_TIME:
            usual = _USUAL.pop()
            if not _USUAL:
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
    cv2 = opencv()
    channels = cv2.split(image)[:3]
    middle: Grey = channels[len(channels) // 2]
    apart = max(int(cv2.norm(each, middle, cv2.NORM_INF)) for each in channels)
    if apart > ALIKE:
        if grey == "equal":
            raise ValueError(f"is in colour: its channels differ by up to {apart} counts; say by `grey` how to convert it")
        levels: Grey = np.rint(image[..., :3] @ np.array(WEIGHTS[grey])).astype(image.dtype)
        return levels
    return middle


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
    """Return what a video, TIFF file or folder of images holds; each frame is decoded once, shown to `watch`, and let go.

    InputError if there is no such file or folder, no frame in it, or the first is in colour. A later frame that is in colour
    or of another size is left out, as are those that a truncated video promises and lacks.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; name a video, or a folder of images")
    problems: list[Problem] = []
    cv2 = opencv() if apart is None else ApartOpenCV(apart)
    store = stored(path, problems, cv2)
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


def frames_of(path: Path) -> Iterator[Grey]:
    """Yield the frames of a video, TIFF file or folder of images, as far as they are alike.

    InputError if the first cannot be read.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; name a video, or a folder of images")
    problems: list[Problem] = []
    store = stored(path, problems, opencv())
    first: NDArray[Any] | None = None
    for number in range(store.most):
        image = store.raw(number)
        if image is None or (first is not None and (image.shape, image.dtype) != (first.shape, first.dtype)):
            break
        first = image
        try:
            grey = grey_of(image)
        except ValueError as error:
            raise InputError(f"{path}: frame {number}: {error}") from None
        yield grey
    if first is None:
        raise InputError(f"{path}: its first frame cannot be read{f': {problems[0]}' if problems else ''}")


def _stated(numbers: list[int], times: list[float], rate: float | None) -> tuple[float, ...] | None:
    """Return the times of frames that a file states, if they rise and are not those of a constant rate."""
    at = np.array(times)
    if not np.all(np.isfinite(at)) or not np.all(np.diff(at) > 0):
        return None
    even = rate is not None and np.allclose(at - at[0], (np.array(numbers) - numbers[0]) / rate, atol=0.25 / rate)
    return None if even else tuple((at - at[0]).tolist())
