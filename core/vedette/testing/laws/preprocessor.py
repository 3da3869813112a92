"""Laws of preprocessors: from raw scans of one moment to the returns of a tracker's sensor."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st
from scipy.special import ndtri

from vedette.config.parameters import parameters
from vedette.errors import VedetteError
from vedette.sampling.trajectories import psd_root
from vedette.space import Array
from vedette.supporting import ImagingSensor, Preprocessor
from vedette.testing.bands import judge_run_means
from vedette.testing.comparisons import Closed, Lacking, covariance, demand, finite, frozen_copy, same
from vedette.testing.law import Law, Profile
from vedette.testing.laws.platforms import placed
from vedette.testing.states import SEEDS, sizes
from vedette.types import Detections, Frame, Pose, Scan

RARE, CELLS = 2e-4, 6000
"""Rate of false alarms that is tried, and cells of a row of noise: 1.2 of them are expected in it."""


@frozen(eq=False)
class Raw:
    """One moment's scans by sensor name: returns of states of usual size, with the sensor's own noise."""

    scans: dict[str, Scan]
    padded: dict[str, Scan]
    empty: dict[str, Scan]
    seed: int
    runs: int
    alpha: float


def drawn(preprocessor: Preprocessor, profile: Profile) -> st.SearchStrategy[Raw]:
    """What every law of a preprocessor is given: up to 4 returns of each of its sensors."""
    return st.builds(_raw, st.just(preprocessor), st.integers(0, 4), SEEDS, st.just(profile))


def _raw(preprocessor: Preprocessor, k: int, seed: int, profile: Profile) -> Raw:
    rng = np.random.default_rng(seed)
    full, padded, empty = {}, {}, {}
    for name, sensor in preprocessor.sensors.items():
        x = sizes(sensor.observes) * rng.uniform(-1.0, 1.0, (k, len(sensor.observes)))
        x[: int(rng.integers(2))] = 0.0  # where a range is 0, too
        m = len(sensor.measurement)
        root = psd_root(np.broadcast_to(sensor.noise(x), (k, m, m)))
        noise = (root @ rng.standard_normal((k, m, 1)))[..., 0]
        z = sensor.measurement.displace(sensor.measure(x), np.where(np.any(x, axis=-1, keepdims=True), noise, 0.0))
        full[name] = _scan(name, z, k)
        padded[name] = _scan(name, np.concatenate([z, np.zeros((2, m))]), k)
        empty[name] = _scan(name, np.zeros((0, m)), 0)
    return Raw(full, padded, empty, seed, profile.runs, profile.alpha)


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


@frozen(eq=False)
class Exact:
    """States (3, n) as each sensor sees them without error, where the output's axes stand in theirs, and what it makes."""

    states: Array
    where: list[int]
    scans: dict[str, Scan]
    made: Detections

    @property
    def x(self) -> Array:
        """The states over the axes of the output."""
        return self.states[:, self.where]

    def far(self) -> Array:
        """How far returns lie from their states, squared, in deviations of the noise that they state."""
        if len(self.made.z) != 3 or self.made.noise is None:
            raise Closed("it does not make one return with its noise of each")
        apart = self.made.z - self.x
        return np.asarray(np.sum(apart * np.linalg.solve(self.made.noise, apart[..., None])[..., 0], axis=-1))


def _exact(preprocessor: Preprocessor, drawn: Raw, scale: float | None = None, several: bool = False) -> Exact:
    """What is made of exact returns; Closed if the axes of the output are not those of a state that all sensors observe.

    `scale` of the sensor's noise: each return brings it as its own. `several` sensors are taken, too.
    """
    space, sensors = preprocessor.measurement, preprocessor.sensors
    observed = {sensor.observes for sensor in sensors.values()}
    if (len(sensors) > 1 and not several) or len(observed) != 1 or set(space.names) - set(next(iter(observed)).names):
        raise Closed("what it makes are not axes of a state that one sensor observes")
    (state,) = observed
    rng = np.random.default_rng(sum(len(scan.detections.z) for scan in drawn.scans.values()))
    x = sizes(state) * rng.uniform(0.3, 1.0, (3, len(state))) * rng.choice([-1.0, 1.0], (3, 1))
    scans = {}
    for name, sensor in sensors.items():
        z, m = sensor.measure(x), len(sensor.measurement)
        own = None if scale is None else np.broadcast_to(scale * sensor.noise(x), (3, m, m))
        scans[name] = Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool), None, own))
    return Exact(x, [state.names.index(axis) for axis in space.names], scans, _made(preprocessor, scans))


def returns_lie_where_they_were_seen(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions: a target that all sensors see exactly has a return there, give or take the noise it states."""
    exact = _exact(preprocessor, drawn, several=True)
    demand(len(preprocessor.sensors) == 1 or len(exact.made.z), "returns: must be some of targets that all sensors see")
    off = exact.far()
    demand(np.all(off < 9.0), f"returns: are off by {np.sqrt(off).tolist()} of their deviations, allowed 3")


def others_far_away_change_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions: what one sensor sees far away, on any side, changes no return here."""
    exact = _exact(preprocessor, drawn, several=True)
    axes = [i for i in exact.where if next(iter(preprocessor.sensors.values())).observes.axes[i].unit == "m"]
    if not len(exact.made.z) or not axes:
        raise Closed("it makes no return in m")
    beyond = np.repeat(exact.states[:1], 2 * len(axes), axis=0)
    beyond[range(len(beyond)), 2 * axes] += 3e5 * np.repeat([1.0, -1.0], len(axes))
    for name, sensor in preprocessor.sensors.items():
        z = np.concatenate([exact.scans[name].detections.z, sensor.measure(beyond)])
        more = _made(preprocessor, exact.scans | {name: _scan(name, z, len(z))})
        near = [int(np.argmin(np.linalg.norm(more.z - one, axis=-1))) for one in exact.made.z] if len(more.z) else []
        same(f"returns, with others of {name!r} far away", more.z[near], exact.made.z, 1e-9)
        for what in ("noise", "evidence"):
            if (before := getattr(exact.made, what)) is not None:
                same(f"{what}, with returns of {name!r} far away", getattr(more, what)[near], before, 1e-9)


def sensors_confirm_within_the_threshold(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it fuses sensors and has `threshold` in m: returns nearer than that make one, and those farther apart none."""
    units = {parameter.name: parameter.unit for parameter in parameters(type(preprocessor))}
    exact, limit = _exact(preprocessor, drawn, several=True), getattr(preprocessor, "threshold", 0.0)
    if len(preprocessor.sensors) < 2:
        raise Closed("it does not fuse sensors")
    if units.get("threshold") != "m":
        raise Lacking("threshold", "it has no `threshold` in m")
    for share, wanted in ((0.9, 1), (1.1, 0)):
        scans = {}
        for number, (name, sensor) in enumerate(preprocessor.sensors.items()):
            x = exact.states[:1].copy()
            x[0, exact.where[0]] += share * limit * (number if share > 1 else number > 0)
            scans[name] = _scan(name, sensor.measure(x), 1)
        made = len(_made(preprocessor, scans).z)
        told = f"returns: of those {share} times the threshold of {limit:g} m apart, {made} are made, must be {wanted}"
        demand(made == wanted, told)


def evidence_is_a_likelihood_ratio(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it fuses sensors and gives evidence: exp(-evidence) of targets' returns is 1 on average.

    E exp(-log p(e | target) / p(e | clutter)) = 1, whatever is told of a return; half and twice that are allowed.
    """
    exact = _exact(preprocessor, drawn, several=True)
    if len(preprocessor.sensors) < 2 or exact.made.evidence is None:
        raise Closed("it does not fuse sensors to evidence")
    rng = np.random.default_rng(len(exact.states))
    x = np.repeat(exact.states[:1], 1200, axis=0)
    x[:, exact.where[0]] += 1e4 * np.arange(len(x))
    scans = {}
    for name, sensor in preprocessor.sensors.items():
        m = len(sensor.measurement)
        root = psd_root(np.broadcast_to(sensor.noise(x), (len(x), m, m)))
        z = sensor.measurement.displace(sensor.measure(x), (root @ rng.standard_normal((len(x), m, 1)))[..., 0])
        z = z[rng.random(len(x)) < sensor.detects(x)]
        scans[name] = _scan(name, z, len(z))
    found = _made(preprocessor, scans).evidence
    if found is None or len(found) < 240:
        raise Closed("it makes few returns of targets")
    runs = np.array([np.mean(np.exp(-part)) for part in np.array_split(found, 30)])
    judge_run_means("exp(-evidence) of targets' returns", runs, 0.5, 2.0, 1e-9)


def sharper_returns_make_sharper_ones(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: their noise is the sensor's, or a return's own, carried over."""
    exact, sharp = _exact(preprocessor, drawn), _exact(preprocessor, drawn, 1e-2).made
    usual, where = exact.made, exact.where
    if usual.noise is None or sharp.noise is None or len(usual.z) != 3 or len(sharp.z) != 3:
        raise Closed("it does not make one return with its noise of each")
    ratio = np.trace(sharp.noise, axis1=-2, axis2=-1) / np.trace(usual.noise, axis1=-2, axis2=-1)
    demand(np.all(ratio < 0.5), f"noise: of returns 10 times sharper must shrink, is {ratio.tolist()} of the usual")
    ((name, sensor),) = preprocessor.sensors.items()
    for parameter in parameters(type(sensor)):
        value = getattr(sensor, parameter.name)
        if parameter.name.startswith("sigma_") and parameter.unit == "m" and value:
            less: Any = evolve(sensor, **{parameter.name: 3.0 * value})  # type: ignore[misc]
            with suppress(TypeError):  # its sensors are no parameter
                wider: Any = _made(evolve(preprocessor, sensors={name: less}), exact.scans).noise  # type: ignore[misc]
                grows = np.trace(wider - usual.noise, axis1=-2, axis2=-1)
                demand(np.all(grows > 0), f"noise: must grow with {parameter.name} of {name!r}, grows by {grows.tolist()}")
    if len(where) != len(sensor.observes) or len(where) != len(sensor.measurement):
        return
    stated = np.broadcast_to(sensor.noise(exact.states), sharp.noise.shape)
    angles = [axis.unit == "rad" for axis in sensor.measurement.axes]
    if np.any(np.diagonal(stated, axis1=-2, axis2=-1)[..., angles] > 0.2**2):
        return  # conversions allow for the noise of angles that the sensor states, and where that is large, for much
    H, R = sensor.jacobian(exact.states)[..., where], 1e-2 * stated
    back = np.linalg.pinv(H)
    # How far the arc of a deviation in angle leaves its tangent, squared: below the variance of all else, that is no matter.
    arcs = np.diagonal(R, axis1=-2, axis2=-1)[..., angles] / np.linalg.norm(H, axis=-1)[..., angles]
    least = np.linalg.eigvalsh(back @ R @ np.swapaxes(back, -1, -2))[..., 0]
    if np.max(arcs**2, initial=0.0) > 0.1 * np.min(least):
        return
    carried = H @ sharp.noise @ np.swapaxes(H, -1, -2)
    root = np.linalg.cholesky(R)
    white = np.linalg.eigvalsh(np.linalg.solve(root, np.swapaxes(np.linalg.solve(root, carried), -1, -2)))
    told = f"noise: in the sensor's own axes, it is {white.min():.3g} to {white.max():.3g} times the sensor's"
    demand(np.all((white > 0.5) & (white < 2.0)), told)


def placed_scans_are_placed(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If its sensor can be placed: a scan from elsewhere makes the returns of elsewhere, and so do several runs."""
    exact = _exact(preprocessor, drawn)
    ((name, sensor),) = preprocessor.sensors.items()
    poses = [Pose(np.array([700.0, -300.0]), heading=0.4), Pose(np.array([-200.0, 50.0]), heading=-1.0)]
    each = [placed(sensor, pose).measure(exact.states) for pose in poses]
    alone: list[Detections] = []
    for pose, z in zip(poses, each, strict=True):
        scan = Scan(5.0, name, Detections(frozen_copy(z), np.ones(3, dtype=bool)), pose)
        alone.append(_made(preprocessor, {name: scan}))
        off = evolve(exact, made=alone[-1]).far()
        demand(np.all(off < 9.0), f"returns: of a placed scan are off by {np.sqrt(off).tolist()} of their deviations")
    several = Pose(np.stack([pose.position for pose in poses]), heading=np.array([pose.heading for pose in poses]))
    both = Scan(5.0, name, Detections(frozen_copy(np.stack(each)), np.ones((2, 3), dtype=bool)), several)
    made = preprocessor.process({name: both})
    for run, one in enumerate(alone):
        same(f"returns of two runs from two places[{run}]", made.z[run][made.valid[run]], one.z, 1e-9)


def evidence_is_passed_on(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions of one sensor's returns: what says that one is of a target goes with it."""
    exact = _exact(preprocessor, drawn)
    if len(exact.made.z) != 3:
        raise Closed("it does not make one return of each")
    ((name, scan),) = exact.scans.items()
    own = np.array([1.0, -2.0, 4.0])
    with_it = _made(preprocessor, {name: evolve(scan, detections=evolve(scan.detections, evidence=own))})
    demand(with_it.evidence is not None, "evidence: the returns have some, and what is made of them has none")
    assert with_it.evidence is not None
    order = [int(np.argmin(np.linalg.norm(with_it.z - one, axis=-1))) for one in exact.made.z]
    becomes = with_it.evidence[order]
    told = f"evidence: of returns with {own.tolist()} nats becomes {becomes.tolist()}"
    demand(np.all(np.diff(becomes[np.argsort(own)]) > 0), told)


def pictures_make_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it reads pictures: a spot that stands out of noise, bright or dark, makes a return, elsewhere with the picture."""
    if [sensor for sensor in preprocessor.sensors.values() if isinstance(sensor, ImagingSensor)] == []:
        raise Closed("it reads no pictures")
    ((name, _),) = preprocessor.sensors.items()
    lit = np.random.default_rng(len(drawn.scans[name].detections.z)).exponential(1.0, (60, 160))
    lit[20:23, 100] = 1e5

    def made(pixels: Any, x: float = 0.0, y: float = 0.0, posed: bool = True) -> Detections:
        place = np.array([x, y])
        frame, pose = Frame(frozen_copy(pixels), place), Pose(place, heading=np.pi / 2)
        return _made(preprocessor, {name: evolve(Scan.image(5.0, name, frame), pose=pose if posed else None)})

    screen = np.minimum(lit, 255.0).astype(np.uint8)
    shown: Any = None
    refused, some = "", None
    for pictures in ((lit, lit.max() - lit), (np.stack([screen] * 3),), (screen,)):
        try:
            each = [made(pixels) for pixels in pictures]
        except VedetteError as refusal:
            refused = str(refusal)
            continue
        found = [i for i, one in enumerate(each) if len(one.z)]
        demand(found, f"returns: must be some of a {pictures[0].dtype} picture with a spot in noise, got none")
        shown, some = pictures[found[0]], each[found[0]]
        break
    if some is None:
        raise Closed(f"it refuses the kit's pictures: {refused}")
    if some.noise is not None:
        covariance("noise of a return of a picture", some.noise, definite=True)
    moved = np.zeros(some.z.shape[-1])
    for i, axis in enumerate(preprocessor.measurement.axes):
        moved[i] = {"x": 40.0, "y": -30.0}.get(axis.name, 0.0)
    same("returns of a picture that is elsewhere", made(shown, 40.0, -30.0).z, some.z + moved, 1e-9)
    same("returns of a picture without a pose", made(shown, posed=False).z, some.z, 1e-9)


def false_alarms_are_as_rare_as_stated(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it reads pictures and has a `rate` of false alarms: so many cells of noise make a return, or fewer near the ends.

    Noise is exponential power, as of a receiver. The window may take up to 3,072 cells of a row of 6,000.
    """
    known = {parameter.name for parameter in parameters(type(preprocessor))}
    if not all(isinstance(sensor, ImagingSensor) for sensor in preprocessor.sensors.values()):
        raise Closed("it reads no pictures")
    if "rate" not in known:
        raise Lacking("rate")
    ((name, _),) = preprocessor.sensors.items()
    often: Any = evolve(preprocessor, rate=RARE)  # type: ignore[misc]
    rng = np.random.default_rng(drawn.seed)
    rows = drawn.runs // 2
    noise = rng.exponential(rng.uniform(0.5, 2.0), (rows, 1, CELLS))
    found = sum(len(_made(often, {name: Scan.image(5.0, name, Frame(frozen_copy(row)))}).z) > 0 for row in noise)
    low, high = (rows * -np.expm1(-RARE * CELLS * share) for share in (0.4, 1.0))
    reach = -ndtri(drawn.alpha / 2) * np.sqrt(rows) / 2
    told = f"returns: {found} of {rows} rows of {CELLS} cells of noise make some; by `rate`, {high:.0f} do"
    demand(low - reach <= found <= high + reach, told)


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, makes_finite_returns, noise_is_positive_definite, padding_changes_nothing, nothing_comes_of_nothing,
        returns_lie_where_they_were_seen, others_far_away_change_nothing, sensors_confirm_within_the_threshold,
        sharper_returns_make_sharper_ones,
        placed_scans_are_placed, evidence_is_passed_on, pictures_make_returns,
    )),
    Law(evidence_is_a_likelihood_ratio, effort="statistical"),
    Law(false_alarms_are_as_rare_as_stated, effort="statistical"),
)  # fmt: skip
