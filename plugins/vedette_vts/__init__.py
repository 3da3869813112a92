"""Tracking vessels with the polar radar of a vessel traffic service: the paper's filters and study."""

from collections.abc import Iterable

import vedette
from vedette_vts.decorrelated_conversion import DecorrelatedConversion
from vedette_vts.decorrelated_position import DecorrelatedPosition
from vedette_vts.reproduction import VtsReproduction

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [DecorrelatedConversion, DecorrelatedPosition, VtsReproduction]
