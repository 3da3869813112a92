"""Drafts are tried on their own data: what moves as no example does, what reports in turn, what names its objects."""

import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.paths import recording
from vedette.cli import main
from vedette.commands import DONE, UNFIT
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.design import Design
from vedette_tools.drafting.proof import kept, proved
from vedette_tools.drafting.reports import steady
from vedette_tools.drafting.trial import Trial, tried


def table(path, head, rows):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def tracks_of(path, use="aid"):
    draft = drafted(path, use)
    assert not draft.failure
    return vedette.load(tomllib.loads(draft.text)).run().tracks


def hovering():
    """One target that hovers, and flies at 15 m/s, by turns of 20 s."""
    rng, spot, pace = np.random.default_rng(5), np.zeros(2), np.zeros(2)
    for i in range(500):
        course = float(i // 100)
        wanted = 15.0 * np.array([np.cos(course), np.sin(course)]) * (i // 100 % 2)
        pace = pace + np.clip(wanted - pace, -0.8, 0.8)
        spot = spot + 0.2 * pace
        yield f"{0.2 * i:.1f}", *(spot + rng.normal(0, 0.5, 2)).round(2).tolist()


def circling():
    """One target on a circle of 300 m at 7.5 m/s."""
    rng = np.random.default_rng(6)
    for i in range(200):
        yield i, *(300 * np.array([np.cos(i / 40), np.sin(i / 40)]) + rng.normal(0, 2, 2)).round(2).tolist()


def in_turn(seed=7, ships=6):
    """Ships that report one by one, each every 5 to 20 s."""
    rng = np.random.default_rng(seed)
    start, pace, period = rng.uniform(-4000, 4000, (ships, 2)), rng.normal(0, 5, (ships, 2)), rng.uniform(5, 20, ships)
    told = [(t + rng.uniform(0, 0.5), ship) for ship in range(ships) for t in np.arange(period[ship], 300, period[ship])]
    for time, ship in sorted(told):
        yield f"{time:.2f}", *(start[ship] + pace[ship] * time + rng.normal(0, 8, 2)).round(1).tolist(), 9000 + ship


@pytest.mark.costly
@pytest.mark.parametrize("scene", [hovering, circling])
def test_one_target_that_manoeuvres_has_one_track(scene, tmp_path):
    assert len(tracks_of(table(tmp_path / "d.csv", "time,x,y", scene()))) == 1


def stale(targets=40, scans=100, late=55, standing=10):
    """Targets that fly at 200 m/s, 2 km from scan to scan; late, some say the same place again and again."""
    rng = np.random.default_rng(11)
    spots, course = rng.uniform(-2e5, 2e5, (targets, 2)), rng.uniform(0, 2 * np.pi, targets)
    number, said = np.arange(targets), spots
    for i in range(scans):
        spots = spots + 2000 * np.stack([np.cos(course), np.sin(course)], axis=-1)
        stands = (number < standing) & (i > late + 2 * number)
        said = np.where(stands[:, None], said, spots + rng.normal(0, 5, spots.shape))
        yield from ((10 * i, *place) for place in said.round(1).tolist())


@pytest.mark.costly
def test_what_is_fast_or_stops_late_has_one_track(tmp_path):
    """Chains narrowed to the errors held those alone that stood; on the first 2,000 returns none stops."""
    assert len(tracks_of(table(tmp_path / "d.csv", "time,x,y", stale()))) == 40


@pytest.mark.costly
@pytest.mark.parametrize("use", ["aid", "ignore"])
def test_targets_that_report_in_turn_have_a_track_each(use, tmp_path):
    path = table(tmp_path / "d.csv", "time,x,y,mmsi", in_turn())
    tracks = tracks_of(path, use)
    assert len(tracks) == 6
    assert all((track.identity is not None) == (use == "aid") for track in tracks)


@pytest.mark.costly
def test_many_that_report_in_one_second_are_no_look_at_all(tmp_path):
    """Sixty ships in whole seconds, five a second: a busy second of AIS looks like a scan."""
    rows = [(int(float(time)), x, y) for time, x, y, _ in in_turn(ships=60)]
    config = tomllib.loads(drafted(table(tmp_path / "d.csv", "time,x,y", rows)).text)
    assert 4 < config["sensors"]["sensor"]["sigma"] < 16
    assert config["sensors"]["sensor"]["detection_probability"] < 0.3
    assert config["gate"] == {"largest_distance": 9.21}


@pytest.mark.parametrize("again", [1, 3])
@pytest.mark.costly
def test_rows_that_stand_more_than_once_name_objects_as_well(again, tmp_path):
    path = table(tmp_path / "d.csv", "time,x,y,mmsi", [row for row in in_turn() for _ in range(again)])
    config = tomllib.loads(drafted(path).text)
    assert config["source"]["detections"]["identity"] == "mmsi"
    assert "gate" not in config


@pytest.mark.costly
def test_names_that_judge_are_the_truths(tmp_path):
    path = table(tmp_path / "d.csv", "time,x,y,mmsi", in_turn())
    config = tomllib.loads(drafted(path, "truth").text)
    assert "identity" not in config["source"]["detections"]
    result = vedette.load(config).run()
    assert len(result.recording.truth) == 6
    assert result.score().id_switches == 0


@pytest.mark.parametrize(
    ("title", "cells", "named"),
    [
        ("mmsi", lambda i: 9000 + i % 3, True),
        ("Track ID", lambda i: f"t{i % 3}", True),
        ("sourcemmsi", lambda i: 9000 + i % 3, True),
        ("Type of sending device", lambda i: f"t{i % 3}", False),
        ("mmsi", lambda i: 9000 + i, True),
        ("id", lambda i: i, False),
        ("id", lambda i: "", False),
        ("colour", lambda i: i % 3, False),
    ],
)
@pytest.mark.costly
def test_a_column_names_objects_if_names_come_again_one_at_a_time(title, cells, named, tmp_path):
    rows = [(i // 3, 100 * (i % 3) + 2 * (i // 3) + 0.1 * (i * 7 % 5), 0.1 * (i * 3 % 7), cells(i)) for i in range(60)]
    found = tomllib.loads(drafted(table(tmp_path / "d.csv", f"time,x,y,{title}", rows)).text)["source"]["detections"]
    assert found.get("identity", "") == (title if named else "")


@pytest.mark.costly
def test_what_nothing_fits_is_said_first_with_an_exit_code_of_its_own(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(8)
    table(Path("noise.csv"), "time,x,y", [(i, *rng.uniform(-1e5, 1e5, 2).round(1)) for i in range(60)])
    assert main(["new", "config", "noise.csv"]) == UNFIT
    sentence = Path("noise.toml").read_text().splitlines()[0].removeprefix("# ")
    assert sentence in capsys.readouterr().err
    vedette.load("noise.toml")
    table(Path("circle.csv"), "time,x,y", circling())
    assert main(["new", "config", "circle.csv"]) == DONE


def cut(targets):
    """Ten rows a second whose times have no fractions: of one object on a curve, or of several in turn."""
    rng, course = np.random.default_rng(12), 0.0
    spot = rng.uniform(-400, 400, (targets, 2))
    for i in range(300):
        course += 0.02
        spot = spot + 1.5 * np.array([np.cos(course), np.sin(course)])
        yield i * targets // 10, *(spot[i % targets] + rng.normal(0, 0.05, 2)).round(2).tolist()


@pytest.mark.costly
@pytest.mark.parametrize(("targets", "told"), [(1, True), (5, False)])
def test_times_without_fractions_are_told(targets, told, tmp_path):
    failure = drafted(table(tmp_path / "d.csv", "time,x,y", cut(targets))).failure
    assert ("--time COLUMN" in failure) == told


def trial(loglik, tracks, share=1.0, short=0, at_once=None):
    """`tracks` of equal length, all at once unless stated, and `short` ones of hardly any return."""
    return Trial(loglik, 100, tracks + short, short, 100.0 * share, tracks, at_once=at_once or tracks)


def test_the_first_is_left_for_what_is_more_whole_or_clearly_likelier():
    first, other = Design(1.0, 1.0), Design(2.0, 1.0)
    assert kept({first: trial(-500, 5), other: trial(-490, 5)}, first, clean=True) == first
    assert kept({first: trial(-500, 5), other: trial(-470, 5)}, first, clean=True) == other
    assert kept({first: trial(-500, 9), other: trial(-900, 5)}, first, clean=True) == other
    assert kept({first: trial(-500, 5), other: trial(-100, 5, share=0.9)}, first, clean=True) == first
    assert kept({first: trial(-500, 5, share=0.8), other: trial(-900, 5)}, first, clean=False) == first
    assert kept({first: trial(-500, 5, short=9), other: trial(-900, 5)}, first, clean=True) == other
    assert kept({first: trial(-500, 5, short=9), other: trial(-900, 5)}, first, clean=False) == first


@pytest.mark.parametrize(("explained", "fits"), [(740.0, True), (60.0, False)])
def test_short_tracks_of_false_returns_beside_a_long_one_are_no_failure(explained, fits):
    """A boat followed through 830 scans of nine false returns, beside seven tracks of these, was said to fit nothing."""
    beside = Trial(-99_000.0, 8000, 8, 7, explained, 1.1)
    assert (proved(Design(1.0, 1.0), lambda design: beside, explained / 8000.0).failure == "") == fits


@pytest.mark.parametrize(("often", "in_turn", "best"), [(1.0, True, 1), (1.0, False, 0), (3.0, True, 0)])
def test_few_tracks_of_objects_that_report_in_turn_may_be_of_several(often, in_turn, best):
    """Of 88 ships, 44 tracks were the fewest: those at anchor shared them. Rates change likelihoods by themselves."""
    first, few, many = Design(1.0, 1.0), Design(1.0, 1.0, agile=15.0), Design(1.0, 1.0, agile=4.0, often=often)
    known = {first: trial(-500, 12), few: trial(-450, 5), many: trial(-300, 9)}
    assert kept(known, first, clean=True, in_turn=in_turn) == (few, many)[best]
    pieces = known | {many: trial(-300, 9, at_once=5)}
    assert kept(pieces, first, clean=True, in_turn=in_turn) == few  # five targets that stop, each in two tracks


def test_an_acceleration_that_is_far_less_likely_makes_no_tracks_whole():
    """With enough of it one track takes the reports of several objects."""
    shown = {0.1: trial(-500, 12), 0.6: trial(-520, 9), 1.5: trial(-600, 5)}
    proof = proved(Design(0.1, 5.0), lambda design: shown.get(round(design.accel + design.agile, 9)), 1.0, errors=False)
    assert proof.design.accel == pytest.approx(0.6)


def test_what_leaves_out_false_returns_is_about_as_likely():
    """Of 100 returns a third may be false; that fewer tracks explain the rest shows nothing if these were likelier ones."""
    first, other = Design(1.0, 1.0), Design(2.0, 1.0)
    for loglik, chosen in ((-530, other), (-700, first)):
        assert kept({first: trial(-500, 9), other: trial(loglik, 5, share=0.75)}, first, clean=False) == chosen


@pytest.mark.parametrize(("share", "false", "speed"), [(0.8, 0.5, 5.0), (0.85, 0.5, 15.0), (0.78, 0.0, 15.0)])
def test_faster_targets_explain_more_returns_in_clutter(share, false, speed):
    """Of 58 m/s, not 19, among 50 false returns a scan a track came a scan earlier, with one of these in it."""

    def run(design):
        return trial(-500.0 if design.speed == 5.0 else -300.0, 5, share=share if design.speed > 5.0 else 0.8)

    assert proved(Design(0.1, 5.0), run, 1.0 - false, errors=False).design.speed == speed


def test_births_make_clutter_no_likelier(tmp_path):
    """Of false returns alone no track is confirmed, and none is expected; others are likelier if spread wide."""
    rng = np.random.default_rng(13)
    path = table(
        tmp_path / "d.csv", "time,x,y", [(i, *rng.uniform(-1e4, 1e4, 2).round(1)) for i in range(30) for _ in range(20)]
    )
    text = (
        '[sensors.s]\nkind = "cartesian_position"\nsigma = 10\nclutter_density = 5e-8\n[birth]\nkind = "from_returns"\n'
        'spread = {{ vx = {0}, vy = {0} }}\n[estimator]\nkind = "kalman"\n[estimator.motion]\nkind = "constant_velocity"\n'
        'sigma_accel = 1\n[associator]\nkind = "jpda"\n[lifecycle]\nkind = "existence"\nconfirm = 0.9999\n'
    )
    source = {"kind": "csv", "path": str(path), "detections": {"time": "time", "columns": {"x": "x", "y": "y"}}}
    scans = vedette.load(tomllib.loads(text.format(20)) | {"source": source}).run().recording.scans
    few, many = ([tried(text.format(speed), scans, clean=clean).loglik for speed in (20, 200)] for clean in (False, True))
    assert few[0] == few[1] > many[1] > many[0] + 10


def test_alternatives_end_with_the_budget_and_it_is_told():
    """Trials of 10 s each: three fit into 35 s; each failed one is counted."""
    now, ran = [0.0], []

    def run(design):
        now[0] += 10.0
        ran.append(design)
        return None if len(ran) == 2 else trial(-500, 5)

    first = Design(1.0, 1.0)
    proof = proved(first, run, 1.0, budget=35.0, clock=lambda: now[0])
    assert len(ran) == 3
    assert proof.design == first
    assert any("no further" in line for line in proof.said)
    assert any(line.strip().startswith("1 alternatives") for line in proof.said)
    ran.clear()
    whole = proved(first, run, 1.0, budget=1e9, clock=lambda: now[0])
    assert len(ran) > 10
    assert not any("no further" in line for line in whole.said)


@pytest.mark.parametrize("errors", [0.3, 3.0])
def test_errors_that_make_tracks_whole_must_be_about_as_likely(errors):
    """Smaller ones too: four targets that stop at once had a track each by a mode for it, at half as much error again."""
    for loglik, chosen in ((-540, errors), (-560, 1.0)):

        def run(design, loglik=loglik):
            return trial(loglik, 5) if design.errors == errors else trial(-500, 9)

        assert proved(Design(1.0, 1.0), run, 1.0).design.errors == chosen


def test_a_row_under_a_wrong_name_is_left_out():
    times = np.arange(30.0)
    spots = np.stack([3 * times, np.sin(times)], axis=-1)
    spots[[4, 18]] += 500.0
    assert sorted(set(range(30)) - set(steady(np.arange(30), times, spots).tolist())) == [4, 18]


@pytest.mark.costly
def test_aircraft_whose_positions_jitter_keep_their_tracks():
    """The aircraft of a recording, names hidden: the first draft breaks 25 of them, and alternatives none."""
    config = tomllib.loads(drafted(recording("adsb", "area_20min.csv"), "truth").text)
    score = vedette.load(config | {"judge": {"cover_radius": 50.0, "gospa_cutoff": 50.0}}).run().score()
    assert score.id_switches <= 4
    assert score.hota >= 0.93


@pytest.mark.parametrize(
    ("loglik", "mixed", "sure"), [(-1010.0, 0, True), (-950.0, 0, False), (-950.0, 2, False), (-950.0, 9, True)]
)
def test_names_are_doubted_if_returns_are_likelier_so_and_tracks_mix_none(loglik, mixed, sure):
    """A return of another name than its track's is hardly possible where names are sure, and counts in the likelihood."""

    def run(design):
        return (
            Trial(-1000.0, 1000, 10, 0, 950.0, 10.0)
            if design.sure
            else Trial(loglik, 1000, 10, 0, 1000.0, 10.0, mixed=mixed)
        )

    assert proved(Design(0.1, 5.0, sure=True), run, 1.0).design.sure == sure


def test_a_name_without_a_track_is_worse_than_a_track_more():
    some = {
        Design(0.1, 5.0): Trial(-900.0, 1000, 8, 0, 990.0, 8.0, lost=2),
        Design(0.2, 5.0): Trial(-1000.0, 1000, 10, 0, 990.0, 10.0),
    }
    assert kept(some, Design(0.1, 5.0), clean=True) == Design(0.2, 5.0)


@pytest.mark.costly
def test_every_recorded_ship_that_is_named_has_one_track(tmp_path):
    """A third was without a track: new ships were taken for wrong names of old ones."""
    with recording("solent_ais", "SolentAIS_20160112_130211.csv").open() as file:
        head, *rows = (next(file) for _ in range(801))
    (tmp_path / "d.csv").write_text("".join([head, *rows]))
    tracks = vedette.load(tomllib.loads(drafted(tmp_path / "d.csv").text)).run().tracks
    bear = [set(track.identity[track.identity >= 0].tolist()) for track in tracks]
    names = Counter(int(row.split(",")[1]) for row in rows)
    often = {name for name, count in names.items() if count >= 5}
    assert all(len(one) == 1 for one in bear)
    assert Counter(name for one in bear for name in one & often) == dict.fromkeys(often, 1)
