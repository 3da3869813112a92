"""Runs and results made for reports."""

import numpy as np
from attrs import evolve

import vedette
from support.ships import radar_and_beacon
from vedette import Recording, Result, Scan, Space, Track, Trajectory
from vedette.types import Detections
from vedette_report.drawing.brought import drawing

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


def config(**changes):
    modes = [{"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": sigma}} for sigma in (0.1, 1.0)]
    ships = {
        "near": {"start": [100.0, 200.0], "speed": 8.0},
        "late": {"start": [-300.0, 0.0], "speed": 5.0, "course": 2.0, "appears": 31.0},
    }
    radar = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "x": 40.0, "y": -30.0}
    own = {
        "title": "A test",
        "estimator": {"kind": "imm", "modes": modes, "transition": [[0.9, 0.1], [0.1, 0.9]]},
        "birth": {"kind": "from_returns", "spread": {"vx": 8.0, "vy": 8.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
    looks = {"radar": {"interval": 2.0}, "beacon": {"interval": 5.0, "first": 1.0}}
    return radar_and_beacon(ships, 60.0, radar, looks, **(own | changes))


def run(**changes):
    experiment = vedette.load(config(**changes))
    return experiment, experiment.run()


def track(times, mean, cov, number=0, nis=1.0, hit=1.0, space=PLANE, modes=None):
    """A track that is confirmed all the time."""
    count = len(times)
    each = np.ones(count)
    return Track(
        id=number,
        space=space,
        times=np.asarray(times, dtype=float),
        mean=np.asarray(mean, dtype=float),
        cov=np.broadcast_to(cov, (count, len(space), len(space))).astype(float),
        confirmed=each.astype(bool),
        existence=each,
        mode_prob=modes,
        weights=(np.array([1.0 - hit, hit]),) * count,
        nis=nis * each,
        hit=hit * each,
    )


def result(tracks=(), truth=(), times=(), returns_per_scan=1, refused=(), notes=None):
    """A result whose scans hold returns at the origin."""
    detections = Detections.of(np.zeros((returns_per_scan, 2)), 2)
    scans = tuple(Scan(float(time), "beacon", detections) for time in times)
    recording = Recording(scans, tuple(truth), (), notes or {})
    return Result(tuple(tracks), recording, scans, tuple(refused), len(tracks), 0.0, False)


def still(name, times, position):
    return Trajectory(name, PLANE, np.asarray(times, dtype=float), np.tile([*position, 0.0, 0.0], (len(times), 1)))


def drawn_lines(axes):
    return [np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float) for line in axes.lines]


def words(made):
    axes_texts = [text.get_text() for axes in made.axes for text in axes.texts]
    return axes_texts + [text.get_text() for text in made.texts]


def write_pictures(folder, experiment, done):
    """Write the pictures of a result into a folder, whatever its experiment is; return their names."""
    return drawing().of_run(evolve(done, experiment=experiment), folder)
