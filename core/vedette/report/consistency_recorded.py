"""What tracks of a recording state about themselves, over time: the picture of `vedette consistency`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from attrs import frozen

from vedette.metrics.consistency import chi_square_band
from vedette.report import canvas
from vedette.space import Array

MOST = 8
"""Number of tracks that are drawn."""


@frozen(eq=False)
class Lines:
    """One track: NEES (s,) at `times` (s,) if there is truth, NIS (r,) at the scans that it was detected in (r,), both over
    what is expected; the correlation (l,) of innovations at lag 1 ..., each from `pairs` (l,) of numbers.
    """

    name: str
    times: Array
    nees: Array | None
    detected: Array
    nis: Array
    correlation: Array
    pairs: Array


def draw(title: str, tracks: Sequence[Lines], axes: int, measured: int, path: Path) -> None:
    """Write a PNG: NEES where there is truth, NIS and correlations of innovations, each with the band of 95 % of one point.

    `axes` and `measured` are how many numbers a NEES and a NIS are the mean of.
    """
    shown, truth = tracks[:MOST], any(track.nees is not None for track in tracks)
    made = canvas.figure(9.0 if truth else 6.5)
    places = made.subplots(3 if truth else 2, 1)
    *over_time, white = places
    kept = "" if len(shown) == len(tracks) else f"   ·   the first {MOST} of {len(tracks)} tracks"
    canvas.head(made, title, f"1 is expected of NEES and NIS, 0 of correlations; bands hold 95 % of single points{kept}")
    for i, track in enumerate(shown):
        begin = float(track.times[0])
        if track.nees is not None:
            over_time[0].plot(track.times - begin, track.nees, ".-", color=canvas.colour(i), linewidth=1, markersize=3)
        over_time[-1].plot(track.detected - begin, track.nis, ".", color=canvas.colour(i), markersize=4, label=track.name)
        lags = [lag + 0.05 * (i - len(shown) / 2) for lag in range(1, 1 + len(track.correlation))]
        white.vlines(lags, 0.0, track.correlation, color=canvas.colour(i), linewidth=2)
        white.plot(lags, track.correlation, "o", color=canvas.colour(i), markersize=4)
    named = [("NEES", axes), ("NIS", measured)]
    for each, (name, count) in zip(over_time, named[-len(over_time) :], strict=True):
        each.axhspan(*chi_square_band(count, 0.05), color=canvas.FAINT, alpha=0.6, linewidth=0)
        each.axhline(1.0, color=canvas.INK, linewidth=0.8)
        each.set(yscale="log", ylabel=f"{name} over what is expected", xlabel="time since the track began [s]")
    over_time[-1].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, fontsize=9, frameon=False)
    least = min((float(track.pairs[0]) for track in shown if len(track.pairs)), default=0.0)
    if least:
        white.axhspan(-1.96 / least**0.5, 1.96 / least**0.5, color=canvas.FAINT, alpha=0.6, linewidth=0)
    white.axhline(0.0, color=canvas.INK, linewidth=0.8)
    white.set(xlabel="lag [scans]", ylabel="correlation of innovations")
    for each in made.axes:
        canvas.plain(each)
    canvas.save(made, path)
