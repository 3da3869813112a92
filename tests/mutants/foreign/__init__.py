"""Wrong components, as authors of plugins would get them wrong, written without knowledge of the laws.

The list is frozen: a law that is written after it does not change it. `base.mutant` without a fault makes the control, the
right component in the same wrapping, which no law should refuse.
"""

from mutants.foreign import (
    associator,
    birth,
    estimator,
    estimator_modes,
    estimator_scan,
    imaging,
    lifecycle,
    motion,
    motion_turning,
    preprocessor,
    sensor,
    sensor_scan,
    source,
)
from mutants.foreign.base import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *motion.MUTANTS,
    *motion_turning.MUTANTS,
    *sensor.MUTANTS,
    *sensor_scan.MUTANTS,
    *imaging.MUTANTS,
    *associator.MUTANTS,
    *estimator.MUTANTS,
    *estimator_scan.MUTANTS,
    *estimator_modes.MUTANTS,
    *birth.MUTANTS,
    *lifecycle.MUTANTS,
    *preprocessor.MUTANTS,
    *source.MUTANTS,
)
"""All of them."""
