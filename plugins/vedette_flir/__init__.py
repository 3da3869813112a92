"""Tracking in infrared images, pixel by pixel: models of target and atmosphere, cameras, and their filters."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import vedette
from vedette.tracking import Intake
from vedette_flir.annotation import annotated, episodes
from vedette_flir.births.detected import Detected
from vedette_flir.drafting import draft
from vedette_flir.estimators.correlation import CorrelationFilter
from vedette_flir.estimators.monitored import ResidualMonitored
from vedette_flir.estimators.template import TemplateFilter
from vedette_flir.estimators.whitened import WhitenedFilter
from vedette_flir.lifecycles.reappearing import ReappearingTarget
from vedette_flir.lifecycles.sought import SoughtTarget
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.preprocessors.spot_detector import SpotDetector
from vedette_flir.reproduction import FlirReproduction
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sensors.detected_box import DetectedBox
from vedette_flir.sensors.elliptic_spot import EllipticSpot
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sensors.hot_spots import HotSpots
from vedette_flir.sources.stream import VideoStream
from vedette_flir.sources.video import VideoSource

VEDETTE_CONTRACT = 2

MANY = 20
"""Frames in which a detector may be expected to have found something."""


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [
        *(JitteredAcceleration, JitteredWander, AtmosphericWander, ImageVelocity, Carrying),
        *(GaussianSpot, EllipticSpot, HotSpots, BoxCentroid, DetectedBox),
        *(TemplateFilter, CorrelationFilter, ResidualMonitored, WhitenedFilter),
        *(SpotDetector, Detected, SoughtTarget, ReappearingTarget, VideoSource, VideoStream, FlirReproduction),
    ]


@vedette.plugin
def vedette_draft(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Draft a config for a video or a folder of images."""
    return draft(path, wishes)


@vedette.plugin
def vedette_warnings(intake: Intake, recording: vedette.Recording, sensors: Mapping[str, vedette.Sensor]) -> Iterable[str]:
    """Say what to change where a detector found nothing in any frame."""
    for name, came in intake.came.items():
        if sensors[name].claims and came.scans >= MANY and not came.returns:
            yield f'{name}: no spot stands out: for dark targets set polarity = "both", for dim ones a smaller `clear`'


@vedette.plugin
def vedette_files(folder: Path, experiment: vedette.Experiment, result: vedette.Result) -> Iterable[str]:
    """Write a video of a run through images, and when its tracks were lost and found again."""
    return [*annotated(folder, experiment, result), *episodes(folder, result)]


@vedette.plugin
def vedette_files_of_stream(folder: Path, result: vedette.Result) -> Iterable[str]:
    """Write when the tracks of a run through images were lost and found again."""
    return episodes(folder, result)
