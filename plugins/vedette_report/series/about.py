"""What is the same in all of a run's series."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette import Experiment, Recording
from vedette.metrics import positions, truth_at
from vedette_files import units
from vedette_report.figures import length_unit
from vedette_report.map.plane import Plane, place_of
from vedette_report.map.views import view
from vedette_report.series.traces import BAND, band, mode_names


def about(experiment: Experiment, recording: Recording, plane: Plane | None, modes: int) -> dict[str, Any]:
    """Return the names, units and constants that a reader of the series needs."""
    tracker = experiment.tracker
    sensors = {}
    for name, sensor in tracker.sensors.items():
        threshold = tracker.gate.for_sensor(sensor).threshold
        place = place_of(sensor)
        ground = plane if plane is not None and plane.is_ground else None
        sensors[name] = {
            "axes": units(sensor.measurement),
            "band": list(band(len(sensor.measurement))),
            "gate": threshold if np.isfinite(threshold) else None,
            "place": None if ground is None or place is None else ground.platform(np.array(place)).tolist(),
            "view": None if ground is None else view(sensor, place),
        }
    spot = len(positions(truth_at(recording.truth, np.zeros(0), tracker.state).space))
    return {
        "title": experiment.title,
        "axes": units(tracker.state),
        "map": None if plane is None else {"axes": list(plane.space.names), "labels": list(plane.labels)},
        "unit": length_unit(experiment),
        "sensors": sensors,
        "objects": [true.name for true in recording.truth],
        "modes": list(mode_names(experiment, modes)),
        "band": 1.0 - BAND,
        "nees_band": list(band(spot)) if spot else None,
        "notes": dict(recording.notes),
    }
