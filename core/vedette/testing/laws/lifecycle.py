"""Laws of lifecycles."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen
from hypothesis import strategies as st
from numpy.typing import NDArray

from vedette.roles import Lifecycle
from vedette.space import Array, Mask, Space
from vedette.testing.judging import Closed, covariance, demand, frozen_copy, same
from vedette.testing.law import Law, Profile
from vedette.testing.states import SEEDS, STEPS, random_gaussian
from vedette.testing.strategies import SENSOR
from vedette.tracking import trees
from vedette.types import Gaussian

SEEN = Space.of(x="m", y="m")
STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@frozen(eq=False)
class Lives:
    """What scans said of t tracks: existence, hit and expected (s, t), time steps in s, returns' claimed (k,)."""

    existence: Array
    hit: Array
    expected: Array
    claimed: Array
    seen: Gaussian
    order: NDArray[np.int64]
    dt: float
    later: float


def drawn(lifecycle: Lifecycle, profile: Profile) -> st.SearchStrategy[Lives]:
    """What every law of a lifecycle is given: up to 4 tracks through up to 8 scans."""
    return st.builds(_lives, st.integers(1, 4), st.integers(1, 8), st.integers(0, 4), STEPS, STEPS, SEEDS)


def _lives(t: int, s: int, k: int, dt: float, later: float, seed: int) -> Lives:
    rng = np.random.default_rng(seed)
    existence, hit = rng.random((s, t)) ** 0.5, (rng.random((s, t)) < 0.6) * rng.choice([1.0, 0.7], (s, t))
    expected = rng.choice([0.0, 0.5, 0.9, 1.0], (s, t))
    seen = random_gaussian(SEEN, rng, (k,))
    rows = [frozen_copy(array) for array in (existence, hit, expected)]
    belief = Gaussian(frozen_copy(seen.mean), frozen_copy(seen.cov))
    return Lives(rows[0], rows[1], rows[2], frozen_copy(rng.random(k)), belief, rng.permutation(t), dt, later)


def _live(lifecycle: Lifecycle, lives: Lives, tracks: Any = slice(None)) -> list[tuple[Mask, Mask]]:
    """Confirmed and alive (t,) after each scan, of some of the tracks."""
    memory = trees.take(lifecycle.newborn(lives.hit.shape[1])[0], np.arange(lives.hit.shape[1])[tracks], 0)
    verdicts = []
    for existence, hit, expected in zip(lives.existence, lives.hit, lives.expected, strict=True):
        memory, confirmed, alive = lifecycle.review(memory, existence[tracks], hit[tracks], expected[tracks])
        verdicts.append((np.array(confirmed), np.array(alive)))
    return verdicts


def pure(lifecycle: Lifecycle, drawn: Lives) -> None:
    """The same history gives the same verdicts again; arguments stay as they were."""
    for first, again in zip(_live(lifecycle, drawn), _live(lifecycle, drawn), strict=True):
        same("verdicts again", np.array(again), np.array(first), 0.0)


def newborn_tracks_exist_in_part(lifecycle: Lifecycle, drawn: Lives) -> None:
    """New tracks exist with a probability, one a track."""
    for count in (0, 1, 3):
        _, existence = lifecycle.newborn(count)
        demand(existence.shape == (count,), f"newborn: existence must have shape {(count,)}, got {existence.shape}")
        demand(np.all((existence >= 0) & (existence <= 1)), f"newborn: existence must be in [0, 1], got {existence}")


def verdicts_are_one_a_track(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Confirmed and alive are true or false for every track."""
    for confirmed, alive in _live(lifecycle, drawn):
        for name, verdict in (("confirmed", confirmed), ("alive", alive)):
            shape = drawn.hit.shape[1:]
            demand(
                verdict.shape == shape and verdict.dtype == bool,
                f"{name}: must be {shape} of true or false, got {verdict.shape} of {verdict.dtype}",
            )


def tracks_are_judged_alone(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Tracks in another order, or one alone, get their own verdicts."""
    whole = _live(lifecycle, drawn)
    for tracks in (drawn.order, drawn.order[:1]):
        for part, both in zip(_live(lifecycle, drawn, tracks), whole, strict=True):
            same("verdicts", np.array(part), np.array(both)[:, tracks], 0.0)


def batches_as_it_loops(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Runs in one batch give what each gives alone."""
    memory, _ = lifecycle.newborn(drawn.hit.shape[1])
    again, _, _ = lifecycle.review(memory, drawn.existence[0], drawn.hit[0], drawn.expected[0])
    twice = _stacked(again)
    rows = [np.stack([row[-1], row[0]]) for row in (drawn.existence, drawn.hit, drawn.expected)]
    _, confirmed, alive = lifecycle.review(twice, *rows)
    for run in range(2):
        _, one, living = lifecycle.review(again, *(row[run] for row in rows))
        same("confirmed", np.asarray(confirmed)[run], one, 0.0)
        same("alive", np.asarray(alive)[run], living, 0.0)
    same("survive", lifecycle.survive(rows[0], drawn.dt)[1], lifecycle.survive(rows[0][1], drawn.dt))


def _stacked(memory: Any) -> Any:
    """The memory of two equal runs."""
    lead = _map(memory, lambda array: array[None])
    return trees.join(lead, lead, 0)


def _map(tree: Any, change: Any) -> Any:
    if isinstance(tree, np.ndarray):
        return change(tree)
    return trees._rebuild(tree, [_map(part, change) for part in trees._parts(tree)])


def survival_is_a_probability(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Time does not make a target exist more, and no time changes nothing."""
    existence = drawn.existence[0]
    after = lifecycle.survive(existence, drawn.dt)
    demand(np.all((after >= 0) & (after <= existence)), f"survive: must be in [0, {existence}], got {after}")
    same("survive(e, 0)", lifecycle.survive(existence, 0.0), existence, 1e-12, 1.0)


def two_waits_make_one(lifecycle: Lifecycle, drawn: Lives) -> None:
    """To wait twice is to wait once for as long."""
    existence, total = drawn.existence[0], drawn.dt + drawn.later
    twice = lifecycle.survive(lifecycle.survive(existence, drawn.dt), drawn.later)
    same("survive", twice, lifecycle.survive(existence, total), 1e-9, 1.0)


def lasting_as_declared(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If permanent: tracks exist for sure, time takes nothing from that, and all are confirmed and go on."""
    if not lifecycle.permanent:
        raise Closed("it does not say that its tracks last")
    same("newborn existence", lifecycle.newborn(3)[1], np.ones(3), 0.0)
    same("survive", lifecycle.survive(drawn.existence, drawn.dt), drawn.existence, 0.0)
    for confirmed, alive in _live(lifecycle, drawn):
        demand(
            bool(confirmed.all() and alive.all()), "review: every track must be confirmed and go on, as they are permanent"
        )


def a_hit_never_harms(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A track that is seen in each of its scans is confirmed and alive wherever one that is seen less is."""
    ones = np.ones(drawn.hit.shape)
    seen = Lives(ones, ones, drawn.expected, drawn.claimed, drawn.seen, drawn.order, drawn.dt, drawn.later)
    gone = np.zeros(drawn.hit.shape[1], dtype=bool)
    for (confirmed, alive), (better, living) in zip(_live(lifecycle, drawn), _live(lifecycle, seen), strict=True):
        gone = gone | ~alive
        demand(np.all(better | ~confirmed | gone), "confirmed: a track with more hits must be confirmed no later")
        demand(np.all(living | gone), "alive: a track with more hits must live at least as long")


def explained_returns_start_nothing(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A return that a track surely explains starts none, and one less explained is no less likely to start one."""
    starts = lifecycle.starts(SENSOR, drawn.claimed)
    demand(starts.shape == drawn.claimed.shape, f"starts: must have shape {drawn.claimed.shape}, got {starts.shape}")
    demand(not np.any(lifecycle.starts(SENSOR, np.ones(3))), "starts: a return with claimed = 1 must start no track")
    fewer = lifecycle.starts(SENSOR, 0.5 * drawn.claimed)
    demand(np.all(fewer | ~starts), f"starts: half as much explained must start too, got {starts} and {fewer}")


def tracks_start_where_they_were_seen(lifecycle: Lifecycle, drawn: Lives) -> None:
    """New tracks have the mean and covariance of their return on the axes seen, and a covariance on all."""
    if not np.any(lifecycle.starts(SENSOR, np.zeros(1))):
        raise Closed("it starts no tracks at returns")
    try:
        prior = lifecycle.prior(drawn.seen, SEEN, STATE)
    except ValueError as refusal:
        raise Closed(f"it starts no tracks there: {refusal}") from None
    where = STATE.locate(SEEN)
    same("mean of what was seen", prior.mean[:, where], drawn.seen.mean)
    same("cov of what was seen", prior.cov[:, where, :][..., where], drawn.seen.cov)
    covariance("prior", prior.cov, definite=True)


LAWS = (
    Law(pure),
    Law(newborn_tracks_exist_in_part),
    Law(verdicts_are_one_a_track),
    Law(tracks_are_judged_alone),
    Law(batches_as_it_loops),
    Law(survival_is_a_probability),
    Law(two_waits_make_one),
    Law(lasting_as_declared),
    Law(a_hit_never_harms),
    Law(explained_returns_start_nothing),
    Law(tracks_start_where_they_were_seen),
)
