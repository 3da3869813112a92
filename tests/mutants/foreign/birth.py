"""Wrong births."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

RETURNS = partial(standard.FromReturns, spread={"vx": 8.0, "vy": 8.0}, sensors=("radar",))
PLACES = (
    {"at": {"x": (0.0, 300.0), "y": (0.0, 300.0), "vx": (0.0, 5.0), "vy": (0.0, 5.0)}, "initial": 2.0, "rate": 0.1},
    {"at": {"x": (200.0, 50.0), "y": (0.0, 50.0), "vx": (0.0, 5.0), "vy": (0.0, 5.0)}, "initial": 1.0, "rate": 0.02},
)
POISSON = partial(
    standard.Poisson, appear=tuple(standard.births.poisson.Appearance(**place) for place in PLACES), lifetime=100.0
)


def _begin(change=None, **asked):
    """Return a `begin` that asks with other arguments, or changes the answer."""

    def begin(right, found, estimator, sensor, name, detections, claimed):
        call = {"detections": detections, "claimed": claimed}
        call |= {part: f(call[part]) for part, f in asked.items()}
        started = right.begin(found, estimator, sensor, name, **call)
        return started if change is None else attrs.evolve(started, **change(started, call))

    return begin


def _twice(started, call):
    return {
        "returns": np.repeat(started.returns, 2),
        "prior": vedette.Gaussian(np.repeat(started.prior.mean, 2, axis=0), np.repeat(started.prior.cov, 2, axis=0)),
        "existence": np.repeat(started.existence, 2),
    }


def _scattered(started, call):
    apart = np.random.default_rng().normal(size=started.prior.mean.shape)
    return {"prior": vedette.Gaussian(started.prior.mean + apart, started.prior.cov)}


def _velocity_uncertain_by_root(started, call):
    cov = np.array(started.prior.cov)
    cov[..., 2:, 2:] = np.sqrt(np.abs(cov[..., 2:, 2:]))
    return {"prior": vedette.Gaussian(started.prior.mean, cov)}


def _silent(right, found, estimator, sensor, name, detections, claimed):
    try:
        return right.begin(found, estimator, sensor, name, detections, claimed)
    except (ValueError, NotImplementedError):
        n = len(estimator.state)
        return vedette.Newborn(np.zeros(0, dtype=int), vedette.Gaussian(np.zeros((0, n)), np.zeros((0, n, n))), np.zeros(0))


def _weighed(memory, weights):
    """Return the intensity with as many more or fewer in each cell of a Gaussian as its weight says."""
    more = (weights - memory.weights).reshape(-1, *[1] * (memory.number.ndim - 1))
    return attrs.evolve(memory, number=memory.number + more)


def _weights(change):
    """Return a `predict` that changes the weights: a function of them, of how many are old, of the old ones and of dt."""

    def predict(right, memory, estimator, dt, rng):
        ahead = right.predict(memory, estimator, dt, rng)
        return _weighed(ahead, change(right, ahead.weights, len(memory.weights), memory.weights, dt))

    return predict


def _rate_per_scan(right, weights, old, before, dt):
    return weights if dt == 0 else np.append(weights[:old], weights[old:] / dt)


def _immortal(right, weights, old, before, dt):
    return np.append(before, weights[old:]) if len(weights) >= old else weights


def _decays_linearly(right, weights, old, before, dt):
    return np.append(before * (1 - dt / right.lifetime), weights[old:]) if len(weights) >= old else weights


def _standing(right, memory, estimator, dt, rng):
    """The unseen targets do not move."""
    ahead = right.predict(memory, estimator, dt, rng)
    n = len(memory.weights)
    if len(ahead.weights) < n or not isinstance(ahead.belief, vedette.Gaussian):
        return ahead
    mean, cov = (np.concatenate([getattr(memory.belief, part), getattr(ahead.belief, part)[n:]]) for part in ("mean", "cov"))
    return attrs.evolve(ahead, belief=vedette.Gaussian(mean, cov))


def _first_gaussian(right, memory, estimator, sensor, detections, p_gate):
    density, found = right.reveal(memory, estimator, sensor, detections, p_gate)
    return np.exp(found.log_share[0]) if len(memory.weights) else density, found


def _nothing_revealed(right, memory, estimator, sensor, detections, p_gate):
    return None, right.reveal(memory, estimator, sensor, detections, p_gate)[1]


def _in_place(right, memory, estimator, sensor, detections, claimed, p_gate):
    memory.number[...] = right.update(memory, estimator, sensor, detections, claimed, p_gate).number
    return memory


def _detected_all(right, memory, estimator, sensor, detections, claimed, p_gate):
    """Each return of the scan takes one from the expected number of undetected targets, whosever it was."""
    after = right.update(memory, estimator, sensor, detections, claimed, p_gate)
    count = np.sum(detections.valid)
    return _weighed(after, after.weights - count / max(len(after.weights), 1))


birth = partial(mutant, "birth")

MUTANTS: tuple[Mutant, ...] = (
    birth(
        "returns_claimed_ones",
        "Tracks start at the returns that are claimed.",
        RETURNS,
        begin=_begin(claimed=lambda c: 1.0 - c),
    ),
    birth(
        "returns_padding",
        "Padding of the scan starts tracks.",
        RETURNS,
        begin=_begin(detections=lambda d: attrs.evolve(d, valid=np.ones_like(d.valid))),
    ),
    birth(
        "returns_own_noise",
        "A return's own covariance is ignored.",
        RETURNS,
        begin=_begin(detections=lambda d: attrs.evolve(d, noise=None)),
    ),
    birth(
        "returns_exist_surely",
        "New tracks exist with probability 1, whatever `initial` says.",
        RETURNS,
        begin=_begin(lambda s, c: {"existence": np.ones_like(s.existence)}),
    ),
    birth(
        "returns_counted_anew",
        "The returns are numbered among those that start tracks.",
        RETURNS,
        begin=_begin(lambda s, c: {"returns": np.arange(len(s.returns))}),
    ),
    birth("returns_twice", "Every return starts two tracks.", RETURNS, begin=_begin(_twice)),
    birth("returns_scattered", "New tracks are scattered by an unseeded generator.", RETURNS, begin=_begin(_scattered)),
    birth(
        "returns_deviation",
        "The velocity's deviation is taken for its variance.",
        RETURNS,
        begin=_begin(_velocity_uncertain_by_root),
    ),
    birth(
        "returns_any_sensor", "`sensors` is ignored: all sensors start tracks.", RETURNS, starts_from=lambda r, sensor: True
    ),
    birth("returns_silent", "A sensor that cannot start tracks is not refused: none ever starts.", RETURNS, begin=_silent),
    birth("poisson_rate_per_scan", "The rate is taken per scan, not per second.", POISSON, predict=_weights(_rate_per_scan)),
    birth("poisson_immortal", "Unseen targets never leave: `lifetime` is ignored.", POISSON, predict=_weights(_immortal)),
    birth(
        "poisson_linear_decay",
        "1 - dt / lifetime: negative numbers of targets after a long pause.",
        POISSON,
        predict=_weights(_decays_linearly),
    ),
    birth("poisson_standing", "Unseen targets do not move, nor does their uncertainty grow.", POISSON, predict=_standing),
    birth(
        "poisson_not_thinned", "A scan does not thin the unseen targets.", POISSON, update=lambda r, memory, *more: memory
    ),
    birth(
        "poisson_thinned_twice",
        "A scan thins the unseen targets twice.",
        POISSON,
        update=lambda r, memory, *more: r.update(r.update(memory, *more), *more),
    ),
    birth(
        "poisson_takes_returns_away",
        "Every return takes one from the unseen targets, below 0 if need be.",
        POISSON,
        update=_detected_all,
    ),
    birth("poisson_in_place", "The memory that is passed in is changed.", POISSON, update=_in_place),
    birth(
        "poisson_claims_ignored",
        "Returns of existing tracks start tracks all the same.",
        POISSON,
        begin=_begin(claimed=np.zeros_like),
    ),
    birth(
        "poisson_no_clutter",
        "A new track exists surely: the clutter's density is forgotten.",
        POISSON,
        begin=_begin(lambda s, c: {"existence": (1.0 - c["claimed"])[s.returns]}),
    ),
    birth("poisson_first_gaussian", "The density counts the first Gaussian alone.", POISSON, reveal=_first_gaussian),
    birth(
        "poisson_nothing_revealed",
        "The density with which unseen targets compete for returns is not stated.",
        POISSON,
        label="other_model",
        reveal=_nothing_revealed,
    ),
)
