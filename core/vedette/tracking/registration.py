"""Offsets of sensors that all tracks share: one belief about them, to which every track adds what it learns.

Given constant offsets b, targets are independent: p(b, x1, x2, ...) = p(b) p(x1 | b) p(x2 | b) ... Every row holds p(x | b)
by its covariance with the offsets: the rows and one p(b) are the joint posterior, without covariances of two targets.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import fields, kernels
from vedette.filters.motion import predicted
from vedette.roles import Estimator, Sensor
from vedette.sampling.seeds import NO_DRAWS
from vedette.space import Array, Indices, Space
from vedette.supporting import Birth
from vedette.tracking import pytrees
from vedette.tracking.learnt import Information, gained, of_tracks, within
from vedette.types import Detections, Gaussian, Newborn

LINKS = 0.5
"""A track is linked once it took a return of a sensor without offsets by more than this probability."""


@frozen
class Registration:
    """Which state axes are offsets of sensors that all tracks share, as 'biased' adds them to what a sensor measures.

    Each starts at 0 with its standard deviation in `offsets`, whatever the deviation that births give it. A scan updates
    each track and its own view of the offsets. What linked tracks learn is summed, by existence, and told to all as a return
    of the offsets: linked are confirmed tracks that took returns of a sensor without offsets, such as AIS or a radar that is
    taken as registered, and those given at the start, such as fixed echoes. For other tracks the offsets turn or shift all
    that they see, which nothing tells; linearised filters would learn of it by their errors alone.
    Exact for constant offsets, linear models and certain associations; where offsets drift, what two tracks have in common
    of their past is neglected.
    Schmidt, Application of State-Space Methods to Navigation Problems, Advances in Control Systems 3, 1966; Montemerlo,
    Thrun, Koller, Wegbreit, FastSLAM, AAAI 2002 (targets independent given what they share).
    """

    offsets: dict[str, float] = fields.table("state axis to its standard deviation before the first scan", at_least=0)


@final
@frozen
class Agreed(Sensor):
    """What other tracks learnt of the offsets, as a return of them that is the track's for certain."""

    kind: ClassVar[str] = "agreed"
    linear: ClassVar[bool] = True

    observes: Space

    @property
    def measurement(self) -> Space:
        return self.observes

    def measure(self, x: Array) -> Array:
        """(*b, q) -> (*b, q)"""
        return x

    def jacobian(self, x: Array) -> Array:
        """Return H (q, q)."""
        return np.eye(len(self.observes))

    def noise(self, x: Array) -> Array:
        """Return R (q, q); each return states its own."""
        return np.eye(len(self.observes))

    def detects(self, x: Array) -> Array:
        """()"""
        return np.ones(())

    def clutter(self, z: Array) -> Array:
        """()"""
        return np.zeros(())


@frozen(eq=False)
class Offsets:
    """The shared axes of a tracker: their indices `at` (q,) in the state, their prior over `space`, what tells of them."""

    state: Space
    at: Indices
    prior: Gaussian
    agreed: Agreed

    @property
    def space(self) -> Space:
        """The axes."""
        return self.agreed.observes

    def free(self, sensor: Sensor) -> bool:
        """Return whether a sensor has none of the offsets."""
        return not any(name in sensor.observes for name in self.space.names)

    def of(self, estimate: Gaussian) -> Gaussian:
        """Return their marginal in estimates (*b, t, n)."""
        return Gaussian(estimate.mean[..., self.at], estimate.cov[..., self.at, :][..., self.at])

    def given(self, prior: Gaussian, offsets: Gaussian) -> Gaussian:
        """Return priors (*b, n) whose offsets are replaced by others (q,): p(x | offsets) stays as it is."""
        marginal = self.of(prior)
        gain = prior.cov[..., :, self.at] @ np.linalg.pinv(marginal.cov, hermitian=True)
        gain[..., self.at, :] = np.eye(len(self.at))
        step = (gain @ (offsets.mean - marginal.mean)[..., None])[..., 0]
        cov = prior.cov + gain @ (offsets.cov - marginal.cov) @ np.swapaxes(gain, -1, -2)
        return Gaussian(self.state.displace(prior.mean, step), kernels.symmetric(cov))

    def begun(self, sensor: Sensor, begin: Newborn, offsets: Gaussian) -> Newborn:
        """Return tracks that begin at returns of a sensor, with the offsets as they are known by now."""
        seen = [i for i, name in enumerate(self.space.names) if name in sensor.observes]
        if len(begin.returns) and np.any(np.einsum("...ii->...i", self.of(begin.prior).cov)[..., seen] <= 0):
            names = ", ".join(self.space.names[i] for i in seen)
            raise ValueError(f"birth: must begin tracks with a standard deviation > 0 of {names}: see the sensor's `spread`")
        return evolve(begin, prior=self.given(begin.prior, offsets))

    def ahead(self, estimator: Estimator[Any], offsets: Gaussian, dt: float) -> Gaussian:
        """Return the offsets (*b, q) `dt` s later, as a row of their own that the estimator predicts."""
        if dt == 0:
            return offsets
        shape, n = offsets.mean.shape[:-1], len(self.state)
        origin = Gaussian(np.zeros((*shape, 1, n)), np.broadcast_to(np.eye(n), (*shape, 1, n, n)))
        row = self.given(origin, Gaussian(offsets.mean[..., None, :], offsets.cov[..., None, :, :]))
        belief = predicted(estimator, estimator.start(row, self.state, NO_DRAWS), dt, NO_DRAWS)
        ahead = self.of(estimator.moments(belief))
        return Gaussian(ahead.mean[..., 0, :], ahead.cov[..., 0, :, :])

    def agree(
        self,
        estimator: Estimator[Any],
        offsets: Gaussian,
        before: Gaussian,
        belief: Any,
        shares: Array,
        track: Indices | None,
    ) -> tuple[Any, Gaussian]:
        """Return the belief after a scan with what other tracks learnt by it, and the offsets (*b, q) after it.

        offsets, before: those predicted, and those of each row (*b, t) before the scan; shares (*b, t): the probability by
        which a row counts; track (t,): rows of one track are its alternatives; None: each is a track.
        """
        if not np.any(shares > 0):
            return belief, offsets
        L = np.linalg.cholesky(offsets.cov)
        learnt = gained(within(L, offsets.mean, self.of(estimator.moments(belief))), within(L, offsets.mean, before))
        learnt = of_tracks(learnt, shares, track)
        total = Information(np.sum(learnt.matrix, axis=-3), np.sum(learnt.vector, axis=-2))
        after, back = total.posterior, np.swapaxes(L, -1, -2)
        agreed = Gaussian(offsets.mean + (L @ after.mean[..., None])[..., 0], L @ after.cov @ back)
        rows = slice(None) if track is None else np.unique(track, return_inverse=True)[1]
        rest = Information(total.matrix[..., None, :, :] - learnt.matrix, total.vector[..., None, :] - learnt.vector)
        told = rest.as_return
        z = offsets.mean[..., None, :] + (L[..., None, :, :] @ told.mean[..., None])[..., 0]
        R = L[..., None, :, :] @ told.cov @ back[..., None, :, :]
        batch, z, R = offsets.mean.ndim - 1, z[..., rows, :], R[..., rows, :, :]
        alone = pytrees.take(belief, np.arange(z.shape[-2])[:, None], batch)
        seen = Detections(z[..., None, :], np.ones((*z.shape[:-1], 1), dtype=bool), None, R[..., None, :, :])
        innovation = estimator.evaluate(alone, self.agreed, seen, 1.0)
        sure = np.broadcast_to([0.0, 1.0], (*z.shape[:-1], 1, 2))
        return pytrees.take(estimator.update(alone, innovation, sure), 0, batch + 1), agreed


def shared(
    registration: Registration, estimator: Estimator[Any], sensors: Mapping[str, Sensor], birth: Birth | None
) -> Offsets | None:
    """Return the shared axes, None if there are none; ValueError, with its place, if they cannot be shared or observed."""
    state, observed = estimator.state, {name: sensor.observes.names for name, sensor in sensors.items()}
    for name, deviation in registration.offsets.items():
        place = f"registration.offsets.{name}"
        if name not in state:
            raise ValueError(f"{place}: must be an axis of the state, {state}")
        if name not in set().union(*observed.values()):
            raise ValueError(f"{place}: must be an offset of some sensor, as of 'biased'; none observes it")
        if deviation <= 0:
            raise ValueError(f"{place}: must be > 0, got {deviation:g}")
    if not registration.offsets:
        return None
    if estimator.traits.draws:
        raise ValueError(f"registration: must not go with an estimator that draws, as {estimator.kind!r} does")
    starts_none = birth is not None and type(birth).given is Birth.given
    if starts_none and all(set(registration.offsets) & set(names) for names in observed.values()):
        told = f"must be told by a sensor without them, or by given tracks; {', '.join(map(repr, sensors))} all have some"
        raise ValueError(f"registration.offsets: {told}. Without this table each track finds its own, by two places")
    at = np.array([state.names.index(name) for name in registration.offsets])
    variance = np.square(list(registration.offsets.values()))
    return Offsets(
        state, at, Gaussian(np.zeros(len(at)), np.diag(variance)), Agreed(Space(tuple(state.axes[i] for i in at)))
    )
