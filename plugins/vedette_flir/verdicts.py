"""What the infrared paper claims, and the figures that its verdicts follow from."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vedette import Array
from vedette.reproduction import (
    Cell,
    Claim,
    Condition,
    Table,
    judged,
    mean_cell,
    ratio_cell,
    remark,
    rms_cell,
    share_cell,
)
from vedette_flir.matched_truth import Record, bound

Found = Mapping[tuple[float, float, float], Mapping[str, Record]]
Varied = Mapping[str, Mapping[str, Record]]


def table(varied: Varied) -> Table:
    """Return the errors of the paper's filter under each variation."""
    rows = [
        (
            f"{label}: {name}",
            (
                *(rms_cell(_kept(part, seen)) for part in (seen.dynamics, seen.jitter, seen.apparent)),
                _nees(seen),
                mean_cell(np.mean(seen.nis[~seen.lost], axis=1)),
                share_cell(seen.lost),
            ),
        )
        for label, records in varied.items()
        for name, seen in records.items()
    ]
    return Table(
        "Errors per axis, the paper's filter of eight states",
        ("dynamics", "jitter", "sum", "NEES/4", "NIS/2", "lost"),
        tuple(rows),
        "px; SNR 10, spread 2 px, jitter .2 px, jerk density 1e5 px^2/s^5, three passes where a row does not say otherwise. "
        "A wandering position has white velocity, which no filter with accelerations matches: NIS/2 is far from 1. The "
        "filter takes frames as independent in time; the rows `over time` say what that costs. The paper has curves only.",
    )


def figures(found: Found, varied: Varied) -> dict[str, Cell]:
    """Return the figures that the verdicts follow from."""
    strong = {case: records["three passes"] for case, records in found.items() if case[1] >= 2 and case[2] >= 5}
    paper, narrow = varied["wander"]["three passes"], varied["wander, spread 1"]["one pass"]
    unknown, spots, speed = varied["brightness and spread unknown"], varied["two hot spots"], "manoeuvre of 300 px/s^2"
    space, flown = varied["noise correlated over space, SNR 10"], varied[speed]
    return {
        "bound": _largest([_over_bound(seen, bound(case[1], case[2], case[0])[2]) for case, seen in strong.items()]),
        "consistency": _farthest([_nees(seen) for seen in strong.values()]),
        "matched lost": share_cell(np.concatenate([seen.lost for seen in strong.values()])),
        "paper lost": share_cell(paper.lost),
        "paper sum": rms_cell(_kept(paper.apparent, paper)),
        "once NEES": _nees(narrow),
        "once lost": share_cell(narrow.lost),
        "adaptive": _ratio(unknown["adaptive"], unknown["fixed"]),
        "adaptive NEES": _nees(unknown["adaptive"]),
        "spots": _ratio(spots["two spots"], spots["one spot, adaptive"]),
        "full R": _ratio_of(space["full R"].nees, space["white R"].nees),
        "monitored": _ratio(flown["monitored from 1e3"], flown["Q for 1e5"], dynamics=True),
    }


def claims(figures: Mapping[str, Cell], runs: int) -> tuple[Claim, ...]:
    """Return the paper's claims with their verdicts, over so many runs."""
    return (
        judged(
            "An extended Kalman filter on the pixels themselves tracks dynamics and atmospheric jitter",
            (
                Condition("error of the sum over the Riccati bound, matched, the largest", figures["bound"], most=1.10),
                Condition("NEES/4, matched, farthest from 1", figures["consistency"], 0.9, 1.1),
                Condition("runs lost, matched", figures["matched lost"], most=0.05),
                Condition("runs lost, eight states", figures["paper lost"], most=0.15),
                Condition("error of the sum, eight states [px]", figures["paper sum"], most=0.2),
            ),
            runs,
            "with three passes, a spread of at least 2 px and SNR of at least 5",
        ),
        judged(
            "The single-pass filter as printed is enough",
            (
                Condition("NEES/4, spread 1 px, SNR 10", figures["once NEES"], most=1.5),
                Condition("runs lost there", figures["once lost"], most=0.15),
            ),
            runs,
            "one linearisation errs where the prediction is off by about the spot's width; three or four reach the bound",
        ),
        judged(
            "On-line adaptation bears a target whose brightness and size are unknown",
            (
                Condition("error of the sum over that without adaptation", figures["adaptive"], most=0.8),
                Condition("NEES/4", figures["adaptive NEES"], most=1.5),
            ),
            runs,
            "started with twice the amplitude and .6 of the spread",
        ),
        judged(
            "Targets with several hot spots are tracked",
            (Condition("error of the sum over that of a filter with one spot", figures["spots"], most=0.8),),
            runs,
            "the filter knows the spots' places; for an unknown shape the plugin has `template_filter`",
        ),
        judged(
            "A proper correlation of the measurement noise is very important",
            (Condition("NEES with the full R over that with a white one", figures["full R"], most=0.8),),
            runs,
            "noise of which .8 is correlated over 2 px: the covariance becomes honest, the error no smaller",
        ),
        judged(
            "Adapting the state noise is very important for a target that manoeuvres",
            (Condition("error of the dynamics over that of a fixed Q for 1e5", figures["monitored"], most=1.0),),
            runs,
            "it beats no fixed noise that was chosen for the manoeuvre",
        ),
        remark(
            "The dynamics are known to a fraction of a pixel",
            "the paper gives neither jitter nor spectra; only the sum of dynamics and jitter is seen, so the error of the "
            "dynamics has a floor that no signal removes",
        ),
    )


def _kept(part: Array, seen: Record) -> Array:
    """Return the squared errors of the runs that were not lost, one row each."""
    kept = part[~seen.lost]
    return kept.reshape(len(kept), part[0].size) ** 2


def _nees(seen: Record) -> Cell:
    return mean_cell(np.mean(seen.nees[~seen.lost], axis=1))


def _over_bound(seen: Record, limit: float) -> Cell:
    cell = rms_cell(_kept(seen.apparent, seen))
    if cell.measured is None:
        return cell
    return Cell(cell.measured / limit, None if cell.error is None else cell.error / limit)


def _largest(cells: list[Cell]) -> Cell:
    return max(cells, key=lambda cell: math.inf if cell.measured is None else cell.measured)


def _farthest(cells: list[Cell]) -> Cell:
    return max(cells, key=lambda cell: math.inf if cell.measured is None else abs(cell.measured - 1.0))


def _ratio(over: Record, under: Record, *, dynamics: bool = False) -> Cell:
    """Return the ratio of the errors of two filters on the runs that neither lost."""
    both = ~(over.lost | under.lost)
    a, b = ((seen.dynamics if dynamics else seen.apparent)[both] for seen in (over, under))
    return ratio_cell(a.reshape(len(a), -1) ** 2, b.reshape(len(b), -1) ** 2) if len(a) else Cell(None)


def _ratio_of(over: Array, under: Array) -> Cell:
    """Return the ratio of two means over runs of figures (r, s), its error by linearisation."""
    a, b = np.mean(over, axis=1), np.mean(under, axis=1)
    ratio = float(np.mean(a) / np.mean(b))
    spread = ratio * (a / np.mean(a) - b / np.mean(b))
    return Cell(ratio, float(np.std(spread, ddof=1) / np.sqrt(len(a))) if len(a) > 1 else None)
