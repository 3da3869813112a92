"""A detection probability by range and bearing, found from the tracks of a recording."""

import json
from itertools import pairwise

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette_standard import Detection
from vedette_tools.tuning import by_place
from vedette_tools.tuning.by_place import tune_detection
from vedette_tools.tuning.cells import Cells
from vedette_tools.tuning.trials import Trials, smoothed

NEAR, FAR = [0.9, 0.9, 0.4, 0.9], [0.6, 0.6, 0.6, 0.6]
TABLE = {"probability": [NEAR, FAR], "ranges": [0.0, 1000.0], "bearings": (np.arange(4) * np.pi / 2).tolist()}
RADAR = {
    "kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "max_range": 3000.0, "clutter_per_scan": 5.0,
    "clutter_uniform_over": "range",
}  # fmt: skip


def config(seed, *, drawn, own, duration=500):
    """Twenty targets, seen by a radar with the table `drawn`; the tracker's has the parameters `own`."""
    start = {"x": [0, 400], "y": [0, 400], "vx": [0, 5], "vy": [0, 5]}
    models = [{"kind": "constant_velocity", "sigma_accel": 0.1}]
    return {
        "title": "Twenty targets",
        "seed": seed,
        "source": {
            "kind": "simulation",
            "duration": duration,
            "looks": {"radar": {"interval": 2.5}},
            "drawn": {f"t{i}": {"models": models, "start": start} for i in range(20)},
            "sensors": {"radar": RADAR | drawn},
        },
        "sensors": {"radar": RADAR | own},
        "estimator": {"kind": "ekf", "motion": models[0]},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 8, "vy": 8}},
        "lifecycle": {"kind": "existence"},
    }


def chain(rng, s=6):
    """Existence after each scan, survival from the scan before, and existence given all: by the sum over when it dies."""
    p, ratio, first = rng.uniform(0.7, 1.0, s), rng.uniform(0.05, 4.0, s), rng.uniform(0.1, 0.9)
    p[0] = 1.0
    dies = np.arange(s + 1)  # before scan `dies`; s: not within the recording
    prior = np.array([1.0 - first, *(first * np.prod(p[1:k]) * (1 - p[k]) for k in range(1, s)), first * np.prod(p[1:])])

    def alive(until):
        weight = prior * np.array([np.prod(ratio[: min(k, until + 1)]) for k in dies])
        return np.array([np.sum(weight[dies > k]) for k in range(until + 1)]) / np.sum(weight)

    return [float(alive(k)[k]) for k in range(s)], p.tolist(), alive(s - 1)


@pytest.mark.parametrize("seed", range(5))
def test_existence_given_all_scans_is_the_sum_over_when_a_target_goes(seed):
    existence, survives, wanted = chain(np.random.default_rng(seed))
    np.testing.assert_allclose(smoothed(existence, survives, goes_on=True), wanted, atol=1e-12)
    assert np.max(np.abs(wanted - existence)) > 0.05  # the mutant that takes what was known then


def test_a_track_that_ended_was_likely_gone_before():
    existence, survives, _ = chain(np.random.default_rng(1))
    ended = smoothed(existence, survives, goes_on=False)
    assert np.all(ended <= smoothed(existence, survives, goes_on=True))
    assert all(a >= b - 1e-12 for a, b in pairwise(ended))


def counts(p, rng, each=40.0, folds=5):
    n = np.full((folds, *np.shape(p)), each)
    return n, rng.binomial(n.astype(int), p).astype(float)


@pytest.mark.costly
def test_cells_that_differ_by_chance_are_one():
    """Of 600 tables without any difference .075 were held to differ; of 200 more than .14 are once in 2,000 times."""
    rng = np.random.default_rng(1)
    told = [np.ptp(Cells.of(*counts(np.full((3, 4), 0.8), rng)).probability) > 0 for _ in range(200)]
    assert np.mean(told) <= 0.14


def test_rows_and_columns_that_do_not_matter_are_summed():
    rng = np.random.default_rng(2)
    by_range = Cells.of(*counts(np.array([[0.95] * 6, [0.5] * 6]), rng))
    assert by_range.probability.shape == (2, 1)
    around = Cells.of(*counts(np.array([[0.95, 0.95, 0.3, 0.95]] * 3), rng))
    assert around.probability.shape == (1, 4)
    np.testing.assert_allclose(around.probability[0], [0.95, 0.95, 0.3, 0.95], atol=4 * np.max(around.error))


def test_trials_that_are_alike_only_within_a_stretch_show_no_place():
    """Each cell and stretch has a chance of its own, as a target that is hidden for a while: nothing is foretold."""
    rng = np.random.default_rng(3)
    n = np.full((5, 3, 4), 40.0)
    hidden = rng.beta(4, 1, n.shape)
    found = Cells.of(n, rng.binomial(40, hidden).astype(float))
    assert np.ptp(found.probability) < 0.5 * np.ptp(np.mean(hidden, axis=0))


def test_trials_are_counted_in_the_cells_of_the_sensor():
    table = Detection(np.full((2, 4), 0.5), np.array([0.0, 100.0]), np.arange(4) * np.pi / 2)
    met = Trials(
        np.array([50.0, 150.0]), np.array([-0.1, 0.1]), np.array([0, 9]), np.array([0.5, 1.0]), np.array([1.0, 0.25])
    )
    n, h = met.counts(table, 5, 10)
    assert (n[0, 0, 3], h[0, 0, 3]) == (0.5, 0.5)
    assert (n[4, 1, 0], h[4, 1, 0]) == (1.0, 0.25)
    assert np.sum(n) == 1.5


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("by_place")
    path = folder / "scene.json"
    path.write_text(json.dumps(config(1, drawn={"detection": TABLE}, own={"detection_probability": 0.7})))
    assert main(["tune", str(path), "--detection", "sensors.radar=2x4", "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.mark.costly
def test_a_hidden_sector_and_a_far_ring_are_found(scene):
    """Cells within four errors; a range that parts the trials by half lies near the true edge here."""
    found = json.loads((scene / "tuned.json").read_text())
    assert np.shape(found["probability"]) == (2, 4)
    assert 850 < found["ranges_m"][1] < 1100
    off = (np.array(found["probability"]) - np.array([NEAR, FAR])) / np.array(found["error"])
    assert np.max(np.abs(off)) < 4.0
    assert found["advice"] == "take"
    assert found["held_back"]["after"] - found["held_back"]["before"] > 3.0 * found["held_back"]["error"]


@pytest.mark.costly
def test_the_config_that_it_writes_has_the_table_and_runs(scene, tmp_path):
    sensor = vedette.load(scene / "tuned.toml").tracker.sensors["radar"]
    found = json.loads((scene / "tuned.json").read_text())
    assert sensor.detection_probability == 1.0
    np.testing.assert_array_equal(sensor.detection.probability, found["probability"])
    text = (scene / "tuned.txt").read_text()
    assert "take the table" in text
    assert main(["run", str(scene / "tuned.toml"), "--set", "source.duration=60", "--out", str(tmp_path / "run")]) == 0


@pytest.mark.costly
def test_where_no_place_differs_one_number_is_written():
    found = tune_detection(
        config(2, drawn={"detection_probability": 0.8}, own={"detection_probability": 0.95}, duration=200),
        "sensors.radar", rows=2, columns=2,
    )  # fmt: skip
    assert found.advice == "keep"
    assert found.written == {"sensors.radar.detection_probability": found.level}
    assert abs(found.level - 0.8) < 4.0 * np.sqrt(0.8 * 0.2 / 800)


def test_existence_as_it_was_known_then_finds_too_high_a_probability(monkeypatch):
    """The mutant of what is smoothed: whoever missed twice seems gone, and his misses count for less."""
    given = config(2, drawn={"detection_probability": 0.6}, own={"detection_probability": 0.6}, duration=200)
    right = tune_detection(given, "sensors.radar", rows=1, columns=1).level
    monkeypatch.setattr("vedette_tools.tuning.trials.smoothed", lambda existence, survives, goes_on: np.array(existence))
    wrong = tune_detection(given, "sensors.radar", rows=1, columns=1).level
    assert wrong - right > 0.01
    assert abs(right - 0.6) < 4.0 * np.sqrt(0.6 * 0.4 / 800)


@pytest.mark.costly
def test_a_sensor_keeps_the_cells_of_its_own_table():
    own = {"detection_probability": 0.5, "detection": TABLE | {"probability": [[1.0] * 4, [0.5] * 4]}}
    given = config(3, drawn={"detection": TABLE}, own=own, duration=200)
    found = tune_detection(given, "sensors.radar", rows=7, columns=7)
    assert set(found.table.ranges.tolist()) <= {0.0, 1000.0}
    assert len(found.table.bearings) in (1, 4)


@pytest.mark.parametrize("path", ["sensors", "sensors.sonar", "sensors.radar.sigma_range", "estimator", "radar"])
def test_what_is_no_sensor_with_a_place_is_refused(path):
    with pytest.raises(vedette.ConfigError) as error:
        tune_detection(config(1, drawn={}, own={}, duration=100), path)
    assert [problem.place for problem in error.value.problems] == [f"--detection {path}"]


@pytest.mark.parametrize(
    "more", [["--detection", "sensors.radar=4"], ["--detection", "sensors.radar", "--free", "gate.probability"]]
)
def test_the_command_refuses_what_does_not_go_together(more, tmp_path, capsys):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(config(1, drawn={}, own={}, duration=100)))
    assert main(["tune", str(path), *more, "--out", str(tmp_path / "out")]) == 2
    assert f"{more[-2] if '--free' in more else '--detection'}:" in capsys.readouterr().err


@pytest.mark.nightly("tunes forty times: 1 min")
def test_errors_hold_what_they_promise():
    """Of 40 draws with the true cells, .9 of the cells lie within two stated errors."""
    off = []
    own = {"detection": TABLE | {"probability": [[0.8] * 4, [0.8] * 4]}}
    for seed in range(40):
        found = tune_detection(config(seed, drawn={"detection": TABLE}, own=own), "sensors.radar")
        off.append(((found.table.probability - np.array([NEAR, FAR])) / found.error).ravel())
    assert np.mean(np.abs(np.concatenate(off)) < 2.0) > 0.9
    assert abs(np.mean(np.concatenate(off))) < 0.4


def test_the_search_for_probabilities_ends(monkeypatch):
    monkeypatch.setattr(by_place, "ROUNDS", 1)
    given = config(2, drawn={"detection_probability": 0.8}, own={"detection_probability": 0.95}, duration=100)
    assert tune_detection(given, "sensors.radar", rows=2, columns=2).rounds == 1
