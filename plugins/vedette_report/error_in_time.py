"""Whether a detector's errors go on from return to return, found without truth: white errors against correlated ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from attrs import frozen

from vedette import WrappedSensor
from vedette.roles import Sensor
from vedette.space import Array, Mask
from vedette.supporting import ImagingSensor
from vedette.tracking import State, Tracker
from vedette.types import Scan
from vedette.units import say
from vedette_report.error_shape import Measured, Shape, long_run, shape_of

LONGEST, MOST = 400, 64
"""Paths are cut into pieces of at most so many returns, of which so many are enough."""

FEWEST = 20
"""A piece of fewer returns tells too little of how its errors go on."""

OWN = 0.1
"""The white part of a correlated error, over the correlated one, if no larger part is clearly likelier."""

PARTS = (OWN, 0.5, 1.0, 2.0)
"""Those that are tried, each likelier by `CLEARLY` than the ones before it: by hand."""

CLEARLY = 3.0
"""Log-likelihood by which more parameters, or another kind of error, must gain; held back by two errors, too: by hand."""

LEAST = 0.1
"""Errors that are less alike than this from one return to the next count as white: by hand."""

TINY = 1e-300
"""The sum of squares of paths that are exactly straight."""

FAINT = 1e-9
"""Errors of which a path is so many times as long are rounding."""

DIFFUSE = 1e3
"""The deviation of a velocity before the second return, in errors a step: two returns tell nothing of the errors."""

SURELY = 0.5
"""A return is a track's if it was more probably than not."""

PASSES, POINTS = 6, 7
"""So often a grid of so many points a side is drawn closer around its best."""


@frozen(eq=False)
class Path:
    """One measured axis of one target: values (s,) at times (s,) in s."""

    times: Array
    values: Array


@frozen
class Errors:
    """Errors along an axis: their deviation in its unit, of which `white` is not correlated; `tau` in s, 0 of white ones;
    the targets' white acceleration. With standard errors of the logarithms of deviation and tau, and the log-likelihood.
    """

    deviation: float
    white: float
    tau: float
    accel: float
    deviation_error: float
    tau_error: float
    loglik: float

    @property
    def correlated(self) -> float:
        """The deviation of the correlated part."""
        return float(np.sqrt(max(self.deviation**2 - self.white**2, 0.0)))


@frozen
class Compared:
    """White and correlated errors, each fitted to all returns, and by how much correlated ones are likelier on those of the
    second halves of paths, each predicted, with the parameters of the first halves; `dt`: the usual step, in s.
    """

    white: Errors
    correlated: Errors
    gain: float
    error: float
    returns: int
    dt: float

    @property
    def alike(self) -> float:
        """How alike correlated errors are from one return to the next."""
        share = (self.correlated.correlated / self.correlated.deviation) ** 2
        return share * float(np.exp(-self.dt / self.correlated.tau))

    @property
    def wins(self) -> bool:
        """Whether errors are correlated, beyond chance."""
        return self.gain > max(2.0 * self.error, CLEARLY) and self.alike >= LEAST

    def told(self, sensor: str, axis: str, unit: str) -> str:
        """Say what the comparison says."""
        by = f"by {self.gain:+.1f} +- {self.error:.1f} on {self.returns} returns held back"
        if not self.wins:
            return (
                f"errors of {sensor} along {axis} are white as far as these returns tell (correlated ones are likelier {by})"
            )
        fit = self.correlated
        size = f"{say(float(f'{fit.deviation:.3g}'), unit)} +- {100 * fit.deviation_error:.0f} %"
        lasts = f"{say(float(f'{fit.tau:.3g}'), 's')} +- {100 * fit.tau_error:.0f} %"
        return (
            f"errors of {sensor} along {axis} are correlated in time: deviation {size}, correlation time {lasts} ({by}); "
            f"white ones of {say(float(f'{self.white.deviation:.3g}'), unit)} would take the rest for motion"
        )


def compared(paths: Sequence[Path]) -> Compared | None:
    """Return what tells white errors from correlated ones along an axis; None if there are too few returns.

    The targets move at nearly constant velocity, x'' = w; z = x + v, v white, or v = u + e with e' = -e / tau + w. Each path
    is filtered from its second return on, whose velocity is unknown, for a grid of tau, of the acceleration over the errors,
    and of the part of u; the size of all follows in closed form.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sections 8.1 and 8.2.
    """
    pieces = [piece for path in paths for piece in _pieces(path)]
    pieces = pieces[:: max(1, -(-len(pieces) // MOST))]
    if not pieces:
        return None
    every = Pieces.of(pieces)
    first = Pieces.of([Path(one.times[: len(one.times) // 2], one.values[: len(one.times) // 2]) for one in pieces])
    fits = [_fitted(first, correlated) for correlated in (False, True)]
    if min(fit.scale for fit in fits) <= FAINT * np.ptp(every.values):
        return None  # no errors at all: positions that somebody has computed
    scores = [every.singles(fit) for fit in fits]
    halves = np.array([[len(one.times) // 2] for one in pieces])
    held: Mask = np.logical_and(every.used, np.arange(every.used.shape[1]) >= halves)
    apart = [np.where(mask, row, 0.0)[mask] for row, mask in zip(scores[1] - scores[0], held, strict=True)]
    error = float(np.sqrt(sum(long_run(row) for row in apart)))
    white, other = (every.errors(_fitted(every, correlated)) for correlated in (False, True))
    return Compared(white, other, float(sum(map(np.sum, apart))), error, int(np.count_nonzero(held)), every.dt)


def _pieces(path: Path) -> list[Path]:
    count = -(-len(path.times) // LONGEST)
    parts = np.array_split(np.arange(len(path.times)), count) if count else []
    return [Path(path.times[part], path.values[part]) for part in parts if len(part) >= FEWEST]


@frozen
class Fit:
    """Logarithms of tau over a step and of the acceleration (m/s^1.5) over the error's deviation, a step being 1; the white
    part over the correlated one, inf of white errors; the deviation of the correlated part, or of white errors.
    """

    tau: float
    accel: float
    part: float
    scale: float


@frozen(eq=False)
class Pieces:
    """Pieces of paths side by side (w, s): the steps before each return over the usual one `dt`, values, which are used."""

    steps: Array
    values: Array
    used: Mask
    dt: float

    @classmethod
    def of(cls, paths: Sequence[Path]) -> Pieces:
        """Lay paths side by side."""
        longest = max(len(path.times) for path in paths)
        dt = float(np.median(np.concatenate([np.diff(path.times) for path in paths])))

        def padded(values: Array) -> Array:
            return values[np.minimum(np.arange(longest), len(values) - 1)]

        steps = np.array([np.diff(padded(path.times), prepend=path.times[0]) for path in paths]) / dt
        used = np.array([np.arange(longest) < len(path.times) for path in paths])
        values = np.array([padded(path.values - path.values[0]) for path in paths])
        return cls(steps, values, used, dt)

    @property
    def count(self) -> int:
        """How many returns count: all but two of each piece."""
        return int(np.count_nonzero(self.used[:, 2:]))

    def sums(self, tau: Array, accel: Array, part: Array) -> tuple[Array, Array]:
        """Return sum v^2 / S and sum ln S of the innovations v of all pieces, for parameters (p,)."""
        squares, logs = np.zeros(len(tau)), np.zeros(len(tau))
        for i, (v, S) in self._innovations(tau, accel, part):
            squares += np.sum(np.where(self.used[:, i], v**2 / S, 0.0), axis=-1)
            logs += np.sum(np.where(self.used[:, i], np.log(S), 0.0), axis=-1)
        return squares, logs

    def loglik(self, tau: Array, accel: Array, part: Array) -> Array:
        """Return the log-likelihood (p,) at the size that makes it largest."""
        squares, logs = self.sums(tau, accel, part)
        loglik: Array = -0.5 * (self.count * (np.log(2 * np.pi * np.maximum(squares, TINY) / self.count) + 1.0) + logs)
        return loglik

    def singles(self, fit: Fit) -> Array:
        """Return the log-likelihood of each return (w, s) by those before it; 0 of the first two."""
        residuals = np.zeros(self.values.shape)
        one = (np.array([value]) for value in (fit.tau, fit.accel, fit.part))
        for i, (v, S) in self._innovations(*one):
            residuals[:, i] = -0.5 * (v[0] ** 2 / S[0] / fit.scale**2 + np.log(2 * np.pi * S[0] * fit.scale**2))
        return residuals

    def errors(self, fit: Fit) -> Errors:
        """Return a fit in the axis' units, with standard errors by the curvature of the log-likelihood."""
        white = np.isinf(fit.part)
        deviation = fit.scale if white else fit.scale * float(np.hypot(1.0, fit.part))
        cov = self._covariance(fit)
        return Errors(
            deviation=deviation, white=deviation if white else fit.part * fit.scale,
            tau=0.0 if white else self.dt * float(np.exp(fit.tau)),
            accel=fit.scale * float(np.exp(fit.accel)) / self.dt**1.5,
            deviation_error=float(np.sqrt(cov[2, 2])), tau_error=0.0 if white else float(np.sqrt(cov[0, 0])),
            loglik=float(self.loglik(*(np.array([value]) for value in (fit.tau, fit.accel, fit.part)))[0]),
        )  # fmt: skip

    def _covariance(self, fit: Fit) -> Array:
        """Return the covariance (3, 3) of ln tau, ln accel and ln scale."""
        h = np.array([0.1, 0.4])
        grid = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        A, B = self.sums(fit.tau + h[0] * grid[:, 0], fit.accel + h[1] * grid[:, 1], np.full(9, fit.part))
        A = (A / fit.scale**2).reshape(3, 3)
        height = -0.5 * (A + B.reshape(3, 3))
        H = np.zeros((3, 3))
        H[0, 0] = -(height[2, 1] - 2 * height[1, 1] + height[0, 1]) / h[0] ** 2
        H[1, 1] = -(height[1, 2] - 2 * height[1, 1] + height[1, 0]) / h[1] ** 2
        H[0, 1] = H[1, 0] = -(height[2, 2] - height[2, 0] - height[0, 2] + height[0, 0]) / (4 * h[0] * h[1])
        H[0, 2] = H[2, 0] = -(A[2, 1] - A[0, 1]) / (2 * h[0])
        H[1, 2] = H[2, 1] = -(A[1, 2] - A[1, 0]) / (2 * h[1])
        H[2, 2] = 2.0 * self.count
        known = [i for i in range(3) if H[i, i] > 1e-3 and not (i == 0 and np.isinf(fit.part))]
        cov = np.zeros((3, 3))
        curvature, along = np.linalg.eigh(H[np.ix_(known, known)])
        told = curvature > 1e-3  # at the edge of what is searched the likelihood may rise still: that way it tells nothing
        cov[np.ix_(known, known)] = along[:, told] / curvature[told] @ along[:, told].T
        return cov

    def _innovations(self, tau: Array, accel: Array, part: Array) -> Iterator[tuple[int, tuple[Array, Array]]]:
        """Yield the innovations (p, w) of the third return of each piece and those after it, and their variances."""
        white = np.isinf(part)[:, None]
        c, r = np.where(white, 0.0, 1.0), np.where(white, 1.0, part[:, None] ** 2)
        q, rate = np.exp(2 * accel)[:, None], np.exp(-tau)[:, None]
        x, v, e = (np.zeros((len(tau), len(self.steps))) for _ in range(3))
        xx, xe, ee, xv, ve = c + r + x, -c + x, c + x, 0.0 * x, 0.0 * x
        vv = DIFFUSE**2 * (c + r) + x
        for i in range(1, self.steps.shape[1]):
            dt = self.steps[:, i]
            a = np.exp(-dt * rate)
            xx, xv, xe = xx + dt * (2 * xv + dt * vv) + q * dt**3 / 3, xv + dt * vv + q * dt**2 / 2, a * (xe + dt * ve)
            vv, ve, ee = vv + q * dt, a * ve, a * a * ee + c * (1 - a * a)
            x, e = x + dt * v, a * e
            S = xx + 2 * xe + ee + r
            apart = self.values[:, i] - x - e
            if i > 1:
                yield i, (apart, S)
            hx, hv, he = xx + xe, xv + ve, xe + ee
            kx, kv, ke = hx / S, hv / S, he / S
            x, v, e = x + kx * apart, v + kv * apart, e + ke * apart
            xx, xv, xe = xx - kx * hx, xv - kx * hv, xe - kx * he
            vv, ve, ee = vv - kv * hv, ve - kv * he, ee - ke * he


def _fitted(pieces: Pieces, correlated: bool) -> Fit:
    """Return the likeliest errors of one kind."""
    best, height = None, -np.inf
    for part in PARTS if correlated else (np.inf,):
        fit, reached = _climbed(pieces, part)
        if best is None or reached > height + CLEARLY:
            best, height = fit, reached
    assert best is not None
    return best


def _climbed(pieces: Pieces, part: float) -> tuple[Fit, float]:
    low, high = np.array([-1.2, -12.0]), np.array([4.0, 4.0])
    if np.isinf(part):
        low[0] = high[0] = 0.0
    centre, reach = 0.5 * (low + high), 0.5 * (high - low)
    for _ in range(PASSES):
        sides = [np.unique(np.clip(centre[i] + reach[i] * np.linspace(-1, 1, POINTS), low[i], high[i])) for i in (0, 1)]
        tau, accel = (side.ravel() for side in np.meshgrid(*sides))
        heights = pieces.loglik(tau, accel, np.full(len(tau), part))
        top = int(np.argmax(heights))
        centre, reach = np.array([tau[top], accel[top]]), reach * 2.2 / (POINTS - 1)
    squares, _ = pieces.sums(centre[:1], centre[1:], np.array([part]))
    scale = float(np.sqrt(max(squares[0], TINY) / pieces.count))
    return Fit(float(centre[0]), float(centre[1]), part, scale), float(heights[top])


@frozen
class Told:
    """What the returns that tracks took say of the errors of a sensor along a measured axis, in its unit."""

    sensor: str
    axis: str
    unit: str
    compared: Compared
    extent: str = ""
    shape: Shape | None = None

    @property
    def text(self) -> str:
        """In words, a line each: how they go on, and where it stands out how they grow and how heavy their tails are."""
        shape = self.shape.told(self.sensor, self.axis, self.extent) if self.shape else ()
        return "\n".join((self.compared.told(self.sensor, self.axis, self.unit), *shape))

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        white, correlated = self.compared.white, self.compared.correlated
        return {
            "sensor": self.sensor, "axis": self.axis, "unit": self.unit, "correlated": self.compared.wins,
            "gain": self.compared.gain, "gain_error": self.compared.error, "white_deviation": white.deviation,
            "deviation": correlated.deviation, "deviation_error": correlated.deviation_error * correlated.deviation,
            "correlation_time": correlated.tau, "correlation_time_error": correlated.tau_error * correlated.tau,
            "extent": self.extent, "shape": self.shape.data() if self.shape else None,
        }  # fmt: skip


NIS_IS_NOT_ENOUGH = (
    "a NIS near 1 does not show that R is right: a filter takes errors that go on from scan to scan for motion"
)


def in_tracks(tracker: Tracker, scans: Iterable[Scan], states: Iterable[State]) -> tuple[Told, ...]:
    """Return what the returns that confirmed tracks took say, of each sensor and each place or direction that it measures.

    states: after each of the scans. A sensor whose errors are part of the state, and one whose returns bear times of their
    own, is not asked. A place along any axis is followed as if it kept its velocity, also a range or a bearing.
    """
    taken: dict[tuple[str, int], tuple[list[float], list[Array]]] = {}
    asked = {name: _measured(sensor) for name, sensor in tracker.sensors.items()}
    for scan, state in zip(scans, states, strict=True):
        if not asked[scan.sensor] or scan.frame is not None or scan.detections.time is not None:
            continue
        rows, columns = np.nonzero(np.where(state.confirmed[:, None], state.weights[:, 1:], 0.0) > SURELY)
        returns = columns if state.returns is None else state.returns[rows, columns]
        for track, z in zip(state.ids[rows].tolist(), scan.detections.z[returns], strict=True):
            times, values = taken.setdefault((scan.sensor, track), ([], []))
            times.append(scan.time)
            values.append(z)
    comparisons: list[Told | None] = []
    for name, axes in asked.items():
        given = [(np.array(times), np.array(values)) for (of, _), (times, values) in taken.items() if of == name]
        sensor = tracker.sensors[name]
        if one := _stated_once(sensor, axes):
            axes, alike = (
                [i for i in axes if i not in one],
                compared([path for i in one for path in _along(sensor, i, given)]),
            )
            comparisons += [_told_along(name, sensor, i, given, alike) for i in one]
        comparisons += [_told_along(name, sensor, i, given, compared(_along(sensor, i, given))) for i in axes]
    return tuple(told for told in comparisons if told is not None)


def _stated_once(sensor: Sensor, axes: Sequence[int]) -> list[int]:
    """Return the axes of a plane whose errors a sensor states by one number: they are told together, for either may be by
    chance as motion makes it.
    """
    pair = [i for i in axes if sensor.measurement.names[i] in ("x", "y")]
    R = np.diagonal(sensor.noise(np.zeros(len(sensor.observes))))[pair] if len(pair) > 1 and hasattr(sensor, "sigma") else ()
    return pair if len(R) and np.ptp(R) == 0 else []


def _along(sensor: Sensor, i: int, taken: Sequence[tuple[Array, Array]]) -> list[Path]:
    """Return paths along one axis of returns of tracks: times (s,) and returns (s, m) of each."""
    period, paths = sensor.measurement.axes[i].period, []
    for times, z in taken:
        good = np.isfinite(z[:, i])
        paths.append(Path(times[good], z[good, i] if period is None else np.unwrap(z[good, i], period=period)))
    return paths


def _told_along(
    name: str, sensor: Sensor, i: int, taken: Sequence[tuple[Array, Array]], told: Compared | None
) -> Told | None:
    """Return what a comparison, and the shape of errors, say along one axis; None without a comparison."""
    if told is None:
        return None
    axis, paths = sensor.measurement.axes[i], _along(sensor, i, taken)
    extents = [_extent(sensor, z[np.isfinite(z[:, i])]) for _, z in taken]
    measured = [Measured(path.times, path.values, extent) for path, (_, extent) in zip(paths, extents, strict=True)]
    return Told(name, axis.name, axis.unit, told, extents[0][0], shape_of(measured))


def _extent(sensor: Sensor, z: Array) -> tuple[str, Array]:
    """Return how far or how large what was returned is (s,), and how that is called."""
    names = sensor.measurement.names
    if "range" in names:
        return "range", z[:, names.index("range")]
    for title, pair, joined in (
        ("size", ("width", "height"), lambda a, b: np.sqrt(np.maximum(a * b, 0.0))),
        ("distance from the origin", ("x", "y"), np.hypot),
    ):
        if set(pair) <= set(names) and (title == "size" or sensor.measurement.axes[names.index("x")].unit == "m"):
            return title, joined(*(z[:, names.index(axis)] for axis in pair))
    return "", np.full(len(z), np.nan)


def _measured(sensor: Sensor) -> list[int]:
    """Return which measured axes are places or directions, without an error that the state has, too."""
    if isinstance(sensor, ImagingSensor) or _has_own_states(sensor):
        return []
    return [i for i, axis in enumerate(sensor.measurement.axes) if axis.unit in ("m", "px", "rad")]


def _has_own_states(sensor: Sensor) -> bool:
    """Return whether a wrapper adds axes to the state, as that of biases does."""
    if not isinstance(sensor, WrappedSensor):
        return False
    return not set(sensor.observes.names) <= set(sensor.of.observes.names) or _has_own_states(sensor.of)
