"""A camera's frames beside a recording: one file a frame, bit for bit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, final

import numpy as np

from vedette.types import Frame, LazyScans, Recording
from vedette_files.archives import open_arrays
from vedette_files.images.header import check_pixels
from vedette_files.input_files import check_regular, inside
from vedette_files.json_values import short, vector
from vedette_files.writing import write_arrays

ENTRY = "pixels"
LARGEST = 2**29
"""Bytes of a frame: the most pixels, as floats."""
KINDS = {np.dtype(kind) for kind in ("u1", "u2", "f4", "f8")}
"""Pixels of a frame: integers of 8 or 16 bit as cameras give them, else floats."""


@final
class FrameFiles:
    """Where the frames of one recording go: `NAME_frames/000000.npz` and on, beside NAME.jsonl."""

    def __init__(self, recording: Path) -> None:
        self.folder, self.count = recording.parent / f"{recording.stem}_frames", 0

    @classmethod
    def of(cls, path: Path, recording: Recording) -> FrameFiles | None:
        """Return the place for the frames of a recording at `path`; None where a file holds them: they are read lazily."""
        return None if isinstance(recording.scans, LazyScans) else cls(path)

    def keep(self, frame: Frame) -> dict[str, Any]:
        """Write the next frame; return what the recording's line says of it. ValueError for a batch of runs."""
        if frame.pixels.ndim not in (2, 3) or (frame.corner is not None and frame.corner.shape != (2,)):
            raise ValueError(f"a frame of pixels {frame.pixels.shape} cannot be written: it must be one image")
        self.folder.mkdir(exist_ok=True)
        file = self.folder / f"{self.count:06d}.npz"
        self.count += 1
        whole = np.issubdtype(frame.pixels.dtype, np.integer)
        pixels = np.ascontiguousarray(frame.pixels, dtype=None if whole else float)
        write_arrays(file, {"pixels": pixels}, compressed=bool(whole))
        corner = {} if frame.corner is None else {"corner": np.asarray(frame.corner, dtype=float).tolist()}
        return {"file": f"{self.folder.name}/{file.name}", **corner}


def read_frame(given: Any, folder: Path) -> Frame:
    """Return the frame that a line of a recording in `folder` names; ValueError says what is wrong with it."""
    if not isinstance(given, dict) or not isinstance(given.get("file"), str) or set(given) - {"file", "corner"}:
        raise ValueError(f"frame must be an object with file and optionally corner, got {short(given)}")
    corner = np.array(vector(given["corner"], "frame.corner", 2)) if "corner" in given else None
    file = inside(folder, given["file"])
    try:
        check_regular(file)
        return Frame(_pixels(file), corner)
    except (OSError, ValueError) as error:
        raise ValueError(f"frame {short(given['file'])}: {' '.join(str(error).split())}") from None


def _pixels(file: Path) -> np.ndarray[Any, Any]:
    """Return the pixels of an archive, whose header is checked before any is read."""
    with open_arrays(file, what="an image as Vedette writes it", largest=LARGEST) as arrays:
        shape, dtype = arrays.head(ENTRY)
        if len(shape) not in (2, 3) or dtype not in KINDS:
            raise ValueError(f"must be an image of 8 or 16 bit or of floats, got {dtype} {shape}")
        check_pixels(*shape[:-3:-1])
        if math.prod(shape) > 4 * shape[-1] * shape[-2]:
            raise ValueError(f"must have at most 4 channels, got {shape[0]}")
        return arrays[ENTRY]
