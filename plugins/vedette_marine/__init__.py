"""Marine radar: from radar pictures to returns, from AIS to a reference, and the study of IMM-PDAF on ships."""

from collections.abc import Iterable
from pathlib import Path

import vedette
from vedette_marine.births.announced import Announced
from vedette_marine.lifecycles.announced import AnnouncedTracks
from vedette_marine.picture.inspection import illustrate
from vedette_marine.picture_runs import MarinePicturesReproduction
from vedette_marine.preprocessors.cfar import Cfar
from vedette_marine.preprocessors.radar_picture import RadarPicture
from vedette_marine.reproduction import MarineReproduction
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [
        RadarScreen,
        RadarPicture,
        Cfar,
        RadarPictures,
        Announced,
        AnnouncedTracks,
        MarineReproduction,
        MarinePicturesReproduction,
    ]


@vedette.plugin
def vedette_files(folder: Path, experiment: vedette.Experiment, result: vedette.Result) -> Iterable[str]:
    """Write pictures of what the preprocessors found in a run's radar pictures."""
    pictured = [part for part in experiment.preprocessors.values() if isinstance(part, RadarPicture)]
    return [name for part in pictured for name in illustrate(part, folder, result)]
