"""Files as others write them, with the truth apart: a ship's radar, latitudes and longitudes, shuffled milliseconds."""

from datetime import UTC, datetime, timedelta

import numpy as np
from attrs import frozen

from vedette import Space, Trajectory

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
LATITUDE, LONGITUDE = 59.43, 10.48
START = datetime(2026, 11, 22, 8, 30, tzinfo=UTC)


@frozen(eq=False)
class File:
    """The text of a file, its truth in east and north, and a config by the hand of one who knows how it was made."""

    name: str
    text: str
    truth: tuple[Trajectory, ...]
    by_hand: str


def paths(rng, count, times, sigma, size, speed):
    """Trajectories (count, s, 4) of nearly constant velocity."""
    dt = times[1] - times[0]
    F = np.kron([[1, dt], [0, 1]], np.eye(2))
    root = np.linalg.cholesky(sigma**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2)))
    x = np.concatenate([rng.uniform(-size, size, (count, 2)), rng.normal(0, speed, (count, 2))], axis=-1)
    found = [x]
    for _ in times[1:]:
        x = x @ F.T + rng.standard_normal((count, 4)) @ root.T
        found.append(x)
    return np.stack(found, axis=1)


def truth(times, states):
    return tuple(Trajectory(f"target {i}", STATE, times, own) for i, own in enumerate(states))


def ships_radar(seed=1):
    """Range and relative bearing from a turning ship: 2.5 s, 8 m, 0.6 deg, P_D 0.9, three false returns a scan."""
    rng, times = np.random.default_rng(seed), 2.5 * np.arange(140)
    states = paths(rng, 3, times, 0.05, 1500, 5)
    heading = 0.5 + 0.8 * np.sin(times / 60)
    own = np.cumsum(2.5 * 6 * np.stack([np.sin(heading), np.cos(heading)], axis=-1), axis=0)
    rows = []
    for k, time in enumerate(times):
        seen = [states[i, k, :2] - own[k] for i in range(3) if rng.random() < 0.9]
        polar = [(np.hypot(*p) + rng.normal(0, 8), np.arctan2(*p) + rng.normal(0, np.deg2rad(0.6))) for p in seen]
        polar += [(4000 * np.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)) for _ in range(rng.poisson(3))]
        east, north = own[k]
        for r, b in polar:
            bearing = np.rad2deg(b - heading[k]) % 360
            rows.append(f"{time},{r:.2f},{bearing:.3f},{east:.2f},{north:.2f},{np.rad2deg(heading[k]) % 360:.2f}")
    return File(
        "radar.csv",
        "\n".join(["Time (s),Range (m),Bearing (deg),OwnEast (m),OwnNorth (m),Heading (deg)", *rows]) + "\n",
        truth(times, states),
        """
[source]
kind = "csv"
path = "radar.csv"
frame = "x north, y east"
[source.detections]
time = "Time (s)"
columns = { range = "Range (m)", bearing = "Bearing (deg)" }
units = { bearing = "deg" }
[source.platform]
time = "Time (s)"
columns = { x = "OwnNorth (m)", y = "OwnEast (m)", heading = "Heading (deg)" }
units = { heading = "deg" }
[sensors.radar]
kind = "range_bearing"
sigma_range = 8.0
sigma_bearing = "0.6 deg"
max_range = 4000.0
detection_probability = 0.9
clutter_per_scan = 3.0
[estimator]
kind = "ekf"
motion = { kind = "constant_velocity", sigma_accel = 0.05 }
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
spread = { vx = 6.0, vy = 6.0 }
[lifecycle]
kind = "m_of_n"
""",
    )


def degrees(east, north):
    """Latitude and longitude of points near the origin, on WGS 84: the radii of curvature there, to second order."""
    a, e2, phi = 6378137.0, 0.0066943799901413165, np.deg2rad(LATITUDE)
    w = np.sqrt(1 - e2 * np.sin(phi) ** 2)
    meridian, normal = a * (1 - e2) / w**3, a / w
    latitude = phi + north / meridian - east**2 * np.tan(phi) / (2 * meridian * normal)
    longitude = east / (normal * np.cos(phi)) * (1 + north * np.tan(phi) / meridian)
    return np.rad2deg(latitude), LONGITUDE + np.rad2deg(longitude)


def reports(seed=2):
    """Latitude and longitude with stamps by ISO 8601: 1 s, 5 m, P_D 0.95, one false report a scan."""
    rng, times = np.random.default_rng(seed), np.arange(180.0)
    states = paths(rng, 3, times, 0.2, 800, 8)
    rows = []
    for k, time in enumerate(times):
        seen = [states[i, k, :2] + rng.normal(0, 5, 2) for i in range(3) if rng.random() < 0.95]
        seen += [rng.uniform(-2000, 2000, 2) for _ in range(rng.poisson(1))]
        stamp = (START + timedelta(seconds=time)).isoformat()
        for latitude, longitude in (degrees(*spot) for spot in seen):
            rows.append(f"{stamp},{latitude:.8f},{longitude:.8f},{rng.integers(1, 9)}")
    stamps = times + START.timestamp()
    return File(
        "reports.csv",
        "\n".join(["timestamp,lat,lon,quality", *rows]) + "\n",
        truth(stamps, states),
        """
[source]
kind = "csv"
path = "reports.csv"
origin = { latitude = 59.43, longitude = 10.48 }
[source.detections]
time = "timestamp"
columns = { latitude = "lat", longitude = "lon" }
[sensors.radio]
kind = "cartesian_position"
sigma = 5.0
detection_probability = 0.95
clutter_density = 6e-8
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.2 }
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
spread = { vx = 8.0, vy = 8.0 }
[lifecycle]
kind = "m_of_n"
""",
    )


def shuffled(seed=3):
    """Positions with times in ms, the rows in any order: 0.5 s, 3 m, P_D 0.9, two false returns a scan."""
    rng, times = np.random.default_rng(seed), 0.5 * np.arange(240)
    states = paths(rng, 2, times, 0.5, 400, 6)
    rows = []
    for k, time in enumerate(times):
        seen = [states[i, k, :2] + rng.normal(0, 3, 2) for i in range(2) if rng.random() < 0.9]
        seen += [rng.uniform(-1000, 1000, 2) for _ in range(rng.poisson(2))]
        rows += [f"{x:.2f};{y:.2f};{1000 * time:.0f}" for x, y in seen]
    rng.shuffle(rows)
    return File(
        "plots.csv",
        "\n".join(["x;y;t_ms", *rows]) + "\n",
        truth(times, states),
        """
[source]
kind = "csv"
path = "plots.csv"
delimiter = ";"
sort = true
[source.detections]
time = "t_ms"
columns = { x = "x", y = "y" }
units = { time = "ms" }
[sensors.lidar]
kind = "cartesian_position"
sigma = 3.0
detection_probability = 0.9
clutter_density = 5e-7
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.5 }
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
spread = { vx = 6.0, vy = 6.0 }
[lifecycle]
kind = "m_of_n"
""",
    )


FILES = (ships_radar, reports, shuffled)
