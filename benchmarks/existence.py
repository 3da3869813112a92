"""Whether the existence that a tracker states is the share of its tracks that are of targets, on truth drawn from its model.

    python -m benchmarks.existence                 all kinds, 400 runs; some five minutes of a core
    python -m benchmarks.existence --kinds jpda gnn --runs 100

Targets come at one place as a Poisson process, live for 30 s on average, move as the model says and are detected with .8, in
15 false returns a scan. Whether a track is of a target is asked where these truly are (`of_targets`). Ten bins of stated
existence: what is stated less what is true; errors are of sums over runs, as the scans of a run depend on each other.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np

import vedette
from vedette import Detections, Scan
from vedette.space import Array
from vedette_standard.associators.jpda import Jpda

SCANS, SIGMA, P_DETECT, FALSE, LIFETIME = 30, 2.0, 0.8, 15.0, 30.0
INITIAL, RATE, SPREAD, SPEED, SIDE, ACCEL = 4.0, 0.15, 50.0, 2.0, 500.0, 0.3
FARTHEST, LEAST, BINS = -20.0, 1e-3, 10
PAIRING = Jpda()
KINDS = {
    "jpda": {"kind": "jpda"},
    "variational": {"kind": "variational"},
    "lmb": {"kind": "lmb"},
    "k_best, mean shown": {"kind": "k_best", "show": "mean"},
    "k_best": {"kind": "k_best"},
    "n_scan": {"kind": "n_scan"},
    "jpda_star": {"kind": "jpda_star"},
    "gnn": {"kind": "gnn"},
    "nearest": {"kind": "nearest"},
}


def tracker(kind: str) -> vedette.Tracker:
    """Return the tracker, whose model is that of the truth."""
    at = {"x": [0, SPREAD], "y": [0, SPREAD], "vx": [0, SPEED], "vy": [0, SPEED]}
    appear = [{"at": at, "initial": INITIAL, "rate": RATE}]
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": ACCEL}},
        "sensors": {"radar": {
            "kind": "cartesian_position", "sigma": SIGMA, "detection_probability": P_DETECT,
            "clutter_density": FALSE / SIDE**2}},
        "gate": {"probability": 1.0, "largest_distance": 30.0},
        "associator": KINDS[kind],
        "birth": {"kind": "poisson", "lifetime": LIFETIME, "appear": appear},
        "lifecycle": {"kind": "existence", "lifetime": LIFETIME, "confirm": 0.5, "show": 0.5, "delete": 1e-4},
    })  # fmt: skip


def drawn(seed: int, run: int) -> Iterator[tuple[Array, Scan]]:
    """Yield of each scan where the targets are (j, 2), and its returns."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run,)))
    stay, first = np.exp(-1.0 / LIFETIME), RATE * LIFETIME * -np.expm1(-1.0 / LIFETIME)
    noise = np.linalg.cholesky(ACCEL**2 * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]]))
    there = np.zeros((0, 2, 2))
    for time in range(SCANS):
        there = there[rng.random(len(there)) < stay]
        there[:, 0] += there[:, 1]
        there += np.einsum("ij,njk->nik", noise, rng.standard_normal(there.shape))
        new = rng.standard_normal((rng.poisson(first if time else INITIAL), 2, 2)) * np.array([[SPREAD], [SPEED]])
        there = np.concatenate([there, new])
        own = there[rng.random(len(there)) < P_DETECT, 0]
        own = own + SIGMA * rng.standard_normal(own.shape)
        z = np.concatenate([own, SIDE * (rng.random((rng.poisson(FALSE), 2)) - 0.5)])
        yield there[:, 0].copy(), Scan(float(time), "radar", Detections.of(z, 2))


def log_densities(mean: Array, cov: Array, there: Array) -> Array:
    """Return log N (t, j) of places (j, 2) by Gaussians of mean (t, 2) and covariance (t, 2, 2)."""
    apart = there[None] - mean[:, None]
    distance = np.einsum("tji,tij->tj", apart, np.linalg.solve(cov, np.swapaxes(apart, 1, 2)))
    return -0.5 * (distance + np.log(np.linalg.det(2 * np.pi * cov))[:, None])


def of_targets(density: Array, existence: Array, unseen: Array) -> Array:
    """Return the probability (t,) that each track is of a target, given where the targets (j,) are.

    It is the marginal of all pairings: r N(x) of a pair, the log of N being `density` (t, j); u(x) (j,) of a target without
    a track, the tracker's intensity of unseen ones; 1 - r of a track without a target. Of two tracks beside one target it
    tells the one that it more probably is.
    """
    some = np.clip(existence, 1e-12, 1.0 - 1e-12)[:, None]
    pairs = np.log(some) + density - np.log(unseen)
    pairs = np.where(pairs - np.log1p(-some) > FARTHEST, pairs, -np.inf)
    return 1.0 - PAIRING.associate(np.concatenate([np.log1p(-some), pairs], axis=1), None)[:, 0]


def calibration(kind: str, seed: int, runs: int) -> tuple[Array, Array]:
    """Return sums (runs, bins) of stated existence less pairing, and the numbers of tracks (runs, bins)."""
    one = tracker(kind)
    order = one.state.locate(one.sensors["radar"].observes)
    excess, number = np.zeros((2, runs, BINS))
    for run in range(runs):
        state = one.start()
        for there, scan in drawn(seed, run):
            state = one.step(state, scan)
            estimate, existence = one.estimate(state), state.existence
            some = existence >= LEAST
            unseen = one.estimator.moments(state.unseen.belief)
            tracks, places = (
                log_densities(of.mean[:, order], of.cov[:, order][:, :, order], there) for of in (estimate, unseen)
            )
            undetected = np.sum(state.unseen.weights[:, None] * np.exp(places), axis=0) + 1e-300
            true = of_targets(tracks, existence, undetected)[some]
            place = np.minimum((existence[some] * BINS).astype(int), BINS - 1)
            excess[run] += np.bincount(place, existence[some] - true, BINS)
            number[run] += np.bincount(place, minlength=BINS)
    return excess, number


def deviations(excess: Array) -> Array:
    """Return how many standard errors (bins,) the mean over runs of the excess is from 0; 0 where there is none."""
    error = np.std(excess, axis=0, ddof=1) / np.sqrt(len(excess))
    return np.divide(np.mean(excess, axis=0), error, out=np.zeros(BINS), where=error > 0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser("python -m benchmarks.existence", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    given = parser.parse_args(arguments)
    print("| associator | " + " | ".join(f"{i / BINS:g}" for i in range(BINS)) + " | worst, standard errors |")
    print("| --- " * (BINS + 2) + "|")
    for kind in given.kinds:
        excess, number = calibration(kind, given.seed, given.runs)
        mean = np.sum(excess, axis=0) / np.maximum(np.sum(number, axis=0), 1)
        cells = [kind, *(f"{value:+.3f}" for value in mean), f"{np.max(np.abs(deviations(excess))):.1f}"]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
