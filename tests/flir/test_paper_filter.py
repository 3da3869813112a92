"""The paper's filter of eight states on `examples/flir.toml`, beside an iterated filter that is written here."""

import math

import numpy as np
import pytest
from attrs import evolve
from scipy.linalg import expm

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Scan
from vedette.config.files import read_file

SPREAD = {"x": 0.5, "y": 0.5, "vx": 20.0, "vy": 20.0, "ax": 200.0, "ay": 200.0, "jx": 0.2, "jy": 0.2}
SIGMA_JITTER, TAU_JITTER, RATE, AMPLITUDE, WIDTH = 0.2, 0.076, 30.0, 10.0, 2.0
BLANK = slice(120, 150)


def experiment(density):
    config = read_file(EXAMPLES / "flir.toml")
    config.pop("gate", None)  # the default one
    config["estimator"]["motion"]["motion"] = {"kind": "jittered_acceleration", "jerk_density": density}
    config["birth"]["spread"] = SPREAD
    return vedette.load(config)


def motion(density):
    """F and Q of x, vx, ax, jx by Van Loan's matrix exponential, for both axes: in the order x, y, vx, vy, ..."""
    A = np.diag([1.0, 1.0, 0.0], 1)
    A[3, 3] = -1.0 / TAU_JITTER
    G = np.diag([0.0, 0.0, density, 2.0 * SIGMA_JITTER**2 / TAU_JITTER])
    whole = expm(np.block([[-A, G], [np.zeros((4, 4)), A.T]]) / RATE)
    F = whole[4:, 4:].T
    return np.kron(F, np.eye(2)), np.kron(F @ whole[:4, 4:], np.eye(2))


def spot(at, first):
    """The mean of 10 e^(-r^2 / 2 w^2) over 8 x 8 pixels from `first`, and its derivatives to where it is: (64,), (64, 2)."""
    edges = np.arange(9) - 0.5 + (first - at)[:, None]
    value = WIDTH * math.sqrt(math.pi / 2) * np.diff([[math.erf(e / WIDTH / math.sqrt(2)) for e in row] for row in edges])
    slope = -np.diff(np.exp(-0.5 * (edges / WIDTH) ** 2))
    image = np.outer(value[1], value[0])
    return AMPLITUDE * image.ravel(), AMPLITUDE * np.stack(
        [np.outer(value[1], slope[0]).ravel(), np.outer(slope[1], value[0]).ravel()], axis=1
    )


def plain(frames, corner, density, start):
    """Means (s, 8) and covariances (s, 8, 8) of an extended Kalman filter with three passes over each frame."""
    F, Q = motion(density)
    C = np.kron([1.0, 0.0, 0.0, 1.0], np.eye(2))
    x, P = np.array(start), np.diag(np.square(list(SPREAD.values())))
    means, covs = [], []
    for k, pixels in enumerate(frames):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        first = np.rint(C @ x - corner - 3.5).astype(int)
        column, row = first
        if min(first) < 0 or max(first) + 8 > len(pixels):
            break  # the window leaves the image: lost, as truth stays away from its sides
        z, at = pixels[row : row + 8, column : column + 8].ravel(), x
        for _ in range(3):
            h, D = spot(C @ at, first + corner)
            H = D @ C
            K = np.linalg.solve(H @ P @ H.T + np.eye(64), H @ P).T
            at = x + K @ (z - h - H @ (x - at))
        keep = np.eye(8) - K @ H
        x, P = at, keep @ P @ keep.T + K @ K.T  # Joseph's form: the short one loses its digits within 50 frames
        means.append(x)
        covs.append(P)
    return np.array(means), np.array(covs)


def figures(means, covs, truth):
    """Root mean square of the position's error, mean NEES over its 2 axes, and whether it was ever off by 4 px."""
    if len(means) < len(truth):
        return np.inf, np.inf, True
    error = means[:, :2] - truth[:, :2]
    apparent = error + means[:, 6:8] - truth[:, 2:4]
    squares = np.einsum("si,sij,sj->s", error, np.linalg.inv(covs[:, :2, :2]), error) / 2
    return np.sqrt(np.mean(error**2)), np.mean(squares), bool(np.any(np.hypot(*apparent.T) > 4.0))


def runs_of(pytestconfig, few):
    return 60 if pytestconfig.getoption("vedette_profile") == "nightly" else few


@pytest.mark.parametrize("density", [1e5, 1e6, 1e7])
def test_the_default_gate_keeps_what_a_plain_iterated_filter_keeps(density, pytestconfig):
    built = experiment(density)
    ours, theirs = [], []
    for seed in range(runs_of(pytestconfig, 3)):
        result = evolve(built, seed=seed).run()
        truth = result.recording.truth[0].states
        track = result.tracks[0]
        start = built.tracker.given(result.recording).mean[0, :8]
        frames = [scan.frame.pixels for scan in result.recording.scans]
        ours.append(figures(track.mean[:, :8], track.cov[:, :8, :8], truth))
        theirs.append(figures(*plain(frames, np.array([-24, -24]), density, start), truth))
    ours, theirs = np.array(ours), np.array(theirs)
    assert not ours[theirs[:, 2] == 0, 2].any()
    assert not theirs[:, 2].any()
    apart = (ours - theirs)[:, :2]
    error = np.std(apart, axis=0, ddof=1) / np.sqrt(len(apart))
    assert np.all(np.abs(np.mean(apart, axis=0)) <= 2.0 * error + 1e-9)  # rounding apart, they are the same filter


@pytest.mark.parametrize("blank", ["noise", "nothing", "unknown"])
def test_a_blanked_target_counts_as_missed(blank, pytestconfig):
    rng = np.random.default_rng(0)
    shown = {
        "noise": lambda pixels: rng.standard_normal(pixels.shape),
        "nothing": np.zeros_like,
        "unknown": lambda pixels: np.full_like(pixels, np.nan),
    }[blank]
    for density in (1e5, 1e6, 1e7):
        built = experiment(density)
        tracker = built.tracker
        for seed in range(runs_of(pytestconfig, 1)):
            recording = built.source.open(tracker.sensors, np.random.default_rng(seed))
            state, hits = tracker.start(tracker.given(recording), recording.scans[0].time), []
            for k, scan in enumerate(recording.scans[: BLANK.stop]):
                frame = scan.frame if k < BLANK.start else Frame(shown(scan.frame.pixels), scan.frame.corner)
                state = tracker.step(state, Scan.image(scan.time, scan.sensor, frame))
                hits.append(state.hit[0])
            assert np.mean(np.array(hits[BLANK]) < 0.5) >= 0.9
            assert np.min(hits[: BLANK.start]) > 0.5
