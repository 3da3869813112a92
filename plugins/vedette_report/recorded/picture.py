"""What tracks of a recording state about themselves, over time: the picture of `vedette consistency`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from attrs import frozen

from vedette.metrics import chi_square_band
from vedette.space import Array
from vedette_report.drawing import canvas

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vedette_report.recorded.tracks import Recorded

MOST = 8
"""Number of tracks that are drawn."""


def drawn(title: str, told: Sequence[Recorded]) -> Figure:
    """Draw NEES where there is truth, NIS and correlations of innovations, with bands of 95 % of one point."""
    return _drawn(title, [_lines(one) for one in told], told[0].axes, told[0].measured)


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


def _lines(one: Recorded) -> Lines:
    seen = one.innovations
    hit = seen.hit > 0.5
    name = f"track {one.track}" if one.truth is None else f"{one.truth}, track {one.track}"
    nis = seen.nis[hit] / (seen.hit * seen.axes)[hit]
    return Lines(name, one.times, one.nees, seen.times[hit], nis, seen.correlation, seen.pairs)


def _drawn(title: str, tracks: Sequence[Lines], axes: int, measured: int) -> Figure:
    shown, truth = tracks[:MOST], any(track.nees is not None for track in tracks)
    panels = 3 if truth else 2
    made = canvas.figure(canvas.stacked(panels), words=0.3 * -(-len(shown) // max(2, canvas.across(4))))
    *over_time, white = made.subplots(panels, 1)
    kept = "" if len(shown) == len(tracks) else f"   ·   the first {MOST} of {len(tracks)} tracks"
    canvas.head(made, title, f"1 is expected of NEES and NIS, 0 of correlations; bands hold 95 % of single points{kept}")
    for i, track in enumerate(shown):
        begin, shade = float(track.times[0]), canvas.colour(i)
        if track.nees is not None:
            fine: dict[str, Any] = {"linewidth": canvas.stroke(1.0), "markersize": canvas.mark(3.0)}
            over_time[0].plot(track.times - begin, track.nees, ".-", color=shade, **fine)
        over_time[-1].plot(track.detected - begin, track.nis, ".", color=shade, markersize=canvas.mark(4), label=track.name)
        lags = [lag + 0.05 * (i - len(shown) / 2) for lag in range(1, 1 + len(track.correlation))]
        white.vlines(lags, 0.0, track.correlation, color=shade, linewidth=canvas.stroke(2))
        white.plot(lags, track.correlation, "o", color=shade, markersize=canvas.mark(4))
    named = [("NEES", axes), ("NIS", measured)]
    for series, (name, count) in zip(over_time, named[-len(over_time) :], strict=True):
        series.axhspan(*chi_square_band(count, 0.05), color=canvas.FAINT, alpha=0.6, linewidth=0)
        series.axhline(1.0, color=canvas.INK, linewidth=canvas.stroke(0.8))
        series.set(
            yscale="log", ylabel=canvas.wrapped(f"{name} over what is expected"), xlabel="time since the track began [s]"
        )
    if truth:
        over_time[0].sharex(over_time[1])
    handles, names = over_time[-1].get_legend_handles_labels()
    columns = min(len(shown), max(2, canvas.across(4)))
    made.legend(handles, names, loc="outside lower center", ncols=columns, **canvas.legend(9))
    least = min((float(track.pairs[0]) for track in shown if len(track.pairs)), default=0.0)
    if least:
        white.axhspan(-1.96 / least**0.5, 1.96 / least**0.5, color=canvas.FAINT, alpha=0.6, linewidth=0)
    white.axhline(0.0, color=canvas.INK, linewidth=canvas.stroke(0.8))
    white.set(xlabel="lag [scans]", ylabel=canvas.wrapped("correlation of innovations"))
    white.xaxis.get_major_locator().set_params(integer=True)
    for series in made.axes:
        canvas.plain(series)
    return made
