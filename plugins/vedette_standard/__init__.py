"""The classics of target tracking, one component a file."""

from collections.abc import Iterable

import vedette
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

VEDETTE_CONTRACT = 1


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Everything in this package."""
    return [ConstantVelocity, CartesianPosition]
