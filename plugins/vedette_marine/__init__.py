"""Marine radar: from radar pictures to returns, from AIS to a reference, and the study of IMM-PDAF on ships."""

from collections.abc import Iterable

import vedette
from vedette_marine.detectors.cfar import Cfar
from vedette_marine.detectors.radar_picture import RadarPicture
from vedette_marine.lifecycles.announced import Announced
from vedette_marine.picture_study import MarinePicturesStudy
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures
from vedette_marine.study import MarineStudy

VEDETTE_CONTRACT = 1


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Everything in this package."""
    return [RadarScreen, RadarPicture, Cfar, RadarPictures, Announced, MarineStudy, MarinePicturesStudy]
