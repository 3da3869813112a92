"""FilterPy's matrices, tracks of Stone Soup and tables of xarray, of shapes and numbers that do not fit."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from fuzz.cases import NUMBERS, pick
from vedette import Space
from vedette_adapters.filterpy import config_of
from vedette_adapters.stonesoup import StoneSoupSource, to_stonesoup, tracks_of
from vedette_adapters.stonesoup_models import StoneSoupSensor

START = datetime(2026, 1, 1)
PLANE = Space.of(x="m", vx="m/s", y="m", vy="m/s")


def _numbers(rng: np.random.Generator, *shape: int) -> Any:
    values = rng.normal(0.0, 10.0, shape)
    if rng.random() < 0.3 and values.size:
        number = pick(rng, [each for each in NUMBERS if not isinstance(each, int) or abs(each) < 2**64])
        values.flat[int(rng.integers(values.size))] = float(number)
    return values


def _filterpy(rng: np.random.Generator) -> str:
    from filterpy.kalman import FadingKalmanFilter, InformationFilter, KalmanFilter

    n, m = int(rng.integers(1, 5)), int(rng.integers(1, 4))
    make = pick(rng, [KalmanFilter, InformationFilter, lambda dim_x, dim_z: FadingKalmanFilter(1.01, dim_x, dim_z)])
    one = make(dim_x=n, dim_z=m)
    for name in ("F", "Q", "H", "x"):
        if rng.random() < 0.5:
            rows, columns = {"H": (m, n), "x": (n, 1)}.get(name, (n, n))
            try:
                setattr(one, name, _numbers(rng, rows, columns))
            except Exception:  # FilterPy's own refusal
                return "filterpy refused"
    axes = ["x", "y", "z", "w", "v"][: n + pick(rng, [0, 0, 0, 0, 1, -1])]
    found = config_of(one, axes if rng.random() < 0.9 else pick(rng, ["xy", [], ["x"] * n, [""] * n]))
    tracker = vedette.build(found)
    tracker.start()
    return "built"


def _stonesoup(rng: np.random.Generator) -> str:
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track

    if rng.random() < 0.5:
        n = int(rng.integers(1, 6))
        states = [
            GaussianState(_numbers(rng, n, 1), np.eye(n), timestamp=START + timedelta(seconds=float(rng.integers(0, 9))))
            for _ in range(int(rng.integers(0, 5)))
        ]
        tracks_of(to_stonesoup(tracks_of([Track(states)], PLANE, START), START), PLANE, START)
        return "tracks"
    models = [
        LinearGaussian(4, [0, 2], np.eye(2)),
        CartesianToBearingRange(4, [0, 2], np.diag([0.01, 4.0]), translation_offset=_numbers(rng, 2, 1)),
        CartesianToBearingRange(4, [2, 0], np.diag([0.01, 4.0]), rotation_offset=_numbers(rng, 3, 1)),
        None,
    ]
    sensors = {"s": StoneSoupSensor(pick(rng, models[:2]), PLANE)}
    pairs = [
        (START + timedelta(seconds=k), {Detection(_numbers(rng, pick(rng, [2, 2, 2, 1, 3]), 1), measurement_model=each)})
        for k, each in enumerate(pick(rng, models) for _ in range(4))
    ]
    recording = StoneSoupSource(pairs, "s").open(sensors, rng)
    for scan in recording.scans:
        if scan.pose is not None:
            sensors["s"].at(scan.pose)
    return "detections"


def case(rng: np.random.Generator, folder: Path) -> str:
    """Draw one of these."""
    return pick(rng, [_filterpy, _stonesoup])(rng)
