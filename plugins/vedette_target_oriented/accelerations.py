"""Section 4.1 of the paper: an acceleration in fixed axes, and along the target's own velocity."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array
from vedette.reproduction import Cell, Chart, Claim, Curve, Panel, Table, mean_cell

SECONDS = 10_000
LAGS = 100
SPEED = 400.0
STEPS = {"scenario 1": (5.0, 5.0), "scenario 2": (1.7, 0.0425)}
"""Standard deviations of the accelerations' steps per second; m/s^2, the last a turn rate in rad/s."""


@frozen(eq=False)
class Accelerations:
    """One scenario's accelerations in m/s^2, (r, s, 2): fixed along x and y, own along and right of the velocity."""

    fixed: Array
    own: Array


def pieces(count: int, rng: np.random.Generator) -> Array:
    """Draw two random walks, from 0 for Poisson(10) s, then at rest for as long, and so on: (count, s, 2), steps of 1."""
    walks = np.empty((count, SECONDS, 2))
    for row in walks:
        lengths = rng.poisson(10, size=SECONDS // 4)
        piece = np.repeat(np.arange(len(lengths)), lengths)[:SECONDS]
        steps = np.where(piece[:, None] % 2 == 0, rng.standard_normal((SECONDS, 2)), 0.0)
        total = np.cumsum(steps, axis=0)
        first = np.searchsorted(piece, piece)
        row[:] = np.where(piece[:, None] % 2 == 0, total - total[first] + steps[first], 0.0)
    return walks


def along_axes(accel: Array) -> Accelerations:
    """Simulate scenario 1: `accel` (r, s, 2) drives the target along x and y; it starts at 400 m/s along x."""
    velocity = np.concatenate([np.zeros_like(accel[:, :1]), np.cumsum(accel[:, :-1], axis=1)], axis=1)
    velocity[..., 0] += SPEED
    return Accelerations(accel, turned(accel, velocity))


def along_velocity(walks: Array) -> Accelerations:
    """Simulate scenario 2: walks (r, s, 2) of the forward acceleration and of the turn rate."""
    forward, rate = walks[..., 0], walks[..., 1]
    speed = SPEED + np.concatenate([np.zeros_like(forward[:, :1]), np.cumsum(forward[:, :-1], axis=1)], axis=1)
    heading = np.concatenate([np.zeros_like(rate[:, :1]), np.cumsum(rate[:, :-1], axis=1)], axis=1)
    direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    left = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    accel = forward[..., None] * direction + (speed * rate)[..., None] * left
    return Accelerations(accel, turned(accel, speed[..., None] * direction))


def turned(accel: Array, velocity: Array) -> Array:
    """Return the components along the velocity and to its right: (*b, 2), (*b, 2) -> (*b, 2)."""
    unit = velocity / np.maximum(np.linalg.norm(velocity, axis=-1, keepdims=True), 1e-9)
    right = unit[..., 0] * -accel[..., 1] + unit[..., 1] * accel[..., 0]
    return np.stack([np.sum(unit * accel, axis=-1), right], axis=-1)


def correlation(pair: Array) -> Array:
    """Return the cross-correlation coefficient of two series (r, s, 2) at lags -100 ... 100: (r, 201)."""
    centred = pair - np.mean(pair, axis=1, keepdims=True)
    size = 1 << (2 * SECONDS - 1).bit_length()
    first, second = (np.fft.rfft(centred[..., j], size) for j in (0, 1))
    product = np.fft.irfft(first * np.conj(second), size)
    rho = np.concatenate([product[:, -LAGS:], product[:, : LAGS + 1]], axis=1)
    scale = np.sqrt(np.prod(np.sum(centred**2, axis=1), axis=-1))
    ratio: Array = rho / scale[:, None]
    return ratio


def kurtosis(values: Array) -> Array:
    """Return the fourth central moment over the squared variance, 3 for a Gaussian: (r, s) -> (r,)."""
    centred = values - np.mean(values, axis=1, keepdims=True)
    ratio: Array = np.mean(centred**4, axis=1) / np.mean(centred**2, axis=1) ** 2
    return ratio


def study(count: int, rng: np.random.Generator) -> dict[str, Accelerations]:
    """Simulate both scenarios, `count` trajectories each, and white noise for comparison."""
    first = along_axes(np.array(STEPS["scenario 1"]) * pieces(count, rng))
    second = along_velocity(np.array(STEPS["scenario 2"]) * pieces(count, rng))
    white = rng.standard_normal((count, SECONDS, 2))
    return {"scenario 1": first, "scenario 2": second, "white noise": Accelerations(white, white)}


def _spread(pair: Array) -> Array:
    """Return the root mean square of the cross-correlation over the lags: (r, s, 2) -> (r,)."""
    root: Array = np.sqrt(np.mean(correlation(pair) ** 2, axis=1))
    return root


def _geometric(values: Array, published: float | None = None) -> Cell:
    """Return the geometric mean over trajectories: variances span decades, as a speed that has grown stays large."""
    log = mean_cell(np.log(values))
    middle = float(np.exp(log.measured or 0.0))
    return Cell(middle, None if log.error is None else middle * log.error, published)


def tables(found: dict[str, Accelerations]) -> tuple[Table, ...]:
    """Return correlations, variances and kurtoses."""
    both = {name: part for name, part in found.items() if name != "white noise"}
    correlations = Table(
        "Section 4.1: cross-correlation of the acceleration's two components",
        ("x and y", "forward and side"),
        tuple((name, (mean_cell(_spread(part.fixed)), mean_cell(_spread(part.own)))) for name, part in found.items()),
        "root mean square over lags of up to 100 s; 0 if independent, .01 for 10,000 samples of white noise",
    )
    printed = {"scenario 1": (None,) * 4, "scenario 2": (1115.0, 1337.0, 14.0, 1477.0)}
    variances = Table(
        "Section 4.1: variance of the acceleration",
        ("x", "y", "forward", "side"),
        tuple((name, tuple(map(_geometric, np.var(_four(part), axis=1).T, printed[name]))) for name, part in both.items()),
        "(m/s^2)^2, geometric mean over trajectories",
    )
    shapes = Table(
        "Section 4.1: kurtosis of the acceleration",
        ("x", "y", "forward", "side"),
        tuple((name, tuple(mean_cell(kurtosis(_four(part)[..., j])) for j in range(4))) for name, part in both.items()),
        "3 for a Gaussian",
    )
    return correlations, variances, shapes


def _four(part: Accelerations) -> Array:
    return np.concatenate([part.fixed, part.own], axis=-1)


def claims(found: dict[str, Accelerations]) -> tuple[Claim, ...]:
    """Return the verdicts on section 4.1."""
    gaps = {name: mean_cell(_spread(found[name].fixed) - _spread(found[name].own)) for name in STEPS}
    clear = {name: (gap.measured or 0.0) > 3 * (gap.error or np.inf) for name, gap in gaps.items()}
    shown = ", ".join(f"{name}: {gap.measured:.4f} +- {gap.error or np.nan:.4f}" for name, gap in gaps.items())
    tails = {name: np.mean([kurtosis(_four(found[name])[..., j]) for j in range(4)], axis=1) for name in STEPS}
    closer = all(tail[2] < tail[0] for tail in tails.values())
    spread = [_geometric(variance).measured or 0.0 for variance in np.var(_four(found["scenario 2"]), axis=1).T]
    aside = spread[2] < 0.1 * spread[3] and 0.5 < spread[0] / spread[1] < 2
    return (
        Claim(
            "Forward and side acceleration are less correlated than those along x and y (figure 3)",
            "reproduced" if all(clear.values()) else "not reproduced",
            f"x-y less forward-side is {shown}: clear of 0 by 3 standard errors in "
            f"{' and '.join(name for name in STEPS if clear[name]) or 'neither'}; how long and how often the "
            "target accelerates is not printed",
        ),
        Claim(
            "The forward acceleration is nearly Gaussian, more so than that along x (figure 4)",
            "not reproduced",
            f"its kurtosis is {'smaller' if closer else 'not smaller'} than that along x, "
            + ", ".join(f"{tail[2]:.3g} against {tail[0]:.3g}" for tail in tails.values())
            + ", but a Gaussian's is 3: rests and restarts make it peaked",
        ),
        Claim(
            "Along the velocity the variance is far smaller than across, while x and y are alike (scenario 2)",
            "reproduced" if aside else "not reproduced",
            f"{spread[2]:.3g} and {spread[3]:.4g} against {spread[0]:.4g} and {spread[1]:.4g} (m/s^2)^2",
        ),
        Claim(
            "The four variances are 14, 1477, 1115 and 1337 (m/s^2)^2",
            "remark",
            "turning axes keeps the mean square: 1115 + 1337 = 2452 and 14 + 1477 = 1491 belong to one trajectory only if "
            "the mean acceleration across is 31 m/s^2; the trajectories are not given",
        ),
    )


def charts(found: dict[str, Accelerations]) -> tuple[Chart, ...]:
    """Return figures 3 and 4: the first trajectory's correlations and histograms."""
    lags = np.arange(-LAGS, LAGS + 1.0)
    panels = [
        Panel(f"{name}: {words}", "lag [s]", "correlation", (Curve(words, lags, correlation(pair[:1])[0]),))
        for name, part in found.items()
        for words, pair in (("x and y", part.fixed), ("forward and side", part.own))
        if not (name == "white noise" and words != "x and y")
    ]
    shapes = [_histogram(name, part, j) for name, part in found.items() if name != "white noise" for j in (0, 1, 2, 3)]
    return (
        Chart("correlation", "Cross-correlation of the acceleration's components (figure 3)", tuple(panels)),
        Chart("distribution", "Distribution of the acceleration (figure 4)", tuple(shapes)),
    )


def _histogram(name: str, part: Accelerations, j: int) -> Panel:
    """Return one component's density in units of its standard deviation, beside the Gaussian's."""
    values = _four(part)[0, :, j]
    edges = np.linspace(-4.0, 4.0, 81)
    middle = 0.5 * (edges[1:] + edges[:-1])
    density = np.histogram((values - values.mean()) / values.std(), edges)[0] / (len(values) * (edges[1] - edges[0]))
    gauss = np.exp(-0.5 * middle**2) / np.sqrt(2 * np.pi)
    words = ("x", "y", "forward", "side")[j]
    return Panel(
        f"{name}: {words}",
        "acceleration [standard deviations]",
        "density",
        (Curve(words, middle, density), Curve("Gaussian", middle, gauss, "dashed")),
    )
