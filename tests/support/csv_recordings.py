"""Recordings in CSV, opened and shown."""

import numpy as np

from vedette_files import CsvSource
from vedette_files.tables.returns import DetectionColumns
from vedette_standard.sensors.cartesian_position import CartesianPosition

RNG = np.random.default_rng(0)
PLANE = {"radar": CartesianPosition(sigma=1.0)}
XY = {"x": "north", "y": "east"}


def opened(folder, text, sensors=PLANE, truth=None, platform=None, **columns):
    (folder / "d.csv").write_text(text, encoding="utf-8")
    detections = DetectionColumns(**({"time": "t", "columns": XY} | columns))
    return CsvSource(detections, str(folder / "d.csv"), truth=truth, platform=platform).open(sensors, RNG)


def shown(recording):
    """Each scan's time and returns, as lists."""
    return [(scan.time, scan.detections.z.tolist()) for scan in recording.scans]


def told(recording):
    return [str(problem) for problem in recording.refused]
