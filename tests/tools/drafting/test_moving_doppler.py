"""Drafts of range rates from a moving platform: with its velocity, or where its motion is taken out of them."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.foreign_files import paths
from vedette import Space, Trajectory, metrics
from vedette_tools.drafting.config import draft_config

BY_NIGHT = pytest.mark.nightly("drafts and runs: 2 to 4 s each")

TIMES = 2.0 * np.arange(80)
HAND = """
[source]
kind = "csv"
path = "data.csv"
[source.detections]
time = "t"
columns = {{ range = "range_m", bearing = "angle_deg", range_rate = "doppler_mps" }}
units = {{ bearing = "deg" }}
[source.platform]
time = "t"
columns = {{ x = "own_x", y = "own_y"{velocity} }}
over_ground = {over_ground}
[sensors.s]
kind = "range_bearing_rate"
sigma_range = 10
sigma_bearing = 0.01
sigma_rate = 0.5
max_rate = 40
max_range = 8000
crossing_speed = 12
detection_probability = 0.9
clutter_per_scan = 3
[estimator]
kind = "ekf"
motion = {{ kind = "constant_velocity", sigma_accel = 0.1 }}
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
[lifecycle]
kind = "existence"
"""


def rows_of(share, seed=4):
    """Range, bearing and range rate from a platform that goes in bends at 15 m/s; the rate holds a share of its motion."""
    rng = np.random.default_rng(seed)
    states, rows = paths(rng, 3, TIMES, 0.1, 4000, 12), []
    course = np.sin(TIMES / 40)
    velocity = 15 * np.stack([np.cos(course), np.sin(course)], axis=-1)
    own = np.cumsum(2.0 * velocity, axis=0)
    own_v = np.gradient(own, TIMES, axis=0)
    for k, time in enumerate(TIMES):
        seen = []
        for x in (states[i, k] for i in range(3) if rng.random() < 0.9):
            d, v = x[:2] - own[k], x[2:] - share * own_v[k]
            r = np.hypot(*d)
            seen.append(np.array([r, np.arctan2(d[1], d[0]), d @ v / r]) + rng.normal(0, [10, 0.01, 0.5]))
        for r, b, v in rng.random((rng.poisson(3), 3)):
            seen += [np.array([8000 * np.sqrt(r), np.pi * (2 * b - 1), 40 * (2 * v - 1)])]
        moves = f"{own[k, 0]:.2f},{own[k, 1]:.2f},{own_v[k, 0]:.3f},{own_v[k, 1]:.3f}"
        rows += [f"{time},{r:.2f},{np.rad2deg(b):.3f},{v:.3f},{moves}" for r, b, v in seen]
    truth = tuple(Trajectory(f"{i}", Space.of(x="m", y="m"), TIMES, path[:, :2]) for i, path in enumerate(states))
    return ["t,range_m,angle_deg,doppler_mps,own_x,own_y,own_vx,own_vy", *rows], truth


def drafted(rows):
    Path("data.csv").write_text("\n".join(rows) + "\n")
    return draft_config(Path("data.csv"))


def error(config, truth):
    experiment = vedette.load(config)
    result = experiment.run()
    score = metrics.judge(result.tracks, truth, result.scans, experiment.judge)
    return score.position_rmse_m, score.coverage


@pytest.mark.parametrize("share", [1.0, pytest.param(0.0, marks=BY_NIGHT)])
@pytest.mark.costly
def test_a_moving_doppler_radar_is_drafted_as_by_a_hand(share, tmp_path, monkeypatch):
    """Whether the rates hold the platform's motion is found by the data; the velocity is read only where they do."""
    monkeypatch.chdir(tmp_path)
    rows, truth = rows_of(share)
    text = drafted(rows)
    found = tomllib.loads(text)
    assert found["sensors"]["sensor"]["kind"] == "range_bearing_rate"
    assert found["sensors"]["sensor"]["sigma_rate"] == pytest.approx(0.5, rel=0.15)
    assert ("vx" in found["source"]["platform"]["columns"]) == (share == 1.0)
    assert ("doppler_mps is over ground: the platform's own motion is not in it" in text) == (share == 0.0)
    Path("draft.toml").write_text(text)
    velocity, over_ground = (', vx = "own_vx", vy = "own_vy"', "false") if share else ("", "true")
    Path("hand.toml").write_text(HAND.format(velocity=velocity, over_ground=over_ground))
    (got, covered), (wanted, least) = error("draft.toml", truth), error("hand.toml", truth)
    assert got <= 1.05 * wanted
    assert covered >= least - 0.02


@BY_NIGHT
@pytest.mark.costly
def test_without_velocity_columns_rates_over_ground_are_kept_and_others_left_out(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for share, kind in ((0.0, "range_bearing_rate"), (1.0, "range_bearing")):
        rows = [row.rpartition(",")[0].rpartition(",")[0] for row in rows_of(share)[0]]
        text = drafted(rows)
        assert tomllib.loads(text)["sensors"]["sensor"]["kind"] == kind
        assert ("it needs the velocity of the platform, which no column tells" in text) == (share == 1.0)


@pytest.mark.costly
def test_a_velocity_with_a_gap_is_not_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows, _ = rows_of(1.0)
    text = drafted([rows[0], f"{rows[1].rpartition(',')[0]},", *rows[2:150]])
    assert tomllib.loads(text)["sensors"]["sensor"]["kind"] == "range_bearing"


@pytest.mark.costly
def test_a_platform_that_stands_needs_no_velocity(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [
        f"{','.join(row.split(',')[:4])},{'own_x,own_y' if i == 0 else '0,0'}" for i, row in enumerate(rows_of(0.0)[0][:150])
    ]
    assert "velocity of the platform" not in drafted(rows)


@pytest.mark.parametrize(
    ("titles", "columns"),
    [
        ("own_lat,own_lon,own_sog [kn],own_cog", {"speed": "own_sog [kn]", "course": "own_cog"}),
        ("own_east,own_north,own_veast,own_vnorth", {"vx": "own_vnorth", "vy": "own_veast"}),
        ("own_x,own_y,own_vx,own_vy", {"vx": "own_vx", "vy": "own_vy"}),
        ("own_x,own_y,own_vx,own_speed", {}),
    ],
)
def test_columns_of_a_platforms_velocity_are_known_by_their_titles(titles, columns, tmp_path):
    from vedette_tools.drafting.recognising import read_table

    rows = [f"{t},{100 + t},{10 + t},{t},59.{t},10.{t},8,120" for t in range(5)]
    (tmp_path / "d.csv").write_text("\n".join([f"t,range,bearing [deg],doppler,{titles}", *rows]) + "\n")
    found = read_table(tmp_path / "d.csv")
    assert {axis: title for axis, title in found.platform.items() if axis in ("vx", "vy", "speed", "course")} == columns
    if "speed" in columns:
        assert found.source()["platform"]["units"]["speed"] == "kn"
        assert found.source()["platform"]["units"]["course"] == "deg"
