"""Comparisons for laws, which say where they failed, by how much, and what was expected."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

import numpy as np
from attrs import evolve

from vedette.config.parameters import parameters
from vedette.errors import VedetteError
from vedette.space import Array, Mask, Space
from vedette.types import Gaussian
from vedette.units import in_unit

T = TypeVar("T")

_DIGITS = float(np.finfo(float).tiny / np.finfo(float).eps)
"""A variance below it has lost digits: as a correlation it says nothing."""


class Broken(AssertionError):
    """A law does not hold."""


class Closed(Exception):
    """A law does not apply to this component; the message says why. This is no error: there is nothing to judge."""


class Unlike(Closed):
    """A law does not apply to what this component is, whatever its numbers."""


class Lacking(Closed):
    """It has no parameter of this name, by whose meaning the law would judge it."""

    def __init__(self, name: str, why: str = "") -> None:
        super().__init__(why or f"it has no `{name}`")
        self.name = name


class Misuse(VedetteError, ValueError):
    """The kit was used wrongly; the message says how to put it right."""


@contextmanager
def closed_by(refused: type[Exception] | tuple[type[Exception], ...], why: str) -> Iterator[None]:
    """Raise Closed where something within is `refused`; "{}" in `why` stands for what the refusal says."""
    try:
        yield
    except refused as refusal:
        raise Closed(why.format(refusal)) from None


def closed_if(unfit: Any, why: str | Closed) -> None:
    """Raise Closed, with a sentence or as it is given, if the condition holds."""
    if unfit:
        raise why if isinstance(why, Closed) else Closed(why)


def demand(holds: Any, otherwise: str) -> None:
    """Raise Broken with a sentence unless the condition holds."""
    if not holds:
        raise Broken(otherwise)


def stated(component: Any, name: str, unit: str) -> float:
    """Return what a parameter of this name says, in `unit`; Lacking if it has none, or in a unit of another kind."""
    value = getattr(component, name, None)
    own = {parameter.name: parameter.unit for parameter in parameters(type(component))}.get(name, unit)
    if isinstance(value, float | int) and not isinstance(value, bool) and 0 < value < np.inf:
        with suppress(ValueError):
            return in_unit(f"{float(value)!r} {own}", unit)
    raise Lacking(name)


def varied(component: T, **values: Any) -> T:
    """Return a component with other values of parameters; Closed if it takes none of these."""
    with closed_by(ValueError, "it does not take what this law tries: {}"):
        return evolve(component, **values)  # type: ignore[misc]


def same(
    what: str, got: Array | Mask, wanted: Array | Mask, tolerance: float = 1e-12, scale: Array | float | None = None
) -> None:
    """Raise Broken unless `got` equals `wanted` within `tolerance` times the largest |wanted|, or `scale` if given.

    NaN equals NaN: that a result is finite is a law of its own.
    """
    got, wanted = np.asarray(got, dtype=float), np.asarray(wanted, dtype=float)
    demand(got.shape == wanted.shape, f"{what}: must have shape {wanted.shape}, got {got.shape}")
    if not got.size:
        return
    if scale is None:
        scale = max(float(np.max(np.abs(np.where(np.isfinite(wanted), wanted, 0.0)))), 1e-30)
    with np.errstate(invalid="ignore"):
        off = np.where(got == wanted, 0.0, np.abs(got - wanted)) / scale  # equal infinities are equal
    off = np.where(np.isnan(got) & np.isnan(wanted), 0.0, np.where(np.isnan(off), np.inf, off))
    worst = np.unravel_index(int(np.argmax(off)), off.shape)
    place = f"{what}[{', '.join(map(str, worst))}]" if worst else what
    allowed = np.broadcast_to(tolerance * np.asarray(scale), off.shape)[worst]
    near = f" to within {allowed:.2g}" if allowed > 1e-9 * abs(got[worst] - wanted[worst]) else ""
    digits = 9 if f"{wanted[worst]:.9g}" != f"{got[worst]:.9g}" else 17  # enough to differ
    told = f"{place}: must be {wanted[worst]:.{digits}g}{near}, got {got[worst]:.{digits}g}"
    demand(off[worst] <= tolerance, told)


def deviations(cov: Array) -> Array:
    """Return the standard deviations (*b, n) of covariances (*b, n, n)."""
    return np.sqrt(np.maximum(np.diagonal(cov, axis1=-2, axis2=-1), 0.0))


def products(spread: Array) -> Array:
    """Return the products (*b, n, n) of every two of (*b, n), in which covariances are compared."""
    return spread[..., :, None] * spread[..., None, :]


def same_moments(what: str, space: Space, got: Gaussian, wanted: Gaussian, tolerance: float) -> None:
    """Raise Broken unless means and covariances agree, judged against each axis' standard deviation."""
    demand(got.mean.shape == wanted.mean.shape, f"{what}mean: must have shape {wanted.mean.shape}, got {got.mean.shape}")
    spread = np.maximum(deviations(wanted.cov), 1e-12) + 1e-12 * np.abs(wanted.mean)
    apart = space.difference(got.mean, wanted.mean)
    same(f"{what}mean, in standard deviations", apart / spread, np.zeros(apart.shape), tolerance, 1.0)
    same(f"{what}covariance", got.cov, wanted.cov, tolerance, products(spread))


def whitened(root: Array, cov: Array) -> Array:
    """Return covariances (*b, m, m) in units of the covariance that has this root."""
    half = np.linalg.solve(root, np.swapaxes(np.linalg.solve(root, cov), -1, -2))
    return (half + np.swapaxes(half, -1, -2)) / 2


def finite(what: str, values: Array) -> None:
    """Raise Broken unless every number is finite."""
    demand(np.all(np.isfinite(values)), f"{what}: must be finite, got {_short(values)}")


def covariance(what: str, cov: Array, definite: bool) -> None:
    """Raise Broken unless `cov` (*b, n, n) is finite, symmetric and positive (semi-)definite, judged as correlations.

    So an axis in rad counts as much as one in m. Rounding up to 1e-9 is allowed where it need not be definite.
    """
    finite(what, cov)
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    told = f"{what}: variances must be {'> 0' if definite else '>= 0'}, got {_short(variance)}"
    demand(np.all(variance > 0 if definite else variance >= 0), told)
    spread = np.sqrt(np.where(variance > _DIGITS, variance, 1.0))
    correlation = cov / spread[..., :, None] / spread[..., None, :]
    skew = np.max(np.abs(correlation - np.swapaxes(correlation, -1, -2)), initial=0.0)
    demand(skew <= 1e-9, f"{what}: must be symmetric, differs from its transpose by {skew:.2g}")
    if correlation.size:
        least = float(np.min(np.linalg.eigvalsh(correlation)))
        told = f"positive {'' if definite else 'semi-'}definite, its correlations have eigenvalue {least:.3g}"
        demand(least > (0.0 if definite else -1e-9), f"{what}: must be {told}")


def frozen_copy(values: Array) -> Array:
    """Return a read-only copy: numpy raises an error if a component writes into its argument."""
    copy = np.array(values)
    copy.flags.writeable = False
    return copy


def derivative(
    function: Callable[[Array], Array], x: Array, difference: Callable[[Array, Array], Array], step: Array
) -> tuple[Array, Array]:
    """Return the derivative (m, n) of `function` (*b, n) -> (*b, m) at x (n,) by fourth-order central differences, and its
    uncertainty.

    The uncertainty (m, n) is the change from halving the `step` (n,), or at a kink, where the slopes of both sides differ
    however small the step, their difference: differences around the tip of |x| alone would see a slope of 0 there.
    """

    def estimate(h: Array) -> Array:
        moves = np.diag(h)
        near = difference(function(x + moves), function(x - moves))
        far = difference(function(x + 2 * moves), function(x - 2 * moves))
        return ((8 * near - far) / (12 * h[:, None])).T

    def apart(h: Array) -> Array:
        moves = np.diag(h)
        here = function(x)
        sides = difference(function(x + moves), here) - difference(here, function(x - moves))
        return np.abs(sides / h[:, None]).T

    fine = estimate(step / 2)
    near, far = apart(step / 2), apart(step)
    return fine, np.maximum(np.abs(fine - estimate(step)), np.where(near > 0.75 * far, near, 0.0))


def is_derivative(
    function: Callable[[Array], Array], difference: Callable[[Array, Array], Array], stated: Array, x: Array, step: Array
) -> None:
    """Raise Broken unless `stated` (m, n) is the derivative of `function` at x (n,); not judged where there is none.

    Entries are compared in units of `step` (n,), the size of a typical change of each axis, by differences of two sizes:
    rounding may look like a slope where terms cancel, and looks otherwise at another size.
    """
    for size in (1e-2, 3.7e-3):
        with np.errstate(all="ignore"):
            slope, doubt = derivative(function, x, difference, size * step)
        largest = np.max(np.abs(slope) * step, axis=-1, keepdims=True)
        smooth = np.isfinite(slope) & (doubt * step <= 1e-2 * largest + 1e-12)
        rows = np.max(np.abs(np.where(smooth, slope, 0.0)) * step, axis=-1, keepdims=True)
        off = np.abs(stated - slope) * step - 4 * doubt * step
        allowed = 1e-6 * rows + 1e-9 * np.abs(function(x))[..., :, None]
        # Of what stays at 0 no size is known.
        bad = smooth.all(axis=-1, keepdims=True) & ~(off <= np.maximum(allowed, np.where(largest <= 1e-12, 1e-12, 1e-100)))
        if not np.any(bad):
            return
    i, j = np.argwhere(bad)[0]
    raise Broken(f"jacobian[{i}, {j}]: must be the derivative {slope[i, j]:.9g}, got {stated[i, j]:.9g}")


def _short(values: Array) -> str:
    flat = np.asarray(values).ravel()
    shown = ", ".join(f"{value:.6g}" for value in flat[:12])
    return f"[{shown}{', ...' if flat.size > 12 else ''}]"
