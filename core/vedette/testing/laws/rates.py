"""Laws of sensors that know of time: how fast something changes that they measure too, and by how much they are late."""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array
from vedette.testing.comparisons import closed_if, demand, derivative, same
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks, regular, slopes
from vedette.testing.states import speeds_of

MOVING = {"x": "vx", "y": "vy", "z": "vz"}
STEP = 1e-2
"""Time of a step, in s."""


def rates_are_derivatives(sensor: Sensor, drawn: Looks) -> None:
    """What it measures as NAME_rate is how fast its NAME changes as the target moves on."""
    measured, names = sensor.measurement, sensor.observes.names
    units = {axis.name: axis.unit for axis in measured.axes}
    rates = {f"{name}_rate": name for name, unit in units.items() if units.get(f"{name}_rate") == f"{unit}/s"}
    closed_if(not rates, "it measures nothing together with its rate")
    speeds = {names.index(place): names.index(speed) for place, speed in MOVING.items() if {place, speed} <= {*names}}
    closed_if(not speeds, "it observes no velocity")
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
                otherwise = f"measure: {rate} must be how fast {name} grows, {slope[i]:.6g} {units[rate]}, got {seen[j]:.6g}"
                demand(off <= 1e-2 * (abs(slope[i]) + 1e-2) + 4 * doubt[i], otherwise)


def a_lag_goes_along_the_velocity(sensor: Sensor, drawn: Looks) -> None:
    """If it observes a time beside velocities: by that time all that is seen of a target is late, or early."""
    axes, names = sensor.observes.axes, sensor.observes.names
    times = [i for i, axis in enumerate(axes) if axis.unit == "s"]
    pairs = speeds_of(sensor.observes)
    closed_if(not times or not pairs, "it observes no time beside velocities")
    x = regular(sensor, drawn.x)
    H = slopes(sensor, x)
    way = np.sum([H[..., i] * x[:, None, v] for i, v in pairs], axis=0)
    scale = np.max(np.abs(way), axis=-1, keepdims=True) + 1e-3
    for i in times:
        sign = -1.0 if np.sum(H[..., i] * way) < 0 else 1.0
        same(f"measure: slope to {names[i]}", H[..., i], sign * way, 1e-3, scale)


LAWS = (Law(rates_are_derivatives), Law(a_lag_goes_along_the_velocity))
