"""Results for people: summaries, pictures, pages; runs watched while they go, and exported to other programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from vedette import Component, Recording, Sensor, plugin
from vedette_report.commands import Consistency, Export, Report, Run, Watch
from vedette_report.pictures import Errors, Map, OfRecording, Simulated, Strip

if TYPE_CHECKING:
    from vedette.tracking import Intake

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands and pictures."""
    return [Run, Watch, Report, Export, Consistency, Map, Errors, Strip, Simulated, OfRecording]


@plugin
def vedette_warnings(intake: Intake, recording: Recording, sensors: Mapping[str, Sensor]) -> Iterable[str]:
    """Return what looks wrong with units, times, places and what was refused."""
    from vedette_report.warnings.words import of_input

    return of_input(intake, recording, sensors)
