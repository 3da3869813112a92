"""A draft, tried on the returns that it is for: how likely it finds them, and how whole its tracks are."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve, frozen

from vedette.config import load
from vedette.errors import VedetteError
from vedette.tracking import History, Tracker
from vedette.types import Scan, Track
from vedette_tools.tuning.field_of_view import views
from vedette_tools.tuning.likelihood import Predictive

SHORT = 5
"""A track of fewer scans with a return of its own is short."""

LOOSE, LOOSER = 0.2, 3.0
"""Targets are not as the first were where such a part of the returns are of no track, and so many times as many a scan as
among the first. By hand.
"""


@frozen(eq=False)
class Trial:
    """What running a draft over `returns` of its file showed.

    loglik: of the returns, each predicted from those before it; tracks: confirmed; short: those among them with few returns;
    explained: returns that are of confirmed tracks; long: the number of tracks of equal length that were as broken, the
    square of the sum of their returns over the sum of squares; mixed: times that a confirmed track went over to another
    name, and shared: names that several confirmed tracks bear, beyond the first; lost: names of SHORT returns or more that
    none bears; detected: in which part of the scans between their first and their last return tracks had one; named: how
    many names returns bear, and tracks without any; at_once: the mean number of tracks at a time, each counted from its
    first return to its last.
    """

    loglik: float
    returns: int
    tracks: int
    short: int
    explained: float
    long: float = 0.0
    mixed: int = 0
    shared: int = 0
    lost: int = 0
    detected: float = 1.0
    named: int = 0
    at_once: float = 1.0

    @property
    def share(self) -> float:
        """The part of the returns that confirmed tracks explain."""
        return self.explained / max(self.returns, 1)

    @property
    def broken(self) -> float:
        """How many long tracks, changes of names and names of several tracks there are: the fewer, the better.

        A name without a track counts twice: it would make one track more.
        """
        return self.long + self.misnamed

    @property
    def misnamed(self) -> int:
        """How many changes of names, names of several tracks, and twice those without one there are."""
        return self.mixed + self.shared + 2 * self.lost

    def __str__(self) -> str:
        told = f"{self.tracks} tracks, {self.short} of them short; {self.share:.3f} of the returns are theirs"
        named = f"; {self.mixed} changes of name, {self.shared} names in several tracks" if self.mixed or self.shared else ""
        named += f"; {self.lost} named without a track" if self.lost else ""
        return f"{told}{named}; log-likelihood {self.loglik / max(self.returns, 1):.2f} a return"


def tracker_of(text: str) -> Tracker:
    """Return the tracker of a config, as TOML, without its source."""
    return load({name: part for name, part in tomllib.loads(text).items() if name != "source"}).tracker


def tried(text: str, scans: Sequence[Scan], *, clean: bool = True) -> Trial | None:
    """Return what a config, as TOML, shows on scans of its source; None if it cannot run on them.

    clean: whether hardly a return is false. Else returns are predicted from confirmed tracks alone: each false one begins a
    track, and the wider these are spread, the likelier is clutter.
    """
    try:
        tracker = tracker_of(text)
        seen, predictive, history = views(tracker.sensors, scans), Predictive(tracker), History(tracker)
        state, total = tracker.start(time=scans[0].time), 0.0
        with np.errstate(all="ignore"):
            for scan in scans:
                it = tracker.expect(state, scan)
                if scan.sensor in seen:
                    it = it if clean else evolve(it, existence=np.where(state.confirmed, it.existence, 0.0))
                    total += predictive(it, seen[scan.sensor].cover(it.sensor, scan.pose))[0]
                state = tracker.step(state, scan)
                history.add(state)
    except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return None
    tracks = history.tracks()
    if not np.isfinite(total):
        return None
    hits = [float(np.sum(track.hit)) for track in tracks]
    named = [codes for scan in scans if (codes := scan.detections.identity) is not None]
    given = Counter(code for codes in named for code in codes[codes >= 0].tolist())
    return Trial(
        total, sum(len(scan.detections.z) for scan in scans), len(tracks), sum(hit < SHORT for hit in hits), sum(hits),
        sum(hits) ** 2 / max(float(np.sum(np.square(hits))), 1e-9), *_names(tracks, given), _detected(tracks),
        len(given) + sum(track.identity is None or not np.any(track.identity >= 0) for track in tracks),
        _at_once(tracks),
    )  # fmt: skip


def at_the_end(text: str, first: tuple[Trial, int], scans: Sequence[Scan]) -> str:
    """Say that a config, as TOML, which fits so many first scans, does not fit these later ones; or return ""."""
    begin, looked = first
    if (end := tried(text, scans)) is None:
        return ""
    before, loose = ((one.returns - one.explained) / count for one, count in ((begin, looked), (end, len(scans))))
    if end.share > 1 - LOOSE or loose < LOOSER * before:
        return ""
    told = f"of the returns in the last {len(scans):,} scans its tracks explain {end.share:.2g}"
    return f"{told}, of those by which it was drafted {begin.share:.2g}: draft these rows by themselves, and compare"


def _names(tracks: Sequence[Track], given: Mapping[int, int]) -> tuple[int, int, int]:
    """Return how often tracks went over to another name, how many names several bear, beyond the first of each, and how
    many of those that returns often bear none does; given: how many returns bear each name.
    """
    told = [track.identity[track.identity >= 0] for track in tracks if track.identity is not None]
    mixed = sum(int(np.count_nonzero(np.diff(codes))) for codes in told)
    bears = sum(len(set(codes.tolist())) for codes in told)
    borne = {code for codes in told for code in codes.tolist()}
    return mixed, bears - len(borne), sum(count >= SHORT and code not in borne for code, count in given.items())


def _detected(tracks: Sequence[Track]) -> float:
    """Return in which part of the scans between their first and their last return tracks had one."""
    seen = [np.flatnonzero(track.hit > 0.5) for track in tracks]
    spans = sum(int(rows[-1] - rows[0]) + 1 for rows in seen if len(rows))
    return sum(map(len, seen)) / spans if spans else 1.0


def _at_once(tracks: Sequence[Track]) -> float:
    """Return how many tracks there are at a time, each from its first return to its last; 1 where none lasts."""
    lasting = [track.times[track.hit > 0.5][[0, -1]] for track in tracks if np.any(track.hit > 0.5)]
    if not lasting:
        return 1.0
    begun, ended = np.transpose(lasting)
    return float(max(np.sum(ended - begun) / max(np.max(ended) - np.min(begun), 1e-9), 1.0))
