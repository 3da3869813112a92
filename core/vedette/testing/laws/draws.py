"""The law of estimators that draw random numbers for many tracks and runs at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.testing.comparisons import Closed, demand, frozen_copy
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import Scene, started
from vedette.types import Gaussian


def tracks_draw_their_own(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it declares `draws`: what it draws of a track, or of a run, is not what it draws of the others."""
    if not estimator.traits.draws:
        raise Closed("it does not declare `draws`")
    shape, prior = drawn.prior.mean.shape, drawn.prior
    alike_all = Gaussian(
        frozen_copy(np.broadcast_to(prior.mean[:1, :1], shape)),
        frozen_copy(np.broadcast_to(prior.cov[:1, :1], prior.cov.shape)),
    )
    ends = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        belief = started(estimator, evolve(drawn, prior=alike_all), rng)
        ends.append(estimator.moments(predicted(estimator, belief, drawn.dt, rng)))
    spread = np.sqrt(np.maximum(np.diagonal(ends[0].cov, axis1=-2, axis2=-1), 1e-300))
    other = np.max(np.abs(estimator.state.difference(ends[1].mean, ends[0].mean) / spread)[0, 0])
    apart = estimator.state.difference(ends[0].mean, ends[0].mean[:1, :1]) / spread
    if other < 1e-6:
        raise Closed("what it draws leaves its means alone")
    for b, t in ((0, 1), (1, 0)):
        demand(
            np.max(np.abs(apart[b, t])) > 1e-6 * other,
            f"predict: {'tracks' if t else 'runs'} that start alike are given the same numbers; draw for each, in shape "
            "(*b, t, ...)",
        )


LAWS = (Law(tracks_draw_their_own),)
