"""The result of reproducing a published study: tables with errors, verdicts on its claims, data of its figures.

Plain values; `vedette_study.reproduction` prints and draws them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol, TypeVar

from attrs import frozen

from vedette.space import Array
from vedette_report.findings.cells import Cell
from vedette_report.findings.verdicts import Claim


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


@frozen(eq=False)
class Curve:
    """Points x (s,), y (s,) with a label; as a line, one with its points marked, a dashed line, dots, rings or points alone.

    "published" are the values that a paper prints: hollow marks in black. "expected" is what should be: dashes in grey.
    `colour`: the n-th; default: by its position.
    `doubt` (s,) is half the height of a band around it, for points of a bar through each; with `doubt_across` (s,) both
    are bars at each point. `notes`: a word beside each point.
    """

    label: str
    x: Array
    y: Array
    style: Literal["line", "marked", "dashed", "dots", "rings", "points", "published", "expected"] = "line"
    colour: int | None = None
    doubt: Array | None = None
    doubt_across: Array | None = None
    notes: tuple[str, ...] = ()


@frozen(eq=False)
class Panel:
    """One pair of axes. `equal` gives both one scale, as on a map; `log` and `log_across` make one logarithmic.

    `ticks` name the places 0, 1, .. of the axis across, where there is a name and no number. `within`: the values that
    there can be, such as 0 to 100 %: bands and bars end there.
    """

    title: str
    across: str
    upright: str
    curves: tuple[Curve, ...]
    equal: bool = False
    log: bool = False
    log_across: bool = False
    ticks: tuple[str, ...] = ()
    within: tuple[float, float] | None = None


@frozen(eq=False)
class Chart:
    """A picture, stored under `name`: panels, and under them the claims that it shows with verdicts.

    `shared` gives all panels one upright scale, so that they can be compared.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    claims: tuple[Claim, ...] = ()
    shared: bool = False


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


@frozen
class Element:
    """Something that a paper has: what it is, where, the components that it is here as "role kind", and what verifies it.

    `where` names sections, equations, tables and figures: "equations 1 to 6; figure 3". `verified` names tests as
    "tests/vts/test_models.py::test_name", or says "claim: " and the beginning of a claim of the study.
    """

    what: str
    where: str
    made_of: tuple[str, ...]
    verified: tuple[str, ...]


R = TypeVar("R")


class Keep(Protocol):
    """Returns the part of a study that is kept under a name, or makes and keeps it.

    `kind` is the part's class, an attrs class whose fields are arrays, or None where there is none.
    """

    def __call__(self, name: str, kind: type[R], make: Callable[[], R], /) -> R: ...


def afresh(name: str, kind: type[R], make: Callable[[], R], /) -> R:
    """Make the part and keep nothing."""
    return make()
