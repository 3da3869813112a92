"""Tracks that are doubted: several share the same returns, or run backwards in time they are of others."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np
from attrs import evolve

from vedette.errors import VedetteError
from vedette.tracking import History, Tracker
from vedette.types import Scan
from vedette_report.detector_errors.in_tracks import scans_at, taken
from vedette_tools.drafting.trial import tracker_of

SAME = 0.75
"""Such a part of the pairs of returns that follow each other in tracks is to be the same backwards. By hand: of 35 files
that were tracked right it was .85 and more, of six in which a tenth of the pairs or more were wrong .67 and less. Of 200
drawn scenes that had no part in it, .89 and more.
"""

OWN = 0.8
"""Of what tracks take such a part is to be a return that is most likely theirs. By hand: of 35 files that were tracked right
it was .94 and more, of these scenes .98; where objects are reported twice .5, where a tracker for aircraft follows people
too .6.
"""


def doubt(text: str, scans: Sequence[Scan]) -> str:
    """Say why the tracks that a config, as TOML, makes of scans are not to be believed, or return ""."""
    tracker = tracker_of(text)
    numbered = list(zip(scans, accumulate((len(scan.detections.z) for scan in scans), initial=0), strict=False))
    try:
        with np.errstate(all="ignore"):
            links, own = _joined(tracker, numbered)
            others, _ = _joined(tracker, [(_turned(scan), first) for scan, first in reversed(numbered)])
    except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return ""
    if own < OWN:
        told = f"several tracks share the same returns, {1 - own:.2g} of what they take is not most likely theirs"
        cure = "keep the rows of one receiver and of one kind of object, or add a column that names objects, titled id"
        return f"nothing fits these data: {told}; {cure}; if objects give several returns, see 'grouped_returns'"
    if (same := len(links & others) / max(len(links), len(others), 1)) < SAME:
        told = f"run backwards in time the same tracker joins other returns, {same:.2g} of the pairs are the same"
        cure = "they come too seldom, or too many are false: add a column that names objects, titled id"
        return f"nothing fits these data: {told}; {cure}"
    return ""


def _joined(tracker: Tracker, scans: Sequence[tuple[Scan, int]]) -> tuple[set[frozenset[int]], float]:
    """Return the pairs of returns that follow each other in tracks, and which part of what these take is a likeliest return.

    scans: each with the number of its first return.
    """
    state, history = tracker.start(time=scans[0][0].time), History(tracker)
    for scan, _ in scans:
        state = tracker.step(state, scan)
        history.add(state)
    tracks, at = history.tracks(), scans_at(scan for scan, _ in scans)
    numbers = [[scans[i][1] + column for _, i, column in taken(track, at)] for track in tracks]
    links = {frozenset(pair) for each in numbers for pair in pairwise(each)}
    likeliest = sum(float(np.max(weights[1:], initial=0.0)) for track in tracks for weights in track.weights)
    every = sum(float(np.sum(track.hit)) for track in tracks)
    return links, likeliest / every if every else 1.0


def _turned(scan: Scan) -> Scan:
    """Return a scan as it is where time runs backwards."""
    times = scan.detections.time
    if times is None or not len(times):
        return evolve(scan, time=-scan.time)
    return evolve(scan, time=-float(np.min(times)), detections=evolve(scan.detections, time=-times))
