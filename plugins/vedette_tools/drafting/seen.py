"""What one sensor's returns show: its scans, and the targets that they follow."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices
from vedette_tools.drafting.chains import LEAST, START, Chain, chains, spacing
from vedette_tools.drafting.reports import in_turn, of_owners, without_gross

ALL = 0.5
"""Targets that give returns in fewer of the scans than this report in turn."""

TOGETHER, MOST_REPORTS = 3.0, 6000
"""Where more returns come at a time, they are a look at all targets; of what objects report, so many are followed."""

LOOSE = 0.1
"""Where chains leave more returns than this part, some are false, and the tighter chains are believed. By hand."""

VAGUE = 1 / 3
"""Chains whose errors are such a part of the spread of all returns follow none."""

NOISELESS = 0.1
"""Velocities are told by returns of which the errors make less than this part of their mean square."""

FORGETTING = 100
"""A target whose course is as good as straight is still drafted with process noise that is felt after so many scans."""


@frozen(eq=False)
class Seen:
    """What one sensor's returns show: its scans' times, the positions of its returns, where it stood, the chains, and what
    else it measured.
    """

    times: Array
    spots: tuple[Array, ...]
    stands: Array
    chains: tuple[Chain, ...]
    thirds: tuple[Array, ...] = ()

    @property
    def in_turn(self) -> bool:
        """Whether a scan is a look at a few targets only."""
        looks = sum(chain.looks for chain in self.chains)
        return sum(len(chain.times) for chain in self.chains) < ALL * looks

    @property
    def pieces(self) -> int:
        """How many chains there are, and returns in none: as many targets or false returns it takes to explain all."""
        return len(self.chains) + sum(map(len, self.spots)) - sum(len(chain.times) for chain in self.chains)

    @cached_property
    def rough(self) -> float:
        """The usual second difference along the chains, in m; inf without any."""
        return usual_bend(self.chains)

    @property
    def period(self) -> float:
        """The usual time between scans, in s, or between reports of a target; 1 for a single one."""
        if self.in_turn:
            return float(np.median(np.concatenate([np.diff(chain.times) for chain in self.chains])))
        return float(np.median(np.diff(np.unique(self.times)))) if len(self.times) > 1 else 1.0

    @property
    def least_accel(self) -> float:
        """Return the acceleration noise, m/s^2, that moves a target by the sensor's own error in `FORGETTING` scans.

        Over t s that is accel t^1.5 / sqrt(3). With less, the filter believes its prediction for ever.
        """
        return float(np.sqrt(3) * self.error / (FORGETTING * self.period) ** 1.5) if self.chains else 0.0

    @property
    def least_felt(self) -> float:
        """The acceleration noise that moves a target, over the longest chain, as far as so many returns tell its place.

        With less, the data themselves do not tell it from none; with more, targets that keep their courses are doubted.
        """
        longest = max(chain.looks for chain in self.chains)
        return self.least_accel * float((FORGETTING / longest) ** 1.5 / np.sqrt(longest))

    @property
    def error(self) -> float:
        """The error of a return along an axis, in m, by the usual second difference, whose median is 2.9 times that."""
        return self.rough / 2.9


def usual_bend(chains: Iterable[Chain]) -> float:
    """Return the median second difference along chains, in m; inf without any."""
    seconds = [np.linalg.norm(np.diff(chain.spots, 2, axis=0), axis=-1) for chain in chains]
    return float(np.median(np.concatenate(seconds))) if seconds else np.inf


def follow(
    times: Array,
    spots: tuple[Array, ...],
    stands: Array,
    named: Indices | None,
    likely: Callable[[Seen, int], Seen],
    *,
    reported: bool = False,
) -> Seen:
    """Follow the returns by the names of their objects (n,), if they have any.

    Else twice, first within what their spacing allows, then within what the first time showed, unless that only cuts chains
    where targets turn; or one by one in time, if few come at once, and more can be followed so, or more steadily, of the
    chains that are `likely` where so many returns as scans leave may be false. What is `reported` by the objects comes one
    by one unless that follows less than half as much.
    """
    if named is not None and np.any(named >= 0):
        return Seen(times, spots, stands, tuple(of_owners(times, spots, named)))
    width = spacing(spots)
    seen = Seen(times, spots, stands, tuple(chains(times, spots, width)))
    if np.isinf(width):  # where there is one at a time, all are of one chain, however far off
        seen = evolve(seen, chains=tuple(map(without_gross, seen.chains)))
    if seen.chains:
        # a target may be fast and its returns precise: it still moves as far between two
        narrow = min(width, 4.0 * max(seen.rough, 1e-9))
        tight = evolve(seen, chains=tuple(chains(times, spots, narrow, START * width)) or seen.chains)
        seen = tight if tight.pieces <= seen.pieces or seen.pieces > LOOSE * sum(map(len, spots)) else seen
    first = int(np.searchsorted(np.cumsum([len(places) for places in spots]), MOST_REPORTS, side="right"))
    vague = bool(seen.chains) and seen.error > VAGUE * float(np.max(np.std(np.concatenate(spots), axis=0)))
    count, held = sum(map(len, spots[:first])), sum(int(np.sum(chain.scans < first)) for chain in seen.chains if not vague)
    few = count < TOGETHER * first
    if count >= LEAST:
        single = evolve(seen, chains=tuple(in_turn(times[:first], spots[:first])))
        sure = likely(single, count - held)
        more, surely = (sum(len(chain.times) for chain in each.chains) - held for each in (single, sure))
        least = -0.2 * count if few else 0.8 * count - held  # false returns of scans make no steady chains
        steadier = more > least and single.rough < 0.5 * seen.rough
        if steadier or ((few or reported) and surely > 0.1 * count) or (reported and few and more > -0.5 * held):
            return sure
    return seen


def usual_speed(seen: Iterable[Seen]) -> float:
    """Return how fast targets move along an axis, in m/s, where they do; a guess without any chain.

    Between returns so far apart in time that the errors of their positions hardly count, and no farther: they may turn.
    """
    paces = [np.abs(_paces(chain, each.error)) for each in seen for chain in each.chains]
    every = np.concatenate(paces) if paces else np.full(1, 10.0)
    fast = np.percentile(every, 99)  # a return under a wrong name would be faster than all that is tracked
    return max(float(np.sqrt(np.mean(np.minimum(every, fast) ** 2))), 0.5 * float(np.percentile(every, 95))) or 1e-3


def _paces(chain: Chain, error: float) -> Array:
    """Return the velocities (s, 2) along a chain."""
    for lag in (2**i for i in range(len(chain.times).bit_length())):
        if lag >= len(chain.times):
            break
        dt = (chain.times[lag:] - chain.times[:-lag])[:, None]
        paces: Array = (chain.spots[lag:] - chain.spots[:-lag]) / dt
        if np.mean(2.0 * (error / dt) ** 2) < NOISELESS * np.mean(paces**2):
            return paces
    net: Array = (chain.spots[-1:] - chain.spots[:1]) / (chain.times[-1] - chain.times[0])
    return net
