"""The result of reproducing a published study: tables with errors, verdicts on its claims, data of its figures.

Plain values; `vedette.report.reproduction` prints and draws them.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from attrs import frozen

from vedette.progress import Progress
from vedette.roles import Component
from vedette.space import Array, Space
from vedette.types import Gaussian

Verdict = Literal["reproduced", "not reproduced", "not testable"]


@frozen
class Cell:
    """One figure of a table: measured, with its Monte Carlo standard error, and as published; None where there is none."""

    measured: float | None
    error: float | None = None
    published: float | None = None


@frozen
class Table:
    """Figures of one kind: each row a label and one cell a column. `note` says what they are, with units."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Cell, ...]], ...]
    note: str = ""

    def cell(self, row: str, column: str) -> Cell:
        """Return the cell of a row and a column by their names."""
        return dict(self.rows)[row][self.columns.index(column)]


@frozen
class Claim:
    """What a paper states, whether the study confirms it, and why."""

    text: str
    verdict: Verdict
    why: str


@frozen(eq=False)
class Curve:
    """Points x (s,), y (s,) with a label; as a line, one with its points marked, a dashed line, dots or rings.

    `colour`: the n-th; default: by its position.
    `doubt` (s,) is half the height of a band around it; with `doubt_across` (s,) both are bars at each point.
    `notes`: a word beside each point.
    """

    label: str
    x: Array
    y: Array
    style: Literal["line", "marked", "dashed", "dots", "rings"] = "line"
    colour: int | None = None
    doubt: Array | None = None
    doubt_across: Array | None = None
    notes: tuple[str, ...] = ()


@frozen(eq=False)
class Panel:
    """One pair of axes. `equal` gives both one scale, as on a map; `log` makes the upright one logarithmic."""

    title: str
    across: str
    upright: str
    curves: tuple[Curve, ...]
    equal: bool = False
    log: bool = False


@frozen(eq=False)
class Chart:
    """A picture, stored under `name`: panels below one another."""

    name: str
    title: str
    panels: tuple[Panel, ...]


@frozen(eq=False)
class Findings:
    """All results of a study. `machine` depends on the machine: run times, to which no law applies."""

    title: str
    runs: int
    seed: int
    tables: tuple[Table, ...]
    claims: tuple[Claim, ...]
    charts: tuple[Chart, ...] = ()
    machine: tuple[Table, ...] = ()


class Reproduction(Component):
    """A published study, reproduced: its scenario, its filters as configs, its figures, and verdicts on its claims.

    Laws: the same runs and seed give the same result, to the last bit.
    """

    title: ClassVar[str]
    """The paper."""

    default_runs: ClassVar[int]
    """Default number of Monte Carlo runs."""

    @abstractmethod
    def run(self, runs: int, seed: int, progress: Progress) -> Findings:
        """Run the whole study; `progress` wraps its loops."""


def mean_cell(values: Array, published: float | None = None, scale: float = 1.0) -> Cell:
    """Return the mean of one value per run (r,) times `scale`, with its standard error; no figure without runs."""
    runs = len(values)
    if runs == 0:
        return Cell(None, None, published)
    error = float(np.std(values, ddof=1) / np.sqrt(runs)) * scale if runs > 1 else None
    return Cell(float(np.mean(values)) * scale, error, published)


def rms_cell(squares: Array, published: float | None = None) -> Cell:
    """Return the root of the mean of squared errors (r, s), one row per run; its error from the spread of run means."""
    mean = mean_cell(np.mean(squares, axis=-1))
    if mean.measured is None:
        return Cell(None, None, published)
    root = float(np.sqrt(mean.measured))
    return Cell(root, None if mean.error is None or root == 0 else 0.5 * mean.error / root, published)


def ratio_cell(over: Array, under: Array, published: float | None = None) -> Cell:
    """Return the ratio of two RMS errors on the same runs, from squared errors (r, s), (r, u); error by linearisation."""
    a, b = np.mean(over, axis=-1), np.mean(under, axis=-1)
    if len(a) == 0 or np.mean(b) == 0:
        return Cell(None, None, published)
    ratio = float(np.sqrt(np.mean(a) / np.mean(b)))
    influence = 0.5 * ratio * (a / np.mean(a) - b / np.mean(b)) if np.mean(a) > 0 else np.zeros(len(a))
    return Cell(ratio, float(np.std(influence, ddof=1) / np.sqrt(len(a))) if len(a) > 1 else None, published)


def two_point(first: Gaussian, second: Gaussian, dt: float) -> Gaussian:
    """Start position and velocity from two positions (*b, d) `dt` s apart: mean (*b, 1, 2d), the track's axis added.

    v = (z2 - z1)/T; cov = [R2 R2/T; R2/T (R1 + R2)/T^2]: the information in both, ignoring process noise in between.
    """
    d = first.mean.shape[-1]
    mean = np.concatenate([second.mean, (second.mean - first.mean) / dt], axis=-1)
    cov = np.zeros((*mean.shape, 2 * d))
    cov[..., :d, :d] = second.cov
    cov[..., :d, d:] = cov[..., d:, :d] = second.cov / dt
    cov[..., d:, d:] = (first.cov + second.cov) / dt**2
    return Gaussian(mean[..., None, :], cov[..., None, :, :])


def over_axes(prior: Gaussian, space: Space, state: Space, rest: Mapping[str, tuple[float, float]]) -> Gaussian:
    """Extend a prior over `space` to `state`, whose further axes have the [mean, standard deviation] of `rest`."""
    n = len(state)
    mean, cov = np.zeros((*prior.mean.shape[:-1], n)), np.zeros((*prior.mean.shape[:-1], n, n))
    known = [name for name in state.names if name in space]
    there, here = [[axes.names.index(name) for name in known] for axes in (space, state)]
    mean[..., here] = prior.mean[..., there]
    cov[..., np.array(here)[:, None], here] = prior.cov[..., there, :][..., there]
    for i, name in enumerate(state.names):
        if name not in space:
            mean[..., i], cov[..., i, i] = rest[name][0], rest[name][1] ** 2
    return Gaussian(mean, cov)
