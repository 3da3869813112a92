"""What the laws of lifecycles are tried on."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette.space import Array, Indices, Mask
from vedette.supporting import Lifecycle
from vedette.testing.comparisons import frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, STEPS
from vedette.tracking import pytrees
from vedette.types import Review


@frozen(eq=False)
class Lives:
    """Existence at the start (t,); what s scans said: existence, hit, p_detect and spreads in m (s, t); time steps in s."""

    initial: Array
    existence: Array
    hit: Array
    p_detect: Array
    spread: Array
    order: Indices
    dt: float
    later: float

    def review(self, scan: int, tracks: Any = slice(None), runs: tuple[int, ...] | None = None) -> Review:
        """Return what one scan said of some tracks; or what several did, as runs in a batch."""
        at: Any = scan if runs is None else list(runs)
        rows = [row[at][..., tracks] for row in (self.existence, self.hit, self.p_detect, self.spread)]
        return Review(self.dt, *rows)


def areas_of(lifecycle: Lifecycle) -> list[Array]:
    """Return the corners (c, 2) of the areas in which its targets survive, where they have corners."""
    return [np.asarray(area.corners) for area in getattr(lifecycle, "survives_in", ()) if hasattr(area, "corners")]


def judged(lifecycle: Lifecycle, memory: Any, scan: Review) -> tuple[Any, Mask, Mask]:
    """Return what it says of a scan; if it needs places, all tracks are in the first of its areas, or at the origin."""
    if lifecycle.needs_place:
        at = np.mean([*areas_of(lifecycle), np.zeros((1, 2))][0], axis=0)
        scan = evolve(scan, place=np.broadcast_to(at, (*np.shape(scan.hit), 2)))
    return lifecycle.review(memory, scan)


def drawn(draw: st.DrawFn, lifecycle: Lifecycle, profile: Profile) -> Lives:
    """What every law of a lifecycle is given: up to 4 tracks through up to 16 scans."""
    t, s, dt, later, seed = draw(st.integers(1, 4)), draw(st.integers(1, 16)), draw(STEPS), draw(STEPS), draw(SEEDS)
    rng = np.random.default_rng(seed)
    fate = rng.choice([0.0, 0.6, 0.6, 1.0], t)  # some are never detected, some always
    dt = dt * float(rng.choice([1.0, 1.0, 6.0]))
    existence, hit = rng.random((s, t)) ** 0.5, np.where(rng.random((s, t)) < fate, rng.choice([1.0, 0.7], (s, t)), 0.0)
    p_detect, spread = rng.choice([0.0, 0.5, 0.9, 1.0], (s, t)), 10.0 ** rng.uniform(-1, 5, (s, t))
    rows = [frozen_copy(np.asarray(array, dtype=float)) for array in (existence, hit, p_detect, spread)]
    return Lives(frozen_copy(rng.uniform(0.05, 1.0, t)), rows[0], rows[1], rows[2], rows[3], rng.permutation(t), dt, later)


def live(lifecycle: Lifecycle, lives: Lives, tracks: Any = slice(None)) -> list[tuple[Mask, Mask]]:
    """Confirmed and alive (t,) after each scan, of some of the tracks."""
    memory = pytrees.take(lifecycle.start(lives.initial), np.arange(lives.hit.shape[1])[tracks], 0)
    verdicts = []
    for scan in range(len(lives.hit)):
        memory, confirmed, alive = judged(lifecycle, still(memory), lives.review(scan, tracks))
        verdicts.append((np.array(confirmed), np.array(alive)))
    return verdicts


def still(memory: Any) -> Any:
    """Return a copy of a memory that cannot be written into: it is part of a state, which somebody may have kept."""
    return pytrees.mapped(frozen_copy, memory)
