"""Whether tuned values are better on scans that they were not tuned on, and what they leave of Q's and R's faults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_tools.tuning.errors import long_run
from vedette_tools.tuning.evaluation import Data, Evaluated, evaluate, moments
from vedette_tools.tuning.innovations import Moments, Noise
from vedette_tools.tuning.parameters import Free


@frozen
class Gain:
    """By how much the log-likelihood of some scans grew, and its standard error.

    `by_scans` is the error's part from the paired scans, the rest is from the errors of the tuned values; 0 where they
    were tuned on these scans.
    """

    scans: int
    before: float
    after: float
    by_scans: float
    by_values: float

    @property
    def error(self) -> float:
        """Both together."""
        return math.hypot(self.by_scans, self.by_values)

    @property
    def difference(self) -> float:
        """After less before."""
        return self.after - self.before

    @property
    def text(self) -> str:
        """In words."""
        per = self.difference / self.scans
        parts = f", +- {self.by_scans:.1f} by the scans, +- {self.by_values:.1f} by the values' errors"
        return (
            f"{self.difference:+.1f} +- {self.error:.1f} over {self.scans} scans "
            f"({per:+.3f} a scan{parts if self.by_values else ''})"
        )

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        names = ("scans", "before", "after", "error", "by_scans", "by_values")
        return {name: getattr(self, name) for name in names}


@frozen(eq=False)
class Judged:
    """The config's values and the tuned ones on the whole recording: log-likelihoods (s,), gains, innovations' sizes.

    pull (p,): by how much the likelihood of the scans held back grows over one standard error of each tuned value upwards.
    """

    times: Array
    tuned: int
    before: Array | None
    after: Array
    on: Gain | None
    held: Gain | None
    pull: Array
    noises_before: Sequence[Noise]
    noises_after: Sequence[Noise]

    @property
    def advice(self) -> str:
        """What the scans held back advise: "take" the tuned values, "keep" the ones before, "either"; "" if none are.

        "keep" where the tuned values are worse there by more than twice the error of the paired scans: which values are the
        better ones on these scans is a question about these values, whatever errors they have.
        """
        if self.held is None:
            return ""
        if self.held.difference < -2 * self.held.by_scans:
            return "keep"
        return "take" if self.held.difference > 0 else "either"


def judge(data: Data, free: Sequence[Free], values: Sequence[float], cov: Array) -> Judged:
    """Run the config's own values and the tuned ones, with cov (p, p) of their positions, over all scans."""
    starts = [each.start if each.place.value is None else each.place.value for each in free]
    before = evaluate(data, free, starts, whole=True)
    after = evaluate(data, free, values, whole=True)
    assert after is not None
    held = slice(data.tuned, len(data.times))
    spread, pull = by_values(data, free, values, cov) if data.tuned < len(data.times) else (0.0, np.zeros(len(free)))
    return Judged(
        data.times,
        data.tuned,
        None if before is None else before.loglik,
        after.loglik,
        gain(before, after, slice(0, data.tuned), 0.0),
        gain(before, after, held, spread) if data.tuned < len(data.times) else None,
        pull,
        _noises(moments(data, free, starts, whole=True)),
        _noises(moments(data, free, values, whole=True)),
    )


def by_values(data: Data, free: Sequence[Free], values: Sequence[float], cov: Array) -> tuple[float, Array]:
    """Return the standard error of the likelihood of the scans held back that comes from the errors of the tuned values.

    sqrt(g' C g), with g its slope by central differences over one standard error, and C their covariance, over positions;
    beside it how much the likelihood grows over one standard error of each (p,), 0 where that is not known.
    """
    known = np.flatnonzero(np.isfinite(np.diagonal(cov))).tolist()
    slope, pull = np.zeros(len(known)), np.zeros(len(free))
    for k, i in enumerate(known):
        error, heights, places = float(np.sqrt(cov[i, i])), [], []
        for sign in (1.0, -1.0):
            place = np.clip(free[i].position(values[i]) + sign * error, 0.0, 1.0)
            moved = [*values[:i], float(free[i].value(place)), *values[i + 1 :]]
            held_back = evaluate(data, free, moved, whole=True)
            if held_back is not None:
                heights.append(float(np.sum(held_back.loglik[data.tuned :])))
                places.append(float(place))
        if len(places) == 2 and places[0] > places[1]:
            slope[k] = (heights[0] - heights[1]) / (places[0] - places[1])
            pull[i] = slope[k] * error
    C = cov[np.ix_(known, known)]
    return float(np.sqrt(max(float(slope @ C @ slope), 0.0))), pull


def gain(before: Evaluated | None, after: Evaluated, scans: slice, spread: float) -> Gain | None:
    if before is None:
        return None
    old, new = before.loglik[scans], after.loglik[scans]
    error = float(np.sqrt(max(float(long_run((new - old)[:, None])[0, 0]), 0.0)))
    return Gain(len(old), float(np.sum(old)), float(np.sum(new)), error, spread)


def _noises(moments: Moments | None) -> Sequence[Noise]:
    return [] if moments is None else moments.noises(slice(None))
