"""Scenes with sensors whose offsets all tracks share, and the joint filter of all targets and offsets."""

import numpy as np

import vedette
from vedette import Detections, Gaussian, Scan

RADAR = {
    "kind": "range_bearing", "sigma_range": 8.0, "sigma_bearing": "0.3 deg", "detection_probability": 0.9, "max_range": 6000,
    "clutter_per_scan": 3, "clutter_uniform_over": "range",
}  # fmt: skip
AIS = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-12}
CLUTTER = {"range": {"low": 10, "high": 6000}}
OFF = {"bearing_offset": float(np.radians(1.5)), "x_offset": 24.0, "y_offset": -32.0, "lag": 0.5}
"""What the second radar is off by, 40 m in all."""
PRIOR = {"bearing_offset": 0.03, "x_offset": 50.0, "y_offset": 50.0, "lag": 1.0}
UNITS = {"bearing_offset": "rad", "x_offset": "m", "y_offset": "m", "lag": "s"}


def constant(names):
    """Motions of offsets that stay as they are."""
    return [{"kind": "random_walk", "axes": [name], "unit": UNITS[name], "sigma": 1e-12} for name in names]


def ships():
    """Six ships on straight paths."""
    rng, found = np.random.default_rng(5), {}
    for i in range(6):
        found[f"ship{i}"] = {
            "start": rng.uniform([-500, -2500], [3500, 2500]).tolist(), "course": float(rng.uniform(0, 6.28)),
            "speed": float(rng.uniform(4, 12)), "legs": [{"do": "straight", "seconds": 300}],
        }  # fmt: skip
    return found


def config(sensors, looks, drawn, offsets, names, associator="jpda", starters=()):
    """A config over the ships, with `names` as axes of offsets and `offsets` shared."""
    motion = {"kind": "product", "models": [{"kind": "constant_velocity", "sigma_accel": 0.05}, *constant(names)]}
    return {
        "source": {"kind": "simulation", "duration": 240, "looks": looks, "ships": ships(), "sensors": drawn},
        "sensors": sensors,
        "estimator": {"kind": "ekf", "motion": motion},
        "associator": {"kind": associator},
        "gate": {"probability": 0.999},
        "birth": {
            "kind": "from_returns", "sensors": list(starters),
            "spread": {"vx": 8.0, "vy": 8.0} | {name: PRIOR[name] for name in names},
        },
        "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.999},
        "judge": {"cover_radius": 60, "gospa_cutoff": 60},
        "registration": {"offsets": offsets},
    }  # fmt: skip


def experiment(offsets, *, ais, associator="jpda"):
    """A radar with a bearing offset, and AIS if `ais`."""
    biased = {"kind": "biased", "of": RADAR, "add": {"bearing": "bearing_offset"}, "spread": {"bearing_offset": 0.05}}
    sensors = {"radar": biased} | ({"ais": AIS} if ais else {})
    looks = {"radar": {"interval": 2.5, "clutter": CLUTTER}}
    drawn = {"radar": {"kind": "displaced", "of": RADAR, "add": {"bearing": float(np.radians(3.0))}}}
    return vedette.load(config(sensors, looks, drawn, offsets, ["bearing_offset"], associator))


def ais_of_half(scene, *, seed, bearing):
    """Scans of the radar, turned by a bearing, and reports with identity of every second ship."""
    assert bearing == scene.source.sensors["radar"].add["bearing"]
    recording = scene.source.open(scene.tracker.sensors, np.random.default_rng(seed))
    scans, rng = list(recording.scans), np.random.default_rng(seed + 100)
    for time in np.arange(0.7, 240, 5.0).tolist():
        seen = [(path.at(time)[:2], 100 + i) for i, path in enumerate(recording.truth) if i % 2 == 0 and rng.random() < 0.9]
        if seen:
            z = np.array([place for place, _ in seen]) + 5.0 * rng.standard_normal((len(seen), 2))
            codes = np.array([code for _, code in seen])
            scans.append(Scan(time, "ais", Detections(z, np.ones(len(z), dtype=bool), identity=codes)))
    return sorted(scans, key=lambda scan: scan.time)


def two_radars(shared):
    """Two radars; the second is misplaced and its offsets are estimated, or it is registered."""
    other = {**RADAR, "x": 3000.0, "y": -500.0}
    add, offset = {"bearing": "bearing_offset"}, {"x": "x_offset", "y": "y_offset"}
    biased = {"kind": "biased", "of": other, "add": add, "offset": offset, "lag": "lag"}
    wrong = {
        "kind": "displaced", "of": other, "add": {"bearing": OFF["bearing_offset"]},
        "offset": {"x": OFF["x_offset"], "y": OFF["y_offset"]}, "lag": OFF["lag"],
    }  # fmt: skip
    looks = {"a": {"interval": 2.5, "clutter": CLUTTER}, "b": {"interval": 3.0, "clutter": CLUTTER}}
    names = list(OFF) if shared else []
    sensors = {"a": RADAR, "b": biased if shared else other}
    return vedette.load(
        config(sensors, looks, {"b": wrong} if shared else {}, PRIOR if shared else {}, names, starters=["a"])
    )


def two_sensors():
    """A linear tracker of given targets far apart, whose sensor "off" is displaced along x and y; its prior (3, 6)."""
    motion = {"kind": "constant_velocity", "sigma_accel": 0.5}
    still = {"kind": "random_walk", "axes": ["dx", "dy"], "unit": "m", "sigma": 1e-12}
    right = {"kind": "cartesian_position", "sigma": 1.0}
    off = {"kind": "biased", "of": right, "offset": {"x": "dx", "y": "dy"}}
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "product", "models": [motion, still]}},
            "sensors": {"right": right, "off": off},
            "associator": {"kind": "gnn"},
            "gate": "off",
            "lifecycle": {"kind": "single_target"},
            "registration": {"offsets": {"dx": 10.0, "dy": 10.0}},
        }
    )
    mean = np.array([[0.0, 0, 1, 0, 0, 0], [1000, 0, 0, 1, 0, 0], [0, 1000, -1, 1, 0, 0]])
    cov = np.tile(np.diag([20.0, 20, 9, 9, 100, 100]), (3, 1, 1))
    return tracker, Gaussian(mean, cov)


def joint_filter(tracker, prior, scans):
    """The joint Gaussian (14,) of three targets and two offsets, each return being that of the nearest target."""
    n = 4
    mean = np.concatenate([prior.mean[:, :n].ravel(), np.zeros(2)])
    cov = np.zeros((14, 14))
    for i in range(3):
        cov[n * i : n * i + n, n * i : n * i + n] = prior.cov[i, :n, :n]
    cov[12:, 12:] = 100.0 * np.eye(2)
    motion, time = tracker.estimator.motion.models[0], 0.0
    for scan in scans:
        F, Q = np.eye(14), np.zeros((14, 14))
        dt, time = scan.time - time, scan.time
        for i in range(3):
            own = slice(n * i, n * i + n)
            F[own, own], Q[own, own] = motion.jacobian(mean[own], dt), motion.noise(mean[own], dt)
        mean, cov = F @ mean, F @ cov @ F.T + Q
        for z in scan.detections.z:
            i = int(np.argmin([np.linalg.norm(z - mean[n * j : n * j + 2]) for j in range(3)]))
            H = np.zeros((2, 14))
            H[:, n * i : n * i + 2] = np.eye(2)
            if scan.sensor == "off":
                H[:, 12:] = np.eye(2)
            S = H @ cov @ H.T + np.eye(2)
            gain = cov @ H.T @ np.linalg.inv(S)
            mean, cov = mean + gain @ (z - H @ mean), cov - gain @ S @ gain.T
    return Gaussian(mean, cov)
