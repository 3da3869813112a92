"""Births by returns: from two scans, and with existence shared among what no track claims."""

from typing import Any

import numpy as np
from attrs import evolve, frozen

import vedette
from foreign import Foreign


def whole(detections):
    """Return which returns (k,) are valid and lack no component."""
    return detections.valid if detections.missing is None else detections.valid & ~detections.missing.any(axis=-1)


def placed(state, spread, axes, mean, cov):
    """Return a prior (j, n) over `state` from one over `axes`; the other axes are 0 +- `spread`."""
    if lacking := [axis for axis in state.names if axis not in axes and axis not in spread]:
        raise ValueError(f"spread: must state the standard deviation of {', '.join(lacking)}")
    known = [axis for axis in axes.axes if axis.name in state]
    here, there = axes.locate(vedette.Space(tuple(known))), state.locate(vedette.Space(tuple(known)))
    full = np.diag([0.0 if axis in axes else spread[axis] ** 2 for axis in state.names])
    prior = np.zeros((len(mean), len(state))), np.repeat(full[None], len(mean), axis=0)
    prior[0][:, there] = mean[:, here]
    prior[1][(slice(None), *np.ix_(there, there))] = cov[(slice(None), *np.ix_(here, here))]
    return vedette.Gaussian(state.canonical(prior[0]), prior[1])


def inverted(sensor, detections):
    """Return the moments (k, n) that each return gives alone; a return that lacks a component is read as it stands."""
    return sensor.invert(detections.z, detections.noise)


@frozen
class SharedBirth(vedette.Birth):
    """Every return may be a new target's: existence `expected` (1 - claimed) over the sum of it, at most `most`.

    Reuter, Vo, Vo, Dietmayer, The Labeled Multi-Bernoulli Filter, IEEE T-SP 62, 2014, section IV.
    """

    kind = "shared_birth"
    expected: float = vedette.fields.quantity("1", "targets that appear in a scan", default=0.5, above=0, at_most=10)
    most: float = vedette.fields.probability("largest existence of a new track", default=0.3, above=0)
    least: float = vedette.fields.probability("existence below which no track starts", default=0.01)
    spread: dict[str, float] = vedette.fields.table("state axis that sensors do not observe to its standard deviation")

    def begin(self, found, estimator, sensor, name, detections, claimed):
        prior = inverted(sensor, detections)
        free = np.where(whole(detections), 1 - claimed, 0.0)
        existence = np.minimum(self.expected * free / max(free.sum(), 1e-12), self.most) * free
        chosen = np.flatnonzero(existence >= max(self.least, 1e-9))
        started = placed(estimator.state, self.spread, sensor.observes, prior.mean[chosen], prior.cov[chosen])
        return vedette.Newborn(chosen, started, existence[chosen])


@frozen(eq=False)
class Waiting:
    """Places and their covariances of the last scan's free returns, over `axes`, and their age in s."""

    mean: vedette.Array
    cov: vedette.Array
    axes: Any
    age: float


@frozen
class TwoPoint(vedette.Birth):
    """Two-point differencing: a free return near enough to one of the scan before starts a track, v = (p_1 - p_0) / T.

    Its covariance is [R_1, R_1 / T; R_1 / T, (R_1 + R_0) / T^2]; near enough is within `fastest` T and 3 deviations.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.3.
    """

    kind = "two_point"
    models_unseen = True
    fastest: float = vedette.fields.quantity("m/s", "greatest speed of a target", default=30, above=0)
    initial: float = vedette.fields.probability("that a new track is of a target", default=0.3, above=0)
    spread: dict[str, float] = vedette.fields.table("further state axis to its standard deviation")

    def predict(self, memory, estimator, dt, rng):
        return None if memory is None else evolve(memory, age=memory.age + dt)

    def update(self, memory, estimator, sensor, detections, claimed, p_gate):
        free = whole(detections) & (claimed < 0.5)
        prior = inverted(sensor, detections)
        return Waiting(prior.mean[free], prior.cov[free], sensor.observes, 0.0)

    def begin(self, found, estimator, sensor, name, detections, claimed):
        places = [axis for axis in sensor.observes.axes if axis.unit == "m" and "v" + axis.name in estimator.state]
        position, d = vedette.Space(tuple(places)), len(places)
        speed = tuple(vedette.Axis("v" + axis.name, "m/s") for axis in places)
        now, where = inverted(sensor, detections), sensor.observes.locate(position)
        known = isinstance(found, Waiting) and found.age > 0 and all(axis.name in found.axes for axis in places) and d > 0
        chosen, means, covs = [], np.zeros((0, 2 * d)), np.zeros((0, 2 * d, 2 * d))
        for i in np.flatnonzero(whole(detections) & (claimed < 0.5)) if known else ():
            p1, R1 = now.mean[i, where], now.cov[i][np.ix_(where, where)]
            there, T = found.axes.locate(position), found.age
            apart = p1 - found.mean[:, there]
            allowed = found.cov[:, there, there].sum(axis=-1) + np.trace(R1)
            over = np.linalg.norm(apart, axis=-1) - self.fastest * T - 3 * np.sqrt(allowed)
            if not len(over) or over.min() > 0:
                continue
            j = int(np.argmin(over))
            R0 = found.cov[j][np.ix_(there, there)]
            chosen.append(i)
            means = np.vstack([means, np.concatenate([p1, apart[j] / T])])
            covs = np.concatenate([covs, np.block([[R1, R1 / T], [R1 / T, (R1 + R0) / T**2]])[None]])
        started = placed(estimator.state, self.spread, vedette.Space((*places, *speed)), means, covs)
        return vedette.Newborn(np.array(chosen, dtype=np.intp), started, self.initial * (1 - claimed[chosen]))


COMPONENTS = (
    Foreign("shared birth", "birth", lambda: SharedBirth(spread={"vx": 10.0, "vy": 10.0})),
    Foreign("two-point differencing", "birth", TwoPoint),
)
