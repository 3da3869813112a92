"""Standard errors of tuned parameters: from the criterion's curvature at their own scale, and from its scores."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices
from vedette_tools.tuning.evaluation import Data
from vedette_tools.tuning.evaluator import Asker

DROP = 2.0
"""By this a parabola falls two standard errors from its top: so far the criterion is looked at."""
AXIAL = (1.0, 0.6, 0.3)
"""Parts of that step at which it is looked at along each parameter, to both sides; along two at once at the whole step."""
JUMPS = 0.5
"""Points so far off the smooth surface, and by three of its deviations, lie beyond a jump and count little."""
EDGE = 0.01
"""Nearer than this part of the range to its end, a parameter counts as at the edge."""
UNKNOWN = 0.5
"""A direction whose standard error is a larger part of the ranges cannot be told from the data."""


@frozen(eq=False)
class Curvature:
    """What the criterion tells of the position (p,) of its top.

    cov (p, p) over positions, NaN where nothing is known; `edge` names parameters at an end of their range, and `blurred`
    the directions (j, p) that the data do not tell. `jumps`: how far the criterion lies off a smooth surface at worst.
    """

    position: Array
    cov: Array
    edge: Indices
    blurred: Array
    jumps: float

    @property
    def error(self) -> Array:
        """The standard errors of the position (p,), NaN where they are not known."""
        return np.sqrt(np.diagonal(self.cov))


def curvature(asked: Asker, top: Array) -> Curvature:
    """Return the errors at the top, which is moved by one step of Newton's if that helps.

    Slope g and curvature H are those of the surface c + g d - d' H d / 2 + sum_i q_i d_i^3 that fits best over two standard
    errors, robustly: a track that is just started or lost makes the criterion jump, and close differences would see that
    alone. How far the criterion's own top is from that of the surface is added to the errors.
    The covariance is the sandwich H^-1 J H^-1, with J the long-run covariance of the scans' scores, which holds for a
    likelihood whose model is wrong, too; but no variance is less than that of H^-1, which is right where the model is, as
    J is known badly from few scans. For moments it is H^-1.
    Where clutter is tuned, J has a part by the views, whose volumes are guessed from the returns in them.
    White, Maximum Likelihood Estimation of Misspecified Models, Econometrica 50, 1982.
    """
    p = len(top)
    edge = np.flatnonzero((top < EDGE) | (top > 1.0 - EDGE))
    inner = np.setdiff1d(np.arange(p), edge)
    cov, blurred = np.full((p, p), np.nan), np.zeros((0, p))
    jumps = 0.0
    if len(inner):
        steps = np.array([_step(asked, top, int(i)) for i in inner])
        surface = _surface(asked, top, inner, steps)
        roots, axes = np.linalg.eigh(surface.H)
        told = roots > 1.0 / UNKNOWN**2
        sharp = axes[:, told]
        inverse = (sharp / roots[told]) @ sharp.T if told.any() else np.zeros_like(surface.H)
        shift = np.clip(inverse @ surface.slope, -steps, steps)
        moved = np.array(top)
        moved[inner] = np.clip(top[inner] + shift, EDGE, 1.0 - EDGE)
        jumps = surface.jumps
        if asked.height(moved) >= asked.height(top):
            top, shift = moved, np.zeros_like(shift)
        J = surface.H if asked.by == "consistency" else long_run(surface.scores)
        J = J + surface.by_views
        sandwich = inverse @ J @ inverse
        with np.errstate(invalid="ignore", divide="ignore"):
            least = np.diagonal(inverse + inverse @ surface.by_views @ inverse)
            short = np.sqrt(np.maximum(least / np.diagonal(sandwich), 1.0))
        sandwich = sandwich * short * short[:, None] + np.diag(shift**2)
        unknown = np.sum(axes[:, ~told] ** 2, axis=1) > 0.1
        sandwich[unknown] = np.nan
        sandwich[:, unknown] = np.nan
        cov[np.ix_(inner, inner)] = sandwich
        blurred = np.zeros((int(np.sum(~told)), p))
        blurred[:, inner] = axes[:, ~told].T
    return Curvature(top, cov, edge, blurred, jumps)


def long_run(scores: Array) -> Array:
    """Return the covariance (p, p) of the sum of scores (s, p) of successive scans, with what each tells of the next ones.

    Bartlett's weights over the cube root of their number. Newey, West, A Simple, Positive Semi-Definite,
    Heteroskedasticity and Autocorrelation Consistent Covariance Matrix, Econometrica 55, 1987.
    """
    scores = scores - np.mean(scores, axis=0)
    lags = round(len(scores) ** (1.0 / 3.0))
    total: Array = scores.T @ scores
    for lag in range(1, lags + 1):
        cross = scores[lag:].T @ scores[:-lag]
        total = total + (1.0 - lag / (1.0 + lags)) * (cross + cross.T)
    return total


def _step(asked: Asker, top: Array, i: int) -> float:
    """Return the step along one parameter at which a parabola through the criterion has fallen by DROP from its top.

    Fitted to three steps to both sides, from large ones down, until the criterion is like a parabola over them; the top
    itself has no part in it, for it may be a jump.
    """
    room = float(min(top[i], 1.0 - top[i], 0.4))
    reach, heights = room, dict[float, float]()
    for _ in range(10):
        rungs = [sign * reach / 2**k for k in range(3) for sign in (1.0, -1.0)]
        new = [rung for rung in rungs if rung not in heights]
        heights |= dict(zip(new, asked.heights([_moved(top, {i: rung}) for rung in new]), strict=True))
        d, h = np.array(rungs), np.array([heights[rung] for rung in rungs])
        known = np.isfinite(h)
        if np.sum(known) >= 4:
            _, _, bend = np.linalg.lstsq(np.stack([d**0, d, -0.5 * d**2], axis=-1)[known], h[known], rcond=None)[0]
            if known.all() and 0.5 * bend * reach**2 <= 2.0 * DROP:
                return float(np.clip(np.sqrt(2.0 * DROP / bend), 0.5 * reach, reach)) if bend > 0 else reach
        reach /= 2.0
    return reach


def _moved(top: Array, by: dict[int, float]) -> Array:
    moved = np.array(top)
    for i, step in by.items():
        moved[i] = np.clip(moved[i] + step, 0.0, 1.0)
    return moved


@frozen(eq=False)
class Surface:
    """A smooth surface through the criterion about its top, off which it jumps by `jumps` at worst.

    scores (s, p): by how much each scan's part of the criterion grows with each parameter. by_views (p, p): the covariance
    of the slope by the errors of the views' volumes V, by which the log-likelihood falls as the returns of no track that are
    expected in them: d/dln V of it is -V c.
    """

    slope: Array
    H: Array
    scores: Array
    by_views: Array
    jumps: float


def _surface(asked: Asker, top: Array, inner: Indices, steps: Array) -> Surface:
    """Return the surface over the inner parameters, fitted in units of their steps."""
    p = len(inner)
    unit = np.eye(p)
    points = [sign * part * unit[i] for i in range(p) for part in AXIAL for sign in (1.0, -1.0)]
    points += [s * unit[i] + t * unit[j] for i in range(p) for j in range(i) for s in (1.0, -1.0) for t in (1.0, -1.0)]
    away = np.array(points)

    def place(d: Array) -> Array:
        return _moved(top, dict(zip(inner.tolist(), (d * steps).tolist(), strict=True)))

    heights = np.array(asked.heights([place(d) for d in away]))
    known = np.isfinite(heights)
    pairs = [(i, j) for i in range(p) for j in range(i + 1)]
    squares = np.stack([away[:, i] * away[:, j] * (0.5 if i == j else 1.0) for i, j in pairs], axis=-1)
    terms = np.concatenate([np.ones((len(away), 1)), away, -squares, away**3], axis=-1)[known]
    coefficients, weights = _robust(terms, heights[known])
    jumps = float(np.max(np.abs(heights[known] - terms @ coefficients)))
    H = np.zeros((p, p))
    for (i, j), bend in zip(pairs, coefficients[1 + p : 1 + p + len(pairs)], strict=True):
        H[i, j] = H[j, i] = bend / (steps[i] * steps[j])
    sound = np.zeros(len(away))
    sound[known] = weights
    here = asked.found(top)
    assert here is not None
    grows = [np.zeros_like(here)] * p
    for i in range(p):
        axial = [k for k in range(i * 2 * len(AXIAL), (i + 1) * 2 * len(AXIAL)) if sound[k] > 0.5]
        if len(axial) > 1:
            first, last = min(axial, key=lambda k: away[k, i]), max(axial, key=lambda k: away[k, i])
            low, high = asked.found(place(away[first])), asked.found(place(away[last]))
            if low is not None and high is not None:
                grows[i] = (high - low) / ((away[last, i] - away[first, i]) * steps[i])
    slopes = np.stack(grows, axis=-1)
    scores, by_views = (slopes, np.zeros((p, p))) if slopes.ndim == 2 else (slopes[0], _by_views(asked.data, slopes[1]))
    return Surface(coefficients[1 : 1 + p] / steps, H, scores, by_views, jumps)


def _by_views(data: Data, slopes: Array) -> Array:
    """Return the covariance (p, p) of the slope by the views, from those of the returns (s, p) expected in each scan."""
    sensors = np.array(data.sensors[: len(slopes)])
    each = [view.doubt * np.sum(slopes[sensors == name], axis=0) for name, view in data.unstated.views.items()]
    return np.einsum("vi,vj->ij", each, each) if each else np.zeros((slopes.shape[1],) * 2)


def _robust(terms: Array, heights: Array) -> tuple[Array, Array]:
    """Return the coefficients that fit best by Huber's criterion, and the weight of each height: 1 near the surface."""
    weights: Array = np.ones(len(heights))
    coefficients: Array = np.zeros(terms.shape[1])
    for _ in range(50):
        root = np.sqrt(weights)
        coefficients = np.linalg.lstsq(terms * root[:, None], heights * root, rcond=None)[0]
        off = np.abs(heights - terms @ coefficients)
        limit = max(JUMPS, 3.0 * 1.48 * float(np.median(off)))
        weights = np.where(off > limit, (limit / np.maximum(off, limit)) ** 2, 1.0)
    return coefficients, weights
