"""Vedette: compose target trackers from small parts, and test that each part is right.

>>> import vedette
>>> tracker = vedette.build({
...     "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
...     "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
...     "associator": {"kind": "gnn"},
...     "lifecycle": {"kind": "m_of_n", "spread": {"vx": 10.0, "vy": 10.0}},
... })
>>> state = tracker.start(seed=1)
>>> for time in (0.0, 1.0, 2.0):
...     scan = vedette.Scan(time, "radar", vedette.Detections.of([[100.0 + 8.0 * time, 50.0]]))
...     state = tracker.step(state, scan)
>>> tracker.estimate(state).mean.round(0).tolist(), state.confirmed.tolist()
([[115.0, 50.0, 7.0, 0.0]], [True])

Names are imported when first used, so that `import vedette` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vedette import fields as fields
    from vedette import filters as filters
    from vedette import kernels as kernels
    from vedette.config import build as build
    from vedette.config import load as load
    from vedette.config import to_config as to_config
    from vedette.config.hooks import plugin as plugin
    from vedette.config.registry import Registry as Registry
    from vedette.drafting import track as track
    from vedette.errors import ConfigError as ConfigError
    from vedette.errors import InputError as InputError
    from vedette.errors import PluginError as PluginError
    from vedette.errors import Problem as Problem
    from vedette.errors import ScanRefused as ScanRefused
    from vedette.errors import VedetteError as VedetteError
    from vedette.experiment import Experiment as Experiment
    from vedette.experiment import Result as Result
    from vedette.hypotheses import Branching as Branching
    from vedette.hypotheses import HypothesisAssociator as HypothesisAssociator
    from vedette.hypotheses import Merging as Merging
    from vedette.metrics import Judge as Judge
    from vedette.montecarlo.study import monte_carlo as monte_carlo
    from vedette.progress import Progress as Progress
    from vedette.reproduction import Reproduction as Reproduction
    from vedette.roles import Associator as Associator
    from vedette.roles import Component as Component
    from vedette.roles import Estimator as Estimator
    from vedette.roles import MotionModel as MotionModel
    from vedette.roles import Sensor as Sensor
    from vedette.space import NO_AXES as NO_AXES
    from vedette.space import Array as Array
    from vedette.space import Axis as Axis
    from vedette.space import Indices as Indices
    from vedette.space import Mask as Mask
    from vedette.space import Space as Space
    from vedette.space import SpaceError as SpaceError
    from vedette.supporting import Birth as Birth
    from vedette.supporting import ImagingSensor as ImagingSensor
    from vedette.supporting import Lifecycle as Lifecycle
    from vedette.supporting import Preprocessor as Preprocessor
    from vedette.supporting import Source as Source
    from vedette.tracking.gate import Gate as Gate
    from vedette.tracking.smoothing import smooth as smooth
    from vedette.tracking.smoothing import smoothed as smoothed
    from vedette.tracking.tracker import Tracker as Tracker
    from vedette.tuning import tune as tune
    from vedette.types import Detections as Detections
    from vedette.types import Frame as Frame
    from vedette.types import Gaussian as Gaussian
    from vedette.types import Innovation as Innovation
    from vedette.types import LazyScans as LazyScans
    from vedette.types import Newborn as Newborn
    from vedette.types import Pose as Pose
    from vedette.types import Recording as Recording
    from vedette.types import Review as Review
    from vedette.types import Rows as Rows
    from vedette.types import Scan as Scan
    from vedette.types import Track as Track
    from vedette.types import Trajectory as Trajectory
    from vedette.types import new_gaussian as new_gaussian
    from vedette.types import new_innovation as new_innovation
    from vedette.values import maker as maker
    from vedette.wrapping import WrappedMotion as WrappedMotion
    from vedette.wrapping import WrappedSensor as WrappedSensor

_HOMES = {
    "config": ("build", "load", "to_config"),
    "montecarlo.study": ("monte_carlo",),
    "drafting": ("track",),
    "errors": ("ConfigError", "InputError", "PluginError", "Problem", "ScanRefused", "VedetteError"),
    "experiment": ("Experiment", "Result"),
    "tracking.gate": ("Gate",),
    "config.hooks": ("plugin",),
    "hypotheses": ("Branching", "HypothesisAssociator", "Merging"),
    "metrics": ("Judge",),
    "config.registry": ("Registry",),
    "progress": ("Progress",),
    "report.tables": ("draw_result", "result_html", "tabulate_result"),
    "reproduction": ("Reproduction",),
    "roles": ("Associator", "Component", "Estimator", "MotionModel", "Sensor"),
    "supporting": ("Birth", "ImagingSensor", "Lifecycle", "Preprocessor", "Source"),
    "tracking.smoothing": ("smooth", "smoothed"),
    "space": ("NO_AXES", "Array", "Axis", "Indices", "Mask", "Space", "SpaceError"),
    "tracking.tracker": ("Tracker",),
    "tuning": ("tune",),
    "types": (
        "Detections",
        "Frame",
        "Gaussian",
        "Innovation",
        "LazyScans",
        "Newborn",
        "Pose",
        "Recording",
        "Review",
        "Rows",
        "Scan",
        "Track",
        "Trajectory",
        "new_gaussian",
        "new_innovation",
    ),
    "values": ("maker",),
    "wrapping": ("WrappedMotion", "WrappedSensor"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name in ("fields", "filters", "kernels"):
        return import_module(f"vedette.{name}")
    if name == "__version__":
        return import_module("importlib.metadata").version("vedette")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'vedette' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"vedette.{_HOME_OF[name]}"), name)
    return value


def __dir__() -> list[str]:
    return ["fields", "filters", "kernels", *_HOME_OF]
