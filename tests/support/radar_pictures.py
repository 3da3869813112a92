"""Geometry of a small radar picture, its boat, and a tracker for it."""

import numpy as np

import vedette
from vedette.metrics import judge
from vedette_marine.geometry import PictureGeometry
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures

SIZE, FRAMES = 128, 12
GEOMETRY = PictureGeometry(5.0, [63.5, 63.5], SIZE, SIZE, latitude=54.0, longitude=12.0)
RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
START, SPEED = np.array([-200.0, 150.0]), np.array([6.0, -4.0])


def opened(folder, **more):
    return RadarPictures(str(folder), **more).open({"screen": RadarScreen()}, np.random.default_rng(0))


def config(folder, lifecycle="announced", **source):
    spread = {"vx": 8.0, "vy": 8.0}
    if lifecycle == "announced":
        spread |= {"x": 10.0, "y": 10.0}
    return {
        "source": {"kind": "radar_pictures", "path": str(folder), **source},
        "preprocessors": {
            "radar": {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}, "chain": {"nearest": 20}}
        },
        "sensors": {
            "radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
        },
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "announced" if lifecycle == "announced" else "from_returns", "spread": spread},
        "lifecycle": {"kind": lifecycle},
    }


def judged(given):
    experiment = vedette.load(given)
    result = experiment.run()
    return result, judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)
