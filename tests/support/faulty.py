"""The source of a plugin with a component of each role, one method of which may be wrong, and a config that uses all."""

from __future__ import annotations

import re
import sys
import types
from typing import Any

from vedette import Registry
from vedette.config.contract import described

SOURCE = '''
import numpy as np
from attrs import frozen
import vedette
from vedette import Detections, Gaussian, Innovation, Newborn, Recording, Scan, fields

STATE = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")
SEEN = vedette.Space.of(x="m", y="m")
MEASURED = vedette.Space.of(range="m", x="m", y="m")

@frozen
class Drift(vedette.MotionModel):
    """Moves on, with white acceleration."""
    kind = "x_motion"
    state = STATE
    sigma: float = fields.quantity("m/s^2", "of the acceleration", default=0.5, above=0)
    def move(self, x, dt):
        return np.concatenate([x[..., :2] + dt * x[..., 2:], x[..., 2:]], axis=-1)
    def jacobian(self, x, dt):
        return np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    def noise(self, x, dt):
        return self.sigma**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))

@frozen
class Lidar(vedette.Sensor):
    """Measures a range and a position."""
    kind = "x_sensor"
    observes = SEEN
    measurement = MEASURED
    sigma: float = fields.quantity("m", "of each measured axis", default=5.0, above=0)
    def measure(self, x):
        return np.concatenate([np.linalg.norm(x, axis=-1, keepdims=True), x], axis=-1)
    def jacobian(self, x):
        return np.concatenate([self.unit(x)[..., None, :], np.broadcast_to(np.eye(2), (*x.shape, 2))], axis=-2)
    def unit(self, x):
        return x / np.linalg.norm(x, axis=-1, keepdims=True)
    def noise(self, x):
        return np.broadcast_to(self.sigma**2 * np.eye(3), (*x.shape[:-1], 3, 3))
    def detects(self, x):
        return np.full(x.shape[:-1], 0.9)
    def clutter(self, z):
        return np.full(z.shape[:-1], 1e-9)
    def invert(self, z, noise=None):
        return Gaussian(z[..., 1:], np.broadcast_to(self.sigma**2 * np.eye(2), (*z.shape[:-1], 2, 2)))

@frozen
class Alone(vedette.Associator):
    """Probabilistic data association."""
    kind = "x_associator"
    def associate(self, scores, evidence):
        return np.exp(scores - np.logaddexp.reduce(scores, axis=-1, keepdims=True))

@frozen
class Filter(vedette.Estimator):
    """Another filter."""
    kind = "x_estimator"
    drops = ("exact_when_linear", "bounded")
    of: vedette.Estimator = fields.part("the filter")
    @property
    def state(self):
        return self.of.state
    def start(self, prior, axes, rng):
        return self.of.start(prior, axes, rng)
    def predict(self, belief, dt, rng):
        return self.of.predict(belief, dt, rng)
    def evaluate(self, belief, sensor, observed, p_gate):
        return self.of.evaluate(belief, sensor, observed, p_gate)
    def update(self, belief, innovation, weights):
        return self.of.update(belief, innovation, weights)
    def moments(self, belief):
        return self.of.moments(belief)

@frozen
class Unclaimed(vedette.Birth):
    """A track at each return that no track claims."""
    kind = "x_birth"
    models_unseen = True
    def predict(self, memory, estimator, dt, rng):
        return memory
    def reveal(self, memory, estimator, sensor, detections, p_gate):
        return np.full(detections.z.shape[-2], 1e-9), memory
    def begin(self, found, estimator, sensor, name, detections, claimed):
        return self.at(np.flatnonzero(claimed < 0.1), sensor.invert(detections.z).mean)
    def at(self, rows, spots):
        means = np.concatenate([spots[rows], np.zeros((len(rows), 2))], axis=-1)
        covs = np.broadcast_to(np.diag([25.0, 25.0, 99.0, 99.0]), (len(rows), 4, 4))
        return Newborn(rows, Gaussian(means, covs), np.full(len(rows), 0.5))

@frozen(eq=False)
class Count:
    seen: vedette.Array

@frozen
class Seen(vedette.Lifecycle):
    """Confirms after three detections."""
    kind = "x_lifecycle"
    def start(self, existence):
        return Count(np.ones(existence.shape))
    def predict(self, existence, dt):
        return 0.99 * existence
    def review(self, memory, scan):
        return Count(memory.seen + scan.hit), memory.seen > 2, scan.existence > 0.001

@frozen
class Same(vedette.Preprocessor):
    """Hands the returns on."""
    kind = "x_preprocessor"
    measurement = MEASURED
    sensors = {"raw": Lidar()}
    def process(self, scans):
        return scans["raw"].detections

@frozen
class Scene(vedette.Source):
    """Two targets that drift."""
    kind = "x_source"
    def open(self, sensors, rng):
        return Recording([Scan(float(i), "raw", Detections.of(self.seen(i, rng))) for i in range(8)])
    def seen(self, i, rng):
        x = np.array([[100.0 + 10 * i, 300.0], [-400.0, 800.0 - 8 * i]])
        z = np.concatenate([np.linalg.norm(x, axis=-1, keepdims=True), x], axis=-1)
        return z + rng.normal(size=z.shape)

VEDETTE_CONTRACT = 2

@vedette.plugin
def vedette_components():
    return [Drift, Lidar, Alone, Filter, Unclaimed, Seen, Same, Scene]
'''

CONFIG = """
[source]
kind = "x_source"
[preprocessors.lidar]
kind = "x_preprocessor"
[sensors.lidar]
kind = "x_sensor"
[estimator]
kind = "x_estimator"
[estimator.of]
kind = "ekf"
motion = { kind = "x_motion" }
[associator]
kind = "x_associator"
[birth]
kind = "x_birth"
[lifecycle]
kind = "x_lifecycle"
"""
"""Uses every component of the plugin."""

METHODS = re.findall(r"class (\w+)|    def (\w+)\(self", SOURCE)
HELPERS = ("at", "seen", "state", "unit")


def methods() -> list[tuple[str, str]]:
    """Return class and name of every method that the contract has."""
    found, cls = [], ""
    for name, method in METHODS:
        cls = name or cls
        if method and method not in HELPERS:
            found.append((cls, method))
    return found


def spoiled(cls: str, method: str, fault: str) -> str:
    """Return the source with the value of one method replaced: `fault` may use `given`, what it returns now."""
    head, tail = SOURCE.split(f"class {cls}(", 1)
    before, after = tail.split(f"    def {method}(", 1)
    signature, body, rest = after.split("\n", 2)
    value = body.removeprefix("        return ")
    assert value != body
    wrong = f"        given = {value}\n        {fault}"
    return f"{head}class {cls}({before}    def {method}({signature}\n{wrong}\n{rest}"


def module_of(source: str, name: str = "vedette_x") -> Any:
    """Return the module of a plugin's source."""
    module = types.ModuleType(name)
    sys.modules[name] = module
    exec(compile(source, f"{name}.py", "exec"), module.__dict__)
    return module


def with_plugin(installed: Registry, source: str) -> Registry:
    """Return what is installed with the plugin of a source beside it."""
    classes = module_of(source).vedette_components()
    return Registry((*installed.entries, *(described(cls, "vedette-x", "1") for cls in classes)))
