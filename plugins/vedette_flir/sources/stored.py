"""Where frames are stored: folders of images, pages of a TIFF file, and video files, read through OpenCV."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from vedette import InputError, Problem
from vedette_files.images.header import check_pixels, picture_size, tiff_pages
from vedette_files.images.jpeg import check_jpeg, is_jpeg
from vedette_files.images.png import check_png, is_png
from vedette_files.input_files import check_regular, inside

IMAGES = (".png", ".tif", ".tiff", ".pgm", ".jpg", ".jpeg", ".bmp")

PAGED, BLOCK = (".tif", ".tiff"), 2**24
"""How the names of files end whose pages are frames, and about how many bytes of them are read at once: to come to a page
OpenCV passes over all before it.
"""

FEWEST = 5
"""Images in a folder from which on their numbers tell whether some are lacking."""


def in_order(file: Path) -> tuple[list[int | str], str]:
    """Return what puts files in the order of their names, numbers in them by value: f2.png before f10.png."""
    parts = re.split(r"([0-9]+)", file.name)
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], file.name


def gaps(files: Sequence[Path]) -> list[tuple[Path, Path, int]]:
    """Return pairs of files of which the last number in the name goes on by several steps, and by how many.

    A step is what most go on by. Where names are otherwise unlike, or most steps are uneven, as of dates, nothing is a gap.
    """
    names = [re.fullmatch(r"(.*?)([0-9]+)([^0-9]*)", file.name) for file in files]
    if len({name and (name[1], name[3]) for name in names}) > 1 or len(files) < FEWEST:
        return []
    numbers = np.array([float(name[2]) for name in names if name])
    steps = np.diff(numbers)
    step = max(float(np.median(steps)), 1.0)
    if not len(steps) or np.mean(steps == step) < 0.5 or np.any(steps % step):
        return []
    return [(files[k], files[k + 1], int(steps[k] / step)) for k in np.flatnonzero(steps > step).tolist()]


@final
class Folder:
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
        """Return an image; None, and a problem, if it cannot be read."""
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
        """Return whether an image that cannot be read is the end: there are others."""
        return False

    def count(self) -> tuple[int, list[Problem]]:
        """Return how many frames there are, and what is lacking; from now on nothing is told."""
        self.problems = None
        lacking = [
            Problem(
                after.name,
                f"follows {before.name}: {n - 1} between them are lacking, and times do not count them",
                n - 1,
            )
            for before, after, n in gaps(self.files)
        ]
        return self.most + sum(problem.rows for problem in lacking), lacking


@final
class Pages:
    """The pages of a TIFF file; those that cannot be read are told once, when it is looked through."""

    rate, time = None, math.nan

    def __init__(self, path: Path, problems: list[Problem], cv2: Any) -> None:
        self.path, self.cv2, self.first = path, cv2, 0
        self.pages: Sequence[NDArray[Any]] = ()
        self.problems: list[Problem] | None = problems
        check_regular(path)
        size, (self.most, self.cut) = picture_size(path), tiff_pages(path)
        if size is None or not self.most:
            raise InputError(f"{path}: is no TIFF file that can be read")
        try:
            check_pixels(*size)
        except ValueError as error:
            raise InputError(f"{path}: its pages {error}") from None

    def raw(self, number: int) -> NDArray[Any] | None:
        """Return a page; None, and a problem, if it cannot be read."""
        if not self.first <= number < self.first + len(self.pages):
            block = max(BLOCK // max((page.nbytes for page in self.pages[:1]), default=BLOCK), 1)
            block = min(block, self.most - number)
            try:
                self.pages = self.cv2.imreadmulti(str(self.path), number, block, flags=self.cv2.IMREAD_UNCHANGED)[1]
            except (ValueError, self.cv2.error):
                self.pages = ()
            self.first = number
        if self.pages:
            return self.pages[number - self.first]
        if self.problems is not None:
            self.problems.append(Problem(f"frame {number}", f"page {number + 1} cannot be read"))
        return None

    def ended(self, number: int) -> bool:
        """Return whether a page that cannot be read is the end: there are others."""
        return False

    def count(self) -> tuple[int, list[Problem]]:
        """Return how many pages there are, and whether there were more; from now on nothing is told."""
        self.problems = None
        return self.most, [Problem("end", f"the list of pages breaks off after {self.most}")] * self.cut


@final
class Video:
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
        """Return a frame, and set its `time` in s; None if there is none."""
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
        """Return whether a frame that cannot be read is the end."""
        self.found = number
        return True

    def count(self) -> tuple[int, list[Problem]]:
        """Return how many frames the file promises, and what is lacking."""
        promised = int(self.video.get(self.cv2.CAP_PROP_FRAME_COUNT))
        if not 0 < self.found < promised < self.most:
            return self.found, []
        return promised, [
            Problem("end", f"the video promises {promised} frames and ends after {self.found}", promised - self.found)
        ]


def stored(path: Path, problems: list[Problem], cv2: Any) -> Folder | Pages | Video:
    """Return the store of a folder of images, of a TIFF file's pages, or of a video."""
    if path.is_dir():
        return Folder(path, problems, cv2)
    return Pages(path, problems, cv2) if path.suffix.lower() in PAGED else Video(path, cv2)
