"""Scenes for wrong configs, the advice that commands print of them as a reader would apply it, and figures held back."""

from __future__ import annotations

import copy
import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from vedette import Detections, Scan, Space, Trajectory
from vedette.types import Recording
from vedette_files import write_recording
from vedette_tools.tuning.evaluation import evaluate, open_data

ACCEL, SIGMA, DETECTED, CLUTTER, HALF = 1.0, 10.0, 0.9, 4.0, 1500.0
"""Of the targets and of the sensor: m/s^1.5, m, a probability, false returns a scan, m from the middle to the sides."""

STEP = 1.5
"""Where only a direction is advised, a standard deviation is changed by this factor."""

CONFIG: dict[str, Any] = {
    "title": "Four targets in clutter",
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": ACCEL}},
    "sensors": {
        "radar": {
            "kind": "cartesian_position", "sigma": SIGMA, "detection_probability": DETECTED,
            "clutter_density": CLUTTER / (2 * HALF) ** 2,
        }
    },
    "associator": {"kind": "jpda"},
    "gate": {"probability": 0.999},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
    "judge": {"cover_radius": 50.0, "gospa_cutoff": 50.0},
}  # fmt: skip
POLAR: dict[str, Any] = copy.deepcopy(CONFIG) | {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": ACCEL}},
    "sensors": {
        "radar": {
            "kind": "range_bearing", "sigma_range": SIGMA, "sigma_bearing": 0.005, "max_range": 2500.0,
            "detection_probability": DETECTED, "clutter_per_scan": CLUTTER,
        }
    },
}  # fmt: skip


def recorded(
    path: Path, config: Mapping[str, Any], seed: int, *, detected: float = DETECTED, clutter: float = CLUTTER,
    alike: float = 0.0, turned: float = 0.0, beside: float = 0.0, scans: int = 100,
) -> dict[str, Any]:  # fmt: skip
    """Write the returns of four targets, drawn from the models of `CONFIG` but for what is stated; return the config on it.

    alike: the correlation of an error with that of the scan before; turned: the angle in rad by which bearings are off;
    beside: how far the second target goes beside the first one, in m, and the fourth beside the third; 0: on its own.
    """
    rng, polar = np.random.default_rng(seed), config["sensors"]["radar"]["kind"] == "range_bearing"
    start = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * rng.uniform(300.0, 700.0, (4, 2))
    x, v, error = start, rng.uniform(-6.0, 6.0, (4, 2)), rng.normal(size=(4, 2))
    states, given = [], []
    for k in range(scans):
        if k:
            push, shake = rng.normal(0.0, ACCEL, (2, 4, 2))
            x, v = x + v + push / 2 + shake / np.sqrt(12.0), v + push
            if beside:
                x[1::2], v[1::2] = x[::2] + [0.0, beside], v[::2]
            error = alike * error + np.sqrt(1.0 - alike**2) * rng.normal(size=(4, 2))
        states.append(np.hstack([x, v]))
        false = rng.uniform(-HALF, HALF, (rng.poisson(clutter), 2))
        seen = rng.random(4) < detected
        if polar:
            z = np.stack([np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0]) + turned], axis=1) + error * [SIGMA, 0.005]
            false = np.stack([rng.uniform(0.0, 2500.0, len(false)), rng.uniform(-np.pi, np.pi, len(false))], axis=1)
        else:
            z = x + SIGMA * error
        given.append(Scan(float(k), "radar", Detections.of(np.concatenate([z[seen], false]), 2)))
    space, times = Space.of(x="m", y="m", vx="m/s", vy="m/s"), np.arange(float(scans))
    truth = tuple(Trajectory(f"ship {i}", space, times, np.array(states)[:, i]) for i in range(4))
    measured = vedette.load(dict(config)).tracker.sensors["radar"].measurement
    write_recording(path, Recording(given, truth), {"radar": measured})
    return {**copy.deepcopy(dict(config)), "source": {"kind": "jsonl", "path": str(path)}}


def held_back(config: Mapping[str, Any], path: str) -> tuple[float, float, float]:
    """Return the log-likelihood, the mean GOSPA in m and the coverage of a config on another recording."""
    experiment = vedette.load({**config, "source": {"kind": "jsonl", "path": path}})
    evaluated = evaluate(open_data(experiment, 0.5), [], [], whole=True)
    score = experiment.run().score()
    return (-np.inf if evaluated is None else float(np.sum(evaluated.loglik))), score.gospa_m, score.coverage


def advised(config: Mapping[str, Any], said: str) -> dict[str, Any] | None:
    """Return the config as what a command printed says that it should be, None if it says nothing."""
    new: dict[str, Any] = copy.deepcopy(dict(config))
    motion, radar = new["estimator"]["motion"], new["sensors"]["radar"]
    noises = [key for key in radar if key.startswith("sigma")]
    if told := re.search(r"set (kind = .*?add = \{ (\w+) = (-?[\d.]+) \})", said):
        new["sensors"]["radar"] = {"kind": "displaced", "add": {told[2]: float(told[3])}, "of": radar}
        return new
    if (proportioned := _proportioned(new, " ".join(said.split()))) is not None:
        return proportioned
    if proposals := _proposed(said):
        return _correlated(new, proposals)
    if told := re.search(r"states ([\d.e+-]+) false returns a scan[^,]*, and ([\d.e+-]+)[^.]*? come", said):
        radar["clutter_density"] *= max(float(told[2]) - 4 * DETECTED * ("beside" in said), 0.1) / float(told[1])
        return new
    hints = re.findall(r"likely (.*)", said)
    if not hints:
        return None
    hint = Counter(re.sub(r"[\d.]+ times", "times", each) for each in hints).most_common(1)[0][0]
    if "P_D is" in hint:
        rows = [
            float(share)
            for share in re.findall(r"^ship .* (\d\.\d+) +[\d.]+ +[+-][\d.]+ +(?:-|[\d.]+ \w+)$", said, re.MULTILINE)
        ]
        radar["detection_probability"] = min(radar["detection_probability"] * float(np.mean(rows)), 0.99)
    elif alike := re.match(r"R, or R and Q alike, times too (small|large)", hint):
        sizes = re.findall(rf"likely R, or R and Q alike, ([\d.]+) times too {alike[1]}", said)
        factor = np.sqrt(np.median(np.array(sizes, dtype=float))) ** (1 if alike[1] == "small" else -1)
        motion["sigma_accel"] *= factor
        radar |= {key: radar[key] * factor for key in noises}
    elif hint.startswith("Q is"):
        motion["sigma_accel"] *= STEP if "Q is too small" in hint else 1 / STEP
    else:
        radar |= {key: radar[key] * (STEP if "R is too small" in hint else 1 / STEP) for key in noises}
    return new


PROPORTIONS: dict[str, Callable[..., dict[str, Any]]] = {
    r"true objects (?:go )?at (\S+) m/s.*?half the largest speed": lambda speed: {
        "birth.spread": {"vx": speed / 2, "vy": speed / 2}
    },
    r"process noise moves x by (\S+) standard.*?about 1, or less": lambda times: {
        "*estimator.motion.sigma_accel": 1.0 / times
    },
    r"process noise moves a target by (\S+) standard.*?at least 1, reached within some 10 to 100": lambda times: {
        "*estimator.motion.sigma_accel": (300 / 30) ** 1.5 / times
    },
    r"states no clutter.*?however rough": lambda: {"sensors.radar.clutter_density": 1.0 / (2 * HALF) ** 2},
    r"rarer than a miss. Usual: 0.5 to 0.99": lambda: {"sensors.radar.detection_probability": 0.75},
    r"a detection probability of 0.99 at most": lambda: {"sensors.radar.detection_probability": 0.99},
    r"a lifetime of (50) scans or more": lambda scans: {"lifecycle.lifetime": scans},
    r"a track ends almost at once. Usual: (5) scans": lambda scans: {"lifecycle.max_without_detection": scans},
    r"own returns out.*?Usual: (0.99) to 0.9999": lambda part: {"gate.probability": part},
    r"births with more existence, a smaller spread of velocities": lambda: {
        "birth.initial": 0.3, "*birth.spread.vx": 0.1, "*birth.spread.vy": 0.1
    },
    r"rises to .*? at most; try a lower threshold": lambda: {"lifecycle.confirm": 0.9},
    r"if yours are farther apart, take 'jpda_star'": lambda: {"associator": {"kind": "jpda_star"}},
}  # fmt: skip
"""What is told, with the number that it says, and what a reader would set by it; * factors."""


def _proportioned(new: dict[str, Any], said: str) -> dict[str, Any] | None:
    """Return the config with what is out of proportion set as it is said to be usual, None if nothing is."""
    told = [(found, change) for form, change in PROPORTIONS.items() if (found := re.search(form, said))]
    for found, change in told:
        for path, value in change(*map(float, found.groups())).items():
            *tables, key = path.lstrip("*").split(".")
            table = new
            for name in tables:
                table = table[name]
            table[key] = table[key] * value if path.startswith("*") else value
    return new if told else None


def _proposed(said: str) -> list[dict[str, Any]]:
    """Return the correlated errors that are proposed: the axis, the name of its state, its white part, size and time."""
    form = (
        r"propose: sensors\.radar, with an own error of (?P<white>\S+) m along (?P<axis>\w+)[\s\S]*?"
        r'axes = \["(?P<state>\w+)"\], sigma = (?P<size>\S+), tau = (?P<tau>\S+)'
    )
    return [one.groupdict() for one in re.finditer(form, said)]


def _correlated(new: dict[str, Any], proposals: list[dict[str, Any]]) -> dict[str, Any]:
    radar, motion = new["sensors"]["radar"], new["estimator"]["motion"]
    radar["sigma"] = float(np.mean([float(one["white"]) for one in proposals]))
    new["sensors"]["radar"] = {
        "kind": "biased", "add": {one["axis"]: one["state"] for one in proposals},
        "spread": {one["state"]: float(one["size"]) for one in proposals}, "of": radar,
    }  # fmt: skip
    drifts = [
        {"kind": "gauss_markov", "axes": [one["state"]], "sigma": float(one["size"]), "tau": float(one["tau"].rstrip(","))}
        for one in proposals
    ]
    new["estimator"]["motion"] = {"kind": "product", "models": [motion, *drifts]}
    return new
