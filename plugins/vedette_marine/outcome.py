"""What the study of the marine radar reports: its tables and the data of its figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import frozen

from vedette import Array, Mask
from vedette_report.findings import Cell, Chart, Claim, Curve, Panel, Table, mean_cell, ratio_cell, rms_cell, share_cell
from vedette_study.panels import comparison, mode_panel, over_runs

FILTERS = ("IMM-PDAF", "CV-PDAF", "CT-PDAF")

BLOCK = 20
"""Scans over which an error is averaged for a curve: three curves of single scans hide one another."""

COAST = 30.0
"""Seconds from the announced start until the first return, in the study's part on figure 7 (d); chosen."""

PUBLISHED = {
    "MANV-like boat 1": (117.06, 120.26, 121.22),
    "MANV-like boat 2": (98.52, 101.87, 107.74),
    "DARC-like ship": (422.94, 524.58, 529.63),
}
"""Table 4 of the paper: RMSE in m against AIS, one run each."""

SECONDS = {"MANV-like": (12.4, 11.6, 10.8), "DARC-like": (3.38, 2.89, 3.02)}
"""Table 5: run times in s."""


@frozen(eq=False)
class Record:
    """One filter on one target: squared errors against AIS and against the hull's centre (r, s), NIS / 2 (r, s), lost (r,),
    mode probabilities (s, q) or None; `path` (s, 2) of the first run; modes_doubt (s, q): two standard errors of the modes.
    """

    ais: Array
    centre: Array
    nis: Array
    lost: Mask
    modes: Array | None
    path: Array
    modes_doubt: Array | None = None


Found = Mapping[tuple[str, str], Mapping[str, Record]]
"""(target, parameters) to filter to record."""


def error_table(title: str, parameters: str, records_by: Found, note: str) -> Table:
    """Return the errors of all targets with one set of parameters: against AIS, against the centre, and the runs lost."""
    rows = []
    for (target, each), records in records_by.items():
        if each != parameters:
            continue
        printed = PUBLISHED.get(target, (None,) * 3)
        ais = [rms_cell(kept(records[name], "ais"), value) for name, value in zip(FILTERS, printed, strict=True)]
        centre = [rms_cell(kept(records[name], "centre")) for name in FILTERS]
        lost = [share_cell(records[name].lost) for name in FILTERS]
        rows.append((target, (*ais, *centre, *lost)))
    columns = tuple(f"{name[:-5]} {what}" for what in ("AIS", "centre", "lost") for name in FILTERS)
    return Table(title, columns, tuple(rows), note)


def ratio_table(records_by: Found) -> Table:
    """Return IMM over CV and over CT, on the runs that neither lost."""
    rows = []
    for (target, parameters), records in records_by.items():
        cells = [ratio(records, other, what) for what in ("ais", "centre") for other in ("CV-PDAF", "CT-PDAF")]
        nis = [mean_cell(np.mean(records[name].nis, axis=1)) for name in FILTERS]
        modes = records["IMM-PDAF"].modes
        turning = Cell(None if modes is None else float(np.mean(modes[:, 1])))
        lost = share_cell(np.any([record.lost for record in records.values()], axis=0))
        rows.append((f"{target}, {parameters}", (*cells, *nis, turning, lost)))
    return Table(
        "Ratios of RMSE, and consistency",
        ("IMM/CV AIS", "IMM/CT AIS", "IMM/CV centre", "IMM/CT centre", "NIS IMM", "NIS CV", "NIS CT", "CT mode", "lost"),
        tuple(rows),
        "NIS / 2, which is 1 where R and the models are right and errors are independent. With the same Q in both modes "
        "they cannot be told apart, and the CT mode stays at .50. Lost: by any of the three.",
    )


def ratio(
    records: Mapping[str, Record], other: str, what: str, one: str = "IMM-PDAF", published: float | None = None
) -> Cell:
    """Return the RMSE of one filter over another's, on the runs that both kept."""
    both = ~(records[one].lost | records[other].lost)
    return ratio_cell(getattr(records[one], what)[both], getattr(records[other], what)[both], published)


def kept(record: Record, what: str) -> Array:
    """Return the squares of the runs that were not lost."""
    return getattr(record, what)[~record.lost]


def rms(record: Record, what: str) -> float:
    """Return the RMSE over the runs that were not lost; infinite if all were."""
    values = kept(record, what)
    return float(np.sqrt(np.mean(values))) if values.size else np.inf


def times_table(seconds: Mapping[str, tuple[float, float, float]]) -> Table:
    """Return the run times of whole scenes, one run after the other."""
    rows = tuple(
        (name, tuple(Cell(value, None, printed) for value, printed in zip(seconds[name], SECONDS[name], strict=True)))
        for name in seconds
    )
    return Table(
        "Table 5: run time", FILTERS, rows, "s of CPU for one run of the scene on this machine, association included; the "
        "paper's include its picture chain"
    )  # fmt: skip


def in_blocks(values: Array) -> Array:
    """Return the means over successive blocks of scans, a rest left out: (*b, s) -> (*b, s // BLOCK)."""
    size = min(BLOCK, values.shape[-1])
    whole = values[..., : values.shape[-1] // size * size]
    return np.mean(whole.reshape(*whole.shape[:-1], -1, size), axis=-1)


def charts(
    times: Mapping[str, Array],
    centres: Mapping[str, Array],
    returns: Mapping[str, Array],
    records_by: Found,
    errors: Table,
    claims: tuple[Claim, ...],
) -> tuple[Chart, ...]:
    """Return table 4 with the published marks, the paths, errors over time with bands, and mode probabilities.

    `returns`: those of the first run near each target, (n, 2).
    """
    paths, against, modes = [], [], []
    for (target, parameters), records in records_by.items():
        if parameters != "tuned":
            continue
        centre = centres[target]
        seen = returns[target]
        curves = [Curve("returns", seen[:, 0], seen[:, 1], "dots"), Curve("true centre", centre[:, 0], centre[:, 1])]
        curves.append(Curve("IMM-PDAF", records["IMM-PDAF"].path[:, 0], records["IMM-PDAF"].path[:, 1], "dashed"))
        curves.append(Curve("", centre[:1, 0], centre[:1, 1], "points", 0, notes=("start",)))
        paths.append(Panel(target, "east [m]", "north [m]", tuple(curves), equal=True))
        error = []
        for name in FILTERS:
            some = kept(records[name], "ais")
            root, doubt = over_runs(in_blocks(some if len(some) else records[name].ais))
            error.append(Curve(name, in_blocks(times[target]), root, doubt=doubt))
        against.append(Panel(target, "time [s]", "RMS error against AIS [m]", tuple(error)))
        proposed, names = records["IMM-PDAF"], ("constant velocity", "coordinated turn")
        if proposed.modes is not None:
            modes.append(mode_panel(target, "time [s]", times[target], proposed.modes, names, proposed.modes_doubt))
    columns = [column for column in errors.columns if column.endswith("AIS")]
    table = comparison(errors, columns, "RMS error [m]", title="Against AIS, each filter tuned", log=True)
    return (
        Chart(
            "trajectory", "The targets, returns near them, and a track of each (figure 7 c, d)", tuple(paths), claims[4:5]
        ),
        Chart("table", "RMS errors against AIS (table 4); bars: two standard errors", (table,), claims[:6]),
        Chart(
            "errors",
            f"Errors against AIS, over {BLOCK} scans each; bands: two standard errors (figure 7 a, b)",
            tuple(against),
            claims[:4],
        ),
        Chart(
            "modes", "Mode probabilities of IMM-PDAF, mean over runs; bands: two standard errors", tuple(modes), shared=True
        ),
    )
