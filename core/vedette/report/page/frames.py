"""The frames of a run through images, as small pictures that the page lays under its map."""

from __future__ import annotations

import json
import struct
import zlib
from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette.errors import InputError
from vedette.io import read_frame
from vedette.io.png import SIGNATURE
from vedette.space import Array
from vedette.types import Frame

MOST, BYTES = 400, 6_000_000
"""At most so many frames, evenly chosen, of at most so many bytes in all."""

_DARK, _BRIGHT = 1.0, 99.8
"""Percentiles of the first frame's pixels that are shown black and white."""


def frames(recording: Path) -> list[dict[str, Any]]:
    """Return the frames beside a recording: their scan, the place of the first pixel, their size in px and a PNG in base64.

    None where the recording holds none, as that of a clip, whose frames stay in it.
    """
    named = [(i, given) for i, given in enumerate(_scans(recording)) if given is not None]
    found: list[dict[str, Any]] = []
    limits: tuple[float, float] | None = None
    every, total = max(1, -(-len(named) // MOST)), 0
    for scan, given in named[::every]:
        frame = read_frame(given, recording.parent)
        limits = limits_of(frame) if limits is None else limits
        made = picture(frame, limits)
        total += len(made["png"])
        if total > BYTES:
            break
        found.append({"scan": scan, **made})
    return found


def limits_of(frame: Frame) -> tuple[float, float]:
    """Return the pixels that are shown black and white, by the first frame of a run."""
    pixels = _flat(frame)
    known = pixels[np.isfinite(pixels)]
    low, high = np.percentile(known, [_DARK, _BRIGHT]) if known.size else (0.0, 1.0)
    return float(low), max(float(high), float(low) + 1e-9)


def picture(frame: Frame, limits: tuple[float, float], every: int = 1) -> dict[str, Any]:
    """Return the place of a frame's first pixel, its size in px and a PNG in base64, of one pixel in so many each way."""
    pixels = _flat(frame)
    corner = [0.0, 0.0] if frame.corner is None else np.asarray(frame.corner).tolist()
    text = b64encode(png(_grey(pixels[::every, ::every], *limits))).decode()
    return {"corner": corner, "size": [pixels.shape[1], pixels.shape[0]], "png": text}


def _flat(frame: Frame) -> NDArray[Any]:
    """Return a frame's pixels (h, w): the mean of its channels."""
    pixels: NDArray[Any] = frame.pixels if frame.pixels.ndim == 2 else np.mean(frame.pixels, axis=0)
    return pixels


def _scans(recording: Path) -> list[Any]:
    """Return of each scan of a recording the frame that its line names, or None."""
    try:
        with recording.open(encoding="utf-8") as file:
            lines = [json.loads(line) for line in file if '"frame"' in line or '"sensor"' in line]
    except FileNotFoundError:
        return []
    except ValueError as error:
        raise InputError(f"{recording}: {error}") from None
    return [line.get("frame") for line in lines if "sensor" in line]


def _grey(pixels: NDArray[Any], low: float, high: float) -> NDArray[np.uint8]:
    """Return pixels as shades; those without information are black."""
    shade: Array = np.clip((np.nan_to_num(np.asarray(pixels, dtype=float), nan=low) - low) / (high - low), 0.0, 1.0)
    return np.round(255.0 * shade).astype(np.uint8)


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return an image (h, w) of 8 bit as a PNG, each row as its differences from left to right."""
    height, width = pixels.shape
    rows = np.ones((height, 1 + width), dtype=np.uint8)
    rows[:, 1:] = np.diff(pixels, axis=1, prepend=np.uint8(0))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    chunks = (
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts
    )
    return SIGNATURE + b"".join(chunks)
