"""A limit on a tracker's memory: its arrays hold every pair of a track and a return, or of those within the gates."""

from __future__ import annotations

from typing import Any

from vedette.errors import ScanRefused
from vedette.tracking import pytrees
from vedette.tracking.plan import Plan
from vedette.tracking.state import State
from vedette.types import Scan

MOST_PAIRS = 20_000_000
"""Pairs of a track, or a mode or particle of one, and a return; each takes some 100 bytes, so all of them some 2 GB."""
MOST_STARTED = 4_000_000
"""Modes or particles of all tracks that begin at a scan; each takes some 500 bytes on the way, so all of them some 2 GB."""
LEAST_STARTED = 1000
"""Tracks from which on those that begin at a scan are measured before they do."""
FEW = 128
"""Scans with at most so many numbers are taken without a count."""
LEAST_PAIRS = 30_000
"""Pairs from which on a scan is taken by those within the gates, where all parts of the tracker can."""
_MOST_PARTS = 1000
"""Number of modes or particles that a track may have without being counted."""


def is_sparse(plan: Plan, state: State, scan: Scan) -> bool:
    """Return whether only the pairs within gates are to be worked on; ScanRefused if all have to be and are too many."""
    detections, existence = scan.detections, state.rows.existence
    if (
        plan.by_pairs
        and detections.missing is None
        and detections.z.ndim == 2
        and existence.ndim == 1
        and existence.size * len(detections.z) >= LEAST_PAIRS
    ):
        return True
    check_pairs(state, scan, len(plan.state))
    return False


def check_pairs(state: State, scan: Scan, axes: int) -> None:
    """Raise ScanRefused if the tracks, over so many state axes, and a scan's returns make more pairs than are allowed."""
    rows = state.rows
    k, tracks = scan.detections.z.shape[-2], rows.existence.size
    if tracks * k < MOST_PAIRS / _MOST_PARTS:
        return
    parts = _parts(rows.belief, tracks, axes)
    if (pairs := tracks * k * parts) > MOST_PAIRS:
        told = f"{tracks:,} {'tracks' if rows is state else 'leaves of tracks'}"
        told = told if parts == 1 else f"{told} of {parts:,} modes or particles"
        raise ScanRefused(_told(f"{told} and {k:,} returns", pairs))


def most_pairs(belief: Any, tracks: int, axes: int) -> int:
    """Return the number of pairs that are allowed at once of tracks whose belief is over so many state axes."""
    return MOST_PAIRS // _parts(belief, tracks, axes)


def check_clusters(count: int, tracks: int, returns: int) -> None:
    """Raise ScanRefused if so many clusters of this size, each a table of all its pairs, are more than allowed at once."""
    if count * tracks * returns > MOST_PAIRS:
        raise ScanRefused(
            f"{tracks:,} tracks hang together by the {returns:,} returns that they share, and make {tracks * returns:,} "
            f"pairs; at most {MOST_PAIRS:,} are taken at once: a lifecycle that ends doubtful tracks sooner, "
            "a narrower gate, or a birth that begins fewer tracks (birth.sensors, birth.initial)"
        )


def check_births(tracks: int, count: int, returns: int) -> None:
    """Raise ScanRefused if so many tracks, and others that begin, make more pairs with returns than allowed at once."""
    if (tracks + count) * returns > MOST_PAIRS:
        raise ScanRefused(_told(f"{count:,} tracks that would begin at {returns:,} returns", count * returns))


def check_started(one: Any, axes: int, count: int) -> None:
    """Raise ScanRefused if so many tracks that begin, each with a belief as large as this `one`, take too much memory."""
    parts = _parts(one, 1, axes)
    if parts > 1 and count * parts > MOST_STARTED:
        raise ScanRefused(
            f"{count:,} tracks that would begin have {count * parts:,} modes or particles, and at most {MOST_STARTED:,} are "
            "taken at once: a birth that begins fewer tracks (birth.sensors), or an estimator with fewer of them"
        )


def refused(tracks: int, returns: int, most: int) -> ScanRefused:
    """Return the error that more than `most` pairs are within gates."""
    return ScanRefused(
        f"{tracks:,} tracks and {returns:,} returns make more than {most:,} pairs within gates, and no more are taken at "
        "once: a birth that begins fewer tracks (birth.sensors), a narrower gate, or more certain tracks"
    )


def _parts(belief: Any, tracks: int, axes: int) -> int:
    """Return the number of modes or particles of a track: the numbers in its belief, over those of one Gaussian."""
    return max(1, round(pytrees.size(belief) / tracks / (axes + axes**2)))


def _told(what: str, pairs: int) -> str:
    return (
        f"{what} make {pairs:,} pairs, and at most {MOST_PAIRS:,} are taken at once: a birth that begins fewer tracks "
        "(birth.sensors), a detection threshold that lets fewer returns through, or a narrower view"
    )
