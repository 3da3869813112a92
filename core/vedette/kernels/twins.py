"""Components in compiled form: functions in C that give at once what a component's methods give one by one.

The kernels that call them have no form in numpy, as a component's own methods are that: here each returns None, and so do
the compiled ones for calls that they are not made for. Whoever gets None asks the component.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from attrs import frozen

from vedette.kernels.results import Measured, Moved, Passed, Weighted
from vedette.space import Array, Periods
from vedette.types import Gaussian, Innovation

SENSOR = "void (int, double *, double *, double *, double *, double *, double *, void *)"
MOTION = "void (int, double, double *, double *, double *, double *, double *, void *)"


@frozen(eq=False)
class Twin:
    """The compiled twin of a component: a function in C, and the numbers (p,) that it reads the parameters from.

    function: a `scipy.LowLevelCallable`, or a capsule named by its signature, `SENSOR` or `MOTION`. It takes `count` states
    side by side, number `axis` of state i at [axis * count + i], as all that it takes and gives:

    - of a sensor `(count, x, parameters, z, slope, noise, detects, data)`: from x over the axes that it observes and the
      parameters, what `measure` (m), `jacobian` (m, n), `noise` (m, m) and `detects` give;
    - of a motion `(count, dt, x, parameters, moved, slope, noise, data)`: `move` (n), `jacobian` (n, n), `noise` (n, n).

    It must write every number, give a state the same among others as alone, and may be called from any thread. parameters
    (*b, p) lead with the batch axes of a pose. What it says of a belief's noise is that at its mean: a component whose
    `mean_noise` is another has no twin.

    over: of a motion, its parameters for a step of dt s where they depend on it, in place of `parameters`.
    """

    function: Any
    parameters: Array
    over: Callable[[float], Array] | None = None

    def __attrs_post_init__(self) -> None:
        signature = getattr(self.function, "signature", SENSOR)
        if signature not in (SENSOR, MOTION):
            raise ValueError(f"function: must have the signature {SENSOR!r} or {MOTION!r}, has {signature!r}")

    def numbers(self, x: Array, dt: float = 0.0) -> Array:
        """Return the parameters as they broadcast against states x (*b, .., n): (p,) or (*b, 1, .., p)."""
        given = self.over(dt) if self.over else self.parameters
        return given if given.ndim == 1 else given.reshape(*given.shape[:-1], *(1,) * (x.ndim - given.ndim), given.shape[-1])


def cancels(P: Array, F: Array, cov: Array) -> bool:
    """Return whether a variance in cov = F P F' + Q (*b, n, n) is so small a share of its terms that rounding shows."""
    variance, most = _diagonal(cov), (abs(F) @ _diagonal(P)[..., None] ** 0.5)[..., 0]
    return bool((variance < 1e-5 * most**2).any())


def _diagonal(matrix: Array) -> Array:
    return matrix.diagonal(axis1=-2, axis2=-1)


def measure_twin(x: Array, function: Any, parameters: Array, m: int) -> Measured | None:
    """Return what a sensor's twin says of states (*b, n) over the axes that it observes."""
    return None


def move_twin(x: Array, dt: float, function: Any, parameters: Array, periods: Periods) -> Moved | None:
    """Return what a motion's twin says of states (*b, n); periods: index and period of state axes that wrap."""
    return None


def predict_twin(x: Array, P: Array, dt: float, function: Any, parameters: Array, periods: Periods) -> Gaussian | None:
    """Return the moved x (*b, n), and F P F' + Q (*b, n, n); None where digits cancel, too."""
    return None


def predict_points_twin(
    x: Array, dx: Array, weights: Array, dt: float, function: Any, parameters: Array, periods: Periods
) -> Gaussian | None:
    """Return the moments of the moved points x + dx (*b, s, n) under weights (s,), with the noise at x, the first point."""
    return None


def evaluate_twin(
    x: Array, P: Array, z: Array, noise: Any, function: Any, parameters: Array, axes: Any, p_gate: float, periods: Periods
) -> Innovation | None:
    """`evaluate_returns`, with what the twin says of the means x (*b, t, n); noise (*b, 1, k, m, m): the returns' own."""
    return None


def scan_step_twin(
    x: Array,
    P: Array,
    F: Array,
    Q: Array,
    z: Array,
    function: Any,
    parameters: Array,
    axes: Any,
    p_gate: float,
    limit: float,
    log_density: Array,
    best: bool,
    periods: Periods,
) -> Passed | None:
    """`scan_step`, with what the twin says of the predicted means."""
    return None


def evaluate_points_twin(
    x: Array,
    dx: Array,
    weights: Array,
    z: Array,
    noise: Array | None,
    function: Any,
    parameters: Array,
    axes: tuple[int, ...],
    p_gate: float,
    state_periods: Periods,
    periods: Periods,
) -> Innovation | None:
    """Return the same by points x + dx (*b, t, s, n), of which the first is x, under weights (s,), as `evaluate_points`."""
    return None


def evaluate_particles(
    log_weights: Array, z: Array, expected: Array, R: Array, p_detect: Array, p_gate: float, periods: Periods
) -> Weighted | None:
    """Return what points that expect (*b, t, p, m) say of returns z (*b, k, m); R (.., 1|p, m, m), p_detect (.., 1|p)."""
    return None


def iterate_twin(
    x: Array,
    P: Array,
    z: Array,
    noise: Array | None,
    function: Any,
    parameters: Array,
    axes: tuple[int, ...],
    p_gate: float,
    state_periods: Periods,
    periods: Periods,
    passes: int,
) -> Innovation | None:
    """Return what `evaluate_twin` does, each return linearised at its own estimate, in `passes` at most."""
    return None


def predict_root_twin(
    x: Array, L: Array, dt: float, function: Any, parameters: Array, periods: Periods
) -> tuple[Array, Array] | None:
    """Return the moved x (*b, n), and a root of F L L' F' + Q, with L (*b, n, n)."""
    return None


def evaluate_root_twin(
    x: Array, L: Array, z: Array, noise: Any, function: Any, parameters: Array, axes: Any, p_gate: float, periods: Periods
) -> Innovation | None:
    """Return what `evaluate_twin` does, with a root L for P, and in its detail roots (*b, t, 1|k, n, n) for covariances."""
    return None
