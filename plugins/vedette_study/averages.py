"""Figures averaged over a swept path, run by run: several recordings judged as one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette_study.plan import Plan, by_point


def averaged_plan(plan: Plan) -> Plan:
    """Return the plan without the axes that are averaged over: a point for each choice of the others."""
    axes = {path: values for path, values in plan.axes.items() if path not in plan.average}
    first = {path: plan.axes[path][0] for path in plan.average}
    points = tuple(
        evolve(point, labels={path: value for path, value in point.labels.items() if path not in first})
        for point in plan.points
        if all(point.labels[path] == value for path, value in first.items())
    )
    return evolve(plan, axes=axes, points=points)


def averaged(values: Array, axes: Mapping[str, tuple[Any, ...]], over: tuple[str, ...]) -> Array:
    """Return a figure (points, runs) averaged over some axes of the grid; a run that lacks one lacks the mean."""
    grid = by_point(values, axes)
    mean: Array = np.mean(grid, axis=tuple(i for i, path in enumerate(axes) if path in over))
    return mean.reshape(-1, values.shape[-1])
