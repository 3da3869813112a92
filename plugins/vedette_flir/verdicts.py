"""What the infrared paper claims, and the figures that its verdicts follow from."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vedette import Array
from vedette_flir.matched_truth import TRUTH, Record, Truth, bound
from vedette_report.findings import (
    Cell,
    Claim,
    Condition,
    Place,
    Table,
    judged,
    mean_cell,
    over,
    ratio_cell,
    remark,
    rms_cell,
    share_cell,
)

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
        "A wandering position has white velocity, which no filter with accelerations matches: NIS/2 is far from 1. "
        "Lost runs count nowhere else. The paper has curves only.",
    )


def figures(found: Found, varied: Varied, truth: Truth = TRUTH) -> dict[str, Cell]:
    """Return the figures that the verdicts follow from; those of one pass after the label of their truth."""
    strong = {case: records["three passes"] for case, records in found.items() if case[1] >= 2 and case[2] >= 5}
    paper = varied["wander"]["three passes"]
    unknown, spots = varied["brightness and spread unknown"], varied["two hot spots"]
    space, time = varied["noise correlated over space, SNR 10"], varied["noise correlated over time, SNR 3"]
    flown, calm, own = varied["manoeuvre"], varied["flight at constant velocity"], "dynamics monitored from 1e3"
    once = {label: records["one pass"] for label, records in varied.items() if label.startswith(NARROW)}
    return {
        "bound": _largest([_over_bound(seen, bound(case[1], case[2], case[0], truth)[2]) for case, seen in strong.items()]),
        "consistency": _farthest([_nees(seen) for seen in strong.values()]),
        "matched lost": share_cell(np.concatenate([seen.lost for seen in strong.values()])),
        "paper lost": share_cell(paper.lost),
        "paper sum": rms_cell(_kept(paper.apparent, paper)),
        **{f"{label} NEES": _nees(seen) for label, seen in once.items()},
        **{f"{label} lost": share_cell(seen.lost) for label, seen in once.items()},
        "adaptive": _ratio(unknown["adaptive"], unknown["fixed"]),
        "adaptive NEES": _nees(unknown["adaptive"]),
        "adaptive lost": share_cell(unknown["adaptive"].lost),
        "spots": _ratio(spots["two spots"], spots["one spot, adaptive"]),
        "full R": ratio_cell(space["full R"].nees, space["white R"].nees, power=1.0),
        "whitened": _ratio(time["whitened"], time["three passes"]),
        "whitened NEES": _nees(time["whitened"]),
        "whitened lost": share_cell(time["whitened"].lost),
        "manoeuvre over 1e3": _ratio(flown[own], flown["Q for 1e3"], dynamics=True),
        "manoeuvre over 1e5": _ratio(flown[own], flown["Q for 1e5"], dynamics=True),
        "calm over 1e3": _ratio(calm[own], calm["Q for 1e3"], dynamics=True),
        "calm over 1e5": _ratio(calm[own], calm["Q for 1e5"], dynamics=True),
        "monitored lost": share_cell(flown[own].lost | calm[own].lost),
        "all monitored": _ratio(flown["all monitored from 1e3"], flown["Q for 1e5"], dynamics=True),
    }


def claims(figures: Mapping[str, Cell], runs: int) -> tuple[Claim, ...]:
    """Return the paper's claims with their verdicts, over so many runs."""

    def few(name: str) -> Condition:
        return Condition("runs lost", figures[f"{name} lost"], most=FEW)

    return (
        judged(
            "An extended Kalman filter on the pixels themselves tracks dynamics and atmospheric jitter",
            (
                Condition("error of the sum over the Riccati bound, matched, the largest", figures["bound"], most=1.10),
                Condition("NEES/4, matched, farthest from 1", figures["consistency"], 0.9, 1.1),
                Condition("runs lost, matched", figures["matched lost"], most=0.05),
                Condition("runs lost, eight states", figures["paper lost"], most=FEW),
                Condition("error of the sum, eight states [px]", figures["paper sum"], most=0.2),
            ),
            runs,
            "with three passes, a spread of at least 2 px and SNR of at least 5",
        ),
        _single_pass(figures, runs),
        judged(
            "On-line adaptation bears a target whose brightness and size are unknown",
            (
                Condition("error of the sum over that without adaptation", figures["adaptive"], most=0.8),
                Condition("NEES/4", figures["adaptive NEES"], most=1.5),
                few("adaptive"),
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
            "A proper correlation of the measurement noise over space is very important",
            (Condition("NEES with the full R over that with a white one", figures["full R"], most=0.8),),
            runs,
            "noise of which .8 is correlated over 2 px: the covariance becomes honest, the error no smaller",
        ),
        judged(
            "The correlation of the noise over time is important, too",
            (
                Condition("error of the sum over that with frames taken as independent", figures["whitened"], most=0.8),
                Condition("NEES/4", figures["whitened NEES"], most=1.2),
                few("whitened"),
            ),
            runs,
            "pixels whose noise is correlated over .2 s, SNR 3; frames whitened by the ones before",
        ),
        judged(
            "Adapting the state noise is very important for a target that manoeuvres",
            (
                Condition("in a manoeuvre, error over that of Q for quiet flight", figures["manoeuvre over 1e3"], most=0.9),
                Condition("in a manoeuvre, error over that of Q for it", figures["manoeuvre over 1e5"], most=1.05),
                Condition("in quiet flight, error over that of Q for it", figures["calm over 1e3"], most=1.05),
                Condition("in quiet flight, error over that of Q for a manoeuvre", figures["calm over 1e5"], most=0.95),
                few("monitored"),
            ),
            runs,
            "errors of the dynamics. One filter is as good as the noise that was chosen for each flight, and neither of "
            "these is good in both. Only the dynamics' noise may adapt: if the jitter's does, too, the error in the "
            f"manoeuvre is {figures['all monitored'].said} times that of Q for it, as the manoeuvre is taken for jitter",
        ),
        remark(
            "The dynamics are known to a fraction of a pixel",
            "the paper gives neither jitter nor spectra; only the sum of dynamics and jitter is seen, so the error of the "
            "dynamics has a floor that no signal removes",
        ),
    )


NARROW = "spread 1, "
FEW = 0.15
"""Share of the runs: so few may be lost by a filter that tracks."""


def _single_pass(figures: Mapping[str, Cell], runs: int) -> Claim:
    """Return the claim of the single pass at each truth that was drawn: the paper gives none."""
    labels = [name.removesuffix(" lost") for name in figures if name.startswith(NARROW) and name.endswith(" lost")]
    text = "The single-pass filter as printed is enough"
    conditions = {
        label: (
            Condition(f"{label or 'here'}: NEES/4", figures[f"{label} NEES"], most=1.5),
            Condition(f"{label or 'here'}: runs lost", figures[f"{label} lost"], most=FEW),
        )
        for label in labels
    }
    places = [
        Place({"dynamics": label.removeprefix(NARROW)}, judged(text, each, runs).verdict)
        for label, each in conditions.items()
    ]
    why = (
        "with a spread of 1 px and SNR 10. One linearisation errs where the prediction is off by about the spot's width; "
        "how often depends on the dynamics, which the paper does not give. Three or four passes reach the bound"
    )
    if len(places) == 1:
        return judged(text, conditions[labels[0]], runs, why)
    return over(text, places, why, [each for some in conditions.values() for each in some], runs)


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
    trimmed = None if cell.trimmed is None else (cell.trimmed[0] / limit, cell.trimmed[1] / limit)
    return Cell(cell.measured / limit, None if cell.error is None else cell.error / limit, None, trimmed)


def _largest(cells: list[Cell]) -> Cell:
    return max(cells, key=lambda cell: math.inf if cell.measured is None else cell.measured)


def _farthest(cells: list[Cell]) -> Cell:
    return max(cells, key=lambda cell: math.inf if cell.measured is None else abs(cell.measured - 1.0))


def _ratio(over: Record, under: Record, *, dynamics: bool = False) -> Cell:
    """Return the ratio of the errors of two filters on the runs that neither lost."""
    both = ~(over.lost | under.lost)
    a, b = ((seen.dynamics if dynamics else seen.apparent)[both] for seen in (over, under))
    return ratio_cell(a.reshape(len(a), -1) ** 2, b.reshape(len(b), -1) ** 2) if len(a) else Cell(None)
