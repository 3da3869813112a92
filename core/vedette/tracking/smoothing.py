"""Smoothing: later scans improve earlier estimates. From a tracker's states to smoothed states.

A state keeps all but its belief: identities, existence, confirmation and association weights stay those of the filter.
Where hypotheses are kept, these are retold, too. docs/smoothing.md says what is exact.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from vedette.errors import ConfigError
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Estimator
from vedette.sampling.seeds import NO_DRAWS, Seed, Seeds
from vedette.tracking import pytrees
from vedette.tracking.history import History
from vedette.tracking.plan import of_no_track
from vedette.tracking.retelling import retold, smoothed_rows
from vedette.tracking.state import State, next_state
from vedette.tracking.tracker import Tracker
from vedette.types import Track


def check_smoothing(tracker: Tracker) -> None:
    """Raise ConfigError if the tracker's estimator cannot smooth, before a long run rather than after it."""
    none, rng = of_no_track(tracker.estimator)
    try:
        tracker.estimator.smooth_step(none, none, 1.0, rng)
    except NotImplementedError as error:
        raise ConfigError.at("estimator", f"cannot smooth: {error}") from None


def smooth(
    tracker: Tracker, states: Iterable[State], lag: float = math.inf, seed: int | np.random.Generator = 0
) -> tuple[Track, ...]:
    """Return the tracks that were ever confirmed, smoothed by the scans of up to `lag` s later; by default by all.

    Parameters
    ----------
    tracker
        The tracker that made the states.
    states
        Those of one run in the order of time, as `Experiment.run(keep_states=True)` leaves them in its result.
    lag
        How much later a scan may be that a state uses, in s; default: all scans.
    seed
        Of the draws of an estimator that draws; others draw nothing.

    Returns
    -------
    tuple of Track
        In the order of their ids, with means (s, n) and covariances (s, n, n) over the tracker's state.

    Raises
    ------
    ValueError
        For a lag that is negative or NaN, for times that go backwards, and if there is no state.
    ConfigError
        If the estimator cannot smooth.
    """
    history, state = History(tracker), None
    for state in smoothed(tracker, states, lag, seed):
        history.add(state)
    if state is None:
        raise ValueError("states: must hold those of a run, got none: `Experiment.run(keep_states=True)` keeps them")
    return history.tracks()


def smoothed(
    tracker: Tracker, states: Iterable[State], lag: float = math.inf, seed: int | np.random.Generator = 0
) -> Iterator[State]:
    """Yield the same states, in their order, with beliefs that use the scans of up to `lag` s later (fixed lag) or all.

    It works while the tracker runs: it yields a state as soon as a later one is beyond its lag, or at the end. Runs in
    lock-step are smoothed at once.

    Parameters
    ----------
    tracker
        The tracker that makes the states.
    states
        Those of one run, or of many in lock-step, in the order of time; they may come while the tracker runs.
    lag
        How much later a scan may be that a state uses, in s; default: all scans.
    seed
        Of the draws of an estimator that draws; others draw nothing.

    Yields
    ------
    State
        Each of the states, with a smoothed belief.

    Raises
    ------
    ValueError
        For a lag that is negative or NaN, and for times that go backwards.
    """
    if not lag >= 0:
        raise ValueError(f"lag: must be >= 0 s, got {lag:g} s")
    source = Seed.of(seed)
    window: list[State] = []
    for state in states:
        if window and state.time < window[-1].time:
            raise ValueError(f"states: times must not go backwards, got {state.time:.6f} s after {window[-1].time:.6f} s")
        due = 0
        while due < len(window) and window[due].time + lag < state.time:
            due += 1
        if due:
            yield from islice(_backwards(tracker, window.copy(), source), due)
            del window[:due]
        window.append(state)
    yield from _backwards(tracker, window, source)


def _backwards(tracker: Tracker, states: list[State], seed: Seed | Seeds) -> Iterator[State]:
    """Yield every state smoothed by all of them. It empties the list, so that no state is there both ways."""
    estimator = tracker.estimator
    if isinstance(tracker.associator, HypothesisAssociator):
        yield from retold(tracker, tracker.associator, states, seed) if states else []
        return
    smoothed: list[State] = []
    while states:
        state = states.pop()
        rng = seed.generator(state.steps) if estimator.traits.draws else NO_DRAWS
        smoothed.append(_retraced(estimator, state, smoothed[-1], rng) if smoothed else state)
    while smoothed:
        yield smoothed.pop()


def _retraced(estimator: Estimator[Any], state: State, later: State, rng: np.random.Generator) -> State:
    """Smooth one step. A track that ended before `later` keeps its belief: nothing more is known of it."""
    axis, dt = state.existence.ndim - 1, later.time - state.time
    if state.ids is later.ids:
        return next_state(state, belief=estimator.smooth_step(state.belief, later.belief, dt, rng))
    after = pytrees.take(later.belief, np.isin(later.ids, state.ids), axis)
    goes_on = np.isin(state.ids, later.ids)
    return next_state(state, belief=smoothed_rows(estimator, state.belief, goes_on, after, dt, rng, axis))
