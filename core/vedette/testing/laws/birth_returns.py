"""Laws of how a birth reads a scan and a state: returns row by row, axes by their names, no unit, and nothing missing."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette.supporting import Birth
from vedette.testing.comparisons import (
    Closed,
    closed_by,
    closed_if,
    covariance,
    demand,
    deviations,
    frozen_copy,
    products,
    same,
    same_moments,
)
from vedette.testing.law import Law
from vedette.testing.laws.birth_cases import P_GATE, Returns, begun
from vedette.testing.laws.noise_units import factors, in_half_the_unit
from vedette.testing.strategies import SENSOR, usual
from vedette.types import Detections, Gaussian, Newborn


def axes_are_found_by_name(birth: Birth, drawn: Returns) -> None:
    """The order of the axes in the filter's state is free: the same tracks start, over the axes of the same names."""
    free = np.zeros(len(drawn.claimed))
    other = evolve(drawn, estimator=usual("estimator", "kalman")(usual("motion", "constant_velocity")(0.5, axes=("y", "x"))))
    here, there = begun(birth, drawn, free), begun(birth, other, free)
    same("returns, of a state of y, x, vy, vx", there.returns.astype(float), here.returns.astype(float), 0.0)
    where = other.estimator.state.locate(drawn.estimator.state)
    found = Gaussian(there.prior.mean[:, where], there.prior.cov[:, where][..., where])
    same_moments("begin, of a state of y, x, vy, vx: ", drawn.estimator.state, found, here.prior, 1e-6)


def each_return_has_its_own_noise(birth: Birth, drawn: Returns) -> None:
    """A new track comes from its own return and that one's noise, wherever they stand in the scan, whatever is claimed."""
    k = len(drawn.claimed)
    order = np.arange(k)[::-1]
    own = drawn.sensor.noise(np.zeros(2)) * 4.0 ** np.arange(k)[:, None, None]
    starts = []
    for rows in (np.arange(k), order):
        scan = Detections(drawn.detections.z[rows], drawn.detections.valid[rows], None, own[rows])
        made = begun(birth, evolve(drawn, detections=scan), frozen_copy(np.round(drawn.claimed[rows])))
        starts.append({int(rows[i]): Gaussian(made.prior.mean[j], made.prior.cov[j]) for j, i in enumerate(made.returns)})
    for i in starts[0].keys() & starts[1].keys():
        told = "begin, of a return with its own noise in another row: "
        same_moments(told, drawn.estimator.state, starts[1][i], starts[0][i], 1e-6)


def what_is_missing_says_nothing(birth: Birth, drawn: Returns) -> None:
    """What a return holds where it lacks a component, or where it only pads the scan, starts nothing and changes nothing."""
    k = len(drawn.claimed)
    closed_if(not k, "a scan without returns lacks nothing")
    sensor = usual("sensor", "partial")(drawn.sensor, {"y": 1000.0})
    missing, valid = np.zeros((k, 2), dtype=bool), np.ones(k, dtype=bool)
    missing[0, 1], valid[-1] = True, k < 2
    made = []
    for junk in (0.0, -3e5):
        z = np.array(drawn.detections.z)
        z[0, 1] = junk
        if k > 1:
            z[-1] = junk
        scan = Detections(frozen_copy(z), valid, None, None, missing)
        made.append(begun(birth, evolve(drawn, detections=scan, sensor=sensor), np.zeros(k)))
    first, other = made
    told = "what stands where a component is missing, or in padding,"
    which = f"begin: {told} decides which returns start tracks: {first.returns} or {other.returns}"
    demand(np.array_equal(first.returns, other.returns), which)
    same("mean, with something else where a component is missing", other.prior.mean, first.prior.mean, 1e-9)
    same("covariance, with something else where a component is missing", other.prior.cov, first.prior.cov, 1e-9)
    same("existence, with something else where a component is missing", other.existence, first.existence, 1e-9)


def last(birth: Birth, drawn: Returns, *scans: Array) -> Newborn:
    """The tracks that start at the returns of the last of some scans, none of which is a track's."""
    estimator, sensor, free, rng = drawn.estimator, drawn.sensor, np.zeros(len(scans[0])), drawn.rng()
    memory, found = birth.initial_memory(estimator, rng) if birth.models_unseen else None, None
    for z in scans:
        scan = Detections.of(z, 2)
        if birth.models_unseen:
            memory = birth.predict(memory, estimator, drawn.dt, rng)
            found = birth.reveal(memory, estimator, sensor, scan, P_GATE)[1]
        newborn = birth.begin(found, estimator, sensor, SENSOR, scan, free)
        if birth.models_unseen:
            memory = birth.update(memory, estimator, sensor, scan, free, P_GATE)
    return newborn


def tracks_are_as_unsure_as_their_returns(birth: Birth, drawn: Returns) -> None:
    """Somewhere, a target seen two or three times starts a track, as unsure as the noise of these makes it at least."""
    closed_if(birth.draws or not birth.starts_from(SENSOR), "no return starts a track, or what it draws hides it")
    drawn = evolve(drawn, sensor=evolve(drawn.sensor, clutter_density=1e-12))  # type: ignore[misc]  # for rare targets
    grid = np.stack(np.meshgrid(*[np.linspace(-400.0, 400.0, 5)] * 2), axis=-1).reshape(-1, 2)
    scans = [grid + drawn.rng().uniform(-9.0, 9.0, 2) + 0.03 * drawn.dt * i for i in range(3)]
    with closed_by(ValueError, "it starts no tracks there: {}"):
        before = last(birth, drawn, *scans[:2])
        scans = scans[:2] if len(before.returns) else scans
        before = before if len(before.returns) else last(birth, drawn, *scans)
    if not len(before.returns) and (getattr(birth, "least", 0.0) > 1e-4 or not getattr(birth, "deviations", 1.0)):
        raise Closed("it starts only tracks that likely exist, or none but where a return lies exactly")
    demand(len(before.returns), "begin: none of 25 targets, seen three times and never claimed, starts a track")
    sigma = np.sqrt(drawn.sensor.noise(np.zeros(2))[0, 0])
    added = np.zeros(before.prior.cov.shape)
    for which in range(len(scans)):
        for axis in (0, 1):
            moved = [np.array(z) for z in scans]
            moved[which][:, axis] += 1e-3 * sigma
            other = last(birth, drawn, *moved)
            closed_if(not np.array_equal(other.returns, before.returns), "a small step changes which returns start tracks")
            slope = (other.prior.mean - before.prior.mean) / 1e-3
            added += slope[:, :, None] * slope[:, None, :]
    left = (before.prior.cov - 0.5 * added) / products(np.maximum(deviations(before.prior.cov), 1e-150))
    values, axes = np.linalg.eigh(left)
    row = int(np.argmin(values[:, 0]))
    name = drawn.estimator.state.names[int(np.argmax(np.abs(axes[row, :, 0])))]
    otherwise = "must hold J R J', J being how the mean follows the returns and R their noise; of half of that"
    demand(values[row, 0] > -1e-6, f"begin: the covariance of {name} {otherwise} {-values[row, 0]:.3g} is lacking")


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


LAWS = (
    *(Law(law, needs="not draws") for law in (axes_are_found_by_name, births_know_no_unit)),
    *map(Law, (each_return_has_its_own_noise, what_is_missing_says_nothing, tracks_are_as_unsure_as_their_returns)),
)
