"""What later scans say of earlier ones on the published crossing, by horizon (examples/crossing.toml).

    VEDETTE_DATA=FOLDER python -m benchmarks.horizons                 100 runs of seed 2018; some minutes a core
    VEDETTE_DATA=FOLDER python -m benchmarks.horizons --runs 10

Draws, GOSPA and identity switches are those of `benchmarks.crossing`. A scan is 1 s. `lag 0's links`: smoothed along the
associations that were the best when their scan came, as if there were one past; differences from it are paired by runs, in
mean squares. `links`: of how many, how far the stated probability is from the share that is right, in standard errors, at
worst of ten bins; a link is right if both returns are of one target and none of its returns came between.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import vedette
from benchmarks.crossing import CUTOFF, EXAMPLE, SCANS, compared, drawn_with_sources, truth
from vedette import Tracker, smoothed
from vedette.metrics import covering, switches
from vedette.space import Array
from vedette.tracking import State, take
from vedette.tracking.branching import MOST_RETURNS
from vedette.tracking.state import next_state

KINDS = {
    "k_best, 200": "{kind='k_best', hypotheses=200}",
    "k_best, 200, mean shown": "{kind='k_best', hypotheses=200, show='mean'}",
    "n_scan, 3 scans": "{kind='n_scan', scans=3, hypotheses=100}",
    "lmb": "{kind='lmb'}",
    "variational": "{kind='variational'}",
}
LAGS = (0.0, 3.0, 10.0, math.inf)
BINS = 10


def along_first_links(tracker: Tracker, states: Sequence[State]) -> Iterator[State]:
    """Yield the states smoothed by all scans, each track along the associations that it was shown with, the last first."""
    later = states[-1]
    yield later
    for state in states[-2::-1]:
        goes_on = np.isin(state.ids, later.ids)
        belief = state.belief
        if goes_on.any():
            after = take(later.belief, np.isin(later.ids, state.ids), 0)
            now = take(state.belief, goes_on, 0)
            back = tracker.estimator.smooth_step(now, after, later.time - state.time, np.random.default_rng(0))
            mean, cov = np.array(belief.mean), np.array(belief.cov)
            mean[goes_on], cov[goes_on] = back.mean, back.cov
            belief = vedette.Gaussian(mean, cov)
        later = next_state(state, belief=belief)
        yield later


def figures(tracker: Tracker, states: Sequence[State]) -> tuple[float, int]:
    """Return the mean square of GOSPA in m^2 and the identity switches of all targets."""
    targets = truth()
    squares, apart, present = zip(*(compared(tracker, state, targets) for state in states), strict=True)
    return sum(squares) / SCANS, sum(map(switches, covering(apart, present, CUTOFF).T))


def links(states: Sequence[State], sources: Sequence[Array]) -> Array:
    """Return the stated probability of each link that is shown, and whether it is right (j, 2)."""
    found = []
    for k, state in enumerate(states):
        leaves = state.leaves
        for row, stated in zip(leaves.shown.tolist(), leaves.links.tolist(), strict=True):
            if math.isnan(stated):
                continue
            (before, at), now = divmod(int(leaves.last[row, 1]), MOST_RETURNS), int(leaves.last[row, 2]) // MOST_RETURNS
            before += k - now
            source = sources[k][leaves.choice[row] - 1]
            seen_between = any(source in own for own in sources[before + 1 : k])
            found.append((stated, source >= 0 and sources[before][at - 1] == source and not seen_between))
    return np.array(found, dtype=float).reshape(-1, 2)


def judged(seed: int, run: int, kinds: Sequence[str] = tuple(KINDS)) -> dict[tuple[str, str], tuple[float, int, Array]]:
    """Return of each kind and horizon the mean square of GOSPA, identity switches, and links."""
    scans, sources = drawn_with_sources(truth(), seed, run)
    found = {}
    for name in kinds:
        tracker = vedette.load(EXAMPLE, overrides=[f"associator={KINDS[name]}"]).tracker
        states = [tracker.start()]
        for scan in scans:
            states.append(tracker.step(states[-1], scan))
        del states[0]
        found[name, "online"] = (*figures(tracker, states), links(states, sources))
        if isinstance(states[0].belief, vedette.Gaussian):
            found[name, "lag 0's links"] = (*figures(tracker, [*along_first_links(tracker, states)][::-1]), np.zeros((0, 2)))
        for lag in LAGS:
            told = list(smoothed(tracker, states, lag))
            found[name, "whole" if math.isinf(lag) else f"{lag:g} s"] = (*figures(tracker, told), links(told, sources))
    return found


def calibration(runs: Sequence[Array], bins: int = BINS) -> list[tuple[int, float, float, float]]:
    """Return of each bin with links how many, their mean stated probability, the share that is right, and standard errors.

    runs: of each, probability and whether it is right (j, 2). The error is that over runs, as links that compete for
    returns go right or wrong together; at least that of one link.
    """
    rows = []
    for i in range(bins):
        own = [run[np.minimum((run[:, 0] * bins).astype(int), bins - 1) == i] for run in runs]
        every = np.concatenate(own)
        if len(every):
            excess = [float(np.sum(run[:, 1] - run[:, 0])) for run in own]
            error = math.sqrt(max(sum(one**2 for one in excess), 1.0))
            rows.append((len(every), *map(float, every.mean(axis=0)), sum(excess) / error))
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.horizons", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=2018)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS), metavar="KIND")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--bins", action="store_true", help="print the bins of the links' probabilities")
    given = parser.parse_args(arguments)
    with ProcessPoolExecutor(given.jobs) as pool:
        runs = list(pool.map(judged, [given.seed] * given.runs, range(given.runs), [given.kinds] * given.runs))
    print(f"{given.runs} runs of seed {given.seed}\n")
    print("| associator | horizon | RMS GOSPA [m] | paired difference of mean squares [m^2] | switches a run | links |")
    print("| --- | --- | --- | --- | --- | --- |")
    root = math.sqrt(given.runs)
    for name, horizon in runs[0]:
        square = np.array([run[name, horizon][0] for run in runs])
        changed = np.array([run[name, horizon][1] for run in runs])
        base = runs[0].get((name, "lag 0's links"))
        apart = square - np.array([run[name, "lag 0's links"][0] for run in runs]) if base else np.zeros(len(runs))
        stated = [run[name, horizon][2] for run in runs]
        rows = calibration(stated)
        worst = max((abs(row[3]) for row in rows), default=math.nan)
        rms = float(np.sqrt(np.mean(square)))
        print(
            f"| {name} | {horizon} | {rms:.3f} +- {np.std(square) / root / (2 * rms):.3f} | {np.mean(apart):+.2f} +- "
            f"{np.std(apart) / root:.2f} | {np.mean(changed):.2f} +- {np.std(changed) / root:.2f} | "
            f"{sum(map(len, stated))}, {worst:.1f} |"
        )
        if given.bins:
            for row in rows:
                print("    ", "{} links, stated {:.3f}, right {:.3f}, {:+.1f} standard errors".format(*row))


if __name__ == "__main__":
    main()
