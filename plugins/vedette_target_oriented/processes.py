"""What section 4.1 of the paper reports of accelerations, and what the study finds: tables, verdicts, figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import evolve

from vedette import Array
from vedette_report.findings import Cell, Chart, Claim, Condition, Curve, Panel, Table, judged, mean_cell, ratio_cell, remark
from vedette_target_oriented.accelerations import LAGS, STEPS, Measured

NAMES = ("x", "y", "forward", "aside")
PRINTED = {"scenario 1": (None,) * 4, "scenario 2": (1115.0, 1337.0, 14.0, 1477.0)}
"""Variances in (m/s^2)^2."""
CLEARLY = 0.95
"""Ratio of two correlations that a figure could show."""
Figures = Mapping[tuple[str, ...], Cell]


def tables(measured: Mapping[str, Measured]) -> tuple[Table, ...]:
    """Return correlations, variances and kurtoses."""
    both = {name: part for name, part in measured.items() if name != "white noise"}
    correlations = Table(
        "Section 4.1: cross-correlation of the acceleration's two components",
        ("x and y", "forward and aside", "ratio"),
        tuple((name, _correlations(part)) for name, part in measured.items()),
        f"root mean square over lags of up to {LAGS} s; 0 if independent, .01 for 10,000 samples of white noise",
    )
    variances = Table(
        "Section 4.1: variance of the acceleration",
        NAMES,
        tuple((name, tuple(map(_geometric, part.variance.T, PRINTED[name]))) for name, part in both.items()),
        "(m/s^2)^2, geometric mean over trajectories",
    )
    shapes = Table(
        "Section 4.1: kurtosis of the acceleration",
        NAMES,
        tuple((name, tuple(map(mean_cell, part.kurtosis.T))) for name, part in both.items()),
        "3 for a Gaussian",
    )
    return correlations, variances, shapes


def _correlations(part: Measured) -> tuple[Cell, Cell, Cell]:
    fixed, turned = part.across_axes**2, part.across_own**2
    return mean_cell(np.sqrt(np.mean(fixed, axis=1))), mean_cell(np.sqrt(np.mean(turned, axis=1))), ratio_cell(turned, fixed)


def _geometric(values: Array, published: float | None = None) -> Cell:
    """Return the geometric mean over trajectories: variances span decades, as a speed that has grown stays large."""
    log = mean_cell(np.log(values))
    middle = float(np.exp(log.measured or 0.0))
    trimmed = None if log.trimmed is None else (kept := float(np.exp(log.trimmed[0])), kept * log.trimmed[1])
    return Cell(middle, None if log.error is None else middle * log.error, published, trimmed)


def figures(measured: Mapping[str, Measured]) -> dict[tuple[str, ...], Cell]:
    """Return the figures that the claims are judged by."""
    made: dict[tuple[str, ...], Cell] = {}
    for name in STEPS:
        part = measured[name]
        made["correlation", name] = ratio_cell(part.across_own**2, part.across_axes**2)
        made["x over forward", name] = mean_cell(part.kurtosis[:, 0] - part.kurtosis[:, 2])
        made["y over aside", name] = mean_cell(part.kurtosis[:, 1] - part.kurtosis[:, 3])
        made["forward", name] = mean_cell(part.kurtosis[:, 2])
        made["forward over aside", name] = _geometric(part.variance[:, 2] / part.variance[:, 3])
        made["x over y", name] = _geometric(part.variance[:, 0] / part.variance[:, 1])
    return made


def claims(cells: Figures, count: int) -> tuple[Claim, ...]:
    """Return the claims of section 4.1 with their verdicts, over so many trajectories."""
    first, second = STEPS
    aside = evolve(cells["forward over aside", second], published=0.009)

    def verdict(text: str, why: str, *conditions: Condition) -> Claim:
        return judged(text, conditions, count, why, "trajectories")

    def less(name: str) -> Condition:
        return Condition("correlation forward and aside over that of x and y", cells["correlation", name], most=CLEARLY)

    return (
        verdict(
            "Scenario 1: forward and side acceleration are less correlated than those along x and y (figure 3)",
            "there the target accelerates along x and y independently, and turning the axes cannot make it more so",
            less(first),
        ),
        verdict(
            "Scenario 2: forward and side acceleration are less correlated than those along x and y (figure 3)",
            "how long and how often the target accelerates is not printed: Poisson(10) s, and rests alike, are chosen",
            less(second),
        ),
        verdict(
            "Scenario 1: the forward acceleration is closer to a Gaussian than that along x (figure 4 a, b)",
            "by the kurtosis, 3 for a Gaussian; each axis accelerates and rests at times of its own",
            Condition("kurtosis along x less that forward", cells["x over forward", first], least=0.0, strict=True),
        ),
        verdict(
            "Scenario 2: forward and aside the acceleration is closer to a Gaussian than along x and y (figure 4 c-f)",
            "",
            Condition("kurtosis along x less that forward", cells["x over forward", second], least=0.0, strict=True),
            Condition("kurtosis along y less that aside", cells["y over aside", second], least=0.0, strict=True),
        ),
        verdict(
            "The forward acceleration is nearly Gaussian (figure 4 b, e)",
            "rests and restarts make it peaked",
            *(Condition(f"its kurtosis, {name}", cells["forward", name], most=3.5) for name in STEPS),
        ),
        verdict(
            "Along the velocity the variance is far smaller than across, while x and y are alike (scenario 2)",
            "geometric means over trajectories",
            Condition("variance forward over that aside", aside, most=0.1),
            Condition("variance along x over that along y", evolve(cells["x over y", second], published=0.83), 0.5, 2.0),
        ),
        remark(
            "The four variances are 14, 1477, 1115 and 1337 (m/s^2)^2",
            "turning axes keeps the mean square: 1115 + 1337 = 2452 and 14 + 1477 = 1491 belong to one trajectory only if "
            "the mean acceleration across is 31 m/s^2; the trajectories are not given",
        ),
    )


def charts(measured: Mapping[str, Measured], claims: tuple[Claim, ...]) -> tuple[Chart, ...]:
    """Return figures 3 and 4: the first trajectory's correlations with the spread over all, and its histograms."""
    lags = np.arange(-LAGS, LAGS + 1.0)
    panels = []
    for name, part in measured.items():
        for words, rho in (("x and y", part.across_axes), ("forward and aside", part.across_own)):
            if not (name == "white noise" and words != "x and y"):
                usual = 2 * np.sqrt(np.mean(rho**2, axis=0))
                curves = (
                    Curve("one trajectory", lags, rho[0]),
                    Curve(
                        "band: two root mean squares over all trajectories", lags, np.zeros_like(lags), "dashed", doubt=usual
                    ),
                )
                panels.append(Panel(f"{name}: {words}", "lag [s]", "correlation coefficient", curves))
    shapes = [_histogram(name, measured[name].first[:, j], NAMES[j]) for name in STEPS for j in range(4)]
    title = "Cross-correlation of the acceleration's components (figure 3)"
    return (
        Chart("correlation", title, tuple(panels), claims[:2], shared=True),
        Chart(
            "distribution",
            "Distribution of the acceleration in one trajectory (figure 4)",
            tuple(shapes),
            claims[2:6],
            shared=True,
        ),
    )


def _histogram(name: str, values: Array, words: str) -> Panel:
    """Return one component's density in units of its standard deviation, beside the Gaussian's."""
    edges = np.linspace(-4.05, 4.05, 82)  # rests, at 0, are in the middle of one
    middle = 0.5 * (edges[1:] + edges[:-1])
    density = np.histogram((values - values.mean()) / values.std(), edges)[0] / (len(values) * (edges[1] - edges[0]))
    gauss = np.exp(-0.5 * middle**2) / np.sqrt(2 * np.pi)
    return Panel(
        f"{name}: {words}",
        "acceleration [standard deviations]",
        "density",
        (
            Curve("one trajectory", middle, np.where(density > 0, density, np.nan)),
            Curve("Gaussian", middle, gauss, "dashed"),
        ),
        log=True,
    )
