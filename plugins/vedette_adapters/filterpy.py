"""FilterPy's matrices as a config, and its filters as estimators."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, InputError, MotionModel, Sensor, fields
from vedette.filters import GaussianFilter, Hypotheses, embedded, make_innovation
from vedette_adapters.libraries import foreign, needed

KINDS = {
    "KalmanFilter": "kalman",
    "InformationFilter": "kalman",
    "SquareRootKalmanFilter": "srkf",
    "FadingKalmanFilter": "fading_memory",
}
"""The kinds that give the answers of FilterPy's linear filters."""


def matrix(value: Any) -> Array:
    """Return a matrix of FilterPy's, which may be a number."""
    return np.atleast_2d(np.asarray(value, dtype=float))


def prior_of(one: Any) -> Gaussian:
    """Return what a filter believes now as the start (1, n) of a track: `tracker.start(prior_of(one), time)`."""
    return Gaussian(np.asarray(one.x, dtype=float).reshape(1, -1), matrix(one.P)[None])


def config_of(
    one: Any,
    axes: Sequence[str],
    step: float = 1.0,
    *,
    u: Any = None,
    sensor: str = "s",
    units: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return the config of the tracker of one target that answers as a linear filter of FilterPy does, from its matrices.

    `axes` names the numbers of its state; `step` is the s that its F and Q are for, u its constant control. The track starts
    as the filter is now where its P is diagonal; else `birth` is None, and `tracker.start(prior_of(one), time)` starts it.
    InputError for a filter that is not linear: take the kind `ekf`, `ukf` or `ckf` with a sensor of its own.
    """
    name = type(one).__name__
    if name not in KINDS:
        raise InputError(f"a {name} is not made of matrices alone; those that are: {', '.join(KINDS)}")
    if isinstance(axes, str) or len(axes) != np.size(one.x):
        raise InputError(f"axes: must name the {np.size(one.x)} numbers of the filter's state, got {axes!r}")
    named = {"axes": list(axes), **({"units": dict(units)} if units else {})}
    motion = {"kind": "linear", **named, "F": matrix(one.F).tolist(), "Q": matrix(one.Q).tolist(), "step": step}
    estimator: dict[str, Any] = {"kind": KINDS[name]}
    if u is not None:
        motion |= {"B": np.asarray(one.B, dtype=float).reshape(len(axes), -1).tolist(), "control": np.ravel(u).tolist()}
        estimator["kind"] = "ekf" if estimator["kind"] == "kalman" else estimator["kind"]
    if (alpha := float(getattr(one, "alpha", 1.0))) != 1.0:
        estimator |= {"kind": "fading_memory", "alpha": alpha, "step": step}
    R = np.linalg.inv(matrix(one.R_inv)) if hasattr(one, "R_inv") else matrix(one.R)
    prior = prior_of(one)
    deviations = np.sqrt(np.diagonal(prior.cov[0]))
    diagonal = np.array_equal(prior.cov[0], np.diag(np.diagonal(prior.cov[0])))
    start = {axis: [float(x), float(sd)] for axis, x, sd in zip(axes, prior.mean[0], deviations, strict=True)}
    return {
        "estimator": {**estimator, "motion": motion},
        "sensors": {sensor: {"kind": "linear", **named, "H": matrix(one.H).tolist(), "R": R.tolist()}},
        "associator": {"kind": "nearest"},
        "birth": {"kind": "given", "start": start} if diagonal else None,
        "lifecycle": {"kind": "single_target"},
        "gate": "off",
    }


@final
@frozen(eq=False)
class FilterPyEstimator(GaussianFilter):
    """One of FilterPy's own filters, over Vedette's motion model and sensors: a call for each track and return, so slow.

    `filter` is a KalmanFilter, SquareRootKalmanFilter, ExtendedKalmanFilter, UnscentedKalmanFilter or CubatureKalmanFilter
    of as many axes as the motion. Its x, P, F, Q, H, R, fx and hx are set before each call, and all else is as given. The
    points of the last two are drawn anew before each update, which FilterPy's cubature filter by itself leaves out.
    """

    kind: ClassVar[str] = "filterpy"

    motion: MotionModel = fields.part("how the target moves")
    filter: Any = foreign("the filter of FilterPy's")

    def __attrs_post_init__(self) -> None:
        name = _name(self.filter)
        if name not in UPDATES:
            raise ValueError(f"filter: must be a {' or '.join(UPDATES)}, or derive from one, got {name}")
        if np.size(self.filter.x) != len(self.state):
            raise ValueError(f"filter: must have {len(self.state)} axes, as the motion has, got {np.size(self.filter.x)}")
        if self.state.periods:
            raise ValueError(f"motion: {self.motion.kind!r} has axes that wrap, which FilterPy does not know")
        if not self.motion.linear and not hasattr(self.filter, "fx"):
            raise ValueError(f"motion: {name} needs a linear one, got {self.motion.kind!r}")

    def refuses(self, sensor: Sensor) -> str | None:
        """Refuse sensors that are not linear where the filter is, and those whose returns lack components."""
        if sensor.optional:
            return "its returns may lack components, and FilterPy takes whole ones"
        bent = not sensor.linear and UPDATES[_name(self.filter)] is _update_linear
        return "it is not linear: use an ExtendedKalmanFilter or UnscentedKalmanFilter with it" if bent else None

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        if dt == 0:
            return belief
        mean, cov = np.empty(belief.mean.shape), np.empty(belief.cov.shape)
        for i in np.ndindex(belief.mean.shape[:-1]):
            one = self._at(belief.mean[i], belief.cov[i])
            one.Q = np.asarray(self.motion.noise(belief.mean[i], dt))
            if hasattr(one, "fx"):
                one.fx = lambda x, dt: self.motion.move(np.ravel(x), dt)
                one.predict(dt)
            else:
                one.F = self.motion.jacobian(belief.mean[i], dt)
                one.predict()
            mean[i], cov[i] = np.ravel(one.x), one.P
        return Gaussian(self.state.canonical(mean), cov)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track, from an update by each return."""
        assert isinstance(observed, Detections)
        if observed.missing is not None:
            raise ValueError("a return lacks components, and FilterPy takes whole ones")
        z, tracks = observed.z, belief.mean.shape[:-1]
        k, n, where = z.shape[-2], len(self.state), self.state.locate(sensor.observes)
        x = belief.mean[..., where]
        R = np.broadcast_to(sensor.noise(x), (*tracks, len(sensor.measurement), len(sensor.measurement)))
        shift, post = np.zeros((*tracks, k, n)), np.zeros((*tracks, k, n, n))
        loglik, distance, volume = (np.zeros((*tracks, k)) for _ in range(3))
        update = UPDATES[_name(self.filter)]
        for i in np.ndindex((*tracks, k)):
            track, row = i[:-1], (*i[:-2], i[-1])
            one = self._at(belief.mean[track], belief.cov[track])
            one.R = R[track] if observed.noise is None else observed.noise[row]
            y, S = update(one, sensor, where, z[row])
            distance[i], volume[i] = float(y @ np.linalg.solve(S, y)), 0.5 * np.linalg.slogdet(S)[1]
            loglik[i] = -0.5 * (distance[i] + len(y) * np.log(2 * np.pi)) - volume[i]
            shift[i] = self.state.difference(np.ravel(one.x), belief.mean[track])
            post[i] = (one.P + one.P.T) / 2
        return make_innovation(sensor, x, p_gate, loglik, distance, volume, Hypotheses(shift, post))

    def _at(self, x: Array, P: Array) -> Any:
        """Return a copy of the filter that believes x (n,) and P (n, n)."""
        one = copy.copy(self.filter)
        column = np.ndim(one.x) > 1 or _name(one) == "CubatureKalmanFilter"
        one.x, one.P = (x[:, None] if column else x).copy(), np.array(P)
        return one


def _name(one: Any) -> str:
    """Return the name of FilterPy's class that a filter is of, or derives from; of another one, its own."""
    names = [cls.__name__ for cls in type(one).__mro__]
    return next((name for name in names if name in UPDATES), names[0])


def _update_linear(one: Any, sensor: Sensor, where: list[int], z: Array) -> tuple[Array, Array]:
    """Update by a return z (m,) that is linear in the state; return the residual and its covariance."""
    one.H = embedded(sensor.jacobian(np.ravel(one.x)[where]), where, one.P.shape[0])
    S = one.H @ one.P @ one.H.T + one.R
    expected = one.H @ np.ravel(one.x)
    y = sensor.measurement.difference(z, expected)
    one.dim_z, whole = len(z), expected + y  # the return without a turn too many
    if _name(one) == "SquareRootKalmanFilter":
        one.M = np.zeros((len(z) + one.dim_x, len(z) + one.dim_x))
    one.update(whole if np.ndim(one.x) == 1 else whole[:, None])
    return y, S


def _update_extended(one: Any, sensor: Sensor, where: list[int], z: Array) -> tuple[Array, Array]:
    """Update by a return z (m,), linearised at the mean."""

    def slope(x: Array) -> Array:
        return embedded(sensor.jacobian(np.ravel(x)[where]), where, len(x))

    def column(values: Array) -> Array:
        return values if np.ndim(one.x) == 1 else values[:, None]

    def residual(a: Array, b: Array) -> Array:
        return column(sensor.measurement.difference(np.ravel(a), np.ravel(b)))

    one.dim_z = len(z)
    one.update(column(z), slope, lambda x: column(sensor.measure(np.ravel(x)[where])), residual=residual)
    return np.ravel(one.y), one.S


def _around(one: Any, sensor: Sensor, where: list[int], z: Array) -> tuple[Any, Array]:
    """Return what measures, and the return z (m,), both less what is measured at the mean: so no angle wraps in between."""
    centre = sensor.measure(np.ravel(one.x)[where])
    space = sensor.measurement
    return lambda x: space.difference(sensor.measure(np.ravel(x)[where]), centre), space.difference(z, centre)


def _update_points(one: Any, sensor: Sensor, where: list[int], z: Array) -> tuple[Array, Array]:
    """Update by a return z (m,) through points of the belief, drawn anew."""
    one._dim_z, one.sigmas_f = len(z), one.points_fn.sigma_points(one.x, one.P)
    measure, seen = _around(one, sensor, where, z)
    one.update(seen, hx=measure)
    return one.y, one.S


def _update_cubature(one: Any, sensor: Sensor, where: list[int], z: Array) -> tuple[Array, Array]:
    """Update by a return z (m,) through cubature points of the belief, drawn anew."""
    points = needed("filterpy.kalman.CubatureKalmanFilter").spherical_radial_sigmas(one.x, one.P)
    one.dim_z, one.sigmas_f, one.sigmas_h = len(z), np.array(points), np.zeros((len(points), len(z)))
    one.hx, seen = _around(one, sensor, where, z)
    one.update(seen[:, None])
    return np.ravel(one.y), one.S


UPDATES = {
    "KalmanFilter": _update_linear,
    "SquareRootKalmanFilter": _update_linear,
    "ExtendedKalmanFilter": _update_extended,
    "UnscentedKalmanFilter": _update_points,
    "CubatureKalmanFilter": _update_cubature,
}
"""How each of FilterPy's filters takes a return."""
