"""What the paper on the vessel traffic radar claims, judged by the figures of the study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vedette_report.findings import Cell, Claim, Condition, judged, ratio_cell, remark, share_cell
from vedette_vts.outcome import GATE, MANOEUVRES, Record, leg

Figures = Mapping[tuple[str, ...], Cell]

OFTEN, SELDOM = 50.0, 0.3
"""In % of the manoeuvring scans: outside the gate often, and so seldom that the gate holds the returns."""
FEW = 5.0
"""In % of the runs: so few may be lost by a filter that keeps the track."""
CALMER = 0.75
"""The IMM's straight-line error over that of a single filter that keeps its gate."""
MOSTLY = 50.0
"""In % of the runs: what is seen in fewer is mostly not seen in one run."""
SINGLE = ("CVKF wide", "CAKF")
"""The single filters whose Q is large enough for the manoeuvres."""
IMMS = ("IMMCV2", "IMMCVCA")


def figures(records: Mapping[str, Record]) -> dict[tuple[str, ...], Cell]:
    """Return the figures that the claims are judged by; shares in %."""
    straight = leg("CV1")
    cells: dict[tuple[str, ...], Cell] = {}
    for name, record in records.items():
        out = record.distance > GATE
        cells["outside", name] = share_cell(out[:, MANOEUVRES], scale=100)
        cells["lost", name] = share_cell(record.lost, scale=100)
        cells["manoeuvres", name] = ratio_cell(record.squares[:, MANOEUVRES], record.squares[:, straight])
        for other in records:
            if other != name:
                cells["straight", name, other] = ratio_cell(record.squares[:, straight], records[other].squares[:, straight])
                cells["turning", name, other] = ratio_cell(
                    record.squares[:, MANOEUVRES], records[other].squares[:, MANOEUVRES]
                )
    steady = [records[name].distance > GATE for name in ("CAKF", *IMMS)]
    for name, out in zip(("CAKF", *IMMS), steady, strict=True):
        cells["ever outside", name] = share_cell(np.any(out, axis=1), scale=100)
    return cells


def claims(cells: Figures, runs: int) -> tuple[Claim, ...]:
    """Return the claims of section 3 and of the conclusion with their verdicts, over so many runs."""
    return (
        judged(
            "The CVKF errs much in manoeuvres, and the returns are often outside its gate, so that the track may be lost "
            "(figure 3)",
            [
                Condition("its error in manoeuvres over that on straight legs", cells["manoeuvres", "CVKF"], least=2.0),
                _outside("CVKF", cells, least=OFTEN),
                Condition("runs that it loses where the gate acts, %", cells["lost", "CVKF"], least=OFTEN),
            ],
            runs,
            f"with q = 0.1 m/s^2. With q = 1 m/s^2 {cells['outside', 'CVKF wide'].said} % are outside: a small Q does it",
        ),
        _keeps("CAKF", "figure 4", cells, runs),
        judged(
            "It is the model of constant acceleration that keeps the gate, and pays with a larger error in straight flight "
            "than the CVKF's (figures 3 and 4)",
            [
                Condition("straight-line error of the CAKF over the CVKF's", cells["straight", "CAKF", "CVKF"], least=1.1),
                _outside("CVKF wide", cells, least=OFTEN),
                _outside("CAKF tight", cells, most=SELDOM),
            ],
            runs,
            "the paper compares two values of Q: with q = 1 m/s^2 a CVKF keeps its gate, with q = 0.1 m/s^2 a CAKF does not",
        ),
        *(_keeps(name, f"figure {5 + i}", cells, runs) for i, name in enumerate(IMMS)),
        judged(
            "The returns are always in the gate of the CAKF and of the IMMs",
            [
                Condition(f"runs with a return outside the gate of {name}, %", cells["ever outside", name], most=MOSTLY)
                for name in ("CAKF", *IMMS)
            ],
            runs,
            "of one run, which is what the paper shows: in most runs none is outside. Of all runs no gate can hold every "
            "return: one of .999 misses .1 %",
        ),
        remark(
            "In straight flight the IMM is about as accurate as the CVKF",
            "the paper gives no Q, and the truth is exactly straight: the smaller the CVKF's Q, the better it looks. Over "
            f"the CVKF's error with q = 0.1 m/s^2 that of IMMCV2 is {cells['straight', 'IMMCV2', 'CVKF'].said}, with "
            f"q = 1 m/s^2 {cells['straight', 'IMMCV2', 'CVKF wide'].said}",
        ),
        _beats_single(cells, runs),
    )


def _outside(name: str, cells: Figures, least: float = -np.inf, most: float = np.inf) -> Condition:
    return Condition(f"manoeuvring scans outside the gate of {name}, %", cells["outside", name], least, most)


def _kept(name: str, cells: Figures) -> list[Condition]:
    lost = Condition(f"runs that {name} loses where its gate acts, %", cells["lost", name], most=FEW)
    return [_outside(name, cells, most=SELDOM), lost]


def _keeps(name: str, where: str, cells: Figures, runs: int) -> Claim:
    text = f"The returns stay in the gate of the {name} through manoeuvres, and it keeps the track ({where})"
    return judged(text, _kept(name, cells), runs)


def _beats_single(cells: Figures, runs: int) -> Claim:
    """Return the conclusion: the IMMs keep the track, and no single filter that does is as accurate."""
    conditions = [condition for name in IMMS for condition in _kept(name, cells)]
    for name in IMMS:
        for single in SINGLE:
            calm, turning = cells["straight", name, single], cells["turning", name, single]
            conditions.append(Condition(f"straight-line error of {name} over that of {single}", calm, most=CALMER))
            conditions.append(Condition(f"error in manoeuvres of {name} over that of {single}", turning, most=1.1))
    return judged(
        "The IMM keeps the track through manoeuvres and is more accurate in straight flight than a single filter that does "
        "(section 4)",
        conditions,
        runs,
        f"{' and '.join(SINGLE)} are the single filters that stay in their gates; no single Q has both",
    )
