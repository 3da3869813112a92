"""The result of a study: figures of every run, means with their errors, series against time, differences between points."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import field, frozen

from vedette import Array, VedetteError
from vedette_report.figures import figures_html
from vedette_study.averages import averaged, averaged_plan
from vedette_study.chunk import SERIES, study_figures
from vedette_study.execution import Chunks
from vedette_study.grid import short_names
from vedette_study.plan import Plan, by_point
from vedette_study.statistics import Mean, difference, gathered, mean, ratios
from vedette_study.store import made_by

if TYPE_CHECKING:
    import xarray


@frozen(eq=False)
class Against:
    """One point's series against time (s,): name to its value and standard error; the error of position is a root."""

    times: Array
    values: dict[str, Array]
    errors: dict[str, Array]


@frozen(eq=False)
class Outcome:
    """The result of a study: `figures` name to (points, runs), NaN where a run has none; `against` one series a point.

    Of root mean squares, `figures` hold each run's mean square, over which `means` average before they take the root.
    Where the study averages over a swept path, `parts` is the result at every point.
    """

    plan: Plan
    figures: dict[str, Array] = field(repr=False)
    against: tuple[Against, ...] = field(repr=False)
    interrupted: bool = False
    parts: Outcome | None = field(default=None, repr=False)

    @property
    def runs(self) -> int:
        """Number of runs done at every point."""
        return len(next(iter(self.figures.values()))[0])

    def _repr_html_(self) -> str:
        title = f"{self.plan.title or 'Study'}: {self.runs} runs at each of {len(self.plan.points)} points"
        tables = []
        for i, at in enumerate(self.plan.points):
            means = {name: each for name, each in self.means(i).items() if each.value is not None}
            rows = {
                name: f"{each.value:.4g} +- {each.error:.2g}" if each.error else f"{each.value:.4g}"
                for name, each in means.items()
            }
            tables.append(figures_html(", ".join(map(str, at.labels.values())) or "all", rows))
        return figures_html(title, {}) + "".join(tables)

    def means(self, point: int) -> dict[str, Mean]:
        """Return every figure at a point of the grid."""
        return {name: mean(name, values[point]) for name, values in self.figures.items()}

    def differences(self, point: int, other: int = 0) -> dict[str, Mean]:
        """Return every figure at a point minus that of another, paired by run."""
        return {name: difference(name, values[point], values[other]) for name, values in self.figures.items()}

    def table(self) -> list[dict[str, Any]]:
        """Return a row for each point: its labels, and each figure with its standard error."""
        return [{**at.labels, **_plain(self.means(i))} for i, at in enumerate(self.plan.points)]

    def data(self) -> dict[str, Any]:
        """Return all but runs and series, as plain data."""
        paired = [{**at.labels, **_plain(self.differences(i))} for i, at in enumerate(self.plan.points) if i]
        return {
            "title": self.plan.title,
            "runs": self.runs,
            "seed": self.plan.seed,
            "chunk": self.plan.chunk,
            "interrupted": self.interrupted,
            "units": {name: study_figures()[name].unit for name in self.figures},
            "table": self.table(),
            "differences_to_the_first": paired,
        } | ({} if self.parts is None else {"averaged_over": list(self.plan.average), "parts": self.parts.table()})

    def dataset(self) -> xarray.Dataset:
        """Return labelled arrays over the axes of the grid, the runs and the times; attributes state their origin."""
        try:
            import xarray
        except ImportError:
            raise VedetteError("labelled arrays need xarray: pip install 'vedette[study]'") from None
        axes = self.plan.axes
        names = tuple(short_names(axes, {"run", "step", "time", *study_figures()}).values())
        arrays: dict[str, Any] = {}
        for name, values in self.figures.items():
            series = np.sqrt(values) if study_figures()[name].squared else values
            arrays[f"run_{name}"] = ((*names, "run"), by_point(series, axes), {"units": study_figures()[name].unit})
            for part in ("value", "error"):
                column = np.array([getattr(self.means(i)[name], part) for i in range(len(values))], dtype=float)
                shown = name if part == "value" else f"{name}_error"
                arrays[shown] = (names, by_point(column, axes), {"units": study_figures()[name].unit})
        steps = max(len(series.times) for series in self.against)
        if steps:
            arrays["time"] = ((*names, "step"), by_point(_padded([series.times for series in self.against], steps), axes))
            for name in self.against[0].values:
                for shown, part in ((f"{name}_at", "values"), (f"{name}_at_error", "errors")):
                    rows = [getattr(series, part)[name] for series in self.against]
                    arrays[shown] = ((*names, "step"), by_point(_padded(rows, steps), axes))
        coordinates = {shown: _coordinate(values) for shown, values in zip(names, axes.values(), strict=True)}
        made = {"title": self.plan.title, "seed": self.plan.seed, "chunk": self.plan.chunk, **made_by()}
        return xarray.Dataset(arrays, coordinates, made | {"study": json.dumps(self.plan.given)})


def outcome(plan: Plan, chunks: Chunks, *, interrupted: bool) -> Outcome:
    """Combine the chunks."""
    points = range(len(plan.points))
    names = [name for name in study_figures() if all(name in chunks[0][i].figures for i in points)]
    figures = {name: np.stack([gathered(chunks, name, i) for i in points]) for name in names}
    outcome = Outcome(plan, figures, tuple(_against(chunks, i) for i in points), interrupted)
    if not plan.average:
        return outcome
    means = {name: averaged(values, plan.axes, plan.average) for name, values in figures.items()}
    fewer = averaged_plan(plan)
    nothing = Against(np.zeros(0), {}, {})
    return Outcome(fewer, means, (nothing,) * len(fewer.points), interrupted, outcome)


def _against(chunks: Chunks, point: int) -> Against:
    runs = sum(len(next(iter(chunk[point].figures.values()))) for chunk in chunks)
    total = np.zeros_like(chunks[0][point].sums)
    for chunk in chunks:
        total = total + chunk[point].sums
    value, error = ratios(total, runs)
    values, errors = dict(zip(SERIES, value, strict=True)), dict(zip(SERIES, error, strict=True))
    root = np.sqrt(values.pop("square"))
    spread = np.divide(errors.pop("square"), 2 * root, out=np.zeros_like(root), where=root > 0)
    return Against(chunks[0][point].times, {"position_rmse": root, **values}, {"position_rmse": spread, **errors})


def _plain(means: dict[str, Mean]) -> dict[str, Any]:
    return {name: {"value": mean.value, "error": mean.error, "runs": mean.runs} for name, mean in means.items()}


def _coordinate(values: tuple[Any, ...]) -> list[Any]:
    return list(values) if _numbers(values) else [value if isinstance(value, str) else json.dumps(value) for value in values]


def _numbers(values: tuple[Any, ...]) -> bool:
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def _padded(rows: list[Array], steps: int) -> Array:
    return np.stack([np.pad(row, (0, steps - len(row)), constant_values=np.nan) for row in rows])


def numeric_axes(plan: Plan) -> Iterator[str]:
    """Yield the axes of the grid along which a curve can be drawn."""
    for path, values in plan.axes.items():
        if len(values) > 1 and _numbers(values):
            yield path
