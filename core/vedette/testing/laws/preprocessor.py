"""Laws of preprocessors: from raw scans of one moment to the returns of a tracker's sensor."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette.errors import VedetteError
from vedette.sampling.trajectories import psd_root
from vedette.space import Array
from vedette.supporting import ImagingSensor, Preprocessor
from vedette.testing.comparisons import Closed, covariance, demand, finite, frozen_copy, same
from vedette.testing.law import Law, Profile
from vedette.testing.states import SEEDS, sizes
from vedette.types import Detections, Frame, Pose, Scan


@frozen(eq=False)
class Raw:
    """One moment's scans by sensor name: returns of states of usual size, with the sensor's own noise."""

    scans: dict[str, Scan]
    padded: dict[str, Scan]
    empty: dict[str, Scan]


def drawn(preprocessor: Preprocessor, profile: Profile) -> st.SearchStrategy[Raw]:
    """What every law of a preprocessor is given: up to 4 returns of each of its sensors."""
    return st.builds(_raw, st.just(preprocessor), st.integers(0, 4), SEEDS)


def _raw(preprocessor: Preprocessor, k: int, seed: int) -> Raw:
    rng = np.random.default_rng(seed)
    full, padded, empty = {}, {}, {}
    for name, sensor in preprocessor.sensors.items():
        x = sizes(sensor.observes) * rng.uniform(-1.0, 1.0, (k, len(sensor.observes)))
        m = len(sensor.measurement)
        root = psd_root(np.broadcast_to(sensor.noise(x), (k, m, m)))
        noise = (root @ rng.standard_normal((k, m, 1)))[..., 0]
        z = sensor.measurement.displace(sensor.measure(x), noise)
        full[name] = _scan(name, z, k)
        padded[name] = _scan(name, np.concatenate([z, np.zeros((2, m))]), k)
        empty[name] = _scan(name, np.zeros((0, m)), 0)
    return Raw(full, padded, empty)


def _scan(name: str, z: Array, count: int) -> Scan:
    return Scan(5.0, name, Detections(frozen_copy(z), np.arange(len(z)) < count))


def _made(preprocessor: Preprocessor, scans: dict[str, Scan]) -> Detections:
    """What it makes of the scans, the valid returns only."""
    made = preprocessor.process(scans)
    m = len(preprocessor.measurement)
    demand(made.z.shape[-1:] == (m,), f"z: must have {m} axes {preprocessor.measurement}, got shape {made.z.shape}")
    demand(made.valid.shape == made.z.shape[:-1], f"valid: must have shape {made.z.shape[:-1]}, got {made.valid.shape}")
    evidence = None if made.evidence is None else made.evidence[made.valid]
    noise = None if made.noise is None else made.noise[made.valid]
    return Detections(made.z[made.valid], made.valid[made.valid], evidence, noise)


def pure(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Calls leave the scans as they were, and give the same again."""
    first, again = _made(preprocessor, drawn.scans), (_made(preprocessor, drawn.empty), _made(preprocessor, drawn.scans))[1]
    same("returns again", again.z, first.z, 0.0)


def makes_finite_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """What it makes is finite and canonical, over `measurement`, padding included."""
    made = _made(preprocessor, drawn.scans)
    finite("z, padding included", preprocessor.process(drawn.padded).z)
    finite("z", made.z)
    same("z, canonical", made.z, preprocessor.measurement.canonical(made.z), 1e-9)
    if made.evidence is not None:
        finite("evidence", made.evidence)


def noise_is_positive_definite(preprocessor: Preprocessor, drawn: Raw) -> None:
    """The noise that a return brings is symmetric and positive definite."""
    made = _made(preprocessor, drawn.scans)
    if made.noise is not None:
        m = len(preprocessor.measurement)
        demand(made.noise.shape == (len(made.z), m, m), f"noise: must be (k, {m}, {m}), got shape {made.noise.shape}")
        covariance("noise", made.noise, definite=True)


def padding_changes_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """Returns that are not valid are as if they were not there."""
    plain, padded = _made(preprocessor, drawn.scans), _made(preprocessor, drawn.padded)
    same("returns", padded.z, plain.z)
    if plain.noise is not None and padded.noise is not None:
        same("noise", padded.noise, plain.noise)


def nothing_comes_of_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """From scans without returns it makes none."""
    made = _made(preprocessor, drawn.empty)
    demand(not len(made.z), f"returns: must be none where none were reported, got {len(made.z)}")


def _exact(preprocessor: Preprocessor, drawn: Raw, scale: float | None = None) -> tuple[Array, Detections]:
    """States (3, n) over `measurement`, as one sensor sees them without error, and what is made of them; Closed if the axes
    of the output are not those of a state.
    """
    space, sensors = preprocessor.measurement, preprocessor.sensors
    if len(sensors) != 1 or set(space.names) - set(next(iter(sensors.values())).observes.names):
        raise Closed("what it makes are not axes of a state that one sensor observes")
    ((name, sensor),) = sensors.items()
    rng = np.random.default_rng(len(drawn.scans[name].detections.z))
    x = sizes(sensor.observes) * rng.uniform(0.3, 1.0, (3, len(sensor.observes))) * rng.choice([-1.0, 1.0], (3, 1))
    z, m = sensor.measure(x), len(sensor.measurement)
    own = None if scale is None else np.broadcast_to(scale * sensor.noise(x), (3, m, m))
    scan = Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool), None, own))
    where = [sensor.observes.names.index(axis) for axis in space.names]
    return x[:, where], _made(preprocessor, {name: scan})


def returns_lie_where_they_were_seen(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: each lies at its target, give or take the noise that it states."""
    x, made = _exact(preprocessor, drawn)
    if len(made.z) != 3 or made.noise is None:
        raise Closed("it does not make one return of each")
    apart = made.z - x
    distance = np.sum(apart * np.linalg.solve(made.noise, apart[..., None])[..., 0], axis=-1)
    demand(np.all(distance < 9.0), f"returns: are off by {np.sqrt(distance).tolist()} of their deviations, allowed 3")


def sharper_returns_make_sharper_ones(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: their noise is the sensor's, or a return's own, carried over."""
    _, usual = _exact(preprocessor, drawn)
    x, sharp = _exact(preprocessor, drawn, 1e-4)
    if usual.noise is None or sharp.noise is None or len(usual.z) != 3 or len(sharp.z) != 3:
        raise Closed("it does not make one return with its noise of each")
    ratio = np.trace(sharp.noise, axis1=-2, axis2=-1) / np.trace(usual.noise, axis1=-2, axis2=-1)
    demand(np.all(ratio < 0.5), f"noise: of returns 100 times sharper must shrink, is {ratio.tolist()} of the usual")
    ((_, sensor),) = preprocessor.sensors.items()
    where = [sensor.observes.names.index(axis) for axis in preprocessor.measurement.names]
    if len(where) != len(sensor.observes) or len(where) != len(sensor.measurement):
        return
    full = np.zeros((3, len(where)))
    full[:, where] = x
    stated = np.broadcast_to(sensor.noise(full), sharp.noise.shape)
    angles = [axis.unit == "rad" for axis in sensor.measurement.axes]
    if np.any(np.diagonal(stated, axis1=-2, axis2=-1)[..., angles] > 0.2**2):
        return  # conversions allow for the noise of angles that the sensor states, and where that is large, for much
    H, R = sensor.jacobian(full)[..., where], 1e-4 * stated
    carried = H @ sharp.noise @ np.swapaxes(H, -1, -2)
    root = np.linalg.cholesky(R)
    white = np.linalg.eigvalsh(np.linalg.solve(root, np.swapaxes(np.linalg.solve(root, carried), -1, -2)))
    demand(
        np.all((white > 0.5) & (white < 2.0)),
        f"noise: in the sensor's own axes, it is {white.min():.3g} to {white.max():.3g} times the sensor's",
    )


def placed_scans_are_placed(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If its sensor can be placed: a scan from elsewhere makes the returns of elsewhere."""
    x, _ = _exact(preprocessor, drawn)
    ((name, sensor),) = preprocessor.sensors.items()
    pose = Pose(np.array([700.0, -300.0]), heading=0.4)
    try:
        there = sensor.at(pose)
    except NotImplementedError:
        raise Closed("its sensor cannot be placed") from None
    where = [sensor.observes.names.index(axis) for axis in preprocessor.measurement.names]
    if len(where) != len(sensor.observes):
        raise Closed("its sensor observes further axes")
    full = np.zeros((3, len(where)))
    full[:, where] = x
    scan = Scan(5.0, name, Detections(frozen_copy(there.measure(full)), np.ones(3, dtype=bool)), pose)
    made = _made(preprocessor, {name: scan})
    if len(made.z) != 3 or made.noise is None:
        raise Closed("it does not make one return of each")
    distance = np.sum((made.z - x) * np.linalg.solve(made.noise, (made.z - x)[..., None])[..., 0], axis=-1)
    demand(np.all(distance < 9.0), f"returns: of a placed scan are off by {np.sqrt(distance).tolist()} of their deviations")


def evidence_is_passed_on(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: what says that one is of a target goes with it."""
    x, made = _exact(preprocessor, drawn)
    if len(made.z) != 3:
        raise Closed("it does not make one return of each")
    ((name, sensor),) = preprocessor.sensors.items()
    own = np.array([1.0, -2.0, 4.0])
    full = np.zeros((3, len(sensor.observes)))
    full[:, [sensor.observes.names.index(axis) for axis in preprocessor.measurement.names]] = x
    z = sensor.measure(full)
    with_it = _made(preprocessor, {name: Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool), own))})
    demand(with_it.evidence is not None, "evidence: the returns have some, and what is made of them has none")
    assert with_it.evidence is not None
    order = [int(np.argmin(np.linalg.norm(with_it.z - one, axis=-1))) for one in made.z]
    demand(
        bool(np.all(np.diff(with_it.evidence[order][np.argsort(own)]) > 0)),
        f"evidence: of returns with {own.tolist()} nats becomes {with_it.evidence[order].tolist()}",
    )


def pictures_make_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it reads pictures: a spot that stands out of noise, bright or dark, makes a return, elsewhere with the picture."""
    if [sensor for sensor in preprocessor.sensors.values() if isinstance(sensor, ImagingSensor)] == []:
        raise Closed("it reads no pictures")
    ((name, _),) = preprocessor.sensors.items()
    lit = np.random.default_rng(len(drawn.scans[name].detections.z)).exponential(1.0, (60, 160))
    lit[20:23, 80] = 1e5

    def made(pixels: Array, x: float = 0.0, y: float = 0.0) -> Array:
        place = np.array([x, y])
        frame, pose = Frame(frozen_copy(pixels), place), Pose(place, heading=np.pi / 2)
        return _made(preprocessor, {name: evolve(Scan.image(5.0, name, frame), pose=pose)}).z

    try:
        some = made(lit)
        if not len(some):
            lit = lit.max() - lit
            some = made(lit)
    except VedetteError as refusal:
        raise Closed(f"it refuses the kit's pictures: {refusal}") from None
    demand(len(some), "returns: must be some of a picture with a spot in noise, got none")
    moved = np.zeros(some.shape[-1])
    for i, axis in enumerate(preprocessor.measurement.axes):
        moved[i] = {"x": 40.0, "y": -30.0}.get(axis.name, 0.0)
    same("returns of a picture that is elsewhere", made(lit, 40.0, -30.0), some + moved, 1e-9)


LAWS = (
    Law(pure),
    Law(makes_finite_returns),
    Law(noise_is_positive_definite),
    Law(padding_changes_nothing),
    Law(nothing_comes_of_nothing),
    Law(returns_lie_where_they_were_seen),
    Law(sharper_returns_make_sharper_ones),
    Law(placed_scans_are_placed),
    Law(evidence_is_passed_on),
    Law(pictures_make_returns),
)
