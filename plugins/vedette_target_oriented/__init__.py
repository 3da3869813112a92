"""The target-oriented velocity: motion models with noise and turns along the velocity, and the study of their paper."""

from collections.abc import Iterable

import vedette
from vedette_target_oriented.certain import TargetOrientedCertain
from vedette_target_oriented.consistent import TargetOriented
from vedette_target_oriented.literal import TargetOrientedLiteral
from vedette_target_oriented.reproduction import TargetOrientedReproduction
from vedette_target_oriented.smoothed import TargetOrientedSmoothed

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [
        *(TargetOriented, TargetOrientedLiteral, TargetOrientedCertain, TargetOrientedSmoothed),
        TargetOrientedReproduction,
    ]
