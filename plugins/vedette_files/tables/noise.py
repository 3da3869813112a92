"""Columns of each return's own errors: one, two or three of deviations, variances and covariances."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Problem, Space
from vedette_files.input_files import shown
from vedette_files.tables.numbers import Number, Row, numbers


@frozen
class NoiseColumns:
    """How the covariance of a return over the axes measured is read: of each entry (i, j) the column, and whether it holds
    a deviation.
    """

    names: tuple[str, ...]
    entries: tuple[tuple[int, int, Number, bool], ...] = ()

    @property
    def wanted(self) -> dict[str, str]:
        """The columns to find: name in the config to title in the file."""
        return {column.name: column.title for _, _, column, _ in self.entries}

    def read(self, row: Row, lacking: Collection[str] = ()) -> tuple[float, ...]:
        """Return the covariance of a row, its entries one after another, () without columns; ValueError if it is none.

        That of axes which the row is `lacking` is not read: their variance is 1, and means nothing.
        """
        if not self.entries:
            return ()
        R: Array = np.zeros((len(self.names), len(self.names)))
        without = [i for i, name in enumerate(self.names) if name in lacking]
        R[without, without] = 1.0
        there = [entry for entry in self.entries if entry[0] not in without and entry[1] not in without]
        for i, j, column, deviation in there:
            value = column.of(row)
            if i == j and not value > 0:
                raise ValueError(f"{column.title} must be > 0, got {shown(row.cells[column.name])}")
            R[i, j] = R[j, i] = value**2 if deviation else value
        for i, j, column, _ in there:
            most = math.sqrt(R[i, i] * R[j, j])
            if i != j and not abs(R[i, j]) < most:
                bounds = f"between -{most:.6g} and {most:.6g}, by the variances"
                raise ValueError(f"{column.title} must be {bounds}, got {R[i, j]:.6g}")
        if len(self.names) > 2 and np.linalg.eigvalsh(R)[0] <= 0:
            raise ValueError(f"{self.entries[-1][2].title} and others are no covariance: it must be positive definite")
        return tuple(R.ravel().tolist())


def noise_columns(
    noise: Mapping[str, str],
    measured: Mapping[str, Space],
    absent: Mapping[str, Collection[str]],
    units: Mapping[str, str],
    place: str,
) -> dict[str, NoiseColumns]:
    """Return the columns of the errors of each sensor, by what it measures: those along its axes.

    ConfigError for other axes, and unless each of its axes but those `absent` from its returns has a column, or none has.
    """
    pairs = {key: (key.split()[0], key.split()[-1]) for key in noise if len(key.split()) in (1, 2)}
    problems = [
        Problem(
            f"{place}.noise.{key}",
            f"must be an axis, or two with a blank between, of {' or '.join(map(str, measured.values()))}",
        )
        for key in noise
        if not any(set(pairs.get(key, ("",))) <= set(space.names) for space in measured.values())
    ]
    found = {}
    for name, space in measured.items():
        own = {axis: unit for axis, unit in units.items() if axis in space.names}
        by_axis = numbers(space, "", {axis: axis for axis in space.names}, own, place)
        entries = []
        for key, (first, second) in pairs.items():
            if {first, second} <= set(space.names):
                deviation = " " not in key.strip()
                column = Number(
                    f"noise.{key}", noise[key], by_axis[first].factor * (1.0 if deviation else by_axis[second].factor)
                )
                entries.append((space.names.index(first), space.names.index(second), column, deviation))
        there = [axis for axis in space.names if axis not in absent[name]]
        if entries and sorted(i for i, j, *_ in entries if i == j) != [space.names.index(axis) for axis in there]:
            told = f"must name one column for each of {', '.join(there)}: its deviation, as x, or variance, as 'x x'"
            problems.append(Problem(f"{place}.noise", told))
        found[name] = NoiseColumns(space.names, tuple(entries))
    if problems:
        raise ConfigError(problems)
    return found
