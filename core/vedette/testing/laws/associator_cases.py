"""What the laws of associators are tried on."""

from __future__ import annotations

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.roles import Associator
from vedette.space import Array, Indices
from vedette.testing.comparisons import frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS


@frozen(eq=False)
class Scores:
    """Log scores (2, t, 1+k) without ties, evidence (2, 1, k), and permutations of the tracks and of the returns."""

    scores: Array
    evidence: Array
    tracks: Indices
    returns: Indices


SIZES = st.tuples(st.integers(1, 4), st.integers(0, 4), st.sampled_from([0.5, 3.0, 30.0]), SEEDS)
"""Tracks, returns, how far scores are apart, a seed."""


def drawn(draw: st.DrawFn, associator: Associator, profile: Profile) -> Scores:
    """What every law of an associator is given: up to 4 tracks and 4 returns, some forbidden."""
    t, k, spread, seed = draw(SIZES)
    rng = np.random.default_rng(seed)
    scores = spread * rng.standard_normal((2, t, 1 + k))
    scores[..., 1:][rng.random((2, t, k)) < 0.3] = -np.inf
    evidence = rng.standard_normal((2, 1, k))
    return Scores(frozen_copy(scores), frozen_copy(evidence), rng.permutation(t), rng.permutation(k))
