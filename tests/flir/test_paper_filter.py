"""The paper's filter of eight states on `examples/flir.toml`, beside an iterated filter that is written here."""

import math

import numpy as np
import pytest
from attrs import evolve
from scipy.linalg import expm

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Gaussian, Scan
from vedette.config.files import read_file
from vedette_study.lockstep import run_together

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


def recordings(built, runs):
    """What `vedette run --seed 0`, 1, .. draws."""
    parts = [np.random.SeedSequence(seed).spawn(2)[0] for seed in range(runs)]
    return [built.source.open(built.tracker.sensors, np.random.default_rng(part)) for part in parts]


def together(built, drawn, shown=lambda k, pixels: pixels):
    """Run the tracker on all recordings in lock-step, each frame as `shown`."""
    given = Gaussian(*(np.stack(part) for part in zip(*(start(built, each) for each in drawn), strict=True)))
    scans = []
    for k, (first, *rest) in enumerate(zip(*(each.scans for each in drawn), strict=True)):
        pixels = np.stack([shown(k, scan.frame.pixels) for scan in (first, *rest)])
        corners = np.stack([scan.frame.corner for scan in (first, *rest)])
        scans.append(Scan.image(first.time, first.sensor, Frame(pixels, corners)))
    return run_together(built.tracker, given, scans[0].time, scans)


def start(built, recording):
    given = built.tracker.given(recording)
    return given.mean, given.cov


@pytest.mark.costly
def test_runs_in_lock_step_are_those_of_the_command():
    built = experiment(1e6)
    found = together(built, recordings(built, 2))
    for seed in range(2):
        track = evolve(built, seed=seed).run().tracks[0]
        np.testing.assert_allclose(found.mean[seed], track.mean, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("density", [1e5, 1e6, 1e7])
@pytest.mark.costly
def test_the_default_gate_keeps_what_a_plain_iterated_filter_keeps(density, pytestconfig):
    built = experiment(density)
    drawn = recordings(built, runs_of(pytestconfig, 3))
    found, ours, theirs = together(built, drawn), [], []
    for i, recording in enumerate(drawn):
        truth = recording.truth[0].states
        frames = [scan.frame.pixels for scan in recording.scans]
        ours.append(figures(found.mean[i, :, :8], found.cov[i, :, :8, :8], truth))
        theirs.append(figures(*plain(frames, np.array([-24, -24]), density, start(built, recording)[0][0, :8]), truth))
    ours, theirs = np.array(ours), np.array(theirs)
    kept = theirs[:, 2] == 0
    assert np.mean(kept) >= 0.9
    assert not ours[kept, 2].any()
    apart = (ours - theirs)[kept, :2]
    error = np.std(apart, axis=0, ddof=1) / np.sqrt(len(apart))
    told = f"density {density:g}, {len(drawn)} runs: lost {ours[:, 2].sum():g}, plain {theirs[:, 2].sum():g}"
    for name, mine, its, off in zip(("position px", "NEES/2"), ours[kept].T, theirs[kept].T, error, strict=False):
        told += f"; {name} {mine.mean():.5f}, plain {its.mean():.5f}, apart {np.mean(mine - its):.1e} +- {off:.1e}"
    print(told)
    assert np.all(np.abs(np.mean(apart, axis=0)) <= 2.0 * error + 1e-9)  # rounding apart, they are the same filter


@pytest.mark.parametrize("density", [1e5, 1e6, 1e7])
@pytest.mark.costly
def test_a_blanked_target_counts_as_missed(density, pytestconfig):
    """In the frames that are blanked, by noise, by an even image or by unknown pixels; and in no run before them."""
    rng = np.random.default_rng(0)
    built = experiment(density)
    drawn = [evolve(each, scans=each.scans[: BLANK.stop]) for each in recordings(built, runs_of(pytestconfig, 2))]
    for name, blank in (
        ("noise", lambda pixels: rng.standard_normal(pixels.shape)),
        ("nothing", np.zeros_like),
        ("unknown", lambda pixels: np.full_like(pixels, np.nan)),
    ):
        hit = together(built, drawn, lambda k, pixels, blank=blank: pixels if k < BLANK.start else blank(pixels)).hit
        missed = np.mean(hit[:, BLANK] < 0.5, axis=1)
        before = np.mean(hit[:, : BLANK.start] > 0.5, axis=1)
        print(
            f"density {density:g}, {name}: missed {missed.min():.3f} at least, {missed.mean():.4f}; seen {before.min():.3f}"
        )
        assert np.all(missed >= 0.9)
        assert np.all(before == 1.0)
