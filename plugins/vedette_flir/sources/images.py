"""Grey frames from video files and folders of images, through OpenCV."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import InputError, Problem

Grey = NDArray[np.unsignedinteger[Any]]
"""A frame (h, w) of 8 or 16 bit."""

IMAGES = (".png", ".tif", ".tiff", ".pgm", ".jpg", ".jpeg", ".bmp")

ALIKE = 8
"""Counts by which the channels of a grey picture may differ where a codec rounded them."""


def opencv() -> Any:
    """The module `cv2`; InputError if it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError("reading images needs OpenCV: pip install 'vedette[vision]'") from None
    return cv2


def read_frames(path: Path) -> tuple[dict[int, Grey], float | None, list[Problem]]:
    """Frames by number, the file's frames per second if it says so, and what could not be used.

    InputError if there is no such file or folder, no frame in it, or the first is in colour. A later frame that is in colour
    or of another size is left out, as are those that a truncated video promises and lacks.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; name a video, or a folder of images")
    raw, rate, problems = _folder(path) if path.is_dir() else _video(path)
    frames: dict[int, Grey] = {}
    size: tuple[int, ...] | None = None
    for number, image in raw.items():
        try:
            grey = grey_of(image)
            if size is not None and grey.shape != size:
                raise ValueError(f"must be {size[1]} x {size[0]} px as the first, got {grey.shape[1]} x {grey.shape[0]}")
        except ValueError as error:
            if size is None:
                raise InputError(f"{path}: frame {number}: {error}") from None
            problems.append(Problem(f"frame {number}", str(error)))
            continue
        size = grey.shape
        frames[number] = grey
    if not frames:
        raise InputError(f"{path}: holds no frame that can be read")
    return frames, rate, problems


def grey_of(image: NDArray[Any]) -> Grey:
    """The one channel of an 8 or 16 bit image; ValueError for others. Three channels that are alike are one."""
    if image.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"must have pixels of 8 or 16 bit, got {image.dtype}")
    if image.ndim == 2:
        return image
    if image.shape[2] not in (1, 3):
        raise ValueError(f"must have one channel, got {image.shape[2]}")
    middle = image[..., image.shape[2] // 2]
    apart = max(int(np.max(np.maximum(each, middle) - np.minimum(each, middle))) for each in np.moveaxis(image, 2, 0))
    if apart > ALIKE:
        raise ValueError(f"is in colour: its channels differ by up to {apart} counts; convert it to grey levels first")
    return np.ascontiguousarray(middle)


def _video(path: Path) -> tuple[dict[int, NDArray[Any]], float | None, list[Problem]]:
    cv2 = opencv()
    video = cv2.VideoCapture(str(path))
    try:
        if not video.isOpened():
            raise InputError(f"{path}: is no video that OpenCV can read")
        rate, promised = float(video.get(cv2.CAP_PROP_FPS)), int(video.get(cv2.CAP_PROP_FRAME_COUNT))
        found: dict[int, NDArray[Any]] = {}
        while True:
            read, image = video.read()
            if not read:
                break
            found[len(found)] = image
    finally:
        video.release()
    lacking = [Problem("end", f"the video promises {promised} frames and ends after {len(found)}")]
    return found, rate if rate > 0 else None, lacking if 0 < len(found) < promised else []


def _folder(path: Path) -> tuple[dict[int, NDArray[Any]], float | None, list[Problem]]:
    cv2 = opencv()
    found, problems = {}, []
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGES)
    if not files:
        raise InputError(f"{path}: holds no image; their names must end in {', '.join(IMAGES)}")
    for number, file in enumerate(files):
        image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        if image is None:
            problems.append(Problem(f"frame {number}", f"{file.name} is no image that OpenCV can read"))
        else:
            found[number] = image
    return found, None, problems
