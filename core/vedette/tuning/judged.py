"""Whether tuned values are better on scans that they were not tuned on, and what they leave of Q's and R's faults."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette.tuning.errors import long_run
from vedette.tuning.evaluation import Data, Evaluated, evaluate
from vedette.tuning.free import Free
from vedette.tuning.moments import Noise


@frozen
class Gain:
    """By how much the log-likelihood of some scans grew, and its standard error from the paired scans."""

    scans: int
    before: float
    after: float
    error: float

    @property
    def difference(self) -> float:
        """After less before."""
        return self.after - self.before

    @property
    def text(self) -> str:
        """In words."""
        per = self.difference / self.scans
        return f"{self.difference:+.1f} +- {self.error:.1f} over {self.scans} scans ({per:+.3f} a scan)"

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {"scans": self.scans, "before": self.before, "after": self.after, "error": self.error}


@frozen(eq=False)
class Judged:
    """The config's values and the tuned ones on the whole recording: log-likelihoods (s,), gains, innovations' sizes."""

    times: Array
    tuned: int
    before: Array | None
    after: Array
    on: Gain | None
    held: Gain | None
    noises_before: Sequence[Noise]
    noises_after: Sequence[Noise]


def judge(data: Data, free: Sequence[Free], values: Sequence[float]) -> Judged:
    """Run the config's own values, as far as it has any, and the tuned ones over all scans."""
    own = [each.start if each.place.value is None else each.place.value for each in free]
    before = evaluate(data, free, own, whole=True, moments=True)
    after = evaluate(data, free, values, whole=True, moments=True)
    assert after is not None
    held = slice(data.tuned, len(data.times))
    return Judged(
        data.times,
        data.tuned,
        None if before is None else before.loglik,
        after.loglik,
        _gain(before, after, slice(0, data.tuned)),
        _gain(before, after, held) if data.tuned < len(data.times) else None,
        _noises(before),
        _noises(after),
    )


def _gain(before: Evaluated | None, after: Evaluated, scans: slice) -> Gain | None:
    if before is None:
        return None
    old, new = before.loglik[scans], after.loglik[scans]
    error = float(np.sqrt(max(float(long_run((new - old)[:, None])[0, 0]), 0.0)))
    return Gain(len(old), float(np.sum(old)), float(np.sum(new)), error)


def _noises(found: Evaluated | None) -> Sequence[Noise]:
    return [] if found is None or found.moments is None else found.moments.noises(slice(None))
