"""Constant-false-alarm-rate tests: rates in closed form against the noise itself, and returns of polar sweeps."""

import math

import numpy as np
import pytest
from attrs import evolve

from vedette import Frame, InputError, Pose, Scan, load
from vedette.metrics import judge
from vedette_marine import configs, scenes
from vedette_marine.preprocessors.cfar import Cfar
from vedette_marine.preprocessors.false_alarm_rates import factor, greatest_of, ordered
from vedette_marine.screen import RadarScreen

SCREEN = {"receiver": RadarScreen()}
TESTS = ("CA", "GO", "OS")


def cell_average(factor, cells):
    return (1.0 + factor / cells) ** -cells


def seen(preprocessor, power, pose=None):
    plain = Scan.image(0.0, "receiver", Frame(power))
    return preprocessor.process({"receiver": evolve(plain, pose=pose)})


@pytest.mark.parametrize("rate", [1e-1, 1e-3, 1e-6])
@pytest.mark.parametrize("window", [2, 8, 32])
def test_factors_give_their_rate(window, rate):
    rank = max(1, round(0.75 * window))
    assert cell_average(factor("CA", window, rank, rate), window) == pytest.approx(rate, rel=1e-9)
    assert greatest_of(factor("GO", window, rank, rate), window) == pytest.approx(rate, rel=1e-6)
    assert ordered(factor("OS", window, rank, rate), window, rank) == pytest.approx(rate, rel=1e-9)


def test_closed_forms_against_integrals():
    """P(p > T Z) = E exp(-T Z) over the density of Z, by quadrature."""
    from scipy import integrate, special, stats

    n, rank, t = 8, 6, 3.0
    ca = integrate.quad(lambda z: stats.gamma.pdf(z, n, scale=1 / n) * np.exp(-t * z), 0, np.inf)[0]
    assert cell_average(t, n) == pytest.approx(ca, rel=1e-7)
    half = stats.gamma(n // 2, scale=2 / n)
    go = integrate.quad(lambda z: 2 * half.pdf(z) * half.cdf(z) * np.exp(-t * z), 0, np.inf)[0]
    assert greatest_of(t, n) == pytest.approx(go, rel=1e-7)
    ways = rank * special.comb(n, rank)
    os = integrate.quad(lambda z: ways * (1 - np.exp(-z)) ** (rank - 1) * np.exp(-z * (n - rank + 1 + t)), 0, np.inf)[0]
    assert ordered(t, n, rank) == pytest.approx(os, rel=1e-7)


@pytest.mark.parametrize("test", TESTS)
@pytest.mark.by_turns
def test_false_alarms_in_noise_come_at_the_rate(test):
    """400,000 independent windows, one tested cell each; 5 standard errors: 6e-7 a test. The level does not matter."""
    preprocessor = Cfar(SCREEN, cell=5.0, test=test, rate=0.01, window=16, guard=2)
    rng = np.random.default_rng(1)
    count = 400_000
    noise = rng.standard_exponential((count, 16 + 4 + 1)) * rng.uniform(0.1, 100.0, (count, 1))
    found = preprocessor.echoes(noise)
    assert not found[:, :10].any()
    assert not found[:, 11:].any()
    assert abs(found.sum() - 0.01 * count) < 5 * math.sqrt(0.01 * 0.99 * count)
    wrong = Cfar(SCREEN, cell=5.0, test=test, rate=0.011, window=16, guard=2).echoes(noise)
    assert abs(wrong.sum() - 0.01 * count) > 5 * math.sqrt(0.01 * 0.99 * count)  # a rate off by a tenth is seen


def test_each_test_is_its_definition():
    power = np.random.default_rng(2).standard_exponential((3, 40))
    for test in TESTS:
        preprocessor = Cfar(SCREEN, cell=5.0, test=test, rate=0.05, window=8, guard=1)
        t = factor(test, 8, 6, 0.05)
        for row, found in zip(power, preprocessor.echoes(power), strict=True):
            for j in range(5, 35):
                near, far = row[j - 5 : j - 1], row[j + 2 : j + 6]
                level = {"CA": np.mean([near, far]), "GO": max(near.mean(), far.mean())}
                level["OS"] = np.sort(np.concatenate([near, far]))[5]
                assert found[j] == (row[j] > t * level[test])


def test_an_edge_of_clutter_hurts_go_less_and_a_neighbour_hurts_os_less():
    """What the three tests are for: false alarms at a step of 15 dB, and a target 10 cells before a stronger one."""
    alarms, hits = {}, {}
    for test in TESTS:
        preprocessor = Cfar(SCREEN, cell=5.0, test=test, rate=1e-3, window=32, guard=2)
        noise = np.random.default_rng(4).standard_exponential((4000, 101)) * np.where(np.arange(101) < 50, 1.0, 30.0)
        alarms[test] = preprocessor.echoes(noise)[:, 51:60].mean()
        pair = np.random.default_rng(5).standard_exponential((4000, 101))
        pair[:, 50] += 40.0
        pair[:, 60] += 400.0
        hits[test] = preprocessor.echoes(pair)[:, 50].mean()
    assert alarms["GO"] < 0.3 * alarms["CA"]
    assert hits["OS"] > 0.9 > 0.2 > hits["CA"]


@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize(("up", "heading"), [("north-up", 0.7), ("head-up", 0.7)])
def test_a_target_lies_where_it_is(test, up, heading):
    power = np.random.default_rng(6).standard_exponential((360, 200))
    rows, columns = np.mgrid[:360, :200]
    power += 3000 * np.exp(-0.5 * ((rows - 44.5) ** 2 / 1.0 + (columns - 99.5) ** 2 / 1.0))
    preprocessor = Cfar(SCREEN, cell=10.0, test=test, rate=1e-8, guard=6, up=up)
    pose = Pose(np.array([100.0, -50.0]), heading=np.pi / 2 - heading)
    made = seen(preprocessor, power, pose)
    bearing = np.deg2rad(45.0) + (heading if up == "head-up" else 0.0)
    assert len(made.z) == 1
    np.testing.assert_allclose(made.z[0], [100 + 1000 * np.sin(bearing), -50 + 1000 * np.cos(bearing)], atol=3.0)
    line = np.array([np.sin(bearing), np.cos(bearing)])
    assert line @ made.noise[0] @ line == pytest.approx(64.0, rel=0.01)
    assert np.linalg.det(made.noise[0]) ** 0.5 == pytest.approx(8.0 * 1000 * np.deg2rad(0.4), rel=0.02)


def test_bad_sweeps_and_settings_are_told():
    with pytest.raises(InputError, match="sweeps: must be power >= 0"):
        seen(Cfar(SCREEN, cell=5.0), np.full((4, 100), -1.0))
    with pytest.raises(ValueError, match="window: must be even"):
        Cfar(SCREEN, cell=5.0, window=9)
    assert len(seen(Cfar(SCREEN, cell=5.0), np.ones((4, 20))).z) == 0  # shorter than a window


@pytest.mark.nightly("runs of raw video: 4 s")
@pytest.mark.parametrize("test", TESTS)
def test_boats_are_tracked_from_simulated_sweeps(test):
    """Raw video instead of pictures, from a config; false alarms of the sea's spikes are left to the tracker."""
    pytest.importorskip("cv2")
    receiver = {"receiver": {"kind": "radar_screen"}}
    settings = {"cell": 3.0, "test": test, "rate": 1e-9, "window": 64, "guard": 24, "up": "head-up", "link": 30.0}
    scene = scenes.manoeuvres() | {"video": "sweeps", "frames": 12, "lost": 1}
    tracker = configs.tracker(configs.TUNED_BOATS["IMM-PDAF"], 8.0, automatic=True)
    experiment = load(
        tracker | {"source": scene, "preprocessors": {"radar": {"kind": "cfar", "sensors": receiver} | settings}}
    )
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)
    assert not result.refused
    assert score.coverage > 0.6  # the first seconds are for confirming
    assert score.position_rmse_m < 20
