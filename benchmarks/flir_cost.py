"""Costs in images: update by the information pair and by the innovation form, lock-step Monte Carlo, simulated frames.

    python benchmarks/flir_cost.py [updates] [runs] [frames]

Without an argument, all three. Times are CPU times, which other processes hardly affect. The innovation form
factorises an N^2 x N^2 matrix: at 64 x 64 it holds 134 MB and is timed once.
"""

import sys
from time import process_time

import numpy as np

from vedette import Frame, Gaussian
from vedette.filters import evaluate_frame
from vedette_flir.camera import Camera
from vedette_flir.matched_truth import FRAMES, record
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.spots import circular
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene


def least(action, repeats):
    """Return the shortest time of `repeats`, in us."""
    times = []
    for _ in range(repeats):
        before = process_time()
        action()
        times.append(process_time() - before)
    return 1e6 * min(times)


def updates():
    """Print one line for each window."""
    motion = Carrying(JitteredAcceleration(), {"amplitude": "count", "spread": "px", "background": "count"})
    mean = np.array([[40.2, 39.7, 0, 0, 0, 0, 0.1, -0.1, 10.0, 2.0, 0.0]])
    cov = np.diag([0.5, 0.5, 9, 9, 9, 9, 0.04, 0.04, 0, 0, 0])[None]
    frame = Frame(np.random.default_rng(1).standard_normal((80, 80)))
    for window in (8, 24, 64):
        sensor = GaussianSpot(across=("x", "jx"), down=("y", "jy"), camera=Camera(window=window))
        where = motion.state.locate(sensor.observes)
        whole = least(lambda: evaluate_frame(Gaussian(mean, cov), motion.state, sensor, frame, 0.99), 50)  # noqa: B023
        cut = sensor.camera.cut(frame, sensor.measure(mean[:, where]))
        image, slopes, _ = circular(*cut.offsets(sensor.measure(mean[:, where])), mean[..., 9])
        pair = least(lambda: sensor.camera.information(cut, image, slopes, mean[..., 10]), 50)  # noqa: B023
        C = np.zeros((2, 11))
        C[0, [0, 6]] = C[1, [1, 7]] = 1.0
        H = slopes.reshape(2, -1).T @ C

        def innovation(H=H, size=window**2):
            S = H @ cov[0] @ H.T + np.eye(size)
            return np.linalg.solve(S, H @ cov[0])

        full = least(innovation, 3 if window <= 24 else 1)
        print(f"{window:2} x {window:2}: update {whole:4.0f} us, its pair {pair:4.0f} us; innovation form {full:9.0f} us")


def runs():
    """Print the time per run-frame of the paper's filter, all runs' images in one array, and the share of the truth."""
    for count in (1, 10, 100, 1000):
        before = process_time()
        record(3, 2.0, 10.0, 0.2, count, np.random.default_rng(1))
        took = process_time() - before
        print(f"{count:4} runs in lock-step: {1e6 * took / count / FRAMES:7.1f} us a run-frame, frames drawn and 3 passes")


def frames():
    """Print frames a second of the simulated scene at 64 x 64, simple and with everything on."""
    target = HotTarget(
        ImageVelocity(),
        (HotSpot(40.0, 1.5, x=2.0), HotSpot(30.0, 1.0, x=-2.0)),
        {"x": (32.0, 0.0), "y": (32.0, 0.0), "vx": (5.0, 0.0), "vy": (0.0, 0.0)},
        turn_rate=0.5,
    )
    plain = {"targets": {"one": target}, "frames": 3000}
    full = plain | {"targets": {"one": target, "two": target}, "clutter": 5.0, "drift": (3.0, 1.0), "dead": 0.001}
    for name, given in (("one target, white noise", plain), ("two targets, background, drift, dead pixels", full)):
        scene = InfraredScene(**given)
        took = least(lambda: scene.open({"camera": GaussianSpot()}, np.random.default_rng(1)), 3) * 1e-6  # noqa: B023
        print(f"64 x 64, {name}: {scene.frames / took:7.0f} frames/s")


def main():
    """Run what is asked for."""
    known = {"updates": updates, "runs": runs, "frames": frames}
    asked = sys.argv[1:] or list(known)
    if wrong := [name for name in asked if name not in known]:
        sys.exit(f"flir_cost: there are {', '.join(known)}; got {', '.join(wrong)}")
    for name in asked:
        known[name]()


if __name__ == "__main__":
    main()
