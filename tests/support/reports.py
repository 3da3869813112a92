"""Named positions of objects that move smoothly, turn and stop: drawn, with errors that are known."""

import numpy as np
import pandas as pd

METRES = 111_194.9
"""In a degree of latitude, to 0.5 %."""


def drawn_paths(seed=0, objects=8, rows=120, sigma=5.0, interval=10.0):
    """Return times, true positions and velocities, and measured positions in m, each (objects, rows, ...)."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1.5, (objects, rows)) * interval, axis=1)
    dt = np.diff(times, prepend=0.0, axis=1)
    turn = np.where(np.arange(rows) // 30 % 2 == 1, rng.normal(0.0, 0.01, (objects, 1)), 0.0)
    course = rng.uniform(0, 2 * np.pi, (objects, 1)) + np.cumsum(turn * dt, axis=1)
    speed = np.where(np.arange(rows) // 40 % 3 == 2, 0.0, rng.uniform(3.0, 12.0, (objects, 1)))
    velocities = speed[..., None] * np.stack([np.sin(course), np.cos(course)], axis=-1)
    spots = np.cumsum(velocities * dt[..., None], axis=1) + rng.uniform(-5e3, 5e3, (objects, 1, 2))
    return times, spots, velocities, spots + rng.normal(0, sigma, spots.shape)


def reports_frame(seed=0, **how):
    """Return reports as a table in the order of time, x east and y north in m, with the true positions aside."""
    times, spots, _, measured = drawn_paths(seed, **how)
    names = np.repeat([f"ship {i}" for i in range(len(times))], times.shape[1])
    columns = {"time": times.ravel(), "id": names, "x": measured[..., 0].ravel(), "y": measured[..., 1].ravel()}
    order = np.argsort(columns["time"], kind="stable")
    true = spots.reshape(-1, 2)[order]
    return pd.DataFrame(columns).iloc[order].reset_index(drop=True), true
