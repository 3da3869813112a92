"""The law that births know no unit of length: in half the unit, the same tracks start, twice as many units away."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.supporting import Birth
from vedette.testing.comparisons import Closed, covariance, same, same_moments
from vedette.testing.law import Law
from vedette.testing.laws.birth_cases import Returns, begun
from vedette.testing.laws.birth_returns import last
from vedette.testing.laws.noise_units import factors, in_half_the_unit
from vedette.testing.strategies import usual
from vedette.types import Detections, Gaussian


def births_know_no_unit(birth: Birth, drawn: Returns) -> None:
    """In half the unit of length the same tracks start: parameters, returns and priors are twice as many units, or 1 / 4.

    Where it starts tracks with accelerations, over these, too.
    """
    wide = usual("estimator", "kalman")(usual("motion", "constant_acceleration")(0.5))
    axes = {axis.name: axis.unit for axis in wide.state.axes}
    z = np.stack(np.meshgrid(*[np.linspace(-300.0, 300.0, 4)] * 2), axis=-1).reshape(-1, 2)
    for estimator in (wide, drawn.estimator):
        given = evolve(drawn, estimator=estimator, detections=Detections.of(z, 2), claimed=np.zeros(len(z)))
        halved = evolve(given, estimator=in_half_the_unit(estimator, axes), sensor=in_half_the_unit(drawn.sensor, axes))
        try:
            other = in_half_the_unit(birth, axes)  # which may lie beyond its limits
            here, there = last(birth, given, z, z, z), last(other, halved, *[2.0 * z] * 3)
        except ValueError as refusal:
            told = str(refusal)
            continue
        size = factors(estimator.state)
        covariance("prior of a track that starts in the first scan", begun(birth, given).prior.cov, definite=True)
        same("returns, in half the unit", there.returns.astype(float), here.returns.astype(float), 0.0)
        same("existence, in half the unit", there.existence, here.existence, 1e-9, 1.0)
        same_in_m = Gaussian(there.prior.mean / size, there.prior.cov / (size[:, None] * size))
        same_moments("in half the unit: ", estimator.state, same_in_m, here.prior, 1e-6)
        return
    raise Closed(f"it starts no tracks there: {told}")


LAWS = (Law(births_know_no_unit, needs="not draws"),)
