"""Two radars, one on a ship and with a clock that is wrong, through one service, and `vedette run` on their recording."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.services import as_json, feed, ran
from vedette.streams import Arrival
from vedette.types import Pose, Recording, Scan, Trajectory
from vedette_files import read_recording, write_recording

WRONG = 3.7
"""s by which the ship's clock is ahead."""
AT = (1500.0, -400.0)
"""Where the radar on land stands."""
SEEN = {"sigma_range": 6.0, "sigma_bearing": 0.004, "detection_probability": 0.95, "clutter_density": 1e-7}
TRACKER: dict[str, Any] = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
    "sensors": {
        "land": {"kind": "range_bearing", "x": AT[0], "y": AT[1], **SEEN},
        "ship": {"kind": "range_bearing", **SEEN},
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 6.0, "vy": 6.0}},
    "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.99, "delete": 0.01},
}
START, VELOCITY = (
    np.array([[200.0, 900.0], [-700.0, 300.0], [600.0, -1500.0]]),
    np.array([[5.0, -3.0], [4.0, 4.0], [-6.0, 2.0]]),
)


def scene() -> tuple[list[Scan], tuple[Trajectory, ...]]:
    rng, scans = np.random.default_rng(11), []
    for k in range(160):
        sensor, time = ("land", "ship")[k % 2], 1.25 * k
        pose = Pose(np.array([-1000.0 + 4.0 * time, -800.0 + 2.0 * time]), np.array([4.0, 2.0]), 0.4 + 0.002 * time)
        place, heading = (np.array(AT), 0.0) if sensor == "land" else (pose.position, pose.heading)
        away = START + time * VELOCITY - place
        z = np.stack([np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0]) - heading], axis=-1)
        z = (z + rng.normal(0, [6.0, 0.004], z.shape))[rng.random(3) < 0.95]
        scans.append(Scan(time, sensor, vedette.Detections.of(z, 2), pose if sensor == "ship" else None))
    times = np.array([scan.time for scan in scans])
    space = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
    places = START[:, None] + times[:, None] * VELOCITY[:, None]
    states = np.concatenate([places, np.broadcast_to(VELOCITY[:, None], places.shape)], axis=-1)
    return scans, tuple(Trajectory(f"boat {i}", space, times, each) for i, each in enumerate(states))


def line(scan: Scan) -> bytes:
    told: dict[str, Any] = {"sensor": scan.sensor, "z": scan.detections.z.tolist()}
    told["time"] = scan.time + (WRONG if scan.sensor == "ship" else 0.0)
    if scan.pose is not None and scan.pose.velocity is not None:
        own = {"position": scan.pose.position.tolist(), "velocity": scan.pose.velocity.tolist()}
        told["pose"] = {**own, "heading": scan.pose.heading}
    return json.dumps(told).encode() + b"\n"


@pytest.mark.costly
def test_one_service_of_two_radars_is_as_good_as_a_run_on_the_recording(tmp_path: Path) -> None:
    """The receiver estimates the wrong clock's offset: each message is under way for 20 ms, and longer now and then."""
    scans, truth = scene()
    path, record, judged = (tmp_path / name for name in ("all.jsonl", "record.jsonl", "judged.jsonl"))
    spaces = {name: sensor.measurement for name, sensor in vedette.build(TRACKER).sensors.items()}
    write_recording(path, Recording(tuple(scans), truth), spaces)
    run = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(path)}}).run()
    rng = np.random.default_rng(4)
    came = [(scan.time + 0.02 + (rng.exponential(0.6) if k > 1 and k % 3 else 0.0), scan) for k, scan in enumerate(scans)]
    arrivals = [Arrival(line(scan), time) for time, scan in sorted(came, key=lambda each: each[0])]
    config = {
        **TRACKER,
        "inputs": [feed(scans={"clock": "offset"})],
        "service": {"horizon": "10 s", "record": str(record)},
    }
    running = ran(config, arrivals)
    counts = running.counters.counts
    assert (counts["scans_taken_total"], counts["scans_refused_total"]) == (160, 0)
    assert counts["scans_late_total"] > 10
    recording, _ = read_recording(record)
    np.testing.assert_allclose([scan.time for scan in recording.scans], [scan.time + 0.02 for scan in scans], atol=1e-9)
    later = tuple(evolve(path, times=path.times + 0.02) for path in truth)
    moved = tuple(evolve(scan, time=scan.time) for scan in recording.scans)
    write_recording(judged, Recording(moved, later), spaces)
    live = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(judged)}}).run()
    again = vedette.load({**TRACKER, "source": {"kind": "jsonl", "path": str(record)}}).steps()
    assert as_json([state for _, state in again][-1]) == as_json(running.state)
    assert len(live.tracks) == len(run.tracks)
    for figure in ("gospa_m", "position_rmse_m", "nees_state", "hota", "coverage", "confirmed_after_s"):
        assert getattr(live.score(), figure) == pytest.approx(getattr(run.score(), figure), rel=1e-6)
    assert run.score().coverage > 0.95
    for one, other in zip(live.tracks, run.tracks, strict=True):
        np.testing.assert_allclose(one.mean, other.mean, atol=1e-5)


def test_a_place_of_its_own_that_poses_replace_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    """As of a run, which warns of it."""
    told = [json.dumps({**json.loads(line(scan)), "sensor": "land"}).encode() for scan in scene()[0][1:20:2]]
    ran({**TRACKER, "inputs": [feed()]}, [Arrival(each, 1e6) for each in told])
    (why,) = [vars(each)["why"] for each in caplog.records if each.getMessage() == "sensor placed by its poses"]
    assert why.startswith("sensors.land: x = 1500, y = -400 of its own do not count")
