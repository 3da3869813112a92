"""The confirmed tracks of a run in a table: from when to when, how many scans, and how fast and where to in the end."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from vedette import Result, Track
from vedette_files import Terms, labels, utc
from vedette_files.input_files import shown
from vedette_report.columns import aligned

MOST_TRACKS = 30
"""Number of tracks that the summary tells of; `tracks.csv` has all."""
_LONGEST = 60
"""Characters of a name that stand in the table."""

SURE, MOST_TIMES = 0.95, 5
"""Probability of a link below which ids may have been exchanged; how many such times the summary tells of."""


def track_rows(result: Result, most: int = MOST_TRACKS) -> list[str]:
    """Return the lines of the table; none without tracks, as in a run that kept nothing."""
    tracks = result.tracks
    if not tracks:
        return []
    terms, space = Terms.of(result.recording.notes, tracks), tracks[0].space
    moving = "vx" in space and "vy" in space
    titles = ["track", *(["identity"] if terms.named else []), "from", "to", "scans"]
    if moving:
        unit = space.axes[space.names.index("vx")].unit
        titles += [f"speed [{unit}]", "course [deg]"]
    table = [_row(track, terms, moving=moving) for track in tracks[:most]]
    lines = ["Confirmed tracks" + (f": the last speed, and the course {_sense(terms)}" if moving else "")]
    lines += [f"  {line}" for line in aligned([titles, *table])]
    more = len(tracks) - most
    lines += [f"  and {more:,} more, which tracks.csv has"] if more > 0 else []
    return lines + list(_exchanges(tracks, terms))


def _exchanges(tracks: Sequence[Track], terms: Terms) -> Iterator[str]:
    """Yield when two tracks or more may have exchanged what they track, as their links say."""
    met = defaultdict[float, list[tuple[int, float]]](list)
    for track in tracks:
        if track.link is not None:
            for k in np.flatnonzero((track.link < SURE) & track.confirmed):
                met[float(track.times[k])].append((track.id, float(track.link[k])))
    times = sorted(time for time, seen in met.items() if len(seen) > 1)
    if times:
        yield "Ids may have been exchanged"
    for time in times[:MOST_TIMES]:
        ids = " and ".join(str(number) for number, _ in met[time])
        risk = 1.0 - min(link for _, link in met[time])
        yield f"  from {utc(time) if terms.dated else f'{time:.2f} s'} on: tracks {ids}, with probability {risk:.2f}"
    if len(times) > MOST_TIMES:
        yield f"  and {len(times) - MOST_TIMES:,} more times, as the links in tracks.csv say"


def _sense(terms: Terms) -> str:
    return "clockwise from north" if terms.north_east or terms.origin is not None else "from +x towards +y"


def _row(track: Track, terms: Terms, *, moving: bool) -> list[str]:
    first = int(np.argmax(track.confirmed))
    ends = [utc(time) if terms.dated else f"{time:.2f} s" for time in (float(track.times[first]), float(track.times[-1]))]
    names = labels(track.identity, len(track.times))
    name = [_printed(next(filter(None, reversed(names)), "-"))] if terms.named else []
    row = [f"{track.id}", *name, *ends, f"{len(track.times) - first:,}"]
    return row + list(_motion(track, terms)) if moving else row


def _printed(name: str) -> str:
    return name if name.isprintable() and len(name) <= _LONGEST else shown(name, _LONGEST)


def _motion(track: Track, terms: Terms) -> tuple[str, str]:
    """Return speed and course at the end, each give or take its standard deviation."""
    where = [track.space.names.index(name) for name in ("vx", "vy")]
    (vx, vy), cov = track.mean[-1, where], track.cov[-1][np.ix_(where, where)]
    speed = float(np.hypot(vx, vy))
    if not np.isfinite(speed) or speed == 0.0:
        return f"{speed:.3g}", "-"
    along = np.array([vx, vy]) / speed
    spread, across = (float(np.sqrt(max(unit @ cov @ unit, 0.0))) for unit in (along, np.array([-along[1], along[0]])))
    course = np.degrees(np.arctan2(vy, vx))
    if terms.origin is not None and not terms.north_east:
        course = 90.0 - course
    if across > speed:  # it may point anywhere
        return f"{speed:.3g} +- {spread:.2g}", "-"
    return f"{speed:.3g} +- {spread:.2g}", f"{round(course) % 360} +- {np.degrees(across / speed):.2g}"
