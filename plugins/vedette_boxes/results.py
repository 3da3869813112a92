"""The tracks of a run as results of the MOTChallenge."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vedette import Array, Experiment, Gaussian, Result
from vedette_boxes.rows import write_rows
from vedette_boxes.sensors.box import BOX
from vedette_boxes.shown import shown
from vedette_boxes.sources.mot import MotSource

NAME = "mot.txt"


def results(folder: Path, experiment: Experiment, result: Result) -> list[str]:
    """Write the boxes of confirmed tracks, if the run read detections of that format, and return the file's name."""
    if not isinstance(experiment.source, MotSource) or not set(BOX.axes) <= set(experiment.tracker.state.axes):
        return []
    write_rows(folder / NAME, sorted(_rows(experiment.source.rate, result), key=lambda row: row[:2]))
    return [NAME]


def _rows(rate: float, result: Result) -> Iterator[tuple[int, int, Array, float]]:
    for track in result.tracks:
        boxes, here = shown(Gaussian(track.mean, track.cov), track.space, track.hit)
        for i in np.flatnonzero(track.confirmed & here).tolist():
            yield round(float(track.times[i]) * rate), 1 + track.id, boxes[i], float(track.existence[i])
