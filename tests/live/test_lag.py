"""An output of a service that tells of tracks some seconds late, smoothed by what came since."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.services import TRACKER, lines, served, wait_for
from vedette import ConfigError
from vedette.tracking import smoothed
from vedette_live.config import load_service

LAG = 5.0


def config(folder: Path, horizon: float) -> dict[str, object]:
    """A service with two outputs, of which one is late."""
    stream = folder / "stream.jsonl"
    stream.write_bytes(b"".join(lines()))
    outputs = [
        {
            "output": {"kind": "file", "path": str(folder / name)},
            "format": {"kind": "json_lines"},
            "confirmed": False,
            "lag": lag,
        }
        for name, lag in (("now", 0), ("late", LAG))
    ]
    feed = {"input": {"kind": "file", "path": str(stream), "follow": False}, "format": {"kind": "json_lines"}}
    return {**TRACKER, "inputs": [feed], "outputs": outputs, "service": {"horizon": horizon}}


@pytest.mark.parametrize("horizon", [0.0, 4.0])
def test_each_state_is_told_once_as_the_library_smooths_it(tmp_path: Path, horizon: float) -> None:
    with served(config(tmp_path, horizon)) as running:
        wait_for(lambda: running.counters.counts["scans_taken_total"] == 80)
    experiment = vedette.load({**TRACKER})
    state, states = experiment.tracker.start(seed=np.random.SeedSequence(0).spawn(2)[1]), []
    for line in lines():
        scan = json.loads(line)
        state = experiment.tracker.step(
            state, vedette.Scan(scan["time"], scan["sensor"], vedette.Detections.of(scan["z"], 2))
        )
        states.append(state)
    told = [json.loads(line) for line in (tmp_path / "late").read_text().splitlines()]
    assert [each["time"] for each in told] == [each.time for each in states]
    for report, of in zip(told, smoothed(experiment.tracker, states, LAG), strict=True):
        mean, names = experiment.tracker.estimate(of).mean, experiment.tracker.state.names
        for i, number in enumerate(of.ids.tolist()):
            (track,) = [each for each in report["tracks"] if each["id"] == number]
            assert [track[name] for name in names] == mean[i].tolist()
    now = [json.loads(line)["time"] for line in (tmp_path / "now").read_text().splitlines()]
    assert now[-1] == states[-1].time


def test_what_cannot_be_smoothed_is_refused_with_its_place(tmp_path: Path) -> None:
    given = config(tmp_path, 0.0) | {
        "estimator": {
            "kind": "bootstrap_particles",
            "particles": 100,
            "motion": {"kind": "constant_velocity", "sigma_accel": 0.05},
        }
    }
    with pytest.raises(ConfigError) as refused:
        load_service(given)
    assert [problem.place for problem in refused.value.problems] == ["outputs[1].lag"]


def test_a_late_output_cannot_tell_of_now(tmp_path: Path) -> None:
    given = config(tmp_path, 0.0)
    given["outputs"][1]["predict"] = True  # type: ignore[index]
    with pytest.raises(ConfigError) as refused:
        load_service(given)
    assert [problem.place for problem in refused.value.problems] == ["outputs[1].predict"]
