"""Drafts of data with a height or a range rate: what is found, what is left out and why, and how near the tracks come."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.foreign_files import paths
from vedette import Space, Trajectory, metrics
from vedette_tools.drafting.chains import Chain
from vedette_tools.drafting.config import draft_config
from vedette_tools.drafting.height_and_rate import third_noise

TIMES = 2.0 * np.arange(80)
SPACE = Space.of(x="m", y="m", z="m")
BIRTH = '[associator]\nkind = "jpda"\n[lifecycle]\nkind = "existence"\nconfirm = 0.99\n'
"""The lifecycle is the draft's: errors are of the scans in which tracks are shown, and the first are the largest."""


def heights(seed=4):
    """Positions in space: 6 m, 12 m in height, P_D 0.9, two false returns a scan."""
    rng = np.random.default_rng(seed)
    flat, up = paths(rng, 3, TIMES, 0.1, 1500, 8), paths(rng, 3, TIMES, 0.1, 300, 4)
    whole, rows = np.concatenate([flat[..., :2], 2000 + up[..., :1]], axis=-1), []
    for k, time in enumerate(TIMES):
        seen = [whole[i, k] + rng.normal(0, [6, 6, 12]) for i in range(3) if rng.random() < 0.9]
        seen += [np.append(rng.uniform(-4000, 4000, 2), rng.uniform(0, 4000)) for _ in range(rng.poisson(2))]
        rows += [f"{time},{x:.2f},{y:.2f},{z:.2f}" for x, y, z in seen]
    truth = tuple(Trajectory(f"{i}", SPACE, TIMES, own) for i, own in enumerate(whole))
    by_hand = """
[source]
kind = "csv"
path = "data.csv"
detections = { time = "t", columns = { x = "x", y = "y", z = "height" } }
[sensors.s]
kind = "linear"
axes = ["x", "y", "z"]
R = [[36, 0, 0], [0, 36, 0], [0, 0, 144]]
detection_probability = 0.9
clutter_density = 8e-12
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.1, axes = ["x", "y", "z"] }
[birth]
kind = "from_returns"
spread = { vx = 10, vy = 10, vz = 10 }
"""
    return ["t,x,y,height", *rows], truth, by_hand + BIRTH


def rates(seed=4, sign=1.0):
    """Range, bearing and range rate: 10 m, .01 rad, .5 m/s, P_D 0.9, three false returns a scan."""
    rng = np.random.default_rng(seed)
    states, rows = paths(rng, 3, TIMES, 0.1, 4000, 12), []
    for k, time in enumerate(TIMES):
        seen = []
        for x in (states[i, k] for i in range(3) if rng.random() < 0.9):
            r, noise = np.hypot(x[0], x[1]), rng.normal(0, [10, 0.01, 0.5])
            seen.append(np.array([r, np.arctan2(x[1], x[0]), (x[0] * x[2] + x[1] * x[3]) / r]) + noise)
        for r, b, v in rng.random((rng.poisson(3), 3)):
            seen += [np.array([8000 * np.sqrt(r), np.pi * (2 * b - 1), 40 * (2 * v - 1)])]
        rows += [f"{time},{r:.2f},{np.rad2deg(b):.3f},{sign * v:.3f}" for r, b, v in seen]
    truth = tuple(Trajectory(f"{i}", Space.of(x="m", y="m"), TIMES, own[:, :2]) for i, own in enumerate(states))
    by_hand = """
[source]
kind = "csv"
path = "data.csv"
[source.detections]
time = "t"
columns = { range = "range_m", bearing = "angle_deg", range_rate = "doppler_mps" }
units = { bearing = "deg" }
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
motion = { kind = "constant_velocity", sigma_accel = 0.1 }
[birth]
kind = "from_returns"
"""
    return ["t,range_m,angle_deg,doppler_mps", *rows], truth, by_hand + BIRTH


def error(config, truth):
    experiment = vedette.load(config)
    result = experiment.run()
    score = metrics.judge(result.tracks, truth, result.scans, experiment.judge)
    return score.position_rmse_m, score.coverage


@pytest.mark.parametrize("make", [heights, rates])
@pytest.mark.nightly("drafts and runs: 1 s each")
def test_a_draft_tracks_as_well_as_a_hand(make, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows, truth, by_hand = make()
    Path("data.csv").write_text("\n".join(rows) + "\n")
    text = draft_config(Path("data.csv"))
    Path("draft.toml").write_text(text)
    Path("hand.toml").write_text(by_hand)
    sensor = tomllib.loads(text)["sensors"]["sensor"]
    if make is heights:
        np.testing.assert_allclose(np.diagonal(sensor["R"]), [36, 36, 144], rtol=0.25)
    else:
        assert sensor["sigma_rate"] == pytest.approx(0.5, rel=0.1)
    (drafted, covered), (wanted, least) = error("draft.toml", truth), error("hand.toml", truth)
    assert drafted <= 1.05 * wanted
    assert covered >= least - 0.02


def drafted(rows, tmp_path):
    """Return the draft of the first rows."""
    rows = rows[:150]
    file = tmp_path / "data.csv"
    file.write_text("\n".join(rows) + "\n")
    return draft_config(file)


@pytest.mark.costly
def test_a_rate_that_falls_where_ranges_grow_is_left_out(tmp_path):
    text = drafted(rates(sign=-1.0)[0], tmp_path)
    assert "doppler_mps is left out: it falls where ranges grow, and a range rate must rise; turn its sign" in text
    assert 'kind = "range_bearing"\n' in text
    assert "# not read: doppler_mps" in text


@pytest.mark.costly
def test_a_rate_on_a_moving_platform_is_left_out(tmp_path):
    rows = rates()[0]
    rows = [f"{rows[0]},own_x,own_y", *(f"{row},{float(row.split(',')[0])},0" for row in rows[1:])]
    text = drafted(rows, tmp_path)
    assert "doppler_mps is left out: it needs the velocity of the platform, which no column tells" in text


@pytest.mark.costly
def test_a_height_that_never_changes_or_is_not_always_there_is_not_read(tmp_path):
    rows = heights()[0]
    flat = [rows[0], *(f"{row.rpartition(',')[0]},0.0" for row in rows[1:])]
    gaps = [rows[0], f"{rows[1].rpartition(',')[0]},", *rows[2:]]
    for given in (flat, gaps):
        text = drafted(given, tmp_path)
        assert "# not read: height" in text
        assert 'kind = "cartesian_position"' in text


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.4])
def test_a_height_that_turns_is_not_taken_for_its_errors(turn):
    """As of a satellite: one of 0.4 rad a look had errors of 500 m, and has 1; what does not turn has what it had."""
    rng, looks = np.random.default_rng(1), np.arange(80)
    heights = 7000 * np.sin(turn * looks) + rng.normal(0, 1, 80)
    chain = Chain(looks, np.zeros(80, dtype=int), TIMES, np.zeros((80, 2)))
    assert third_noise([chain], heights[:, None]) == pytest.approx(1.0, rel=0.25)


def test_a_height_without_tracks_is_left_out(tmp_path):
    rng = np.random.default_rng(0)
    rows = ["t,x,y,z", *(f"{k},{rng.uniform(0, 1e4):.1f},{rng.uniform(0, 1e4):.1f},{k % 7}" for k in range(5))]
    text = drafted(rows, tmp_path)
    assert "z is left out: no track was found that tells its noise" in text


def elevations():
    """Range, bearing and elevation of two aircraft that pass near the radar at 9 km: 30 m, .1 deg, .1 deg, in clear air."""
    rng, rows = np.random.default_rng(5), []
    for time in 4.0 * np.arange(60):
        for start, pace in (([-20e3, 4e3], [200.0, 20.0]), ([3e3, 25e3], [0.0, -220.0])):
            x, y = np.array(start) + time * np.array(pace)
            r, b, e = np.sqrt(x**2 + y**2 + 9e3**2), np.arctan2(x, y), np.arcsin(9e3 / np.sqrt(x**2 + y**2 + 9e3**2))
            angles = np.rad2deg([b, e]) + rng.normal(0, 0.1, 2)
            rows += [f"{time},{r + rng.normal(0, 30):.1f},{angles[0] % 360:.4f},{angles[1]:.4f}"]
    return ["t,range_m,az_deg,el_deg", *rows]


@pytest.mark.costly
def test_elevations_place_targets_in_space(tmp_path):
    """They were thrown away, and slant ranges taken for distances over ground: 3.5 km off."""
    config = tomllib.loads(drafted(elevations(), tmp_path))
    assert config["sensors"]["sensor"]["kind"] == "range_bearing_elevation"
    assert float(config["sensors"]["sensor"]["sigma_elevation"].removesuffix(" deg")) == pytest.approx(0.1, rel=0.3)
    result = vedette.load(config).run()
    assert len(result.tracks) == 2
    for track in result.tracks:
        assert track.mean[-1, track.space.names.index("z")] == pytest.approx(9e3, abs=200.0)


@pytest.mark.costly
def test_heights_in_steps_have_the_errors_of_steps(tmp_path):
    """A transponder's, of 25 ft, were drafted with .15 m."""
    titles, *rows = heights()[0]
    stepped = [f"{row.rpartition(',')[0]},{25 * (260 + (k if k % 10 == 0 else 0))}" for k, row in enumerate(rows)]
    R = tomllib.loads(drafted([f"{titles}_ft", *stepped], tmp_path))["sensors"]["sensor"]["R"]
    assert np.sqrt(R[2][2]) > 0.95 * 7.62 / np.sqrt(12)


@pytest.mark.costly
def test_errors_of_heights_in_micrometres_are_as_small_as_they_are(tmp_path):
    """No smaller ones than 1e-6 m were drafted, ten times what they are."""
    rng, times = np.random.default_rng(9), np.arange(60)
    spots = [(times * 0.3 + at + rng.normal(0, 0.1, (3, 60))).T for at in (0.0, 20.0, 40.0)]
    rows = [f"{time},{x:.4f},{y:.4f},{z:.4f}" for time in times for x, y, z in (own[time] for own in spots)]
    (tmp_path / "d.csv").write_text("\n".join(["t_s,x (um),y (um),z (um)", *rows]))
    R = tomllib.loads(draft_config(tmp_path / "d.csv"))["sensors"]["sensor"]["R"]
    assert R[2][2] == pytest.approx(R[0][0], rel=0.5)
