"""The source of a plugin that brings one motion model."""

from __future__ import annotations

SOURCE = '''
from typing import ClassVar
import numpy as np
import attrs
from attrs import frozen
import vedette
from vedette import fields

VEDETTE_CONTRACT = 2

@frozen
class Drift(vedette.MotionModel):
    """Drifts with the current.

    By a third party.
    """

    kind: ClassVar[str] = "drift"
    current: float = fields.quantity("m/s", "speed of the water", at_least=0)

    @property
    def state(self) -> vedette.Space:
        return vedette.Space.of(x="m", y="m")

    def move(self, x, dt):
        return x + self.current * dt

    def noise(self, x, dt):
        return dt * np.eye(2)

@vedette.plugin
def vedette_components():
    return [Drift]
'''


def drifting(name: str = "Drift", kind: str = "drift", contract: int = 2) -> str:
    """Return the source with another name, kind or contract."""
    source = SOURCE.replace("Drift(", f"{name}(").replace("[Drift]", f"[{name}]")
    return source.replace('"drift"', f'"{kind}"').replace("CONTRACT = 2", f"CONTRACT = {contract}")
