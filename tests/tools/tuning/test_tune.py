"""Tuning from end to end: the top found from afar, judged, written, resumed, and told."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.tuned import RANGES, TRUTH, off, recorded
from vedette.cli import main
from vedette.errors import ConfigError
from vedette_report.drawing.canvas import Look
from vedette_tools.commands import tune as command
from vedette_tools.tuning import evaluator
from vedette_tools.tuning.checkpoint import EVALUATIONS, Kept
from vedette_tools.tuning.config_text import toml
from vedette_tools.tuning.innovations import Noise
from vedette_tools.tuning.summary import data, text
from vedette_tools.tuning.tuner import tune
from vedette_tools.tuning.validation import Gain

SIGMAS = ["estimator.motion.sigma_accel", "sensors.radar.sigma"]
FREE = [f"{path}={RANGES[path]}" for path in SIGMAS]


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("data") / "recording.jsonl", seed=3, duration=60.0)


@pytest.fixture(scope="module")
def tuned(config):
    return tune(config, FREE, overrides=off({path: TRUTH[path] for path in SIGMAS}, 4.0), part=0.7, starts=1)


@pytest.mark.costly
def test_the_noises_are_found_from_four_times_too_large(tuned, config):
    for each in tuned.parameters:
        assert abs(each.after - TRUTH[each.free.path]) < 3.0 * each.error
        assert each.interval[0] < each.after < each.interval[1]
    best = sum(tuned.judged.after[: tuned.judged.tuned])
    for each in tuned.parameters:
        assert np.max(each.curve.heights) < 0.01
        assert np.min(each.curve.heights) < -1.5
    assert tuned.judged.held.difference > 0
    assert best > sum(tuned.judged.before[: tuned.judged.tuned])


def test_it_says_what_was_at_fault(tuned):
    said = text(tuned)
    assert "times too large" in said
    assert "R is too large" in said or "likely R" in said
    assert "held back: +" in said
    assert "after: NIS" in said


def test_thresholds_that_the_likelihood_depends_on_are_told(tuned):
    assert "NOTE" not in text(tuned)
    assert "NOTE: all of them" in text(evolve(tuned, kept="all of them"))


def test_a_loss_on_the_scans_held_back_is_told_with_its_size_and_both_causes(tuned):
    held, pull = Gain(50, 0.0, -13.0, 6.0, 2.0), np.array([1.5, -7.25])
    lower = evolve(tuned, judged=evolve(tuned.judged, on=Gain(50, 0.0, 21.5, 18.0, 0.0), held=held, pull=pull))
    said = text(lower)
    assert "lower there, by 2.2 times the error of the scans" in said
    assert "keep the values you had" in said
    assert "those scans favour a smaller sensors.radar.sigma: one standard error smaller gains 7.2" in said
    assert "larger estimator" not in said
    assert "smaller estimator" not in said
    assert "overfitted" in said
    assert "the two parts differ" in said
    assert "over all scans they gain +8.5" in said
    assert "not known well" not in said
    assert "are better: keep them" in toml(lower)
    assert data(lower)["advice"] == "keep"
    for one in ("overfitted", "keep the values", "those scans favour"):
        assert one not in text(tuned)
    assert data(tuned)["advice"] == "take"


def test_values_that_are_known_badly_are_still_not_to_be_taken_where_they_are_worse(tuned):
    """The values' own errors may explain the loss; on these scans the ones before are better all the same."""
    judged = evolve(tuned.judged, held=Gain(50, 0.0, -30.0, 6.0, 40.0))
    said = text(evolve(tuned, judged=judged))
    assert judged.advice == "keep"
    assert "a loss of this size is within what the errors of the tuned values allow: these are not known well" in said
    by_chance = evolve(judged, held=Gain(50, 0.0, -5.0, 6.0, 0.0))
    assert by_chance.advice == "either"
    assert "no worse there than chance allows" in text(evolve(tuned, judged=by_chance))
    assert evolve(judged, held=None).advice == ""


def test_innovations_without_fault_do_not_contradict_values_that_were_off(tuned):
    """Noises may look right while a value was four times too large: the text then says what can hide it."""
    quiet = [Noise("radar", "x", 1.0, 0.0, 85.0, 80.0)]
    said = text(evolve(tuned, judged=evolve(tuned.judged, noises_before=quiet)))
    before = next(line for line in said.splitlines() if "before: NIS" in line)
    assert "neither Q nor R" not in before
    assert "in the 85 returns of tracks" in before


def test_the_tuned_config_runs(tuned, tmp_path):
    path = tmp_path / "tuned.toml"
    path.write_text(toml(tuned), encoding="utf-8")
    assert "# tuned: " in path.read_text()
    again = vedette.load(path)
    assert again.tracker.sensors["radar"].sigma == tuned.values["sensors.radar.sigma"]
    assert again.tracker.estimator.motion.sigma_accel == tuned.values["estimator.motion.sigma_accel"]
    assert again.source.path == vedette.load(tuned.config).source.path


@pytest.mark.costly
def test_the_command_resumes_and_gives_the_same(config, tmp_path, capsys, monkeypatch):
    """Stopped half-way, it goes on with what is kept; the figures are those of a run without a stop."""
    monkeypatch.setattr(command, "can_draw", lambda: False)
    path, folder = tmp_path / "one.json", tmp_path / "out"
    path.write_text(json.dumps(config))
    call = ["tune", str(path), "--free", FREE[1], "--starts", "1", "--out", str(folder), "--json"]
    assert main(call) == 0
    whole = capsys.readouterr().out.splitlines()
    assert {each.name for each in folder.iterdir()} == {"tuned.toml", "tuned.txt", "tuned.json"}

    run_one, count = evaluator.run_one, [0]

    def stops(*arguments):
        count[0] += 1
        if count[0] == 30:
            raise KeyboardInterrupt
        return run_one(*arguments)

    monkeypatch.setattr(evaluator, "run_one", stops)
    assert main(call) == 130
    with (folder / EVALUATIONS).open("a") as file:
        file.write('{"values": [0.1')  # a line that a kill tore
    assert main(call) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*call[:4], "--starts", "1", "--out", str(folder), "--set", "seed=5", "--resume"]) == 2
    assert "its config differs" in capsys.readouterr().err
    recording = Path(config["source"]["path"])
    before = recording.read_bytes()
    recorded(recording, seed=4, duration=60.0)
    assert main([*call, "--resume"]) == 2
    assert "its data differs" in capsys.readouterr().err
    recording.write_bytes(before)
    count[0] = 30
    with monkeypatch.context() as patch:  # the disk is full at the end: all that was asked was gone
        patch.setattr(command, "write_texts", lambda *given: os.truncate(folder / "none", 0))
        assert main([*call, "--resume"]) == 2
    asked = count[0]
    assert main([*call, "--resume"]) == 0
    after = capsys.readouterr().out.splitlines()
    assert json.loads(after[-1]) == json.loads(whole[-1])
    assert count[0] == asked > 30
    assert f"{asked - 1} kept from before" in "\n".join(after)
    assert not (folder / EVALUATIONS).exists()


def test_what_is_kept_is_read_back_to_the_last_bit(tmp_path):
    kept = Kept(tmp_path, {"seed": 1}, resume=False)
    values = np.random.default_rng(0).normal(size=7) * 1e-7
    kept.add((0.1, 2 / 3), values)
    kept.add((0.2, 1.0), None)
    again = Kept(tmp_path, {"seed": 1}, resume=True)
    assert np.array_equal(again[0.1, 2 / 3], values)
    assert again[0.2, 1.0] is None
    assert (0.3, 1.0) not in again


@pytest.mark.costly
def test_consistency_finds_the_noises_too(config):
    changed = off({path: TRUTH[path] for path in SIGMAS}, 4.0)
    tuned = tune(config, FREE[1:], overrides=changed[:1] + ["sensors.radar.sigma=40"], by="consistency", part=0.7, starts=1)
    (each,) = tuned.parameters
    assert abs(each.after - TRUTH["sensors.radar.sigma"]) < 3.0 * each.error


@pytest.mark.nightly("starts processes")
def test_workers_change_nothing(config):
    """Two processes, which open the recording themselves, come to the same figures to the last bit."""
    one, two = (tune(config, FREE, part=0.7, starts=2, workers=workers) for workers in (1, 2))
    assert data(one) == data(two)


@pytest.mark.costly
def test_the_picture_is_drawn(tuned, tmp_path):
    pytest.importorskip("matplotlib")
    assert "tuned.png" in command._write(tmp_path, tuned, Look())
    assert (tmp_path / "tuned.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"part": 1.5}, "--part: must be > 0 and <= 1, got 1.5"),
        ({"part": 0.01}, "at least 10 are needed"),
        ({"starts": 0}, "--starts: must be a whole number from 1"),
        ({"method": "newton"}, "--method: must be one of"),
        ({"by": "eye"}, "--by: must be 'likelihood' or 'consistency'"),
        ({"resume": True}, "--resume: needs the folder"),
    ],
)
def test_wrong_use_is_said(config, more, said):
    with pytest.raises(ConfigError, match=said.replace(".", r"\.")):
        tune(config, FREE, **more)


def test_a_recording_without_returns_is_refused(config, tmp_path):
    lines = [json.loads(line) for line in Path(config["source"]["path"]).read_text(encoding="utf-8").splitlines()]
    for line in lines:
        if "z" in line:
            line["z"] = []
    path = tmp_path / "quiet.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(ConfigError, match=r"source: gives \d+ scans without any return"):
        tune(config | {"source": {"kind": "jsonl", "path": str(path)}}, FREE)
