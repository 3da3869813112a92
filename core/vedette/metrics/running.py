"""The judge of a run: it takes the tracks scan by scan, and keeps the sums that the score needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, final

import numpy as np
from attrs import evolve, frozen

from vedette.errors import PluginError
from vedette.metrics.coverage import LastCover, covering
from vedette.metrics.histories import Entries, Truth, confirmed_entries, truth_at
from vedette.metrics.matching import Match, MatchedPairs, matched
from vedette.metrics.score import Collected, Figure, Judge, Score
from vedette.metrics.tally import SETS, Errors, Fate, Nis, Total, of_all, sets
from vedette.names import look_up
from vedette.roles import Sensor
from vedette.space import Array, Indices, Mask, Space
from vedette.types import Detections, Gaussian, Scan, Track, Trajectory

SCANS, ENTRIES = 200, 5_000
"""After so many scans, or tracks times scans, a block is judged."""

RETURNS = 1_000
"""Scans after which a track that is gone does not return: hypotheses may bring one back."""

_REMEMBERED = 4_096


@frozen(eq=False)
class Block:
    """Some scans of a run, at `times` (s,) in s: their match with the truth, and which are judged, `chosen`.

    axes (s,): how many each measures; `which`: the true objects of the match, among those of the run.
    """

    found: Match
    pairs: MatchedPairs
    times: Array
    chosen: Indices
    axes: Indices
    which: Indices


@final
class RunningJudge:
    """Judges the tracks of one run scan by scan.

    Parameters
    ----------
    truth : all true objects
    space : the tracks' axes; None if there are no tracks
    options : how tracks are judged
    gate_probability : that of the tracker's gate: `nis` allows for the returns that it rejects. Frames are not gated
    sensors : those of the scans, for the posterior Cramer-Rao bound
    figures : those of plugins, which are computed besides
    keep : numbers that may be kept for figures of whole tracks, by default none: there are no such figures then, nor beyond
    nobody : that there is no truth means that no object is there: every track is false

    Raises
    ------
    InputError : truth and tracks have no position axis in common
    """

    def __init__(
        self,
        truth: Sequence[Trajectory],
        space: Space | None,
        options: Judge,
        gate_probability: float = 1.0,
        *,
        sensors: Mapping[str, Sensor] | None = None,
        figures: Sequence[Figure] = (),
        keep: float = 0.0,
        nobody: bool = False,
    ) -> None:
        self.tracks, self._nobody, self._entries_chosen = 0, nobody, 0
        self.space = truth_at(truth, np.zeros(0), space).space
        self.whole = look_up("WholeTracks")(len(truth), options, keep)
        self._truth, self._options, self._gate, self._sensors = truth, options, gate_probability, sensors
        self._part = [] if space is None else space.locate(self.space)
        self._begin = np.array([path.times[0] if len(path.times) else np.inf for path in truth])
        self._end = np.array([path.times[-1] if len(path.times) else -np.inf for path in truth])
        self._scans = self._own_scans = self._chosen = self._judged = 0
        self._under_way = False
        self._confirmed: set[int] = set()
        self._seen: dict[int, int] = {}
        self._most = _REMEMBERED
        self._rows: list[dict[str, Any]] = []
        self._held, self._held_longer = LastCover(len(truth)), LastCover(len(truth))
        self._sets, self._later, self._errors, self._nis = Total(), Total(), Errors(), Nis()
        self._fates = [Fate() for _ in truth]
        self._further: dict[str, Collected] = {one.name: one.start() for one in figures if one.start is not None}
        self._looks: list[Scan] = []
        self._numbers: list[int] = []

    def add(
        self, scan: Scan, ids: Indices, confirmed: Mask, estimate: Gaussian, nis: Array, hit: Array, modes: Array | None
    ) -> None:
        """Add the tracks (t,) after one scan, in the order of their ids; modes (t, r) are the mode probabilities, if any."""
        names = ids[confirmed]
        self.tracks += len(new := set(names.tolist()) - self._confirmed)
        self._confirmed |= new
        columns = {"mean": estimate.mean, "cov": estimate.cov, "nis": nis, "hit": hit, "modes": modes}
        kept = {name: values[confirmed] for name, values in columns.items() if values is not None}
        bare = scan if scan.frame is None else evolve(scan, frame=None)  # frames of a whole block would not fit
        self._rows.append({"scan": bare, "gate": gate_of(scan, self._gate), "track": names, **kept})

    def finish_block(self) -> Block | None:
        """Judge the scans since the last block, and forget them; None if there are none."""
        rows, self._rows = self._rows, []
        if not rows:
            return None
        block = self.judged([row["scan"] for row in rows], self._entries(rows), np.array([row["gate"] for row in rows]))
        for i, row in enumerate(rows):
            self._seen |= dict.fromkeys(row["track"].tolist(), self._scans - len(rows) + i)
        if len(self._seen) > self._most:
            self._forget()
            self._most = max(_REMEMBERED, 2 * len(self._seen))  # so that it is done seldom
        return block

    def judged(self, scans: Sequence[Scan], entries: Entries, gates: Array) -> Block:
        """Judge the next scans (s,) of the run: the entries of confirmed tracks at them, `gates` (s,) as in `add`."""
        options = self._options
        times = np.array([scan.time for scan in scans])
        axes = np.array([scan.detections.z.shape[-1] for scan in scans])
        chosen = self._choose(scans)
        which = np.flatnonzero((self._begin <= times[-1]) & (times[0] <= self._end))
        near = truth_at([self._truth[j] for j in which.tolist()], times[chosen], self.space, options.truth_gap)
        known: Mask = np.any(near.alive, axis=1) | ~np.any(near.unsaid, axis=1)
        states = near.states.reshape(len(chosen), len(which), len(self.space))
        real = Truth(self.space, states[known], near.alive[known], near.unsaid[known])
        match = matched(entries, real, chosen[known], options, self._held, which)
        lacking = [0.0 if (gone := scan.detections.missing) is None else np.sum(gone) / max(len(gone), 1) for scan in scans]
        self._nis.add(entries, chosen, axes - lacking, gates)
        self._entries_chosen += int(np.count_nonzero(np.isin(entries.scan, chosen)))
        block = Block(match, match.pairs(), times, chosen, axes, which)
        alive: Mask = np.any(near.alive, axis=1)
        self._sum(block, alive, known)
        if options.bound is not None and not self.whole.dropped:
            self._looks += [evolve(scan, detections=Detections.of([], 1), frame=None) for scan in scans]
        self._scans += len(scans)
        for name, further in self._further.items():
            with _blamed(name):
                further.add(block)
        return evolve(block, found=evolve(match, apart=()))  # many blocks may be kept, and distances are large

    def take(self, tracks: Sequence[Track], scans: Sequence[Scan]) -> tuple[Block, ...]:
        """Judge all scans of a run with the tracks that it left, instead of one scan after the other; return the blocks.

        In them a track's name is its number among those that were ever confirmed. InputError if one has an entry when there
        is no scan.
        """
        confirmed = [track for track in tracks if track.confirmed.any()]
        self.tracks = len(confirmed)
        entries = confirmed_entries(confirmed, np.array([scan.time for scan in scans]), self.space)
        edges = np.searchsorted(entries.scan, np.arange(len(scans) + 1))
        blocks, begin = list[Block](), 0
        while begin < len(scans):
            most = int(np.searchsorted(edges, edges[begin] + ENTRIES, "right")) - 1
            end = min(max(most, begin + 1), begin + SCANS)
            gates = np.array([gate_of(scan, self._gate) for scan in scans[begin:end]])
            blocks.append(self.judged(scans[begin:end], entries.part(slice(edges[begin], edges[end]), begin), gates))
            begin = end
        return tuple(blocks)

    def score(self) -> Score:
        """Return the figures of all blocks that are finished."""
        nis = self._nis.ratio()
        more = {}
        for name, further in self._further.items():
            with _blamed(name):
                more[name] = further.value()
        if not self._judged:
            scans = 0 if self._truth else self._chosen
            false = self._entries_chosen / scans if self._nobody and scans else None
            return Score(scans=scans, tracks=self.tracks, nis=nis, false_tracks=false, more=more)
        means = dict(zip(SETS, self._sets.mean.tolist(), strict=True))
        fates = [
            fate.score(path.name, self._options.lost_scans) for path, fate in zip(self._truth, self._fates, strict=True)
        ]
        lowest = None
        if self._looks and self._sensors is not None:
            numbers = np.array(self._numbers[: self._judged], dtype=np.intp)
            lowest = self.whole.position_bound(self._sensors, self._truth, self._looks, numbers)
        return Score(
            scans=self._judged,
            tracks=self.tracks,
            nis=nis,
            position_bound_m=lowest,
            more=more,
            **means,
            **self._errors.figures(),
            **self.whole.figures(self._judged, round(means["false_tracks"] * self._judged)),
            **of_all(fates),
        )

    def _sum(self, block: Block, alive: Mask, known: Mask) -> None:
        """Add a block; `alive` (s,): the chosen scans at which any object is, `known` (s,): those where the truth says so.

        Scans before any true object is recorded, or after the last one, say nothing about the tracks and do not count.
        """
        match, which = block.found, block.which
        some, place = np.flatnonzero(alive), np.concatenate([[0], np.cumsum(known)])
        begin = 0 if self._under_way else int(place[some[0]] if some.size else place[-1])
        end = int(place[some[-1] + 1]) if some.size else begin
        values, judged = sets(match, self._options, begin), end - begin
        if some.size:
            self._under_way = True
            self._sets.join(self._later)
            self._judged += self._later.count + judged
            self._sets.add(values[:, :judged])
            self._later, values = Total(), values[:, judged:]
        self._later.add(values)
        times = block.times[match.scans]
        self.whole.add(match, times, which, begin)
        if self._options.bound is not None and not self.whole.dropped:
            self._numbers += (self._scans + match.scans[begin:]).tolist()
        pairs, order = block.pairs, np.argsort(block.pairs.truth, kind="stable")
        self._errors.add(match, pairs)
        edges = np.searchsorted(pairs.truth[order], np.arange(len(which) + 1))
        fates, longer = [self._fates[number] for number in which.tolist()], self._covered_longer(block)
        rows = (match.truth.alive.tolist(), match.cover.tolist(), longer.tolist())
        for time, alive_now, covers, covers_longer in zip(times.tolist(), *rows, strict=True):
            for fate, there, cover, held in zip(fates, alive_now, covers, covers_longer, strict=True):
                if there:
                    fate.follow(time, cover, held)
        squares = pairs.square[order][None]
        for fate, a, b in zip(fates, edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if a < b:
                fate.squares.add(squares[:, a:b])

    def _choose(self, scans: Sequence[Scan]) -> Indices:
        """Return which of the next scans are judged, as the options choose among all."""
        options, last = self._options, np.inf if self._options.last_scan is None else self._options.last_scan
        own = np.flatnonzero([options.sensor in (None, scan.sensor) for scan in scans])
        number = self._own_scans + np.arange(len(own))
        chosen = own[(options.first_scan <= number) & (number <= last)]
        self._own_scans, self._chosen = self._own_scans + len(own), self._chosen + len(chosen)
        return chosen

    def _covered_longer(self, block: Block) -> Indices:
        """Return the covering tracks within the error of a lost track."""
        radius = self._options.lost_error
        if radius is None or radius == self._options.cover_radius:
            return block.found.cover
        return covering(block.found.apart, block.found.present, radius, self._held_longer, block.which)

    def _forget(self) -> None:
        """Forget the tracks that are gone for long, so that what is known of tracks does not grow with the run."""
        self._seen = {track: scan for track, scan in self._seen.items() if self._scans - scan <= RETURNS}
        self._confirmed &= self._seen.keys()
        for held in (self._held, self._held_longer):
            held.owner = {track: owner for track, owner in held.owner.items() if track in self._seen}

    def _entries(self, rows: Sequence[dict[str, Any]]) -> Entries:
        """Return the confirmed tracks of some scans, by scan, then by track."""
        names = ("track", "mean", "cov", "nis", "hit", *(["modes"] if "modes" in rows[0] else []))
        whole = {name: np.concatenate([row[name] for row in rows]) for name in names}
        part = self._part
        return Entries(
            scan=np.repeat(np.arange(len(rows)), [len(row["track"]) for row in rows]),
            track=whole["track"],
            mean=whole["mean"][:, part],
            cov=whole["cov"][:, part][:, :, part],
            nis=whole["nis"],
            hit=whole["hit"],
            mode_prob=whole.get("modes"),
        )


def gate_of(scan: Scan, gate_probability: float) -> float:
    """Return the gate's probability in a scan: 1 for a camera's, as frames are not gated."""
    return gate_probability if scan.frame is None else 1.0


@contextmanager
def _blamed(name: str) -> Iterator[None]:
    """Say which figure of a plugin failed."""
    try:
        yield
    except Exception as error:
        raise PluginError(f"figure {name!r} failed: {type(error).__name__}: {error}") from error


def judge(
    tracks: Sequence[Track],
    truth: Sequence[Trajectory],
    scans: Sequence[Scan],
    options: Judge,
    gate_probability: float = 1.0,
    sensors: Mapping[str, Sensor] | None = None,
    figures: Sequence[Figure] = (),
    nobody: bool = False,
) -> Score:
    """Judge the tracks of one run against the truth, at the scans that the tracker took.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and are not judged.

    Parameters
    ----------
    tracks, truth, scans : of the run
    options, gate_probability, sensors, figures, nobody : as for RunningJudge, to which this gives the run

    Raises
    ------
    InputError : truth and tracks have no position axis in common, or a track has an entry when there is no scan
    """
    given = truth, space_of(tracks), options, gate_probability
    judging = RunningJudge(*given, sensors=sensors, figures=figures, keep=np.inf, nobody=nobody)
    judging.take(tracks, scans)
    return judging.score()


def space_of(tracks: Sequence[Track]) -> Space | None:
    """Return the axes of tracks; None if none was ever confirmed."""
    return next((track.space for track in tracks if track.confirmed.any()), None)
