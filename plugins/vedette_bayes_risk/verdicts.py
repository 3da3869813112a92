"""What the paper on Bayes-risk detection claims, judged by the figures of the study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vedette import Array, Experiment
from vedette_bayes_risk.configs import CLUTTER, THRESHOLD, scene
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.outcome import PUBLISHED, WINDOWS, Contest, Record
from vedette_report.findings import Cell, Claim, Condition, judged, mean_cell, ratio_cell, remark, rms_cell, share_cell

Figures = Mapping[tuple[str, ...], Cell]
MANOEUVRES = tuple(WINDOWS)[1:]
FEW = 5.0
"""In % of the runs: so few may be lost by a filter whose error is judged."""
FORMS = ("printed P", "with spread")
GAINS = (3.5268 / 4.6119, 3.5270 / 3.5934)
"""The published errors over those of the IMM."""


def figures(
    records: Mapping[str, Record], contests: Mapping[str, Contest], experiments: Mapping[str, Experiment]
) -> dict[tuple[str, ...], Cell]:
    """Return the figures that the claims are judged by; errors in m."""
    cells: dict[tuple[str, ...], Cell] = {}
    proposed = records["proposed"]
    for i, window in enumerate(MANOEUVRES):
        cells["error", window] = rms_cell(proposed.squares[proposed.kept][:, WINDOWS[window]], PUBLISHED["proposed"][i + 1])
        for name in ("IMM/MSPDA tuned", "IMM/MSPDA soft"):
            both = proposed.kept & records[name].kept
            one, other = (record.squares[both][:, WINDOWS[window]] for record in (proposed, records[name]))
            cells[name, window] = ratio_cell(one, other, GAINS[i])
    cells["lost",] = share_cell(~proposed.kept, scale=100)
    first, second = (proposed.squares[proposed.kept][:, WINDOWS[window]] for window in MANOEUVRES)
    cells["phases",] = ratio_cell(first, second, 3.5268 / 3.5270)
    for weights in ("printed", "corrected"):
        printed, spread = (contests[f"{weights} weights, {form}"].contested for form in FORMS)
        cells["NEES", weights] = over(printed, 2.0 * np.ones(len(printed)))
        cells["spread", weights] = over(printed, spread)
    for label, name in (("printed", "proposed, printed"), ("corrected", "proposed")):
        cells["risk", label] = Cell(least_risk(experiments[name].preprocessors["fused"]), 0.0)
    return cells


def printed_false_alarm() -> float:
    """Return P_FA = A_v/(lambda A_1) in m^2, A_1 the area of the simulated clutter: the paper does not state A_1."""
    area = next(iter(scene()["looks"].values()))["clutter"]
    sides = [area[axis]["high"] - area[axis]["low"] for axis in "xy"]
    return float(np.pi * THRESHOLD**2 / (CLUTTER * sides[0] * sides[1]))


def least_risk(detector: Any) -> float:
    """Return the least Bayes risk of deciding by the number of sensors that confirm; .5 is that of a coin."""
    assert isinstance(detector, DistributedDetection)
    weights = np.exp(detector.log_weights())
    return float(1 / np.max(np.diff(weights, prepend=0.0)))


def over(above: Array, below: Array) -> Cell:
    """Return the ratio of two means over different runs, (r,) and (q,), its error by linearisation; none without runs."""
    if min(len(above), len(below)) < 2:
        return Cell(None)
    top, under = mean_cell(above), mean_cell(below)

    def ratio(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
        return a[0] / b[0], a[0] / b[0] * float(np.hypot(a[1] / a[0], b[1] / b[0]))

    trimmed = None if top.trimmed is None or under.trimmed is None else ratio(top.trimmed, under.trimmed)
    return Cell(*ratio((top.measured or 0.0, top.error or 0.0), (under.measured or 0.0, under.error or 0.0)), None, trimmed)


def claims(cells: Figures, runs: int, dense: int) -> tuple[Claim, ...]:
    """Return the claims with their verdicts, over so many runs, and so many in dense clutter."""
    errors = [Condition(f"error in m, {window}", cells["error", window], 3.2, 3.8) for window in MANOEUVRES]
    tuned = [
        Condition(f"error over a tuned IMM's, {w}", cells["IMM/MSPDA tuned", w], most=1.0, strict=True) for w in MANOEUVRES
    ]
    few = Condition("runs that it loses, %", cells["lost",], most=FEW)
    optimism = [
        Condition("position NEES over 2, where returns compete", cells["NEES", "printed"], most=1.2),
        Condition("that NEES over the one with the spread of means", cells["spread", "printed"], most=1.2),
    ]
    return (
        judged(
            "The error in manoeuvres is 3.53 m, the same in both (table 2)",
            [*errors, Condition("error in the first over that in the second", cells["phases",], 0.95, 1.05), few],
            runs,
            "the sensors' sigma and the process noise are not printed: sigma was fitted to these metres, so they are "
            "calibration. That both agree is not",
        ),
        judged(
            "The proposed filter is 2 to 25 % better than IMM/MSPDA in manoeuvres (table 2)",
            [*tuned, few],
            runs,
            "the paper's tuning is not given. Against an IMM with too little process noise "
            f"{' and '.join(_change(cells['IMM/MSPDA soft', window]) for window in MANOEUVRES)}",
        ),
        remark(
            "The probability of a false alarm is P_FA = A_v/(lambda A_1) (equation 3)",
            "it has a unit. The paper does not state A_1: over the 63 km^2 of the simulated clutter it is "
            f"{printed_false_alarm():.0f} m^2, and below 1 it would be only over more than 7,500 km^2. Corrected, "
            "1 - exp(-lambda A_v), it is .0007",
        ),
        judged(
            "P_D(k) and P_F(k), summed from below, are the chances to decide for a target at k (equation 4)",
            [Condition("least risk of any k, .5 for a coin", cells["risk", "printed"], most=0.25)],
            runs,
            "the printed sums decide for a target where few sensors confirm. Summed from above the least risk is "
            f"{cells['risk', 'corrected'].said}, and the weights fall off steeply instead of almost linearly",
        ),
        judged(
            "P(k | k) = sum L(i) P_i / c (equation 6)",
            optimism,
            dense,
            "it leaves out the spread of the means. Under the corrected weights the second is "
            f"{cells['spread', 'corrected'].said}; in dense clutter, 3e-5 /m^2",
            "runs in dense clutter",
        ),
        remark(
            "It is better because it uses what the detection knows, where the IMM's gate may hold no true return",
            "no figure is given for the reason. At the published clutter two returns compete in one scan of a thousand; "
            "what there is to judge is table 2, above",
        ),
    )


def _change(ratio: Cell) -> str:
    if ratio.measured is None:
        return "unknown"
    return f"{100 * (ratio.measured - 1):+.1f} % (+- {100 * (ratio.error or np.nan):.1f})"
