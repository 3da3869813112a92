"""Offsets of sensors that all tracks share: one belief about them, to which every track adds what it learns.

Given constant offsets b, targets are independent: p(b, x1, x2, ...) = p(b) p(x1 | b) p(x2 | b) ... Every row holds p(x | b)
by its covariance with the offsets: the rows and one p(b) are the joint posterior, without covariances of two targets.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import fields, kernels
from vedette.filters.motion import predicted
from vedette.roles import Estimator, Sensor
from vedette.sampling.seeds import NO_DRAWS
from vedette.space import Array, Indices, Mask, Space
from vedette.supporting import Birth
from vedette.tracking import pytrees
from vedette.tracking.learnt import Information, gained, of_tracks, within
from vedette.types import Detections, Gaussian, Newborn
from vedette.wrapping import WrappedSensor

LINKS = 0.5
"""A return counts as taken by a track that took it by more than this probability."""
MOST = 3
"""Sensors with offsets are tried together up to so many."""
PLACES = 1000
"""So many targets are asked whether they tell offsets, at ranges of 10 m to 100 km, evenly by their logarithms."""
TELLS = 0.1
"""What a look of each at such a target must tell on average of any mixture of offsets, in that of their prior: by hand.

Two radars 3 km apart, of 8 m and .3 degrees, tell 6 of bearings (.02 rad) and ranges (50 m), at 100 m .2, at 10 m .01.
"""


@frozen
class Registration:
    """Which state axes are offsets of sensors that all tracks share, as 'biased' adds them to what a sensor measures.

    Each starts at 0 with its standard deviation in `offsets`, whatever the deviation that births give it. A scan updates
    each track and its own view of the offsets. What linked tracks learn is summed, by existence, and told to all as a return
    of the offsets: linked are confirmed tracks that took returns of a sensor without offsets, such as AIS or a radar that is
    taken as registered, or of sensors that together tell their offsets, such as two radars at different places, and those
    given at the start, such as fixed echoes. For other tracks the offsets turn or shift all that they see, which nothing
    tells; linearised filters would learn of it by their errors alone.
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
        return x

    def jacobian(self, x: Array) -> Array:
        return np.eye(len(self.observes))

    def noise(self, x: Array) -> Array:
        """Return R (q, q); each return states its own."""
        return np.eye(len(self.observes))

    def detects(self, x: Array) -> Array:
        return np.ones(())

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


@frozen(eq=False)
class Offsets:
    """The shared axes of a tracker: their indices `at` (q,) in the state, their prior over `space`, what tells of them.

    slots: the number of each sensor with offsets, from 1; of one without and of given tracks it is 0. sets (c, n): whose
    returns, by slots, link a track.
    """

    state: Space
    at: Indices
    prior: Gaussian
    agreed: Agreed
    slots: Mapping[str, int]
    sets: Mask

    @property
    def space(self) -> Space:
        """The axes."""
        return self.agreed.observes

    def codes(self, ids: Indices, sensor: str | None = None) -> Indices:
        """Return what `State.linked` holds of tracks that took a return of a sensor; None: that were given."""
        return ids * self.sets.shape[1] + (0 if sensor is None else self.slots.get(sensor, 0))

    def tell(self, ids: Indices, linked: Indices) -> tuple[Indices, Mask]:
        """Return the codes of `linked` that are of these tracks, and which of the tracks are linked."""
        n = self.sets.shape[1]
        took = np.isin(ids[:, None] * n + np.arange(n), linked)
        return linked[np.isin(linked // n, ids)], np.any(np.all(took[:, None] | ~self.sets, axis=-1), axis=-1)

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
    at = np.array([state.names.index(name) for name in registration.offsets])
    deviations = np.array(list(registration.offsets.values()))
    off = [name for name, names in observed.items() if set(registration.offsets) & set(names)]
    sets = np.eye(1, 1 + len(off), dtype=bool)
    for together in _telling(state, at, deviations, [sensors[name] for name in off]):
        sets = np.vstack([sets, np.isin(np.arange(1 + len(off)), np.add(together, 1))])
    starts_none = birth is not None and type(birth).given is Birth.given
    if starts_none and len(off) == len(sensors) and len(sets) == 1:
        told = (
            f"must be told by a sensor without them, by given tracks, or from different places; {', '.join(map(repr, off))}"
        )
        raise ValueError(f"registration.offsets: {told} do not: other offsets would move all returns alike, or nearly so")
    prior, space = Gaussian(np.zeros(len(at)), np.diag(deviations**2)), Space(tuple(state.axes[i] for i in at))
    return Offsets(state, at, prior, Agreed(space), {name: 1 + i for i, name in enumerate(off)}, sets)


def _telling(state: Space, at: Indices, deviations: Array, sensors: Sequence[Sensor]) -> Iterator[tuple[int, ...]]:
    """Yield the smallest sets of sensors whose returns tell their offsets, wherever they look at targets together."""
    x = np.concatenate([_seen(state, at, sensor) for sensor in sensors])[:: len(sensors)]
    rest, every, sees = np.setdiff1d(np.arange(len(state)), at), list[Array](), list[Mask]()
    for sensor in sensors:
        own = x[:, state.locate(sensor.observes)]
        H = np.zeros((len(x), len(sensor.measurement), len(state)))
        H[..., state.locate(sensor.observes)] = sensor.jacobian(own)
        every.append(np.swapaxes(H, -1, -2) @ np.linalg.inv(sensor.noise(own)) @ H)
        sees.append(np.broadcast_to(sensor.detects(own) > 0, len(x)))
    found = list[tuple[int, ...]]()
    for some in (one for size in range(1, MOST + 1) for one in combinations(range(len(sensors)), size)):
        both = np.all([sees[i] for i in some], axis=0)
        if any(set(one) <= set(some) for one in found) or not both.any():
            continue
        off = [i for i, axis in enumerate(at) if any(state.names[axis] in sensors[j].observes for j in some)]
        total, own = np.sum([every[i][both] for i in some], axis=0), at[off]
        across = total[:, own][..., rest]
        hidden = across @ np.linalg.pinv(total[:, rest][..., rest], 1e-12, hermitian=True) @ np.swapaxes(across, -1, -2)
        told = np.mean(total[:, own][..., own] - hidden, axis=0) * np.outer(deviations[off], deviations[off])
        if np.linalg.eigvalsh(told)[0] > TELLS:
            found.append(some)
            yield some


def _seen(state: Space, at: Indices, sensor: Sensor) -> Array:
    """Return states (p, n) of targets at places that a sensor might see, without offsets."""
    rng, of = np.random.default_rng(0), sensor
    while isinstance(of, WrappedSensor):
        of = of.of
    far, turn = 10.0 ** rng.uniform(1, 5, (PLACES, 1)), rng.uniform(-0.5, 0.5, (PLACES, len(of.measurement)))
    axes, x = of.measurement.axes, rng.normal(0.0, 10.0, (PLACES, len(state)))
    z = np.where([axis.unit == "m" for axis in axes], far, turn * [axis.period or 1.0 for axis in axes])
    try:
        x[:, state.locate(of.observes)] += of.invert(z).mean
    except NotImplementedError:  # one return gives no place
        x *= far
    x[:, at] = 0.0
    return x
