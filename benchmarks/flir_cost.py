"""Costs in images: update by the information pair and by the innovation form, lock-step Monte Carlo, simulated frames.

    python -m benchmarks.flir_cost [updates] [runs] [frames] [stages]

Without an argument, all. Stages are those of a video of 320 x 256 px, with as many BLAS threads as by default. Times are CPU
times, which other processes hardly affect. The innovation form factorises an N^2 x N^2 matrix: at 64 x 64 it holds 134 MB
and is timed once.
"""

import os
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

import vedette
from benchmarks.flir_stream import EXAMPLE, draw
from vedette import Frame, Gaussian, Scan
from vedette.filters import evaluate_frame
from vedette_flir.camera import Camera
from vedette_flir.matched_truth import FRAMES, record
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.patches import sample
from vedette_flir.preprocessors.spot_detector import SpotDetector
from vedette_flir.registration import Registration
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sources.images import look_through
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


def stages(count=300):
    """Print the CPU time a frame of each stage of a run through a drawn video of 320 x 256 px, over `count` frames."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.avi"
        draw(path, count)
        clip = look_through(path)
        spent = dict.fromkeys(("decode", "register", "detect", "sample", "update"), 0.0)
        turned, detector = Registration(), SpotDetector(sensors={"camera": BoxCentroid()})
        tracker = vedette.load(EXAMPLE).tracker
        prior = Gaussian(np.array([[250.5, 86.5, 0, 0, 26, 16]], dtype=float), np.diag([1.0, 1, 1e4, 1e4, 0, 0])[None])
        state = tracker.start(prior, 0.0)

        def timed(stage, action):
            before = process_time()
            made = action()
            spent[stage] += process_time() - before
            return made

        for k in range(count):
            pixels = timed("decode", lambda: clip.frame(k))  # noqa: B023
            scan = Scan.image(k / 30, "camera", Frame(pixels))
            timed("register", lambda: turned.take(pixels))  # noqa: B023
            timed("detect", lambda: detector.process({"camera": scan}))  # noqa: B023
            timed("sample", lambda: sample(pixels, np.array([160.0, 128.0]), 1.2, 60))  # noqa: B023
            state = timed("update", lambda: tracker.step(state, scan))  # noqa: B023
    for stage, took in spent.items():
        print(f"{stage:8} {1e3 * took / count:5.2f} ms of CPU a frame{', within the update' if stage == 'sample' else ''}")
    print(f"existence at the end {state.existence[0]:.3f}; threads by {os.environ.get('OPENBLAS_NUM_THREADS', 'default')}")


def main():
    """Run what is asked for."""
    known = {"updates": updates, "runs": runs, "frames": frames, "stages": stages}
    asked = sys.argv[1:] or list(known)
    if wrong := [name for name in asked if name not in known]:
        sys.exit(f"flir_cost: there are {', '.join(known)}; got {', '.join(wrong)}")
    for name in asked:
        known[name]()


if __name__ == "__main__":
    main()
