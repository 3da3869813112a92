"""Splits and merges are recorded: which tracks began or ended at a return that another's gate holds, too."""

import json
from itertools import pairwise

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from vedette import Detections, Scan
from vedette.tracking import State, births, lineage, memory_limits
from vedette.tracking.history import History
from vedette_files import read_tracks, write_tracks_jsonl

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 2.0, "detection_probability": 0.9, "clutter_density": 1e-5}
    },
    "birth": {"kind": "from_returns", "spread": {"vx": 8.0, "vy": 8.0}},
    "lifecycle": {"kind": "existence", "confirm": 0.9, "delete": 0.05},
}
SPLITTING = ["nearest", "gnn", "k_best", "n_scan", "variational"]
"""Kinds that confirm a second track soon, where there are two returns for one; jpda leaves the first between them."""
MERGING = ["nearest", "gnn", "k_best", "n_scan", "variational"]
"""Kinds that end one of two tracks, where there is one return for both; jpda lets them share it."""
FAR = [500.0, 500.0]


def tracked(scans, kind="gnn", **more):
    """The states and tracks of a run over positions, a scan a second."""
    tracker = vedette.build({**CONFIG, "associator": {"kind": kind}, **more})
    history, states = History(tracker), [tracker.start()]
    for time, z in enumerate(scans):
        states.append(tracker.step(states[-1], Scan(float(time), "radar", Detections.of(z, 2))))
        history.add(states[-1])
    return tracker, states, history.tracks()


def splitting():
    """One target that becomes two at 8 s, and one far away; another begins by itself at 8 s."""
    for i in range(16):
        apart = max(0, i - 7) * 3.0
        parts = [[10.0 * i, apart], [10.0 * i, -apart]] if i >= 8 else [[10.0 * i, 0.0]]
        yield [*parts, FAR, *([[-500.0, 0.0]] if i >= 8 else [])]


def merging():
    """Two targets that come together and are one from 10 s on, a third far away that is gone by then."""
    for i in range(24):
        apart = max(0.0, 40.0 - 4.0 * i)
        yield [[10.0 * i, apart], [10.0 * i, -apart], FAR] if i < 10 else [[10.0 * i, 0.0]]


def near(tracker, track, x, y):
    """Whether a track ends near a position."""
    return np.hypot(*(track.mean[-1, tracker.state.locate(tracker.sensors["radar"].observes)] - [x, y])) < 15.0


@pytest.mark.parametrize("kind", SPLITTING)
def test_a_track_that_splits_from_another_names_it(kind):
    tracker, _, tracks = tracked(splitting(), kind)
    (upper,) = [track for track in tracks if near(tracker, track, 150.0, 24.0)]
    (lower,) = [track for track in tracks if near(tracker, track, 150.0, -24.0)]
    (far,) = [track for track in tracks if near(tracker, track, *FAR)]
    (alone,) = [track for track in tracks if near(tracker, track, -500.0, 0.0)]
    begun = [track for track in (upper, lower) if track.id != 0]
    assert begun
    assert all(0 in track.parents for track in begun)
    assert (far.parents, alone.parents) == ((), ())
    assert all(track.merged is None for track in (far, alone, upper, lower))


@pytest.mark.parametrize("kind", MERGING)
def test_a_track_that_ends_where_another_takes_the_returns_names_it(kind):
    tracker, states, tracks = tracked(merging(), kind)
    goes_on = [track for track in tracks if near(tracker, track, 230.0, 0.0)]
    (far,) = [track for track in tracks if near(tracker, track, *FAR)]
    assert far.merged is None
    ended = [track for track in tracks if track is not far and track.times[-1] < states[-1].time]
    assert len(goes_on) == 1
    for track in ended:
        time, other = track.merged
        assert other == goes_on[0].id
        assert track.times[-1] < time <= states[-1].time
    assert ended


def test_the_sparse_way_records_the_same(monkeypatch):
    given = []
    rng = np.random.default_rng(4)
    place, speed = rng.uniform(0, 400, (60, 2)), rng.normal(0, 8, (60, 2))
    for i in range(14):
        seen = (place + i * speed)[rng.random(60) < 0.9]
        given.append(np.concatenate([seen + rng.normal(0, 2, seen.shape), rng.uniform(0, 400, (20, 2))]))
    found = {}
    for least in (1, 10**9):
        monkeypatch.setattr(memory_limits, "LEAST_PAIRS", least)
        monkeypatch.setattr(births, "LEAST_PAIRS", least)
        found[least] = [state.lineage for state in tracked(given, "jpda")[1]]
    splits = merges = 0
    for few, every in zip(found[1], found[10**9], strict=True):
        assert (few is None) == (every is None)
        if few is not None:
            assert sorted(few.splits.tolist()) == sorted(every.splits.tolist())
            assert few.merges.tolist() == every.merges.tolist()
            splits, merges = splits + len(few.splits), merges + len(few.merges)
    assert splits > 10
    assert merges > 2


def test_files_say_it_and_read_back(tmp_path):
    for scene in (splitting, merging):
        _, _, tracks = tracked(scene())
        write_tracks_jsonl(tmp_path / "tracks.jsonl", tracks, tracks[0].space)
        again = read_tracks(tmp_path / "tracks.jsonl")
        assert [(one.id, one.parents, one.merged) for one in again] == [(one.id, one.parents, one.merged) for one in tracks]
        assert [len(one.times) for one in again] == [len(one.times) for one in tracks]
    assert any(one.merged for one in again)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ({"track": 9, "time": 1.0, "merged_into": 1}, "track 9 must have a line before"),
        ({"track": 1, "time": 1.0, "merged_into": "two"}, "must have track and merged_into, whole"),
        ({"track": 1, "time": None, "merged_into": 2}, "time must be a finite number"),
        ({"track": 1, "time": 1.0, "merged_into": 2, "hit": 0.0}, "and time alone"),
    ],
)
def test_wrong_lines_are_refused_with_their_place(tmp_path, line, said):
    _, _, tracks = tracked(splitting())
    path = tmp_path / "tracks.jsonl"
    write_tracks_jsonl(path, tracks[1:2], tracks[0].space)
    count = len(path.read_text().splitlines())
    with path.open("a") as file:
        file.write(json.dumps(line) + "\n")
    with pytest.raises(vedette.VedetteError, match=said) as caught:
        read_tracks(path)
    assert f"{path}:{count + 1}:" in str(caught.value)


def test_a_quiet_tracker_records_nothing():
    """Tracks that go on by themselves leave no record, nor do those that were never confirmed."""
    assert all(state.lineage is None for _, state in vedette.load(EXAMPLES / "harbour.toml").steps())


def test_confirmed_tracks_alone_split_and_merge():
    parents, gone = set(), set()
    for scene in (splitting, merging):
        for before, after in pairwise(tracked(scene())[1]):
            if after.lineage is not None:
                sure, there = set(before.ids[before.confirmed].tolist()), set(after.ids.tolist())
                parents |= (own := set(after.lineage.splits[:, 1].tolist()))
                assert own <= sure
                gone |= (own := set(after.lineage.merges[:, 0].tolist()))
                assert own <= sure - there
                assert set(after.lineage.merges[:, 1].tolist()) <= sure & there
    assert parents
    assert gone


@pytest.mark.parametrize("kind", MERGING)
def test_tracks_end_in_scans_without_returns(kind):
    """Two that came at different times end at different times, in scans that hold nothing, beside one another."""
    scans = [*([[FAR]] * 6), *([[FAR, [0.0, 0.0]]] * 4), *([np.zeros((0, 2))] * 20)]
    _, states, tracks = tracked(scans, kind)
    assert len(tracks) == 2
    assert not len(states[-1].ids)
    assert all(state.lineage is None for state in states[-20:])


def test_gates_that_are_mixed_up_are_noticed(monkeypatch):
    """The mutant takes the wrong track's gate."""
    real = lineage._gated

    def rolled(gates, sure):
        return real(evolve(gates, scores=np.roll(gates.scores, 1, axis=0)), sure)

    monkeypatch.setattr(lineage, "_gated", rolled)
    with pytest.raises(AssertionError):
        test_a_track_that_splits_from_another_names_it("gnn")


def test_a_track_merges_into_the_one_that_takes_most_of_its_returns():
    """Of three returns in the gate of a track that ends, one is taken by track 1 and two by track 2."""
    scores = np.zeros((3, 4))
    gates = lineage.Gates(np.arange(3), np.ones(3, dtype=bool), 3, np.arange(3), scores, None, None)
    took = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.6, 0.7]])
    found = lineage.lineage(gates, np.array([1, 2]), 3, took, None)
    assert found.merges.tolist() == [[0, 2]]


def test_a_track_that_comes_back_has_not_merged(monkeypatch):
    """The best hypothesis lacks it, and later has it again."""
    tracker, states, _ = tracked([[[0.0, 0.0], [60.0, 0.0]]] * 8)
    gone = lineage.Lineage(np.zeros((0, 2), dtype=int), np.array([[0, 1]]))
    monkeypatch.setattr(State, "lineage", property(lambda state: gone if state.time == 5.0 else None))
    for last, merged in ((7, (5.0, 1)), (8, None)):
        history = History(tracker)
        for state in states[1:last]:
            history.add(state)
        assert history.tracks()[0].merged == merged
