"""Tracks in files: whole, the same bytes for the same tracks, and back to the last bit."""

import csv
import json
import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vedette import Space, Track
from vedette.errors import InputError
from vedette_files import read_tracks, write_tracks_csv, write_tracks_jsonl

STATE = Space.of(x="m", y="m", heading="rad mod 2pi")
NUMBERS = st.floats(-1e15, 1e15) | st.just(math.nan)
TIMES = st.floats(-1e15, 1e15)
WRITERS = {"csv": write_tracks_csv, "jsonl": write_tracks_jsonl}
COLUMNS = ["time", "x", "y", "heading", "sd_x", "sd_y", "sd_heading"]
COLUMNS += [f"cov_{pair}" for pair in ("x_x", "x_y", "x_heading", "y_y", "y_heading", "heading_heading")]


@st.composite
def tracks(draw, identity, modes):
    s, n = draw(st.integers(1, 3)), len(STATE)

    def some(*shape, elements=NUMBERS):
        return draw(arrays(float, shape, elements=elements))

    return Track(
        id=identity,
        space=STATE,
        times=some(s, elements=TIMES),
        mean=some(s, n),
        cov=some(s, n, n),
        confirmed=draw(arrays(bool, s)),
        existence=some(s),
        mode_prob=some(s, modes) if modes else None,
        weights=tuple(some(draw(st.integers(1, 4))) for _ in range(s)),
        nis=some(s),
        hit=some(s),
    )


@st.composite
def many_tracks(draw):
    modes = draw(st.integers(0, 3))
    return [draw(tracks(identity, modes)) for identity in draw(st.lists(st.integers(0, 99), max_size=3, unique=True))]


def example(modes=2):
    return Track(
        id=3,
        space=STATE,
        times=np.array([0.5, 2.25]),
        mean=np.array([[1.0, 2.0, 0.1], [3.0, 4.0, 0.2]]),
        cov=np.array([[[4.0, 0.5, 0.25], [0.5, 9.0, 0.125], [0.25, 0.125, 0.0]]] * 2),
        confirmed=np.array([False, True]),
        existence=np.array([0.5, 0.75]),
        mode_prob=np.array([[0.25, 0.75], [1.0, 0.0]])[:, :modes] if modes else None,
        weights=(np.array([1.0]), np.array([0.25, 0.5, 0.25])),
        nis=np.array([math.nan, 1.5]),
        hit=np.array([0.0, 0.75]),
    )


@settings(max_examples=80)
@given(given_tracks=many_tracks())
@pytest.mark.costly
def test_tracks_come_back_to_the_last_bit(tmp_path_factory, given_tracks):
    path = tmp_path_factory.mktemp("tracks") / "tracks.jsonl"
    write_tracks_jsonl(path, given_tracks, STATE)
    for before, after in zip(given_tracks, read_tracks(path), strict=True):
        assert (after.id, after.space) == (before.id, before.space)
        for name in ("times", "mean", "cov", "confirmed", "existence", "mode_prob", "nis", "hit"):
            np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
        for one, other in zip(before.weights, after.weights, strict=True):
            np.testing.assert_array_equal(one, other)
    again = path.with_name("again.jsonl")
    write_tracks_jsonl(again, read_tracks(path), STATE)
    if given_tracks:
        assert again.read_bytes() == path.read_bytes()


@settings(max_examples=80)
@given(given_tracks=many_tracks())
@pytest.mark.costly
def test_csv_holds_the_estimates_to_the_last_bit(tmp_path_factory, given_tracks):
    path = tmp_path_factory.mktemp("tracks") / "tracks.csv"
    write_tracks_csv(path, given_tracks, STATE)
    assert b"\r" not in path.read_bytes()
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    expected = [(track, i) for track in given_tracks for i in range(len(track.times))]
    for row, (track, i) in zip(rows, expected, strict=True):
        cells = {name: float(cell) if cell else math.nan for name, cell in row.items()}
        upper = track.cov[i][np.triu_indices(len(STATE))]
        deviations = [math.sqrt(variance) if variance > 0 else 0 * variance for variance in np.diag(track.cov[i])]
        np.testing.assert_array_equal(
            [cells[name] for name in COLUMNS], [track.times[i], *track.mean[i], *deviations, *upper]
        )
        modes = [] if track.mode_prob is None else track.mode_prob[i]
        assert (int(row["track"]), row["confirmed"]) == (track.id, "1" if track.confirmed[i] else "0")
        np.testing.assert_array_equal(
            [cells[name] for name in ("existence", "hit", "nis", *(f"mode_{r + 1}" for r in range(len(modes))))],
            [track.existence[i], track.hit[i], track.nis[i], *modes],
        )


def test_csv_as_documented(tmp_path):
    write_tracks_csv(tmp_path / "t.csv", [example()], STATE)
    assert (tmp_path / "t.csv").read_bytes() == (
        b"track,time,x,y,heading,sd_x,sd_y,sd_heading,cov_x_x,cov_x_y,cov_x_heading,cov_y_y,cov_y_heading,"
        b"cov_heading_heading,confirmed,existence,hit,nis,mode_1,mode_2\n"
        b"3,0.5,1.0,2.0,0.1,2.0,3.0,0.0,4.0,0.5,0.25,9.0,0.125,0.0,0,0.5,0.0,,0.25,0.75\n"
        b"3,2.25,3.0,4.0,0.2,2.0,3.0,0.0,4.0,0.5,0.25,9.0,0.125,0.0,1,0.75,0.75,1.5,1.0,0.0\n"
    )


def test_jsonl_as_documented(tmp_path):
    write_tracks_jsonl(tmp_path / "t.jsonl", [example()], STATE)
    header, first, second = map(json.loads, (tmp_path / "t.jsonl").read_text().splitlines())
    axes = {"x": "m", "y": "m", "heading": "rad mod 2pi"}
    assert header == {"format": "vedette tracks", "version": 1, "axes": axes}
    assert (first["track"], first["time"], first["nis"], first["weights"]) == (3, 0.5, None, [1.0])
    assert (second["confirmed"], second["mode_prob"]) == (True, [1.0, 0.0])


@pytest.mark.parametrize("kind", WRITERS)
def test_no_tracks_leave_a_header(tmp_path, kind):
    WRITERS[kind](tmp_path / "t", [], STATE)
    assert len((tmp_path / "t").read_text().splitlines()) == 1


@pytest.mark.parametrize("kind", WRITERS)
def test_tracks_of_unlike_kinds_are_refused_and_what_was_there_stays(tmp_path, kind):
    (tmp_path / "t").write_text("before")
    other = evolve(example(), space=Space.of(x="m", y="m", z="m"))
    for odd in (other, example(modes=0), example(modes=1)):
        with pytest.raises(ValueError, match="track 3 is over"):
            WRITERS[kind](tmp_path / "t", [example(), odd], STATE)
    with pytest.raises(ValueError, match="track 3 is over"):
        WRITERS[kind](tmp_path / "t", [other], STATE)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("t", "before")]


@pytest.mark.parametrize("kind", WRITERS)
def test_an_error_halfway_leaves_what_was_there(tmp_path, kind):
    (tmp_path / "t").write_text("before")
    broken = evolve(example(), confirmed=np.array([True]), weights=())
    with pytest.raises((ValueError, IndexError)):
        WRITERS[kind](tmp_path / "t", [example(), broken], STATE)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("t", "before")]


HEADER = json.dumps({"format": "vedette tracks", "version": 1, "axes": {"x": "m"}})
GOOD = {
    "track": 1,
    "time": 0.0,
    "mean": [1.0],
    "cov": [[1.0]],
    "confirmed": True,
    "existence": 1.0,
    "hit": 1.0,
    "nis": 0.5,
    "weights": [0.0, 1.0],
}
BAD = {
    "empty": ("", "t.jsonl: is empty"),
    "another format": (
        '{"format": "vedette", "version": 1}',
        't.jsonl:1: the first line must be a header {"format": "vedette',
    ),
    "no axes": ('{"format": "vedette tracks", "version": 1}', "t.jsonl:1: axes must be axis names to units, got null"),
    "cut short": (f'{HEADER}\n{{"track": 1, "ti', "t.jsonl:2: is not JSON, or cut short, at column"),
    "no object": (f"{HEADER}\n7", "t.jsonl:2: must be an object, got 7"),
    "no id": (GOOD | {"track": 1.5}, "t.jsonl:2: track must be a whole number"),
    "field unknown": (GOOD | {"speed": 1}, "t.jsonl:2: unknown field 'speed'; known are track, time, confirmed, mean"),
    "time": (GOOD | {"time": None}, "t.jsonl:2: time must be a finite number"),
    "text": (GOOD | {"nis": "high"}, 't.jsonl:2: nis must be numbers or null, got "high"'),
    "ragged": (GOOD | {"cov": [[1.0], []]}, "t.jsonl:2: cov must be numbers or null"),
    "shape": (GOOD | {"mean": [1.0, 2.0]}, "t.jsonl:2: mean must have shape (1,), got [1.0, 2.0]"),
    "field lacks": ({name: value for name, value in GOOD.items() if name != "weights"}, "t.jsonl:2: weights must"),
}


@pytest.mark.parametrize(("content", "text"), BAD.values(), ids=BAD)
def test_a_file_that_is_no_tracks_file(tmp_path, content, text):
    (tmp_path / "t.jsonl").write_text(content if isinstance(content, str) else f"{HEADER}\n{json.dumps(content)}\n")
    with pytest.raises(InputError) as caught:
        read_tracks(tmp_path / "t.jsonl")
    assert text in str(caught.value)


def test_modes_may_not_change_within_a_track(tmp_path):
    lines = [json.dumps(GOOD | {"mode_prob": modes}) for modes in ([1.0], [0.5, 0.5])]
    (tmp_path / "t.jsonl").write_text("\n".join([HEADER, *lines]))
    with pytest.raises(InputError, match=r"t\.jsonl:3: mode_prob must have as many modes"):
        read_tracks(tmp_path / "t.jsonl")
