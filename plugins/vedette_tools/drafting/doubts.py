"""Tracks that are doubted: run backwards in time they are of other returns, or they go in pairs at one place."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import accumulate, combinations, pairwise

import numpy as np
from attrs import evolve, frozen

from vedette.config import load
from vedette.errors import VedetteError
from vedette.space import Array
from vedette.tracking import History, Tracker
from vedette.types import Scan, Track

SAME = 0.75
"""Such a part of the pairs of returns that follow each other in tracks is to be the same backwards. By hand: of 35 files
that were tracked right it was .85 and more, of six in which a tenth of the pairs or more were wrong .67 and less."""

ONE_PLACE, NEAR, ASIDE, LEAST = 0.5, 3.0, 0.1, 20
"""Two tracks that both have returns of so many scans are at one place if they are apart by less than so many of their
deviations and such a part of the spread of all, in the mean by less than such a part of what they are at a time. By hand."""

PAIRED = 0.8
"""So many of the returns are of such pairs of tracks where each object is reported twice. By hand."""


@frozen(eq=False)
class _Followed:
    """The numbers of the returns that a track took, in the order of the file, each at its time and place; their variance."""

    returns: tuple[int, ...]
    times: Array
    places: Array
    variance: float


def doubt(text: str, scans: Sequence[Scan]) -> str:
    """Say why the tracks that a config, as TOML, makes of scans are not to be believed, or return ""."""
    tracker = load({name: part for name, part in tomllib.loads(text).items() if name != "source"}).tracker
    numbered = list(zip(scans, accumulate((len(scan.detections.z) for scan in scans), initial=0), strict=False))
    try:
        with np.errstate(all="ignore"):
            ahead = list(_followed(tracker, numbered))
            back = list(_followed(tracker, [(_turned(scan), first) for scan, first in reversed(numbered)]))
    except (VedetteError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return ""
    if (share := _paired(ahead)) > PAIRED:
        told = f"{share:.2g} of the returns are of tracks that go in pairs at one place: objects are reported twice"
        return f"nothing fits these data: {told}; keep the rows of one receiver, or one of each row"
    one, other = _links(ahead), _links(back)
    if (same := len(one & other) / max(len(one), len(other), 1)) < SAME:
        told = f"run backwards in time the same tracker joins other returns, {same:.2g} of the pairs are the same"
        return f"nothing fits these data: {told}; they come too seldom: add a column that names objects, titled id"
    return ""


def _followed(tracker: Tracker, scans: Sequence[tuple[Scan, int]]) -> Iterator[_Followed]:
    """Yield the tracks of scans, each with the number of its first return."""
    state, history = tracker.start(time=scans[0][0].time), History(tracker)
    firsts: dict[float, list[int]] = {}
    for scan, first in scans:
        state = tracker.step(state, scan)
        history.add(state)
        firsts.setdefault(state.time, []).append(first)
    for track in history.tracks():
        if np.any(track.hit > 0.5):
            yield _taken(track, firsts)


def _taken(track: Track, firsts: dict[float, list[int]]) -> _Followed:
    """Return a track with the returns that it took; firsts: of each time, the numbers of its scans' first returns."""
    later: Counter[float] = Counter()
    numbers = []
    for row in reversed(range(len(track.times))):
        time, listed = float(track.times[row]), None if track.returns is None else track.returns[row]
        later[time] += 1  # a track may begin with the second of two scans of one time
        if track.hit[row] > 0.5:
            column = int(np.argmax(track.weights[row][1:]))
            numbers.append(firsts[time][-later[time]] + (column if listed is None else int(listed[column])))
    rows, axes = track.hit > 0.5, [track.space.names.index(axis) for axis in "xy"]
    variance = float(np.mean(np.trace(track.cov[rows][:, axes][:, :, axes], axis1=1, axis2=2)))
    return _Followed(tuple(numbers[::-1]), track.times[rows], track.mean[rows][:, axes], variance)


def _turned(scan: Scan) -> Scan:
    """Return a scan as it is where time runs backwards."""
    times = scan.detections.time
    if times is None or not len(times):
        return evolve(scan, time=-scan.time)
    return evolve(scan, time=-float(np.min(times)), detections=evolve(scan.detections, time=-times))


def _links(tracks: Sequence[_Followed]) -> set[frozenset[int]]:
    """Return the pairs of returns that follow each other in a track."""
    return {frozenset(pair) for track in tracks for pair in pairwise(track.returns)}


def _paired(tracks: Sequence[_Followed]) -> float:
    """Return which part of the returns of tracks is of two that go together."""
    if not tracks:
        return 0.0
    of_pairs: set[int] = set()
    spread = float(np.linalg.norm(np.std(np.concatenate([track.places for track in tracks]), axis=0)))
    long = [(number, track) for number, track in enumerate(tracks) if len(track.times) >= LEAST]
    for (i, one), (j, other) in combinations(long, 2):
        _, mine, others = np.intersect1d(one.times, other.times, return_indices=True)
        apart = one.places[mine] - other.places[others]
        if len(apart) < max(LEAST, 0.5 * min(len(one.times), len(other.times))):
            continue
        usual = np.sqrt(np.mean(np.sum(apart**2, axis=-1)))
        near = usual <= min(NEAR * np.sqrt(one.variance + other.variance), ASIDE * spread)
        if near and np.linalg.norm(np.mean(apart, axis=0)) <= ONE_PLACE * usual:
            of_pairs |= {i, j}
    total = sum(len(track.returns) for track in tracks)
    return sum(len(tracks[i].returns) for i in of_pairs) / max(total, 1)
