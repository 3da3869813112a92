"""The judge of a run that is over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette.metrics.running import RunningJudge
from vedette.metrics.score import Figure, Judge, Score
from vedette.roles import Sensor
from vedette.space import Space
from vedette.types import Scan, Track, Trajectory


def judge(
    tracks: Sequence[Track],
    truth: Sequence[Trajectory],
    scans: Sequence[Scan],
    options: Judge,
    gate_probability: float = 1.0,
    sensors: Mapping[str, Sensor] | None = None,
    figures: Sequence[Figure] = (),
    nobody: bool = False,
) -> Score:
    """Judge the tracks of one run against the truth, at the scans that the tracker took.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and are not judged.

    Parameters
    ----------
    tracks, truth, scans : of the run
    options, gate_probability, sensors, figures, nobody : as for RunningJudge, to which this gives the run

    Raises
    ------
    InputError : truth and tracks have no position axis in common, or a track has an entry when there is no scan
    """
    given = truth, space_of(tracks), options, gate_probability
    judging = RunningJudge(*given, sensors=sensors, figures=figures, keep=np.inf, nobody=nobody)
    judging.take(tracks, scans)
    return judging.score()


def space_of(tracks: Sequence[Track]) -> Space | None:
    """Return the axes of tracks; None if none was ever confirmed."""
    return next((track.space for track in tracks if track.confirmed.any()), None)
