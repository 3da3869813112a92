"""The frames of a run through images, as small pictures that the page lays under its map."""

from __future__ import annotations

import json
import struct
import zlib
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Frame, ImagingSensor, InputError, LazyScans, Scan, VedetteError, load
from vedette.tracking import open_source
from vedette_files import SIGNATURE, read_frame
from vedette_files.json_values import parse

MOST, BYTES = 400, 6_000_000
"""At most so many frames, evenly chosen, of about so many bytes in all."""
_FINE = 360
"""Pixels of a frame's longer side: a finer one is made coarser by a whole number."""

_DARK, _BRIGHT = 1.0, 99.8
"""Percentiles of the first frame's pixels that are shown black and white."""

Numbered = tuple[int, Frame]


def frames(recording: Path, times: Array, config: str = "{}", every: int = 1) -> list[dict[str, Any]]:
    """Return the frames of a run: their scan, the place of the first pixel, their size in px and a PNG in base64.

    They lie beside the recording, or in the clip that the config names, which is opened again for the scans at `times` (s,).
    None where there is neither. The scans are one in `every` of the recording's, as `times` are.
    """
    named = [(i, given) for i, given in enumerate(islice(_scans(recording), 0, None, every)) if given is not None]
    if named:
        return _shown([i for i, _ in named], lambda k: (named[k][0], read_frame(named[k][1], recording.parent)))
    clip = _clip(config)
    return [] if clip is None or not len(times) else _shown(list(range(len(times))), _in_clip(clip, times))


def _shown(scans: Sequence[int], at: Callable[[int], Numbered | None]) -> list[dict[str, Any]]:
    """Return some of the frames as pictures, evenly chosen: as many as fit, by the size of the first."""
    frames: list[dict[str, Any]] = []
    limits: tuple[float, float] | None = None
    most, k = min(MOST, len(scans)), 0
    while k < len(scans):
        one = at(k)
        if one is not None:
            scan, frame = one
            limits = limits_of(frame) if limits is None else limits
            made = picture(frame, limits)
            if not frames:
                most = min(most, int(BYTES / len(made["png"])))
            if not most:
                return []
            frames.append({"scan": scan, **made})
        k += max(1, -(-len(scans) // most))
    return frames


def _clip(config: str) -> Sequence[Scan] | None:
    """Return the scans of the clip that a run was made of; None if it had none, or it is not there any more."""
    try:
        experiment = load(parse(config))
        source, sensors = experiment.source, experiment.tracker.sensors
        if source is None or source.draws or not any(isinstance(sensor, ImagingSensor) for sensor in sensors.values()):
            return None
        scans = open_source(source, experiment.preprocessors, sensors, np.random.default_rng(0)).scans
    except (VedetteError, OSError, ValueError):
        return None
    return scans if isinstance(scans, LazyScans) and not scans.once else None


def _in_clip(clip: Sequence[Scan], times: Array) -> Callable[[int], Numbered | None]:
    """Return what gives the frame of each scan: the run may have left frames out, so the clip's number is no smaller."""

    def at(k: int) -> Numbered | None:
        for i in range(k, len(clip)):
            try:
                scan = clip[i]
            except (VedetteError, OSError, IndexError):
                continue
            if scan.time >= times[k]:
                return (k, scan.frame) if scan.time == times[k] and scan.frame is not None else None
        return None

    return at


def limits_of(frame: Frame) -> tuple[float, float]:
    """Return the pixels that are shown black and white, by the first frame of a run."""
    pixels = _flat(frame)
    known = pixels[np.isfinite(pixels)]
    low, high = np.percentile(known, [_DARK, _BRIGHT]) if known.size else (0.0, 1.0)
    return float(low), max(float(high), float(low) + 1e-9)


def picture(frame: Frame, limits: tuple[float, float], every: int = 1, fine: int = _FINE) -> dict[str, Any]:
    """Return the place of a frame's first pixel, its size in px and a PNG in base64, of one pixel in so many each way.

    With `every` 1 a frame whose longer side has more than `fine` px is made coarser by the mean of blocks.
    """
    pixels = _flat(frame)
    corner = [0.0, 0.0] if frame.corner is None else np.asarray(frame.corner).tolist()
    shown = _coarse(pixels, fine) if every == 1 else pixels[::every, ::every]
    text = b64encode(png(_grey(shown, *limits))).decode()
    return {"corner": corner, "size": [pixels.shape[1], pixels.shape[0]], "png": text}


def _flat(frame: Frame) -> NDArray[Any]:
    """Return a frame's pixels (h, w): the mean of its channels."""
    return frame.pixels if frame.pixels.ndim == 2 else np.mean(frame.pixels, axis=0)


def _coarse(pixels: Array, fine: int) -> Array:
    """Return a large image with blocks of pixels as their mean; what does not fill a block is left out."""
    by = -(-max(pixels.shape) // fine)
    if by == 1:
        return pixels
    height, width = (size // by for size in pixels.shape)
    blocks = np.asarray(pixels[: height * by, : width * by], dtype=float).reshape(height, by, width, by)
    return blocks.mean(axis=(1, 3))


def _scans(recording: Path) -> Iterator[Any]:
    """Yield of each scan of a recording the frame that its line names, or None."""
    try:
        with recording.open(encoding="utf-8") as file:
            for line in file:
                if '"sensor"' in line:
                    yield json.loads(line).get("frame") if '"frame"' in line else None
    except FileNotFoundError:
        return
    except (ValueError, AttributeError) as error:
        raise InputError(f"{recording}: {error}") from None


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
