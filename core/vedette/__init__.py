"""Vedette: compose target trackers from small parts, and test that each part is right.

>>> import vedette
>>> tracker = vedette.build({
...     "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
...     "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
...     "associator": {"kind": "gnn"},
...     "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
...     "lifecycle": {"kind": "m_of_n"},
... })
>>> state = tracker.start(seed=1)
>>> for time in (0.0, 1.0, 2.0):
...     scan = vedette.Scan(time, "radar", vedette.Detections.of([[100.0 + 8.0 * time, 50.0]]))
...     state = tracker.step(state, scan)
>>> tracker.estimate(state).mean.round(0).tolist(), state.confirmed.tolist()
([[115.0, 50.0, 7.0, 0.0]], [True])

Names are imported when first used, so that `import vedette` costs nothing. Plugins bring some of them, as `vedette.track`.
"""

from importlib import import_module
from typing import Any

_ROOMS = ("fields", "filters", "kernels")
_HOMES = {
    "config": "build load to_config",
    "errors": "ConfigError InputError PluginError Problem ScanRefused VedetteError",
    "experiment": "Experiment Result",
    "tracking.gate": "Gate",
    "config.hooks": "plugin",
    "hypotheses": "Branching HypothesisAssociator Merging",
    "metrics": "Judge",
    "config.registry": "Registry",
    "progress": "Progress",
    "roles": "Associator Component Estimator MotionModel Sensor Traits",
    "supporting": "Birth Command ImagingSensor Lifecycle Picture Preprocessor Reproduction Source",
    "tracking.smoothing": "smooth smoothed",
    "kernels.twins": "Twin",
    "space": "NO_AXES Array Axis Indices Mask Space SpaceError",
    "tracking.tracker": "Tracker",
    "types": "Detections Frame Gaussian Innovation LazyScans Mixtures Newborn Pose Recording Review Rows Scan "
    "Track Trajectory new_gaussian new_innovation",
    "values": "maker",
    "wrapping": "WrappedEstimator WrappedMotion WrappedSensor",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f"vedette.{name}")
    if name == "__version__":
        return import_module("importlib.metadata").version("vedette")
    if name in _HOME_OF:
        value = getattr(import_module(f"vedette.{_HOME_OF[name]}"), name)
    elif name.startswith("_"):
        raise AttributeError(f"module 'vedette' has no attribute {name!r}")
    else:
        value = import_module("vedette.names").look_up(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*_ROOMS, *_HOME_OF, *import_module("vedette.names").brought()]
