"""AIS: when a transponder reports, by ITU-R M.1371, and what it reports: its antenna's position, with error and rounding."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, fields
from vedette_files.libraries import needed
from vedette_marine.ais import KNOT, Reports, rate_of_turn, turn_rate
from vedette_sim.ships import Ship

STEP = 1.0 / 3.0
"""Time step in s at which reporting intervals are evaluated: every interval of the table is a multiple of it."""

_SPEEDS = {"A": (14.0, 23.0), "B": (2.0, 14.0, 23.0)}
"""Speeds in knots at which the interval changes."""

_INTERVALS = {
    ("A", False): (10.0, 6.0, 2.0),
    ("A", True): (10.0 / 3.0, 2.0, 2.0),
    ("B", False): (180.0, 30.0, 15.0, 5.0),
    ("B", True): (180.0, 30.0, 15.0, 5.0),
}
"""Nominal intervals in s by class and by whether the course changes, slow to fast; class B is class B SOTDMA."""

_MOORED = 3.0
"""Knots below which a moored class A ship reports every 180 s."""

_TURNING, _MEAN, _CALM, _SLOWER = np.radians(5.0), 30.0, 20.0, 180.0
"""A ship turns while its heading is this far from the mean of the last 30 s, and for 20 s after; slower rates wait 180 s."""


@final
@frozen
class Transponder:
    """A ship's AIS transponder. Resolution: position 1e-4 minutes, speed .1 knot, course .1 degree, heading 1 degree.

    >>> from vedette_sim.ships import Leg
    >>> def sent(speed, last=300.0, legs=(), **how):
    ...     rng = np.random.default_rng(1)
    ...     return reports(Ship([0.0, 0.0], 0.7, speed, legs), Transponder(**how), 7, last, (54.0, 12.0), rng)
    >>> plain = {"spread": 0.0, "gnss": 0.0, "antenna": [30.0, -5.0]}
    >>> made = [sent(6.0, **plain), sent(10.0, **plain), sent(13.0, **plain), sent(6.0, carriage="B", **plain)]
    >>> made += [sent(0.0, 900.0, moored=True, **plain), sent(6.0, 300.0, [Leg("turn", seconds=400.0, rate=0.02)], **plain)]
    >>> [float(np.round(np.diff(each.time)[-1], 1)) for each in made]  # 11.7, 19.4, 25.3 and 11.7 knots, moored, turning
    [10.0, 6.0, 2.0, 30.0, 180.0, 3.3]
    >>> slower = [Leg("accelerate", seconds=7.0, accel=-1.0)]  # from 25.3 to 11.7 knots: for 180 s it reports as before
    >>> [float(np.round(np.diff(sent(13.0, last, slower, **plain).time)[-1], 1)) for last in (170.0, 300.0)]
    [2.0, 10.0]
    >>> one, c, s = made[0], np.cos(0.7), np.sin(0.7)
    >>> there = 6 * one.time[0] * np.array([c, s]) + [30 * c + 5 * s, 30 * s - 5 * c]
    >>> np.allclose([(one.longitude[0] - 12) * 65_576, (one.latitude[0] - 54) * 111_305], there, atol=0.5)  # m a degree
    True
    >>> np.allclose([one.speed[0] / KNOT, *np.degrees([one.course[0], one.heading[0]])], [11.7, 49.9, 50.0])
    True
    >>> turn = np.radians((39 / 4.733) ** 2 / 60)  # 68.8 deg/min as ROT 39
    >>> np.allclose(one.latitude * 6e5, np.round(one.latitude * 6e5)), np.allclose(made[-1].turn[-1], turn)
    (True, True)
    >>> rough, early = sent(6.0, 2e4, gnss=50.0, gnss_seconds=20.0, spread=0.0), sent(6.0, 2e4, spread=0.2, gnss=0.0)
    >>> off = (rough.latitude - 54) * 111_305 - 6 * s * rough.time
    >>> off -= np.polyval(np.polyfit(rough.time, off, 2), rough.time)  # the earth is round
    >>> np.allclose([np.std(off), np.mean(off[1:] * off[:-1]) / np.var(off)], [50.0, np.exp(-10 / 20)], rtol=0.1)
    True
    >>> late = np.diff(early.time) - 10.0
    >>> bool(np.max(np.abs(late)) < 2.01), np.allclose(np.std(late), 2 / 3**0.5, rtol=0.1)
    (True, True)
    """

    carriage: str = fields.choice("class A or B", ("A", "B"), default="A")
    antenna: Array = fields.pair(
        "m", "[x, y] of its GNSS antenna, forward and to port of the hull's centre", default=(0.0, 0.0)
    )
    mmsi: int = fields.integer("its number; default: made from its place in the config", default=0, at_most=999_999_999)
    gnss: float = fields.quantity("m", "standard deviation of the position, east and north each", default=2.1, at_least=0)
    gnss_seconds: float = fields.quantity("s", "time after which that error is correlated by 1/e", default=60.0, above=0)
    moored: bool = fields.flag("its status says moored or at anchor", default=False)
    spread: float = fields.probability(
        "each report comes early or late by up to this part of the interval", default=0.1, at_most=0.2
    )


def antenna_path(path: Ship, antenna: Array, times: Array) -> Array:
    """Return east and north (s, 2) of a point given as [forward, port] of the centre."""
    heading = path.heading(times)
    cos, sin = np.cos(heading), np.sin(heading)
    offset = np.stack([cos * antenna[0] - sin * antenna[1], sin * antenna[0] + cos * antenna[1]], axis=-1)
    return path.states(times)[..., :2] + offset


def nominal_intervals(carriage: str, speed: Array, heading: Array, *, moored: bool = False) -> Array:
    """Return the interval in s at each step of `STEP` s, from speeds in knots and unwrapped headings in rad (s,)."""
    turning = _recently(np.abs(heading - _trailing_mean(heading, round(_MEAN / STEP))) > _TURNING, round(_CALM / STEP))
    band = np.searchsorted(_SPEEDS[carriage], speed, side="right")
    slow, quick = (
        np.array(_INTERVALS[carriage, change])[_trailing_max(band, round(_SLOWER / STEP))] for change in (False, True)
    )
    interval: Array = np.where(turning, quick, slow)
    if moored and carriage == "A":
        interval = np.where(speed <= _MOORED, 180.0, np.minimum(interval, 10.0))
    return interval


def report_times(start: float, intervals: Array, spread: float, rng: np.random.Generator) -> Array:
    """Draw when reports are sent (s,): each once the current interval has passed, early or late by up to `spread` of it."""
    last, reports = start - rng.uniform() * intervals[0], []
    late = spread * rng.uniform(-1.0, 1.0)
    for step, interval in enumerate(intervals.tolist()):
        now = start + step * STEP
        due = last + interval * (1.0 + late)
        if due < now + STEP:
            last = max(due, now)  # it was not due before, so the interval has just become shorter
            late = spread * rng.uniform(-1.0, 1.0)
            reports.append(last)
    return np.array(reports)


def reports(
    path: Ship, transponder: Transponder, mmsi: int, last: float, origin: tuple[float, float], rng: np.random.Generator
) -> Reports:
    """Return a ship's reports until `last` s, as received; `origin` is the latitude and longitude in deg of x = y = 0."""
    enu2geodetic = needed("pymap3d", "places on the globe need pymap3d", "marine").enu2geodetic
    end = last if path.disappears is None else min(last, path.disappears)
    grid = path.appears + STEP * np.arange(int(np.floor((end - path.appears) / STEP)) + 1)
    speed = np.hypot(*path.states(grid)[:, 2:].T) / KNOT
    intervals = nominal_intervals(transponder.carriage, speed, path.heading(grid), moored=transponder.moored)
    times = np.clip(np.round(report_times(path.appears, intervals, transponder.spread, rng), 2), path.appears, end)
    true, soon = (antenna_path(path, transponder.antenna, at) for at in (times, times + 0.05))
    place, velocity = true + transponder.gnss * _correlated(times, transponder.gnss_seconds, rng), (soon - true) / 0.05
    latitude, longitude, _ = enu2geodetic(place[:, 0], place[:, 1], 0.0, *origin, 0.0)
    rate = -np.degrees(path.heading(times + 0.05) - path.heading(times)) / 0.05 * 60.0
    rot = rate_of_turn(rate)
    return Reports(
        mmsi,
        times,
        np.round(np.asarray(latitude) * 600_000.0) / 600_000.0,
        np.round(np.asarray(longitude) * 600_000.0) / 600_000.0,
        np.minimum(np.round(np.hypot(*velocity.T) / KNOT, 1), 102.2) * KNOT,
        np.radians(np.mod(np.round(np.degrees(np.arctan2(velocity[:, 0], velocity[:, 1])), 1), 360.0)),
        np.radians(np.mod(np.round(np.degrees(0.5 * np.pi - path.heading(times))), 360.0)),
        turn_rate(rot) if transponder.carriage == "A" else np.full(len(times), np.nan),
    )


def _correlated(times: Array, seconds: float, rng: np.random.Generator) -> Array:
    """Draw a Gauss-Markov error (s, 2) at `times`, with variance 1."""
    noise = rng.standard_normal((len(times), 2))
    for k in range(1, len(times)):
        keep = np.exp(-(times[k] - times[k - 1]) / seconds)
        noise[k] = keep * noise[k - 1] + np.sqrt(1.0 - keep**2) * noise[k]
    return noise


def _trailing_mean(values: Array, count: int) -> Array:
    """Return the mean of the last `count` values at each place, of fewer at the start."""
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    low = np.maximum(np.arange(len(values)) + 1 - count, 0)
    return values[0] + (total[1:] - total[low]) / (np.arange(len(values)) + 1 - low)


def _trailing_max(values: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Return the greatest of the last `count` values at each place, of fewer at the start."""
    padded = np.concatenate([np.full(count - 1, values.min()), values])
    return np.lib.stride_tricks.sliding_window_view(padded, count).max(axis=-1)


def _recently(true: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    return _trailing_max(true.astype(np.intp), count) > 0
