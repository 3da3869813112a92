"""`vedette consistency`: what tracks of a recording say of their own covariances, with truth and without."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from vedette.cli import main
from vedette.config import load
from vedette.types import Detections, Recording
from vedette_files import Terms, write_recording
from vedette_report.detector_errors.in_tracks import NIS_IS_NOT_ENOUGH
from vedette_report.recorded import pooled, recorded_consistency, sentences
from vedette_report.recorded.pairing import Followed

SCENE = """
title = "One boat"
seed = 3

[source]
kind = "simulation"
duration = 400
looks.radar.interval = 1.0
drawn.boat.models = [{ kind = "constant_velocity", sigma_accel = 1.0 }]
drawn.boat.start = { x = [0, 20], y = [0, 20], vx = [12, 2], vy = [0, 2] }

[sensors.radar]
kind = "cartesian_position"
sigma = 10.0
detection_probability = 0.9

[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 1.0 }

[associator]
kind = "pda"

[birth]
kind = "given"
start = { x = [0, 20], y = [0, 20], vx = [12, 2], vy = [0, 2] }

[lifecycle]
kind = "single_target"
"""

LOSING = """
title = "Lost in a turn"
seed = 4

[source]
kind = "simulation"
duration = 400
looks.radar.interval = 4
[source.ships.ferry]
start = [-1500, 300]
course = "20 deg"
speed = 9
legs = [
  { do = "straight", seconds = 120 },
  { do = "turn", seconds = 60, rate = "1.2 deg/s" },
  { do = "straight", seconds = 300 },
]

[sensors.radar]
kind = "cartesian_position"
sigma = 12.0
detection_probability = 0.9
clutter_density = 3e-7

[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.005 }

[associator]
kind = "pda"

[birth]
kind = "from_returns"
spread = { vx = 8.0, vy = 8.0 }

[lifecycle]
kind = "m_of_n"
"""
"""A turn of 0.19 m/s^2 from 120 to 180 s, which the filter does not follow."""


@pytest.fixture
def losing(tmp_path):
    path = tmp_path / "ferry.toml"
    path.write_text(LOSING)
    return path


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "boat.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def untold(scene, tmp_path):
    """Settings that replay the scene without its truth."""
    experiment = load(scene)
    recording = experiment.run().recording
    path = tmp_path / "boat.jsonl"
    sensors = {name: sensor.measurement for name, sensor in experiment.tracker.sensors.items()}
    write_recording(path, Recording(recording.scans), sensors)
    return ["--set", "source.kind=jsonl", "--set", f"source.path={path}"]


@pytest.mark.costly
def test_it_prints_text_and_figures_and_writes_them_with_a_picture(scene, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["consistency", str(scene), "--out", str(out), "--json"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split()[:4] == ["object", "track", "scans", "ANEES"]
    assert lines[2].split()[:3] == ["boat", "0", "401"]
    (track,) = json.loads(lines[-1])["tracks"]
    assert track["truth"] == "boat"
    assert track["nis"] == pytest.approx(1.0, abs=0.3)
    assert track["hits"] == pytest.approx(1.0, abs=0.1)
    assert (out / "consistency.txt").read_text().strip() in "\n".join(lines)
    assert json.loads((out / "consistency.json").read_text())["tracks"] == [track]
    assert (out / "consistency.png").read_bytes().startswith(b"\x89PNG")
    assert main(["report", str(out)]) == 2
    told = capsys.readouterr().err
    assert f"RUN_DIR: {out}" in told
    assert "consistency.json, consistency.png, consistency.txt" in told


@pytest.mark.costly
@pytest.mark.costly
def test_of_the_folder_of_a_run_it_tells_what_it_does_of_its_config(scene, tmp_path, capsys):
    assert main(["run", str(scene), "--out", str(tmp_path / "ran")]) == 0
    told = []
    for given in (scene, tmp_path / "ran"):
        capsys.readouterr()
        assert main(["consistency", str(given)]) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]


@pytest.mark.costly
def test_without_truth_the_innovations_are_told_and_they_are_the_same(scene, untold, tmp_path, capsys):
    assert main(["consistency", str(scene), "--json"]) == 0
    (known,) = json.loads(capsys.readouterr().out.splitlines()[-1])["tracks"]
    assert main(["consistency", str(scene), *untold, "--json", "--out", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out.splitlines()
    (track,) = json.loads(out[-1])["tracks"]
    assert out[2].split()[:2] == ["-", "0"]
    assert out[2].split()[3] == "-"
    assert (track["truth"], track["anees"], track["noncredibility_db"]) == (None, None, None)
    for name in ("nis", "whiteness", "hits"):
        assert track[name] == pytest.approx(known[name], rel=0.05)
    assert (tmp_path / "out/consistency.png").exists()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ([], ""),
        (["estimator.motion.sigma_accel=0.2"], "Q is too small"),
        (["estimator.motion.sigma_accel=8"], "Q is too large"),
        (["sensors.radar.sigma=1"], "likely R, or R and Q alike, 10 times too small"),
        (["sensors.radar.sigma=5"], "likely R, or R and Q alike, 3"),
        (["sensors.radar.sigma=40"], "R is too large"),
        (["sensors.radar.sigma=5", "estimator.motion.sigma_accel=0.5"], "likely R, or R and Q alike, 3"),
    ],
)
@pytest.mark.by_turns
def test_without_truth_the_innovations_tell_q_from_r(scene, untold, settings, words):
    open_gate = "gate.probability=0.99999999"
    (told,) = recorded_consistency(load(scene, overrides=[*untold[1::2], open_gate, *settings]))
    assert (words in told.hint) if words else told.hint == ""


@pytest.mark.costly
def test_more_detections_than_declared_are_told(scene, untold):
    (told,) = recorded_consistency(load(scene, overrides=[*untold[1::2], "sensors.radar.detection_probability=0.45"]))
    assert told.hits == pytest.approx(2.0, abs=0.15)
    assert "P_D is higher" in told.hint


def of_two(boats):
    """A scene of boats 2 km apart that a radar detects as stated, and whose reports come in .35 of the looks."""
    radar = {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9}
    start = [{"x": [2000.0 * i, 20], "y": [0, 20], "vx": [12, 2], "vy": [0, 2]} for i in range(boats)]
    moves = {"kind": "constant_velocity", "sigma_accel": 1.0}
    source = {
        "kind": "simulation",
        "duration": 400,
        "looks": {"radar": {"interval": 2.0}, "reports": {"interval": 2.0, "first": 1.0}},
        "drawn": {f"boat {i}": {"models": [moves], "start": one} for i, one in enumerate(start)},
        "sensors": {"reports": {**radar, "detection_probability": 0.35}},
    }
    return load(
        {
            "seed": 3,
            "source": source,
            "sensors": {"radar": radar, "reports": radar},
            "estimator": {"kind": "kalman", "motion": moves},
            "associator": {"kind": "pda"},
            "birth": {"kind": "from_returns", "sensors": ["radar"], "spread": {"vx": 15, "vy": 5}},
            "lifecycle": {"kind": "m_of_n", "misses": 30},
        }
    )


@pytest.mark.costly
@pytest.mark.parametrize("boats", [1, 3])
def test_detections_are_counted_by_sensor(boats):
    """They were pooled: a line a track, without the sensor's name, said that its P_D was lower."""
    told = recorded_consistency(experiment := of_two(boats=boats))
    assert experiment.tracker.gate.probability < 1
    lines = [line for line in sentences(told) if "P_D" in line]
    if boats == 1:
        assert [line.partition(": ")[2].startswith("reports: returns are missed") for line in lines] == [True]
        assert "gate" in lines[0]
    else:
        assert [line.startswith("reports, over all tracks: returns are missed") for line in lines] == [True]
    for one in told:
        assert one.data()["hits_by_sensor"]["radar"] == pytest.approx(1.0, abs=0.1)
        assert one.data()["hits_by_sensor"]["reports"] == pytest.approx(0.35 / 0.9, abs=0.12)
        assert "reports 0." in one._repr_html_()


@pytest.mark.costly
def test_without_a_gate_none_is_said_to_shut_returns_out(scene):
    missing = '[source.sensors.radar]\nkind = "cartesian_position"\nsigma = 10.0\ndetection_probability = 0.5\n'
    scene.write_text(f"{SCENE}\n{missing}")
    (told,) = recorded_consistency(load(scene, overrides=["gate=off"]))
    assert "P_D is lower" in told.hint
    assert "gate" not in told.hint


@pytest.mark.costly
def test_what_is_said_of_returns_that_lie_beside_the_truth_is_in_the_json(scene, capsys):
    own = '{ kind = "cartesian_position", sigma = 10.0, detection_probability = 0.9 }'
    scene.write_text(f'{SCENE}\n[source.sensors.radar]\nkind = "displaced"\nadd = {{ x = 20 }}\nof = {own}\n')
    assert main(["consistency", str(scene), "--json"]) == 0
    *lines, data = capsys.readouterr().out.splitlines()
    data = json.loads(data)
    assert [line.removeprefix("LOOKS WRONG: ") for line in lines if line.startswith("LOOKS")] == data["warnings"]
    (beside,) = data["beside_truth"]
    assert beside["off"]["x"][0] == pytest.approx(20.0, abs=3.0)
    assert data["turned"] == []
    assert set(data["told"]) <= set(lines)


@pytest.mark.costly
def test_a_sensor_that_some_targets_do_not_answer_is_told_once():
    """It was told of each track, that its P_D is higher or lower."""
    told = []
    for i, one in enumerate(recorded_consistency(of_two(boats=4))):
        seen, own = one.innovations, np.array(one.innovations.sensors) == "reports"
        hit, declared = np.where(own, float(i < 2), seen.hit), np.where(own, 0.5, seen.declared)
        told.append(evolve(one, innovations=evolve(seen, hit=hit, declared=declared)))
    assert len(told) == 4
    (line,) = [line for line in sentences(told) if "P_D" in line]
    assert line.startswith("reports: detects 2 tracks up to 2 times")


@pytest.mark.costly
def test_returns_that_the_gate_shuts_out_are_told(scene, untold):
    (told,) = recorded_consistency(load(scene, overrides=[*untold[1::2], "estimator.motion.sigma_accel=0.05"]))
    assert told.hits < 0.8
    assert told.hint.startswith("returns are missed")


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ({}, ""),
        ({"x": "[150, 1]"}, "likely the start is wrong, or stated too exactly"),
        ({"x": "[-90000, 1]"}, "it never takes a return: likely it starts elsewhere"),
        ({"vx": "[90, 0.1]"}, "it never takes a return"),
    ],
)
@pytest.mark.by_turns
def test_a_wrong_start_is_told_from_wrong_noises(scene, start, words):
    changed = [f"birth.start.{axis}={value}" for axis, value in start.items()]
    (told,) = recorded_consistency(load(scene, overrides=[*changed, "seed=5"]))
    assert words in told.hint if words else told.hint == ""


RIGHT = """
[source.sensors.radar]
kind = "range_bearing"
sigma_range = 10.0
sigma_bearing = 0.01
x = -3000
detection_probability = 0.9
"""
BELIEVED = {"sigma_range": 10.0, "sigma_bearing": 0.01}


@pytest.mark.parametrize(
    ("believed", "words"),
    [
        ({}, ""),
        ({"sigma_range": 3.0, "sigma_bearing": 0.003}, ""),
        ({"sigma_bearing": 0.05}, "radar bearing 0.0"),
        ({"sigma_range": 40.0}, "radar bearing 1"),
    ],
)
@pytest.mark.costly
def test_an_axis_that_errs_otherwise_than_stated_is_told(scene, believed, words, capsys):
    text = scene.read_text().replace('kind = "cartesian_position"\nsigma = 10.0', 'kind = "range_bearing"\nx = -3000')
    radar = "\n".join(f"{name} = {value}" for name, value in (BELIEVED | believed).items())
    scene.write_text(text.replace("detection_probability = 0.9", f"detection_probability = 0.9\n{radar}") + RIGHT)
    assert main(["consistency", str(scene), "--set", "estimator.kind=ekf", "--set", "gate.probability=0.99999999"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("squared innovations")]
    assert len(told) == (words != "")
    assert all(words in line for line in told)


def test_a_recording_of_no_track_is_wrong_use(scene, capsys):
    assert main(["consistency", str(scene), "--set", "source.duration=1"]) == 2
    assert "gives no track with enough" in capsys.readouterr().err


def test_tracks_that_lost_their_target_are_told_too(losing, capsys):
    assert main(["consistency", str(losing), "--json"]) == 0
    out = capsys.readouterr().out.splitlines()
    found = json.loads(out[-1])
    (ferry,) = found["objects"]
    assert [one["track"] for one in found["tracks"]] == ferry["tracks"]
    assert len(ferry["tracks"]) >= 2
    assert [one["lost_at_s"] for one in found["tracks"]] == [*ferry["lost_at_s"], None]
    assert all(120 <= time <= 220 for time in ferry["lost_at_s"])
    assert ferry["anees"] > 5
    assert ferry["scans"] <= sum(one["scans"] for one in found["tracks"])
    count, first = len(ferry["tracks"]), ferry["lost_at_s"][0]
    assert any(
        one.startswith(f"ferry: {count} tracks one after the other: the target was lost at {first:g} s") for one in out
    )


def test_a_scan_that_two_tracks_followed_counts_once():
    """The one had not ended yet when the other began; of two sensors scans may have one time."""
    target = SimpleNamespace(hint="")
    used = SimpleNamespace(nis=np.ones(3), hit=np.ones(3), axes=np.full(3, 2))
    told = [
        SimpleNamespace(target=target, innovations=used, nees=np.ones(3), scans=3, times=np.array(times))
        for times in ([0.0, 1.0, 1.0], [1.0, 1.0, 2.0])
    ]
    (one,) = pooled(told, 1.0)
    assert one.scans == 4


def test_times_that_are_dates_are_told_as_dates():
    """Times since 1970 were told to six digits, all alike."""
    given = Followed("a", (), (), (1796018400.5,), Terms(dated=True))
    assert given.hint.split(" lost at ")[1].startswith("2026-11-30T06:00:00.5")
    assert "1796018400.5 s" in evolve(given, terms=Terms()).hint


def test_a_target_lost_for_good_is_told(losing, capsys):
    assert main(["consistency", str(losing), "--json", "--set", "lifecycle.hits=20", "--set", "lifecycle.looks=20"]) == 0
    *_, line, found = capsys.readouterr().out.splitlines()
    assert "1 track: the target was lost at 1" in line
    assert "and not found again" in line
    assert len(json.loads(found)["tracks"]) == 1


@pytest.mark.costly
def test_a_target_that_is_kept_is_not_called_lost(losing, capsys):
    assert main(["consistency", str(losing), "--json", "--set", "estimator.motion.sigma_accel=0.2"]) == 0
    out = capsys.readouterr().out
    (ferry,) = json.loads(out.splitlines()[-1])["objects"]
    assert (len(ferry["tracks"]), ferry["lost_at_s"], ferry["hint"]) == (1, [], "")
    assert " lost" not in out.splitlines()[0]
    assert ferry["anees"] < 2


def test_a_track_that_goes_over_to_another_object_is_judged_against_each(losing, tmp_path):
    """Two objects on one path, each 500 m beside it half of the time: the track is the one's, then the other's."""
    settings = ["estimator.motion.sigma_accel=0.2"]
    experiment = load(losing, overrides=settings)
    recording = experiment.run().recording
    (whole,) = recording.truth
    half = whole.times[len(whole.times) // 2]
    aside = np.zeros_like(whole.states)
    aside[:, whole.space.names.index("x")] = 500.0
    later = (whole.times >= half)[:, None]
    truth = (
        evolve(whole, name="first", states=whole.states + later * aside),
        evolve(whole, name="second", states=whole.states + ~later * aside),
    )
    path = tmp_path / "both.jsonl"
    sensors = {name: sensor.measurement for name, sensor in experiment.tracker.sensors.items()}
    write_recording(path, Recording(recording.scans, truth), sensors)
    replayed = ["source.kind=jsonl", f"source.path={path}", *settings]
    first, second = recorded_consistency(load(losing, overrides=replayed))
    assert (first.truth, second.truth) == ("first", "second")
    assert first.track == second.track
    assert first.times[-1] < half <= second.times[0]
    assert max(first.anees, second.anees) < 3.0
    assert len(first.innovations.times) + len(second.innovations.times) == first.scans + second.scans - 1
    assert first.lost == first.times[-1]
    assert second.lost is None


CARS = """
[source]
kind = "csv"
path = "cars.csv"
detections = { time = "time", columns = { x = "x", y = "y" } }

[sensors.lidar]
kind = "cartesian_position"
sigma = SIGMA
detection_probability = 0.99
clutter_density = 1e-7

[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = ACCEL }

[associator]
kind = "jpda"

[birth]
kind = "from_returns"
spread = { vx = 10.0, vy = 10.0 }

[lifecycle]
kind = "existence"
"""


@pytest.mark.parametrize(
    ("alike", "sigma", "accel", "said"),
    [(0.7, 0.08, 1.4, "correlated in time: deviation"), (0.0, 0.15, 0.02, "are white as far as")],
)
@pytest.mark.costly
def test_a_nis_near_one_is_said_not_to_show_that_r_is_right(alike, sigma, accel, said, tmp_path, monkeypatch, capsys):
    """Errors of .15 m that go on, of straight targets: with half of them, and an acceleration that no target has, the
    innovations are white and of the right size, as with all of white ones.
    """
    monkeypatch.chdir(tmp_path)
    rng, times, rows = np.random.default_rng(5), 0.1 * np.arange(300), []
    for i in range(4):
        error = rng.normal(0, 0.15, (300, 2))
        for k in range(1, 300):
            error[k] = alike * error[k - 1] + np.sqrt(1 - alike**2) * error[k]
        rows += [(t, *place) for t, place in zip(times, times[:, None] * rng.normal(0, 8, 2) + 40 * i + error, strict=True)]
    Path("cars.csv").write_text("time,x,y\n" + "".join(f"{t:.1f},{x:.4f},{y:.4f}\n" for t, x, y in sorted(rows)))
    Path("cars.toml").write_text(CARS.replace("SIGMA", str(sigma)).replace("ACCEL", str(accel)))
    assert main(["consistency", "cars.toml", "--json"]) == 0
    *lines, figures = capsys.readouterr().out.splitlines()
    at = lines.index(f"{NIS_IS_NOT_ENOUGH}:")
    assert all(line.startswith("  errors of lidar along") and said in line for line in lines[at + 1 : at + 3])
    tracks, errors = (json.loads(figures)[name] for name in ("tracks", "errors"))
    assert [one["correlated"] for one in errors] == 2 * [alike > 0]
    assert abs(np.mean([one["nis"] for one in tracks]) - 1) < 0.15
    assert abs(np.mean([one["whiteness"] for one in tracks])) < 0.15
    assert all(one["deviation" if alike else "white_deviation"] == pytest.approx(0.15, rel=0.15) for one in errors)


@pytest.mark.costly
def test_errors_that_go_on_are_not_called_a_wrong_r(scene, tmp_path, capsys):
    """R is that of the errors; as they go on, innovations are correlated and small, as with an R that is too large."""
    experiment = load(scene)
    recording = experiment.run().recording
    rng, before, scans = np.random.default_rng(2), np.zeros(2), []
    for scan in recording.scans:
        before = 0.6 * before + 0.8 * rng.normal(0, 10.0, 2)
        at = recording.truth[0].at(scan.time)
        scans.append(evolve(scan, detections=Detections.of((at[:2] + before)[None])))
    path = tmp_path / "on.jsonl"
    write_recording(path, Recording(tuple(scans)), {"radar": experiment.tracker.sensors["radar"].measurement})
    settings = ["source.kind=jsonl", f"source.path={path}", "estimator.motion.sigma_accel=1.0"]
    assert main(["consistency", str(scene), *(part for one in settings for part in ("--set", one)), "--json"]) == 0
    *lines, figures = capsys.readouterr().out.splitlines()
    (track,) = json.loads(figures)["tracks"]
    assert track["whiteness"] > 0.2
    assert not any("R is too" in line or "R too" in line for line in lines)
    assert lines.count(track["hint"]) == 1
    assert "radar" in track["hint"]
    assert "correlated in time" in track["hint"]
