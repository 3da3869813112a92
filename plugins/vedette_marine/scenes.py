"""Scenes like the two recordings of the paper: pictures of a simulated radar, with AIS, as configs.

The recordings can be had from the DLR (Fowdur, Baum, Heymann, Real-World Marine Radar Datasets for Evaluating Target
Tracking Methods, Sensors 21(14), 4641, 2021); they are not at hand. Known are the sizes of the ships, metres per pixel, the
numbers of frames made and received, and that one shows a radar beacon. Ranges, paths, sea and land are chosen.
"""

from __future__ import annotations

from typing import Any

GAIN = {"gain": -8.0, "beam": "1.2 deg"}
"""Decibels that put the sea at the threshold, and the beam."""


def _legs(*legs: tuple[float, float]) -> list[dict[str, Any]]:
    """Return legs of (seconds, deg/s): straight where the rate is 0."""
    return [
        {"do": "turn", "seconds": seconds, "rate": f"{rate} deg/s"} if rate else {"do": "straight", "seconds": seconds}
        for seconds, rate in legs
    ]


MANOEUVRES = {
    "boat 1": _legs(
        (60, 0), (30, 3), (45, 0), (40, -4), (70, 0), (25, 5), (60, 0), (60, -2.5), (40, 0), (30, -4), (50, 0),
        (45, 4), (60, 0), (36, -5), (75, 0), (60, 2), (50, 0), (30, -4), (44, 0), (40, 4.5),
    ),
    "boat 2": _legs(
        (40, 0), (45, -3), (60, 0), (30, 5), (50, 0), (50, -3.5), (45, 0), (36, 5), (70, 0), (40, -4), (40, 0),
        (60, 3), (60, 0), (24, -5), (55, 0), (45, 4), (40, 0), (60, -3), (50, 0), (30, 4),
    ),
}  # fmt: skip
"""Legs of the two boats: from a half to almost a full turn, with 40 to 75 s straight in between."""

BOATS: dict[str, dict[str, Any]] = {
    "boat 1": {
        "path": {"start": [-100.0, 1400.0], "course": "-20 deg", "speed": 8.0, "legs": MANOEUVRES["boat 1"]},
        "length": 29.0,
        "width": 7.0,
        "cross_section": 300.0,
        "ais": {"carriage": "A", "antenna": [-4.0, 0.0]},
    },
    "boat 2": {
        "path": {"start": [2067.0, -317.0], "course": "160 deg", "speed": 7.0, "legs": MANOEUVRES["boat 2"]},
        "length": 23.0,
        "width": 6.0,
        "cross_section": 250.0,
        "ais": {"carriage": "A", "antenna": [-3.0, 0.0]},
    },
}

SHIP: dict[str, Any] = {
    "path": {
        "start": [-2200.0, 1500.0],
        "course": "-12 deg",
        "speed": 8.0,
        "legs": _legs((140, 0), (80, -0.15), (120, 0), (80, 0.1)),
    },
    "length": 180.0,
    "width": 28.0,
    "cross_section": 10000.0,
    "ais": {"carriage": "A", "antenna": [-65.0, 0.0]},
}


def manoeuvres() -> dict[str, Any]:
    """Return a scene like MANV: two boats that manoeuvre and cross, 6 m a pixel, 1,000 frames of which 24 were lost."""
    return {
        "kind": "radar_pictures_scene",
        "radar": {"metres_per_pixel": 6.0, "range": 2778.0, "pulse": 12.0, "calm": 500.0} | GAIN,
        "vessels": BOATS,
        "frames": 1000,
        "lost": 24,
        "sea": {"shape": 2.0, "level": 1.0, "seconds": 6.2},
        "buoys": [{"at": [-1000.0, 1900.0]}, {"at": [1700.0, -700.0]}],
        "reference": "truth",
    }


def large_ship() -> dict[str, Any]:
    """Return a scene like DARC: an almost straight ship of 180 m, 11 m a pixel, 540 frames with 13 lost, a radar beacon."""
    return {
        "kind": "radar_pictures_scene",
        "radar": {"metres_per_pixel": 11.0, "range": 5556.0, "pulse": 30.0, "calm": 700.0} | GAIN,
        "vessels": {"ship": SHIP},
        "frames": 540,
        "lost": 13,
        "sea": {"shape": 1.0, "level": 7.0, "seconds": 6.2},
        "buoys": [{"at": [600.0, 1900.0], "cross_section": 30.0}, {"at": [-700.0, 2100.0], "cross_section": 30.0}],
        "racons": [{"at": [1500.0, 2300.0], "length": 1500.0}],
        "reference": "truth",
    }
