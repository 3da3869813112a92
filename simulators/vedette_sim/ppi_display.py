"""From the receiver's decibels to a radar's screen: sweeps turned upright, colours, the interface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vedette import Array
from vedette_sim.polar_fields import Float32, opencv
from vedette_sim.ppi import PpiRadar

Picture = NDArray[np.uint8]

RING = (120, 70, 0)
"""Blue, green, red of range rings and scale."""

COLOURS = np.array([[0.0, 0.0, 0.0], [45.0, 112.0, 45.0], [150.0, 200.0, 60.0], [255.0, 250.0, 130.0]])
"""Red, green, blue of echoes at brightness 0, 85, 170, 255; each has nearly that brightness as a grey."""

TEXT = (235, 215, 150)
"""Blue, green, red of the interface's text."""

MARGIN = 6
"""Pixels from the picture's edge to a text."""


def turned(levels: Float32, bearings: Array) -> Float32:
    """Resample levels (azimuths, bins) of sweeps at increasing `bearings` (azimuths,) to an even grid from 0 clockwise."""
    n = len(bearings)
    wanted = (np.arange(n) + 0.5) * (2.0 * np.pi / n)
    first = bearings[0]
    unrolled = first + np.mod(wanted - first, 2.0 * np.pi)
    # Where own ship turns to port faster than sweeps follow, later sweeps would lie before earlier ones: hold them instead.
    known = np.maximum.accumulate(np.append(bearings, first + 2.0 * np.pi))
    at = np.round(np.interp(unrolled, known, np.arange(n + 1.0)), 6)
    low = np.floor(at).astype(np.intp)
    part = (at - low).astype(np.float32)[:, None]
    if np.all(part == 0):
        return levels[low % n]
    return levels[low % n] * (np.float32(1.0) - part) + levels[(low + 1) % n] * part


def quantised(levels: Float32, span: float) -> Picture:
    """Return the brightness of decibels over black: 0 at black, 255 at `span` and above."""
    return np.clip(levels * np.float32(255.0 / span) + np.float32(0.5), 0, 255).astype(np.uint8)


def palette() -> Picture:
    """Return the colour (3, 256), blue, green, red, of each brightness: linear between the stops."""
    stops = np.linspace(0.0, 255.0, len(COLOURS))
    return np.rint([np.interp(np.arange(256.0), stops, COLOURS[:, c]) for c in (2, 1, 0)]).astype(np.uint8)


def coloured(picture: Picture, colours: Picture) -> Picture:
    """Map brightness (h, w) to colour (3, h, w)."""
    return np.stack([opencv().LUT(picture, table) for table in colours])


def interface(radar: PpiRadar, title: str) -> tuple[Picture, Array]:
    """Return what the interface draws over every picture (h, w, 3), 0 where nothing, and the boxes (n, 4) of its texts."""
    cv2, size, middle = opencv(), radar.size, radar.centre
    screen = np.zeros((size, size, 3), dtype=np.uint8)
    reach = radar.range / radar.metres_per_pixel
    at = (round(middle * 16), round(middle * 16))
    for ring in range(1, 5):
        cv2.circle(screen, at, round(reach * ring / 4 * 16), RING, 1, cv2.LINE_8, 4)
    for degree in range(0, 360, 5):
        inner = reach * (0.975 if degree % 30 == 0 else 0.99)
        sin, cos = np.sin(np.radians(degree)), np.cos(np.radians(degree))
        ends = [(round(middle + r * sin), round(middle - r * cos)) for r in (inner, reach)]
        cv2.line(screen, *ends, RING, 1)
    up = "N UP" if radar.up == "north-up" else "H UP"
    miles = radar.range / 1852.0
    left = [title, f"RANGE {miles:.2f} NM", f"RINGS {miles / 4:.3f} NM", f"{up}  RM"]
    right = [f"GAIN {radar.gain:+.0f} DB", f"PULSE {radar.pulse / 149.896:.2f} US", f"{60.0 / radar.period:.0f} RPM"]
    boxes = [_text(screen, left, right=False), _text(screen, right, right=True)]
    return screen, np.array(boxes, dtype=float)


def _text(screen: Picture, lines: list[str], *, right: bool) -> tuple[int, int, int, int]:
    """Write lines into an upper corner; return x, y, width and height of their box."""
    cv2, size = opencv(), screen.shape[0]
    scale, step = size / 2048.0, max(8, round(size / 57))
    widths = [cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0][0] for line in lines]
    widest = max(widths)
    x = size - MARGIN - widest if right else MARGIN
    for number, line in enumerate(lines):
        cv2.putText(screen, line, (x, MARGIN + step * (number + 1)), cv2.FONT_HERSHEY_SIMPLEX, scale, TEXT, 1, cv2.LINE_AA)
    return max(x - 2, 0), MARGIN, min(widest + 4, size), step * len(lines) + step // 2


def heading_line(screen: Picture, radar: PpiRadar, bearing: float) -> None:
    """Draw own ship's heading, `bearing` clockwise from up, on a picture (3, h, w)."""
    middle, reach = radar.centre, radar.range / radar.metres_per_pixel
    tip = (round(middle + reach * np.sin(bearing)), round(middle - reach * np.cos(bearing)))
    for plane, level in zip(screen, RING, strict=True):
        opencv().line(plane, (round(middle), round(middle)), tip, level, 1)
