"""Vedette: compose target trackers from small parts, and prove that the parts are right."""

from vedette import fields, kernels
from vedette.errors import ConfigError, InputError, PluginError, Problem, ScanRefused, VedetteError
from vedette.plugin import plugin
from vedette.roles import Associator, Component, Estimator, Lifecycle, MotionModel, Sensor, Source
from vedette.space import Array, Axis, Mask, Space, SpaceError
from vedette.types import Detections, Gaussian, Innovation, Pose, Recording, Scan, Track, Trajectory

__all__ = [
    "Array",
    "Associator",
    "Axis",
    "Component",
    "ConfigError",
    "Detections",
    "Estimator",
    "Gaussian",
    "Innovation",
    "InputError",
    "Lifecycle",
    "Mask",
    "MotionModel",
    "PluginError",
    "Pose",
    "Problem",
    "Recording",
    "Scan",
    "ScanRefused",
    "Sensor",
    "Source",
    "Space",
    "SpaceError",
    "Track",
    "Trajectory",
    "VedetteError",
    "fields",
    "kernels",
    "plugin",
]
