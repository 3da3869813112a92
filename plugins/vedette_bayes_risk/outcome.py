"""What the paper on Bayes-risk detection reports and what the study finds: tables and data of the figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Experiment, Mask
from vedette_bayes_risk.by_count import BayesRiskByCount
from vedette_bayes_risk.decision import BayesRiskDecision
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_report.findings import Cell, Chart, Claim, Curve, Panel, Table, mean_cell, rms_cell, share_cell
from vedette_study.panels import comparison, mode_panel, over_runs

WINDOWS = {"6-20 s": slice(4, 19), "21-30 s": slice(19, 29), "51-90 s": slice(49, 89)}
"""Slices of a record, which begins at 2 s. The paper reports the last two."""
LOST = 100.0
"""In m; a run with a larger error is lost and counts among the lost alone."""
PUBLISHED = {"proposed": (None, 3.5268, 3.5270), "IMM/MSPDA soft": (None, 4.6119, 3.5934)}


@frozen(eq=False)
class Record:
    """One filter from 2 s on: squares and nees (r, s-2), path (s-2, 2) in the first run; modes (s-2, q) or None.

    modes_doubt (s-2, q): two standard errors of the modes. A run is lost if its error is ever larger than `LOST`.
    """

    squares: Array
    nees: Array
    path: Array
    modes: Array | None
    modes_doubt: Array | None = None

    @property
    def kept(self) -> Mask:
        """Which runs (r,) were not lost."""
        return np.max(self.squares, axis=1) < LOST**2


@frozen(eq=False)
class Contest:
    """One variant in dense clutter: nees of the position and number of returns with weight (r, s-2); kept (r,): not lost."""

    nees: Array
    rivals: Array
    kept: Mask

    @property
    def contested(self) -> Array:
        """Mean NEES (r,) of each kept run over its scans where two or more returns compete."""
        several = self.rivals[self.kept] > 1
        some = np.any(several, axis=1)
        return np.sum(np.where(several, self.nees[self.kept], 0.0), axis=1)[some] / np.sum(several, axis=1)[some]


def tables(
    records: Mapping[str, Record],
    free: Mapping[str, Record],
    contests: Mapping[str, Contest],
    experiments: Mapping[str, Experiment],
) -> tuple[Table, ...]:
    """Return table 2, consistency, the weights, the variants where returns compete, and those without a gate."""
    errors, sizes = [], []
    for name, record in records.items():
        printed = zip(WINDOWS.values(), PUBLISHED.get(name, (None, None, None)), strict=True)
        lost, kept = share_cell(~record.kept, scale=100), record.kept
        errors.append((name, (*(rms_cell(record.squares[kept][:, part], was) for part, was in printed), lost)))
        sizes.append((name, (*(mean_cell(np.mean(record.nees[kept][:, p], axis=1)) for p in WINDOWS.values()), lost)))
    apart = [
        (name, (*(rms_cell(record.squares[:, part]) for part in WINDOWS.values()), share_cell(~record.kept, scale=100)))
        for name, record in free.items()
    ]
    competing = [
        (name, (mean_cell(part.contested), share_cell(part.rivals > 1, scale=100), share_cell(~part.kept, scale=100)))
        for name, part in contests.items()
    ]
    return (
        Table(
            "Table 2: RMS position error",
            (*WINDOWS, "lost %"),
            tuple(errors),
            f"m, lost runs left out: those ever more than {LOST:g} m off; the sensors' sigma, 6.7 m, was chosen to give the "
            "proposed filter its published error; the published IMM stands beside the soft one, which is nearest to it",
        ),
        Table(
            "NEES of position and velocity",
            (*WINDOWS, "lost %"),
            tuple(sizes),
            "4 for a filter whose model is the truth; lost runs left out",
        ),
        _weights(experiments),
        Table(
            "Dense clutter, 3e-5 /m^2: NEES of the position where returns compete",
            ("NEES", "scans with rivals %", "lost %"),
            tuple(competing),
            f"2 is expected of a right covariance; runs that were ever more than {LOST:g} m off are left out",
        ),
        Table(
            "Without the gate, which the paper does not have: RMS position error",
            (*WINDOWS, "lost %"),
            tuple(apart),
            "m, over all runs, the lost ones too",
        ),
        _risks(experiments),
    )


def _risks(experiments: Mapping[str, Experiment]) -> Table:
    """Return the Bayes risk of deciding for a target from k sensors on, and the fused error given k over sigma^2 / k."""
    decision = _detector(experiments["decision"], BayesRiskDecision)
    given = _detector(experiments["R given k"], BayesRiskByCount)
    rows = [("R(k)", decision.risks()), ("error over sigma^2 / k", given.spread())]
    return Table(
        "Section 2: Bayes risk of the decision for a target from k sensors on",
        tuple(f"k = {k}" for k in range(1, 8)),
        tuple((label, tuple(map(Cell, values.tolist()))) for label, values in rows),
        f"the decision g is for a target from k = {decision.best} on, where the risk is least; below it, the mean square of "
        "the fused return's error given k, over what R = sigma^2 / k says",
    )


D = TypeVar("D", bound=DistributedDetection)


def _detector(experiment: Experiment, kind: type[D]) -> D:
    fused: Any = experiment.preprocessors["fused"]
    assert isinstance(fused, kind)
    return fused


def _weights(experiments: Mapping[str, Experiment]) -> Table:
    """Return the weight of a return by the number of sensors that confirm it, relative to all seven."""
    rows = []
    for label, name in (("printed", "proposed, printed"), ("corrected", "proposed")):
        detector: Any = experiments[name].preprocessors["fused"]
        assert isinstance(detector, DistributedDetection)
        log = detector.log_weights()
        rows.append((label, tuple(Cell(float(np.exp(value - log[-1]))) for value in log)))
    return Table("L(k) over L(7)", tuple(f"k = {k}" for k in range(1, 8)), tuple(rows), "k = 1 is left out before")


def charts(
    truth: Array, records: Mapping[str, Record], tables: tuple[Table, ...], claims: tuple[Claim, ...]
) -> tuple[Chart, ...]:
    """Return table 2 with the published marks, figures 3 and 4, the variants in dense clutter, mode probabilities."""
    times = np.arange(2.0, 2.0 + records["proposed"].squares.shape[1])
    path, track = truth[:, :2] / 1e3, records["proposed"].path / 1e3
    flight = (
        Curve("truth", path[:, 0], path[:, 1]),
        Curve("proposed", track[:, 0], track[:, 1], "dashed"),
        Curve("", path[:1, 0], path[:1, 1], "points", 0, notes=("start",)),
    )
    errors = []
    for name, record in records.items():
        root, doubt = over_runs(record.squares[record.kept] if record.kept.any() else record.squares)
        errors.append(Curve(name, times, root, "dashed" if name == "proposed, printed" else "line", doubt=doubt))
    modes = tuple(
        mode_panel(name, "time [s]", times, record.modes, ("constant velocity", "constant acceleration"), record.modes_doubt)
        for name, record in records.items()
        if record.modes is not None
    )
    flown = Panel("One run", "x [km]", "y [km]", flight, equal=True)
    right = Curve("right", np.array([-0.3, len(tables[3].rows) - 0.7]), np.full(2, 2.0), "dashed")
    dense = Panel("", "", "position NEES, 2 is right", (*comparison(tables[3], ("NEES",), "").curves, right))
    return (
        Chart("trajectory", "The target's path, and a track of it (figure 3)", (flown,)),
        Chart(
            "table",
            "RMS position errors by period (table 2); bars: two standard errors",
            (comparison(tables[0], tuple(WINDOWS), "RMS position error [m]"),),
            claims[:2],
        ),
        Chart(
            "errors",
            "RMS position error; bands: two standard errors (figure 4)",
            (Panel("", "time [s]", "error [m]", tuple(errors)),),
            claims[:2],
        ),
        Chart(
            "dense",
            "Position NEES at 100 times the published clutter; bars: two standard errors",
            (evolve(dense, ticks=tuple(label for label, _ in tables[3].rows)),),
            claims[2:5],
        ),
        Chart("modes", "Mode probabilities of the IMMs, mean over runs; bands: two standard errors", modes, shared=True),
    )
