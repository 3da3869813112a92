"""Files of the MOTChallenge: read, written, drafted for, run."""

from pathlib import Path

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette.config import installed_figures
from vedette.metrics import judge
from vedette_boxes import BOX, judge_files, read_rows, results, write_rows
from vedette_boxes.calibration import Calibration, confused, fitted, logit, of_targets
from vedette_boxes.rows import overlap
from vedette_boxes.shown import SURE, shown
from vedette_boxes.sources.mot import MotSource

EXAMPLE = Path(__file__).parents[2] / "examples" / "boxes"
LINES = """1,-1,10,20,30,40,.9,1
1,-1,100,20,30,40,.2,2

3,-1,12,20,30,40,.8,1
2,-1,1,2,0,4,.5,1
4,-1,1,2,x,4,.5,1
4.5,-1,1,2,3,4,.5,1
5,-1,1,2,3
"""


@pytest.fixture
def det(tmp_path):
    path = tmp_path / "det.txt"
    path.write_text(LINES)
    return path


def opened(path, **more):
    camera = vedette.load(EXAMPLE.parent / "boxes.toml").tracker.sensors
    return MotSource(path=str(path), **more).open(camera, np.random.default_rng(0))


def test_each_frame_is_a_scan_also_one_without_boxes_and_bad_lines_are_refused(det):
    recording = opened(det, rate=10.0)
    assert [scan.time for scan in recording.scans] == [0.1, 0.2, 0.3]
    assert [len(scan.detections.z) for scan in recording.scans] == [2, 0, 1]
    assert recording.scans[0].detections.z[0].tolist() == [25.0, 40.0, 30.0, 40.0]
    assert [problem.place for problem in recording.refused] == [f"{det}:{line}" for line in (5, 6, 7, 8)]
    rows = recording.rows["lines"]
    assert (rows.total, rows.used, rows.refused, rows.left_out) == (7, 3, 4, 0)
    assert len(opened(det, frames=9).scans) == 9


def test_scores_become_evidence_and_kinds_classes(det):
    found = opened(det, calibration=Calibration(2.0, -1.0), classes=True).scans[0].detections
    assert found.evidence == pytest.approx(2 * np.log([9.0, 0.25]) - 1)
    assert found.identity.tolist() == [0, 1]
    plain = opened(det, least_score=0.5)
    assert plain.scans[0].detections.evidence is None
    assert plain.scans[0].detections.identity is None
    assert [len(scan.detections.z) for scan in plain.scans] == [1, 0, 1]
    assert plain.rows["lines"].left_out == 1


def test_true_boxes_are_trajectories_but_those_that_do_not_count(det, tmp_path):
    truth = tmp_path / "gt.txt"
    truth.write_text("1,7,10,20,30,40,1,1,1\n3,7,14,20,30,40,1,1,1\n2,8,1,1,5,5,0,1,1\n")
    recording = opened(det, truth=str(truth))
    assert [(path.name, path.space, path.times.tolist()) for path in recording.truth] == [("7", BOX, [1 / 30, 0.1])]


@pytest.mark.parametrize("text", ["", "a table\nof words\n", "time,x,y\n1,2,3\n"])
def test_a_file_without_boxes_is_no_recording_and_gets_no_draft(text, tmp_path, capsys):
    path = tmp_path / "some.txt"
    path.write_text(text)
    with pytest.raises(vedette.InputError):
        read_rows(path)
    from vedette_boxes.drafting import draft

    assert draft(path, {}) is None


def test_scores_beyond_one_are_not_weighed(det):
    det.write_text("1,-1,10,20,30,40,55,1\n")
    with pytest.raises(vedette.InputError, match=r"det\.txt"):
        opened(det, calibration=Calibration(1.0, 0.0))


def test_results_come_back_as_they_were_written(tmp_path):
    rows = [(1, 3, np.array([10.0, 20.0, 4.0, 6.0]), 0.5), (2, 3, np.array([11.5, 20.0, 4.0, 6.25]), 1.0)]
    write_rows(tmp_path / "mot.txt", rows)
    found = read_rows(tmp_path / "mot.txt")
    assert found.frame.tolist() == [1, 2]
    assert found.id.tolist() == [3, 3]
    np.testing.assert_allclose(found.box, [row[2] for row in rows], atol=1e-3)
    assert found.score.tolist() == [0.5, 1.0]


def test_a_calibration_is_found_again():
    rng = np.random.default_rng(3)
    target = rng.random(20000) < 0.7
    score = 1 / (1 + np.exp(-np.where(target, rng.normal(1.5, 1, 20000), rng.normal(-0.5, 1, 20000))))
    found = fitted(score, target)  # of two normal logits of unit variance: slope 2, ratio exp(2 logit - (1.5^2 - .5^2) / 2)
    assert (found.slope, found.offset) == pytest.approx((2.0, -1.0), abs=0.08)
    false = np.exp(found.evidence(score[~target]))
    assert np.mean(false) == pytest.approx(1.0, abs=0.08)  # a likelihood ratio has the mean 1 where there is no target
    with pytest.raises(ValueError, match="10 boxes"):
        fitted(score[:5], target[:5])
    assert logit(np.array([0.0, 1.0])) == pytest.approx(np.array([-1, 1]) * np.log(1e6), rel=1e-6)


def test_detections_are_those_of_true_boxes_once_and_classes_are_counted(tmp_path):
    (tmp_path / "gt.txt").write_text("1,7,10,20,30,40,1,2,1\n1,8,100,20,30,40,1,1,1\n")
    (tmp_path / "det.txt").write_text(
        "1,-1,12,20,30,40,.9,2\n1,-1,10,20,30,40,.9,1\n1,-1,300,20,30,40,.9,1\n1,-1,101,20,30,40,.9,1\n"
    )
    found, true = read_rows(tmp_path / "det.txt"), read_rows(tmp_path / "gt.txt")
    assert of_targets(found, true).tolist() == [-1, 0, -1, 1]
    assert confused(np.array([1, 1, 2, 9]), np.array([1, 2, 2, 2]), 2).tolist() == [[2 / 3, 1 / 3], [0.5, 0.5]]


@pytest.mark.costly
def test_a_draft_is_written_and_runs_and_its_results_are_read(tmp_path, capsys):
    det, gt = ((EXAMPLE / name).read_text().splitlines() for name in ("det.txt", "gt.txt"))
    for name, text in (("det.txt", det), ("gt.txt", gt)):
        (tmp_path / name).write_text("\n".join(line for line in text if int(line.split(",")[0]) <= 60))
    config = tmp_path / "c.toml"
    assert main(["new", "config", str(tmp_path / "det.txt"), "--out", str(config)]) == 0
    experiment = vedette.load(config)
    result = experiment.run()
    assert results(tmp_path, experiment, result) == ["mot.txt"]
    again = judge_files(tmp_path / "gt.txt", tmp_path / "mot.txt")
    truth, own = result.recording.truth, experiment.judge
    assert own.truth_gap == pytest.approx(1.5 / experiment.source.rate, rel=0.01)
    told = judge(result.tracks, truth, result.scans, own, figures=installed_figures()).figures()
    assert told["box_hota"] == pytest.approx(again["hota"], abs=2e-4)  # the file has three digits of a pixel
    assert told["box_mota"] == pytest.approx(again["mota"], abs=2e-3)
    assert again["hota"] > 0.6
    (tmp_path / "gt.txt").unlink()
    assert main(["new", "config", str(tmp_path / "det.txt"), "--out", str(tmp_path / "d.toml")]) == 0
    capsys.readouterr()


@pytest.mark.costly
def test_the_example_is_what_its_script_draws_and_its_config_what_is_drafted(tmp_path, monkeypatch):
    from runpy import run_path

    from vedette_boxes.drafting import draft

    run_path(str(EXAMPLE / "draw.py"))["draw"](tmp_path)
    for name in ("det.txt", "gt.txt", "seqinfo.ini"):
        assert (tmp_path / name).read_text() == (EXAMPLE / name).read_text()
    monkeypatch.chdir(EXAMPLE.parents[1])
    drafted = draft(Path("examples/boxes/det.txt"), {})
    told = (EXAMPLE.parent / "boxes.toml").read_text()
    assert drafted.partition("seed = 1")[2] == told.partition("seed = 1")[2]


@pytest.mark.parametrize("accel", [0.3, 5.0])
@pytest.mark.costly
def test_a_draft_finds_how_boxes_move(accel, tmp_path):
    """Ten people of 100 px: an acceleration of white noise, in heights, to a factor of 2, and few broken tracks."""
    rng, dt, frames = np.random.default_rng(1), 1 / 30, 120
    place, speed = rng.uniform(200, 1800, (10, 2)), rng.normal(0, 50, (10, 2))
    lines = []
    for frame in range(1, frames + 1):
        push = 100 * accel * np.sqrt(dt) * rng.standard_normal((10, 2))
        place, speed = place + dt * speed + 0.5 * dt * push, speed + push
        for middle in place[rng.random(10) < 0.9]:
            w, h = np.array([40.0, 100.0]) * (1 + 0.05 * rng.standard_normal(2))
            x, y = middle + 0.03 * np.array([w, h]) * rng.standard_normal(2)
            lines.append(f"{frame},-1,{x - w / 2:.2f},{y - h / 2:.2f},{w:.2f},{h:.2f},1,-1,-1,-1")
    (tmp_path / "det.txt").write_text("\n".join(lines))
    config = tmp_path / "c.toml"
    assert main(["new", "config", str(tmp_path / "det.txt"), "--out", str(config)]) == 0
    experiment = vedette.load(config)
    assert accel / 2 <= experiment.tracker.estimator.of.motion.sigma_accel <= 2 * accel
    assert 0.8 <= experiment.tracker.sensors["camera"].detection_probability <= 0.96
    assert len(experiment.run().tracks) <= 13


def test_a_box_is_shown_while_it_was_seen_or_its_place_is_known():
    """Three standard deviations off along both sides it overlaps the true one by half."""
    box, cov = np.array([[50.0, 60.0, 20.0, 40.0]]), np.zeros((1, 4, 4))
    off = 3 * SURE * box[:, 2:]
    assert overlap(box, np.concatenate([box[:, :2] + off, box[:, 2:]], axis=1)) == pytest.approx(0.5)
    for spread, seen, expected in ((0.99, 0.0, True), (1.01, 0.0, False), (9.0, 0.5, True), (9.0, 0.49, False)):
        cov[0, [0, 1], [0, 1]] = (spread * SURE * box[0, 2:]) ** 2
        assert shown(vedette.Gaussian(box, cov), BOX, np.array([seen]))[1].tolist() == [expected]
    assert not shown(vedette.Gaussian(np.array([[50.0, 60.0, -1.0, 40.0]]), 0 * cov), BOX, np.ones(1))[1]


@pytest.mark.costly
def test_a_draft_keeps_who_hides(tmp_path):
    """Of two people that walk behind a wall for .7 s, in the midst of 4 s, both keep their identity."""
    rng, lines = np.random.default_rng(3), []
    for frame in range(1, 121):
        for start, speed in ((200.0, 4.0), (1300.0, -3.0)):
            x = start + speed * frame
            if 50 < frame <= 71 or rng.random() > 0.95:
                continue
            box = np.array([x, 500.0, 40.0, 100.0]) + rng.normal(0, [1.5, 3.0, 2.0, 4.0])
            lines.append(f"{frame},-1,{box[0] - 20:.2f},{box[1] - 50:.2f},{box[2]:.2f},{box[3]:.2f},1")
    (tmp_path / "det.txt").write_text("\n".join(lines))
    config = tmp_path / "c.toml"
    assert main(["new", "config", str(tmp_path / "det.txt"), "--out", str(config)]) == 0
    assert len([track for track in vedette.load(config).run().tracks if track.confirmed.any()]) == 2
