"""Boxes in images: a sensor and a motion in px, files of the MOTChallenge, figures by overlap."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import vedette
from vedette.metrics import Figure
from vedette_boxes.calibration import Calibration as Calibration
from vedette_boxes.calibration import fitted as fitted
from vedette_boxes.calibration import of_targets as of_targets
from vedette_boxes.drafting import draft
from vedette_boxes.figures import figures, judged, of_files
from vedette_boxes.motion.box_velocity import BoxVelocity
from vedette_boxes.results import results as results
from vedette_boxes.rows import overlap as overlap
from vedette_boxes.rows import read_rows as read_rows
from vedette_boxes.rows import write_rows as write_rows
from vedette_boxes.sensors.box import BOX as BOX
from vedette_boxes.sensors.box import Box
from vedette_boxes.sources.mot import MotSource

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [Box, BoxVelocity, MotSource]


@vedette.plugin
def vedette_draft(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Draft a config for detections of the MOTChallenge's format."""
    return draft(path, wishes)


@vedette.plugin
def vedette_figures() -> Iterable[Figure]:
    """Return the figures of boxes by their overlap."""
    return figures()


@vedette.plugin
def vedette_files(folder: Path, experiment: vedette.Experiment, result: vedette.Result) -> Iterable[str]:
    """Write results of the MOTChallenge's format."""
    return results(folder, experiment, result)


def judge_files(truth: str | Path, results: str | Path, first: int = 0) -> dict[str, float]:
    """Return HOTA and its parts, MOTA and IDF1 of a file of results, from frame `first` on.

    True boxes whose 7th number is 0 do not count.
    """
    true, told = read_rows(Path(truth)), read_rows(Path(results))
    return judged(of_files(true.of((true.score != 0) & (true.frame >= first)), told.of(told.frame >= first)))
