"""Cost of one update by a frame: the information pair against the innovation form over all pixels.

    python benchmarks/flir_cost.py

The innovation form factorises an N^2 x N^2 matrix: at 64 x 64 it would hold 134 MB and take minutes, so it stops at 24.
"""

from time import perf_counter

import numpy as np

from vedette import Frame, Gaussian
from vedette.gaussian import imaged
from vedette_flir.camera import Camera
from vedette_flir.motion.carrying import Carrying
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.spots import circular


def least(action, repeats):
    """The shortest time of `repeats`, in us."""
    times = []
    for _ in range(repeats):
        before = perf_counter()
        action()
        times.append(perf_counter() - before)
    return 1e6 * min(times)


def main():
    """One line for each window."""
    motion = Carrying(JitteredAcceleration(), {"amplitude": "count", "spread": "px", "background": "count"})
    mean = np.array([[40.2, 39.7, 0, 0, 0, 0, 0.1, -0.1, 10.0, 2.0, 0.0]])
    cov = np.diag([0.5, 0.5, 9, 9, 9, 9, 0.04, 0.04, 0, 0, 0])[None]
    frame = Frame(np.random.default_rng(1).standard_normal((80, 80)))
    for window in (8, 24, 64):
        sensor = GaussianSpot(across=("x", "jx"), down=("y", "jy"), camera=Camera(window=window))
        where = motion.state.locate(sensor.looks_at)
        whole = least(lambda: imaged(Gaussian(mean, cov), motion.state, sensor, frame, 0.99), 50)  # noqa: B023
        cut = sensor.camera.cut(frame, sensor.measure(mean[:, where]))
        image, slopes, _ = circular(*cut.offsets(sensor.measure(mean[:, where])), mean[..., 9])
        pair = least(lambda: sensor.camera.information(cut, image, slopes, mean[..., 10]), 50)  # noqa: B023
        C = np.zeros((2, 11))
        C[0, [0, 6]] = C[1, [1, 7]] = 1.0
        H = slopes.reshape(2, -1).T @ C

        def innovation(H=H, size=window**2):
            S = H @ cov[0] @ H.T + np.eye(size)
            return np.linalg.solve(S, H @ cov[0])

        full = f"{least(innovation, 3):9.0f} us" if window <= 24 else "not tried"
        print(f"{window:2} x {window:2}: update {whole:6.0f} us, its pair {pair:6.0f} us; innovation form's gain {full}")


if __name__ == "__main__":
    main()
