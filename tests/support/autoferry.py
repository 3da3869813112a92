"""Entries of the Autoferry benchmark's files."""

import json

import numpy as np
from attrs import frozen

from vedette import Sensor, Space
from vedette_files import AutoferrySource
from vedette_standard.sensors.cartesian_position import CartesianPosition

RNG = np.random.default_rng(0)
PLANE = {"radar": CartesianPosition(sigma=1.0)}
SENSOR_IDS = {"lidar": 1, "radar": 2, "infrared": 3, "electro_optical": 4}
BOATS = [
    [{"targetID": 1, "position": [0.0, 0.0, 0.0], "time": 0.0}, {"targetID": 1, "position": [2.0, 0.0, 0.0], "time": 1.0}]
]


@frozen
class Camera(Sensor):
    """Measures the bearing; the tests only read for it."""

    @property
    def observes(self):
        return Space.of(x="m", y="m")

    @property
    def measurement(self):
        return Space.of(bearing="rad mod 2pi")

    def measure(self, x):
        return np.arctan2(x[..., 1:], x[..., :1])

    def noise(self, x):
        return np.eye(1)

    def detects(self, x):
        return np.ones(())

    def clutter(self, z):
        return np.zeros(())


def entry(sensor, time, measurement, ferry=(0.0, 0.0)):
    return {
        "sensorID": SENSOR_IDS[sensor],
        "measurements": [],
        "ownshipPosition": list(ferry),
        "time": time,
        "measurement": measurement,
    }


def opened(folder, entries, boats=BOATS, sensors=PLANE, **options):
    for part, content in (("detections", entries), ("groundTruth", boats)):
        text = content if isinstance(content, str) else json.dumps(content)
        (folder / f"scenario7_{part}.json").write_text(text)
    return AutoferrySource(scenario=7, path=str(folder), **options).open(sensors, RNG)


def told(recording):
    return [str(problem) for problem in recording.refused]
