"""The tracks of a run as results of the MOTChallenge."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vedette import Array, Experiment, Result
from vedette_boxes.rows import write_rows
from vedette_boxes.sensors.box import BOX
from vedette_boxes.sources.mot import MotSource

NAME = "mot.txt"


def results(folder: Path, experiment: Experiment, result: Result) -> list[str]:
    """Write confirmed tracks with boxes, if the run read detections of that format, and return the file's name."""
    if not isinstance(experiment.source, MotSource) or not set(BOX.axes) <= set(experiment.tracker.state.axes):
        return []
    write_rows(folder / NAME, sorted(_rows(experiment.source.rate, result), key=lambda row: row[:2]))
    return [NAME]


def _rows(rate: float, result: Result) -> Iterator[tuple[int, int, Array, float]]:
    for track in result.tracks:
        where = track.space.locate(BOX)
        for i in np.flatnonzero(track.confirmed).tolist():
            box = track.mean[i, where]
            if np.all(box[2:] > 0):
                yield round(float(track.times[i]) * rate), 1 + track.id, box, float(track.existence[i])
