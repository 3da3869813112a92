"""A scene in a config, and a third party's plugin."""

import sys

import pytest

SCENE = """
title = "Two ships"
seed = 7

[source]
kind = "simulation"
duration = 60

[source.looks.radar]
interval = 2.0
clutter.x = { low = -300, high = 900 }
clutter.y = { low = -300, high = 300 }

[source.ships.north]
start = [0, 100]
speed = 8.0

[source.ships.south]
start = [400, -100]
course = "180 deg"
speed = 5.0

[sensors.radar]
kind = "cartesian_position"
sigma = 5.0
detection_probability = 0.9
clutter_density = 4e-6

[estimator]
kind = "imm"
transition = [[0.9, 0.1], [0.1, 0.9]]

[[estimator.modes]]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.1 }

[[estimator.modes]]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 1.0 }

[associator]
kind = "gnn"

[birth]
kind = "from_returns"
spread = { vx = 8.0, vy = 8.0 }

[lifecycle]
kind = "m_of_n"
"""


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "ships.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def undrawn(monkeypatch):
    """A machine without matplotlib: what has nothing to do with pictures is quicker without."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)


ACME = '''
"""A third party's plugin: a motion model, and an associator that presses Ctrl-C when it has seen enough."""

from typing import ClassVar

import numpy as np
from attrs import frozen

import vedette
from vedette import fields

VEDETTE_CONTRACT = 2


@frozen
class Drift(vedette.MotionModel):
    """Stands still but for white noise."""

    kind: ClassVar[str] = "acme_drift"

    spread: float = fields.quantity("m", "standard deviation gained in 1 s, per axis", above=0, default=2.0)
    style: str = fields.choice("of no effect", ("plain", "fancy"), default="plain")

    @property
    def state(self):
        return vedette.Space.of(x="m", y="m")

    def move(self, x, dt):
        return x

    def noise(self, x, dt):
        return self.spread**2 * dt * np.eye(2)


seen = []


@frozen
class Impatient(vedette.Associator):
    """Each track takes its best return, and after ten scans it is enough."""

    kind: ClassVar[str] = "acme_impatient"

    def associate(self, scores, evidence):
        seen.append(scores)
        if len(seen) > 10:
            raise KeyboardInterrupt
        return np.eye(scores.shape[-1])[np.argmax(scores, axis=-1)]


@vedette.plugin
def vedette_components():
    return [Drift, Impatient]
'''
DISTRIBUTIONS = {"acme": ("acme_tracking", ACME), "ruined": ("ruined_tracking", "import nowhere_to_be_found")}


@pytest.fixture
def acme(tmp_path, monkeypatch):
    """Two distributions installed beside Vedette: one that works, one whose import fails."""
    site = tmp_path / "site"
    for name, (module, source) in DISTRIBUTIONS.items():
        info = site / f"{name}-1.2.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(f"[vedette]\n{name} = {module}\n")
        (site / f"{module}.py").write_text(source)
    monkeypatch.syspath_prepend(site)
    yield site
    sys.modules.pop("acme_tracking", None)
