"""The marine study's claims, its filters on matched truth, and what the paper's printed equations do."""

import math
import tomllib

import numpy as np
import pytest

from support.paths import EXAMPLES
from vedette import Detections, Gaussian, Scan, build, load, to_config
from vedette.metrics.consistency import nees
from vedette.sampling import draw_states
from vedette_marine import configs, outcome, scenes
from vedette_marine import reproduction as study
from vedette_marine.points import by_frame_number, draw, first_late, near, prior
from vedette_marine.reproduction import MarineReproduction, record, tuned
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_study.lockstep import run_together

# The study.


@pytest.fixture(scope="module")
def boats(pytestconfig):
    """Tuned filters on the manoeuvring boats: 20 runs, 100 at night; the CV-PDAF chosen on runs of its own."""
    runs = 100 if pytestconfig.getoption("vedette_profile") == "nightly" else 20
    points = draw(scenes.manoeuvres(), runs, study.CLUTTER, np.random.default_rng([11, 0]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "GRID", (0.5, 0.7, 1.0))  # of the whole grids, what is near their best
        patch.setattr(study, "TURN_GRID", ((0.2, 0.4), (1e-2, 3e-2)))
        filters = tuned("MANV-like", 11, 0)
    return {
        name: {each: record("MANV-like", points, target, filters[each], 6.0) for each in outcome.FILTERS}
        for target, name in enumerate(points.names)
    }


@pytest.mark.costly
def test_imm_beats_the_best_cv_on_boats_that_manoeuvre(boats):
    for records in boats.values():
        cell = outcome.ratio(records, "CV-PDAF", "ais")
        assert cell.measured <= 0.96
        assert cell.measured + 2 * cell.error < 1.0
        assert not records["IMM-PDAF"].lost.any()
        assert all(each.lost.mean() <= 0.01 for each in records.values())  # in 20 runs none; CT-PDAF one track of 200
        assert outcome.rms(records["IMM-PDAF"], "ais") <= 10.0
        assert outcome.ratio(records, "CV-PDAF", "centre").measured < 0.9
        assert outcome.ratio(records, "CT-PDAF", "centre").measured < 1.0


@pytest.mark.costly
def test_the_modes_separate_when_tuned_and_do_not_with_one_q(boats):
    records = boats["boat 1"]
    assert np.std(records["IMM-PDAF"].modes[:, 1]) > 0.1
    points = draw(scenes.manoeuvres(), 4, study.CLUTTER, np.random.default_rng([12, 0]))
    alike = record("MANV-like", points, 0, configs.TABLE_6["IMM-PDAF"], 10.0)
    assert np.std(alike.modes[10:, 1]) < 0.05
    assert abs(np.mean(alike.modes[10:, 1]) - 0.5) < 0.02


@pytest.mark.costly
def test_a_turn_rate_in_the_straight_mode_loses_boats():
    """The paper's five axes in both modes, with a straight mode that is sharp: its old turn rate is handed back."""
    points = draw(scenes.manoeuvres(), 8, study.CLUTTER, np.random.default_rng([15, 0]))
    modes = [configs.cv_pdaf(0.05, 1e-3), configs.ct_pdaf(0.2, 1e-2)]
    printed = {"kind": "imm", "transition": [[0.95, 0.05], [0.05, 0.95]], "modes": modes}
    lost = [record("MANV-like", points, target, printed, 6.0).lost.mean() for target in (0, 1)]
    assert np.mean(lost) > 0.5
    kept = [record("MANV-like", points, target, configs.TUNED_BOATS["IMM-PDAF"], 6.0).lost.any() for target in (0, 1)]
    assert not any(kept)


@pytest.mark.costly
def test_the_large_ship_is_the_same_to_all_against_its_antenna():
    points = draw(scenes.large_ship(), 20, study.CLUTTER, np.random.default_rng([13, 0]))
    filters = configs.TUNED_SHIP
    records = {each: record("DARC-like", points, 0, filters[each], 20.0) for each in outcome.FILTERS}
    assert outcome.ratio(records, "CV-PDAF", "ais").measured == pytest.approx(1.0, abs=0.02)
    assert 60 < outcome.rms(records["IMM-PDAF"], "ais") < 75  # the antenna stands 65 m aft
    assert outcome.rms(records["IMM-PDAF"], "centre") < 15


@pytest.mark.costly
def test_a_frame_s_number_for_its_time_makes_errors_of_the_published_size_alike_for_all(boats):
    points = by_frame_number(draw(scenes.manoeuvres(), 4, study.CLUTTER, np.random.default_rng([14, 0])))
    for target, published in ((0, 117), (1, 99)):
        found = [
            outcome.rms(record("MANV-like", points, target, configs.TUNED_BOATS[each], 6.0, lost=np.inf), "ais")
            for each in ("IMM-PDAF", "CT-PDAF")
        ]
        assert found[0] == pytest.approx(found[1], rel=0.02)
        assert found[0] == pytest.approx(published, rel=0.15)


@pytest.mark.costly
def test_the_study_says_all_and_its_seed_decides(monkeypatch):
    short = {name: lambda scene=scene: scene() | {"frames": 40, "lost": 2} for name, scene in study.SCENES.items()}
    monkeypatch.setattr(study, "SCENES", short)
    monkeypatch.setattr(study, "GRID", (0.3, 0.7))
    monkeypatch.setattr(study, "TURN_GRID", ((0.2,), (1e-2, 2e-2)))
    monkeypatch.setattr(study, "TUNING_RUNS", 1)
    results = [MarineReproduction().run(2, seed, lambda items, about: items) for seed in (1, 1, 2)]
    assert results[0].tables == results[1].tables
    assert results[0].claims == results[1].claims
    assert results[0].tables != results[2].tables
    assert len(results[0].claims) == 9
    cell = results[0].tables[0].cell("DARC-like ship", "IMM AIS")
    assert cell.published == 422.94
    (times,) = results[0].machine
    assert all(each.measured > 0 for _, cells in times.rows for each in cells)


def test_without_returns_a_track_coasts_as_announced():
    """Until the first return comes the track is AIS's place and velocity, moved on; afterwards it is on the target again."""
    points = draw(scenes.manoeuvres() | {"frames": 60, "lost": 0}, 3, study.CLUTTER, np.random.default_rng([17, 0]))
    late = first_late(points, 20.0)
    assert not any(scan.detections.valid.any() for scan in late.scans if scan.time < late.times[0] + 20)
    assert all(scan.detections.valid.any() for scan in late.scans if scan.time >= late.times[0] + 20)
    tracker = build(configs.tracker(configs.cv_pdaf(0.7), 6.0))
    found = run_together(tracker, prior(late, 0, 10.0, tracker.state), float(late.times[0]), late.scans)
    gone = late.times[:15] - late.times[0]
    ahead = points.announced[:, 0, None, :2] + gone[:, None] * points.announced[:, 0, None, 2:]
    np.testing.assert_allclose(found.mean[:, :15, :2], ahead, atol=1e-6)
    assert np.linalg.norm(found.mean[:, -1, :2] - points.centres[0, -1], axis=-1).max() < 30


def test_the_returns_of_the_picture_lie_near_the_target():
    points = draw(scenes.manoeuvres() | {"frames": 40, "lost": 0}, 2, 1e-5, np.random.default_rng([18, 0]))
    seen = near(points, 0, 100.0)
    closest = np.min(np.linalg.norm(seen[:, None] - points.centres[0], axis=-1), axis=1)
    assert len(seen) > 30
    assert np.all(closest < 100.0)


def test_the_scenes_to_change_are_the_study_s():
    for name, scene in (("manv", scenes.manoeuvres()), ("darc", scenes.large_ship())):
        theirs = tomllib.loads((EXAMPLES / f"{name}_scene.toml").read_text())["source"]
        for boat, vessel in scene["vessels"].items():
            for part in ("path", "length", "width"):
                assert theirs["vessels"][boat][part] == vessel[part]
            assert theirs["vessels"][boat]["ais"]["antenna"] == vessel["ais"]["antenna"]
        assert (theirs["frames"], theirs["lost"]) == (scene["frames"], scene["lost"])


@pytest.mark.parametrize("filters", [configs.TABLE_6, configs.TUNED_BOATS, configs.TUNED_SHIP])
@pytest.mark.parametrize("automatic", [False, True])
@pytest.mark.parametrize("density", [None, 1e-7])
def test_every_preset_builds(filters, automatic, density):
    for estimator in filters.values():
        tracker = build(configs.tracker(estimator, 10.0, clutter_density=density, automatic=automatic))
        assert tracker.gate.clutter == ("nonparametric" if density is None else "sensor")
        assert tracker.gate.threshold(2) == pytest.approx(9.2103, abs=1e-4)


# Matched truth.


def matched(model, estimator, detection, density, known, runs=60, seconds=100):
    """NEES over the number of axes, (r,) means over the second half, of a filter whose model is the truth."""
    rng = np.random.default_rng(21)
    times = np.arange(0.0, seconds)
    n = len(model.state)
    start = np.array([0.0, 0, 6, 3, 0.02])[:n]
    cov = np.diag([100.0, 100, 1, 1, 1e-4])[:n, :n]
    states = draw_states(model, start + rng.standard_normal((runs, n)) * np.sqrt(np.diag(cov)), times, rng)
    given = Gaussian(np.broadcast_to(start, (runs, 1, n)), np.broadcast_to(cov, (runs, 1, n, n)))
    side, scans = 400.0, []
    for k in range(1, len(times)):
        count = rng.poisson(density * (2 * side) ** 2, runs)
        false = states[:, k, None, :2] + rng.uniform(-side, side, (runs, int(count.max(initial=0)), 2))
        z = np.concatenate([states[:, k, None, :2] + 10 * rng.standard_normal((runs, 1, 2)), false], axis=1)
        valid = np.concatenate([rng.random((runs, 1)) < detection, np.arange(false.shape[1]) < count[:, None]], axis=1)
        scans.append(Scan(times[k], "radar", Detections(np.where(valid[..., None], z, 0), valid)))
    config = configs.tracker(estimator, 10.0, clutter_density=density if known else None)
    config["sensors"]["radar"]["detection_probability"] = detection
    tracker = build(config)
    found = run_together(tracker, given, 0.0, scans)
    error = found.mean - states[:, 1:]
    return np.mean(nees(error, found.cov)[:, seconds // 2 :], axis=1) / n, np.linalg.norm(error[:, -1, :2], axis=-1)


STRAIGHT = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.316}}


@pytest.mark.parametrize("detection", [1.0, 0.95])
def test_cv_pdaf_is_consistent_on_matched_truth(detection):
    """NEES / 4 is 1 within 5 standard errors of the run means and 4 %, as PDA of sparse clutter is nearly exact."""
    each, off = matched(ConstantVelocity(sigma_accel=0.316), STRAIGHT, detection, 1e-6, known=True)
    assert off.max() < 100
    assert abs(each.mean() - 1) < 5 * each.std() / math.sqrt(len(each)) + 0.04


def test_ct_pdaf_is_consistent_on_matched_truth():
    each, off = matched(CoordinatedTurn(0.316, 3.16e-3), configs.ct_pdaf(0.316, 3.16e-3), 0.95, 1e-6, known=True)
    assert off.max() < 100
    assert abs(each.mean() - 1) < 5 * each.std() / math.sqrt(len(each)) + 0.06


def test_a_density_from_the_gate_is_careful_by_a_few_per_cent():
    known, _ = matched(ConstantVelocity(sigma_accel=0.316), STRAIGHT, 0.95, 1e-5, known=True)
    counted, _ = matched(ConstantVelocity(sigma_accel=0.316), STRAIGHT, 0.95, 1e-5, known=False)
    apart = known - counted  # the same draws
    assert 0.0 < apart.mean() < 0.12
    assert apart.mean() > 3 * apart.std() / math.sqrt(len(apart))


def test_a_filter_that_is_too_sure_is_seen():
    sure = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.16}}
    each, _ = matched(ConstantVelocity(sigma_accel=0.316), sure, 0.95, 1e-6, known=True)
    assert each.mean() - 5 * each.std() / math.sqrt(len(each)) > 1.2


# The paper's printed equations.


def turning_boat(seconds=40):
    """Straight for 20 s, then a turn of 4 deg/s: states (s, 5), without noise."""
    states = [np.array([0.0, 0, 8, 0, 0])]
    model = CoordinatedTurn(0.1, 0.01)
    for k in range(1, seconds):
        now = states[-1].copy()
        now[4] = 0.0 if k <= 20 else math.radians(4)
        states.append(model.move(now, 1.0))
    return np.array(states)


def test_the_printed_mode_update_is_stuck_at_zero_and_ours_is_not():
    """mu_j ~ mu_j,k-1 Lambda_j instead of c_j Lambda_j: what was 0 once stays 0, however much the target turns."""
    states = turning_boat()
    transition = np.array([[0.95, 0.05], [0.05, 0.95]])
    estimator = configs.imm_pdaf(0.05, (0.2, 1e-2), 0.95) | {"initial": [1 - 1e-9, 1e-9]}
    tracker = build(configs.tracker(estimator, 3.0))
    given = Gaussian(states[:1], np.diag([9.0, 9, 1, 1, 1e-4])[None])
    state, printed, ratios = tracker.start(given, 0.0), np.array([1.0, 0.0]), []
    for k, x in enumerate(states[1:], start=1):
        before = tracker.estimator.mode_prob(state.belief)[0]
        state = tracker.step(state, Scan(float(k), "radar", Detections.of([x[:2]])))
        after = tracker.estimator.mode_prob(state.belief)[0]
        likelihood = after / (before @ transition)  # up to a constant
        ratios.append(likelihood[1] / likelihood[0])
        printed = printed * likelihood
        printed /= printed.sum()
    assert max(ratios[20:]) > 2  # the turn is seen in the likelihoods
    assert printed[1] == 0
    assert after[1] > 0.5


def test_the_printed_course_convention_loses_what_is_seen_late():
    """With a gap of 20 s before the first return, the mirrored velocity has left the gate; the right one has not."""
    course, speed = math.radians(75), 8.0
    right = np.array([0.0, 0.0, speed * math.sin(course), speed * math.cos(course)])
    printed = right[[0, 1, 3, 2]]
    tracker = build(configs.tracker({"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}}, 6.0))
    hits = []
    for start in (right, printed):
        state = tracker.start(Gaussian(start[None], np.diag([100.0, 100, 1, 1])[None]), 0.0)
        seen = Scan(20.0, "radar", Detections.of([20.0 * right[2:]]))
        hits.append(float(tracker.step(state, seen).hit[0]))
    assert hits[0] > 0.9 > 0.1 > hits[1]


def test_the_examples_filters_are_the_presets():
    example = to_config(load(EXAMPLES / "marine_picture.toml").tracker.estimator)
    assert example == to_config(build(configs.tracker(configs.TUNED_BOATS["IMM-PDAF"], 6.0)).estimator)
