"""Laws of preprocessors: from raw scans of one moment to the returns of a tracker's sensor."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from attrs import evolve

from vedette.config.parameters import parameters
from vedette.supporting import ImagingSensor, Preprocessor
from vedette.testing.comparisons import Closed, Unlike, closed_if, covariance, demand, finite, frozen_copy, same, whitened
from vedette.testing.law import Law
from vedette.testing.laws import preprocessor_fusion, preprocessor_pictures
from vedette.testing.laws.platforms import placed
from vedette.testing.laws.preprocessor_cases import Raw, exactly, leaning, made_of
from vedette.testing.states import sizes
from vedette.tracking import take
from vedette.types import Detections, Pose, Scan

KNOWN = "; if it takes off an error that such sensors have, say so in its `known_failures`"


def pure(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Calls leave the scans as they were, and give the same again."""
    first, _, again = (made_of(preprocessor, scans) for scans in (drawn.scans, drawn.empty, drawn.scans))
    same("returns again", again.z, first.z, 0.0)


def makes_finite_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """What it makes is finite and canonical, over `measurement`, padding included."""
    made = made_of(preprocessor, drawn.scans)
    finite("z, padding included", preprocessor.process(drawn.padded).z)
    finite("z", made.z)
    same("z, canonical", made.z, preprocessor.measurement.canonical(made.z), 1e-9)
    if made.evidence is not None:
        finite("evidence", made.evidence)


def noise_is_positive_definite(preprocessor: Preprocessor, drawn: Raw) -> None:
    """The noise that a return brings is symmetric and positive definite."""
    made = made_of(preprocessor, drawn.scans)
    if made.noise is not None:
        m = len(preprocessor.measurement)
        demand(made.noise.shape == (len(made.z), m, m), f"noise: must be (k, {m}, {m}), got shape {made.noise.shape}")
        covariance("noise", made.noise, definite=True)


def padding_changes_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Returns that are not valid are as if they were not there."""
    plain, padded = made_of(preprocessor, drawn.scans), made_of(preprocessor, drawn.padded)
    same("returns", padded.z, plain.z)
    if plain.noise is not None and padded.noise is not None:
        same("noise", padded.noise, plain.noise)


def nothing_comes_of_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """From scans without returns it makes none."""
    made = made_of(preprocessor, drawn.empty)
    demand(not len(made.z), f"returns: must be none where none were reported, got {len(made.z)}")


def returns_lie_where_they_were_seen(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions: a target that all sensors see exactly has a return there, give or take the noise it states."""
    exact = exactly(preprocessor, drawn, several=True)
    demand(len(preprocessor.sensors) == 1 or len(exact.made.z), "returns: must be some of targets that all sensors see")
    off = exact.far()
    demand(np.all(off < 9.0), f"returns: are off by {np.sqrt(off).tolist()} of their deviations, allowed 3{KNOWN}")


def sharper_returns_make_sharper_ones(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: their noise is the sensor's, or a return's own, carried over."""
    exact, sharp = exactly(preprocessor, drawn), exactly(preprocessor, drawn, 1e-2).made
    usual, where = exact.made, exact.where
    if usual.noise is None or sharp.noise is None or len(usual.z) != 3 or len(sharp.z) != 3:
        raise Closed("it does not make one return with its noise of each")
    ((name, sensor),) = preprocessor.sensors.items()
    angles = [axis.unit == "rad" for axis in sensor.measurement.axes]
    stated = np.broadcast_to(sensor.noise(exact.states), (3, len(angles), len(angles)))
    if np.any(np.diagonal(stated, axis1=-2, axis2=-1)[..., angles] > 0.2**2):
        raise Closed("its sensor's angles err by more than .2 rad, where what is made of them depends on the method")
    ratio = np.trace(sharp.noise, axis1=-2, axis2=-1) / np.trace(usual.noise, axis1=-2, axis2=-1)
    demand(np.all(ratio < 0.5), f"noise: of returns 10 times sharper must shrink, is {ratio.tolist()} of the usual")
    for parameter in parameters(type(sensor)):
        value = getattr(sensor, parameter.name)
        if parameter.name.startswith("sigma_") and parameter.unit == "m" and value:
            with suppress(TypeError, ValueError):  # its sensors are no parameter, or so large a deviation is none
                less: Any = evolve(sensor, **{parameter.name: 3.0 * value})  # type: ignore[misc]
                wider: Any = made_of(evolve(preprocessor, sensors={name: less}), exact.scans).noise  # type: ignore[misc]
                grows = np.trace(wider - usual.noise, axis1=-2, axis2=-1)
                demand(np.all(grows > 0), f"noise: must grow with {parameter.name} of {name!r}, grows by {grows.tolist()}")
    if len(where) != len(sensor.observes) or len(where) != len(sensor.measurement):
        return
    H, R = sensor.jacobian(exact.states)[..., where], 1e-2 * leaning(stated)
    back = np.linalg.pinv(H)
    # How far the arc of a deviation in angle leaves its tangent, squared: below the variance of all else, that is no matter.
    arcs = np.diagonal(R, axis1=-2, axis2=-1)[..., angles] / np.linalg.norm(H, axis=-1)[..., angles]
    least = np.linalg.eigvalsh(back @ R @ np.swapaxes(back, -1, -2))[..., 0]
    if np.max(arcs**2, initial=0.0) > 0.1 * np.min(least):
        return
    carried = H @ sharp.noise @ np.swapaxes(H, -1, -2)
    white = np.linalg.eigvalsh(whitened(np.linalg.cholesky(R), carried))
    told = f"noise: in the sensor's own axes, it is {white.min():.3g} to {white.max():.3g} times the sensor's"
    demand(np.all((white > 0.75) & (white < 1.4)), told)


def placed_scans_are_placed(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If its sensor can be placed: a scan from elsewhere makes the returns of elsewhere, and so do several runs."""
    exact = exactly(preprocessor, drawn)
    ((name, sensor),) = preprocessor.sensors.items()
    poses = [Pose(np.array([700.0, -300.0]), heading=0.4), Pose(np.array([-200.0, 50.0]), heading=-1.0)]
    each = [placed(sensor, pose).measure(exact.states) for pose in poses]
    alone: list[Detections] = []
    for pose, z in zip(poses, each, strict=True):
        scan = Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool)), pose)
        alone.append(made_of(preprocessor, {name: scan}))
        off = evolve(exact, made=alone[-1]).far()
        demand(np.all(off < 9.0), f"returns: of a placed scan are off by {np.sqrt(off).tolist()} of their deviations{KNOWN}")
    several = Pose(np.stack([pose.position for pose in poses]), heading=np.array([pose.heading for pose in poses]))
    both = Scan(5.0, name, Detections(frozen_copy(np.stack(each)), np.ones((2, 3), dtype=bool)), several)
    made = preprocessor.process({name: both})
    for run, one in enumerate(alone):
        same(f"returns of two runs from two places[{run}]", made.z[run][made.valid[run]], one.z, 1e-9)


def what_is_said_of_a_return_goes_with_it(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it takes one sensor's returns: evidence, name, time and noise of one go with what is made of it.

    One that is passed on as it is may be called less sharp, and not sharper.
    """
    closed_if(len(preprocessor.sensors) != 1, Unlike("it takes several sensors"))
    ((name, sensor),) = preprocessor.sensors.items()
    alike = preprocessor.measurement == sensor.measurement and not isinstance(sensor, ImagingSensor)
    scan = drawn.scans[name] if alike else exactly(preprocessor, drawn).scans[name]
    z, count, m = scan.detections.z, np.arange(len(scan.detections.z)), len(sensor.measurement)
    own = np.eye(m) * (0.01 * sizes(sensor.measurement)) ** 2 * (1.0 + count)[:, None, None]
    said = {"evidence": 2.0 * count - 3.0, "identity": count + 100, "time": 5.0 - 0.1 * count, "noise": own}
    plain = Detections(frozen_copy(z), np.ones(len(z), dtype=bool), noise=frozen_copy(own))
    with_it = evolve(plain, **{what: frozen_copy(each) for what, each in said.items()})
    known = z if alike else made_of(preprocessor, {name: evolve(scan, detections=plain)}).z
    made = preprocessor.process({name: evolve(scan, detections=with_it)})
    made = take(made, made.valid, 0)
    far = np.linalg.norm(known[:, None] - made.z, axis=-1)
    pairs = [(i, int(np.argmin(row))) for i, row in enumerate(far) if np.min(row, initial=np.inf) == 0.0]
    closed_if(not pairs or not len(known) == len(z) == len(np.unique(known, axis=0)), "it passes no return on by itself")
    first, then = np.array(pairs).T
    for what, each in said.items():
        has, given = getattr(made, what), each[first]
        unknown = what in ("identity", "time") and has is None  # not all know of names and times
        if unknown or (what == "noise" and not alike):
            continue
        demand(has is not None, f"{what}: the returns have some, and what is made of them has none")
        kept = np.array_equal(has[then], given) or (what == "evidence" and np.all(np.diff(has[then]) > 0))
        wider = what == "noise" and np.all(np.linalg.eigvalsh(whitened(np.sqrt(given), has[then])) > 1 - 1e-9)
        demand(kept or wider, f"{what}: of returns with {given.tolist()} becomes {has[then].tolist()}")


LAWS: tuple[Law, ...] = (
    *map(Law, (pure, makes_finite_returns)),
    *(Law(law, share=2) for law in (
        noise_is_positive_definite, padding_changes_nothing, nothing_comes_of_nothing, returns_lie_where_they_were_seen,
    )),
    *map(Law, (sharper_returns_make_sharper_ones, placed_scans_are_placed, what_is_said_of_a_return_goes_with_it)),
    *preprocessor_fusion.LAWS, *preprocessor_pictures.LAWS,
)  # fmt: skip
