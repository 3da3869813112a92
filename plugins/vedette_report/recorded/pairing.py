"""Which tracks of a run followed which true object, and when an object was lost: what is then judged track by track."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Experiment, Indices, InputError, Mask, Result, Track
from vedette.metrics import NONE, RunningJudge, space_of
from vedette_files import PLAIN, Terms


@frozen(eq=False)
class Followed:
    """One object: the tracks that covered it in turn, by when each first did, and when each of them lost it.

    `scans`: of each track, those (s,) at which it followed this object; `ended`: the time in s of the last scan at which it
    covered it, before another track did or for good; None if it did to the end. `terms`: what times are.
    """

    truth: str
    tracks: tuple[Track, ...]
    scans: tuple[Mask, ...]
    ended: tuple[float | None, ...]
    terms: Terms = PLAIN

    @property
    def lost(self) -> tuple[float, ...]:
        """The times in s at which the object was lost."""
        return tuple(sorted(time for time in self.ended if time is not None))

    def lost_by(self, track: int) -> float | None:
        """Return when the track of this id lost the object, in s; None if it did not."""
        return next((time for one, time in zip(self.tracks, self.ended, strict=True) if one.id == track), None)

    @property
    def hint(self) -> str:
        """When the object was lost, in words; "" if it never was."""
        *before, last = [self.terms.when(time) for time in self.lost] or [""]
        if not last:
            return ""
        count = f"{len(self.tracks)} tracks one after the other" if len(self.tracks) > 1 else "1 track"
        good = ", and not found again" if len(self.lost) == len(self.tracks) else ""
        at = f"{', '.join(before)} and {last}" if before else last
        return f"{count}: the target was lost at {at}{good}"


def followed(experiment: Experiment, result: Result) -> tuple[Followed, ...]:
    """Pair tracks with true objects as the judge does; an object that no track ever covered has no tracks.

    A track that covers no object at a scan follows the one that it covered last, or before that will cover first.
    """
    truth, judge = result.recording.truth, experiment.judge
    try:
        blocks = RunningJudge(truth, space_of(result.tracks), judge).take(result.tracks, result.scans)
    except InputError:  # nothing in common to pair by
        return tuple(Followed(path.name, (), (), ()) for path in truth)
    times = np.concatenate([np.zeros(0), *(block.times[block.found.scans] for block in blocks)])
    cover, alive = np.full((len(times), len(truth)), NONE), np.zeros((len(times), len(truth)), dtype=bool)
    ends = np.cumsum([len(block.found.scans) for block in blocks])
    for rows, block in zip(np.split(np.arange(len(times)), ends), blocks, strict=False):
        cover[rows[:, None], block.which], alive[rows[:, None], block.which] = block.found.cover, block.found.truth.alive
    terms = Terms.of(result.recording.notes)
    confirmed, objects = [track for track in result.tracks if track.confirmed.any()], list[Followed]()
    for j, path in enumerate(truth):
        held = cover[:, j]
        turns = list(dict.fromkeys(held[held != NONE].tolist()))
        last = [float(times[np.flatnonzero(held == i)[-1]]) for i in turns]
        end = max(last, default=np.inf)
        good = np.count_nonzero(times[alive[:, j]] > end) > judge.lost_scans
        ended = tuple(time if time < end or good else None for time in last)
        tracks = tuple(confirmed[i] for i in turns)
        scans = tuple(_followed_at(track, times, cover == i) == j for track, i in zip(tracks, turns, strict=True))
        objects.append(Followed(path.name, tracks, scans, ended, terms))
    return tuple(objects)


def _followed_at(track: Track, times: Array, covers: Mask) -> Indices:
    """Return which object a track follows at each of its scans (s,), from which it covers at `times`, (t, j)."""
    scan, which = np.nonzero(covers)
    at = np.searchsorted(times[scan], track.times, side="right") - 1
    return which[np.maximum(at, 0)]
