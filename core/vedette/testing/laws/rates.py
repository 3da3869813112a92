"""The law of sensors that measure how fast something changes that they measure too."""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array
from vedette.testing.comparisons import Closed, demand, derivative
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks, regular

MOVING = {"x": "vx", "y": "vy", "z": "vz"}
STEP = 1e-2
"""Time of a step, in s."""


def rates_are_derivatives(sensor: Sensor, drawn: Looks) -> None:
    """What it measures as NAME_rate is how fast its NAME changes as the target moves on."""
    measured, names = sensor.measurement, sensor.observes.names
    units = {axis.name: axis.unit for axis in measured.axes}
    rates = {f"{name}_rate": name for name, unit in units.items() if units.get(f"{name}_rate") == f"{unit}/s"}
    if not rates:
        raise Closed("it measures nothing together with its rate")
    speeds = {names.index(place): names.index(speed) for place, speed in MOVING.items() if {place, speed} <= {*names}}
    if not speeds:
        raise Closed("it observes no velocity")
    used = [*speeds, *speeds.values()]
    x = np.where(np.isin(np.arange(len(names)), used), regular(sensor, drawn.x), 0.0)  # no biases, nor anything else
    for state in x:
        velocity = np.zeros(len(names))
        velocity[[*speeds]] = state[[*speeds.values()]]

        def later(t: Array, state: Array = state, velocity: Array = velocity) -> Array:
            return sensor.measure(state + t * velocity)

        slope, doubt = (each[:, 0] for each in derivative(later, np.zeros(1), measured.difference, np.array([STEP])))
        seen = sensor.measure(state)
        for rate, name in rates.items():
            i, j = measured.names.index(name), measured.names.index(rate)
            wanted = seen.copy()
            wanted[j] = slope[i]
            off = abs(measured.difference(seen, wanted)[j])
            if np.isfinite(slope[i]) and doubt[i] <= 1e-3 * (abs(slope[i]) + 1.0):
                demand(
                    off <= 1e-2 * (abs(slope[i]) + 1e-2) + 4 * doubt[i],
                    f"measure: {rate} must be how fast {name} grows, {slope[i]:.6g} {units[rate]}, got {seen[j]:.6g}",
                )


LAWS = (Law(rates_are_derivatives),)
