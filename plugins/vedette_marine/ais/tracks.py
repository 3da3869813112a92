"""AIS reports as trajectories: where a ship was between its reports, and how large the error may be."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Space, Trajectory
from vedette_marine.ais.reports import Reports, east_north

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@frozen(eq=False)
class Between:
    """A ship at requested times (q,): place (q, 2) and velocity (q, 2), and `error` (q,), the error of the place in m that a
    turn or a change of speed since its last report may cause. NaN outside its reports and in gaps.
    """

    place: Array
    velocity: Array
    error: Array


def motion(reports: Reports, origin: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Return increasing times (s,), places (s, 2) and velocities (s, 2) of one ship; of equal times the last report counts.

    A velocity that is not reported, as without COG, is the slope between its neighbours; 0 if there is only one report.
    """
    last = np.diff(reports.time, append=np.inf) > 0
    last_reports = reports.where(last)
    place, speed = east_north(last_reports.latitude, last_reports.longitude, origin), last_reports.velocity.copy()
    lacking = np.isnan(speed).any(axis=-1)
    if lacking.any():
        slope = np.gradient(place, last_reports.time, axis=0) if len(place) > 1 else np.zeros_like(place)
        speed[lacking] = slope[lacking]
    return last_reports.time, place, speed


def between(reports: Reports, origin: tuple[float, float], times: Array, longest: float = 60.0) -> Between:
    """Interpolate a ship at `times` (q,) in s along the straight line between two reports at most `longest` s apart.

    The line is off by at most a T^2 / 8 under an acceleration a; with a = |v2 - v1| / T from the reports' velocities that
    is |v2 - v1| T / 8 in the middle, and 4 s (1 - s) of it at the fraction s. A turn to and fro between two reports, and the
    receiver's own error of some metres, are not included.
    """
    known, place, speed = motion(reports, origin)
    if len(known) < 2:
        nothing = np.full((len(times), 2), np.nan)
        return Between(nothing, nothing, nothing[:, 0])
    i = np.clip(np.searchsorted(known, times, side="right") - 1, 0, len(known) - 2)
    gap = known[i + 1] - known[i]
    part = (times - known[i]) / gap
    inside = (part >= 0) & (part <= 1) & (gap <= longest)
    s = np.where(inside, part, np.nan)[:, None]
    error = 0.5 * s[:, 0] * (1 - s[:, 0]) * np.linalg.norm(speed[i + 1] - speed[i], axis=-1) * gap
    return Between(
        (1 - s) * place[i] + s * place[i + 1],
        (1 - s) * speed[i] + s * speed[i + 1],
        error,
    )


def trajectories(reports: Reports, origin: tuple[float, float], longest: float = 60.0) -> tuple[Trajectory, ...]:
    """Return the ship's reports as trajectories, one for each stretch without a gap of more than `longest` s."""
    time, place, speed = motion(reports, origin)
    if not len(time):
        return ()
    cuts = np.flatnonzero(np.diff(time) > longest) + 1
    parts = []
    for k, rows in enumerate(np.split(np.arange(len(time)), cuts)):
        name = f"MMSI {reports.mmsi}" + ("" if len(cuts) == 0 else f" ({k + 1})")
        parts.append(Trajectory(name, STATE, time[rows], np.concatenate([place[rows], speed[rows]], axis=-1)))
    return tuple(parts)
