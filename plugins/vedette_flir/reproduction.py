"""The study of the paper on tracking in infrared images."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Progress, Reproduction
from vedette_flir import verdicts
from vedette_flir.elements import ELEMENTS
from vedette_flir.matched_truth import Record, Truth, bound, information, record
from vedette_flir.pictures import charts
from vedette_flir.robustness import variations
from vedette_report.findings import Cell, Claim, Element, Findings, Keep, Table, afresh, mean_cell, rms_cell, share_cell

CASES = tuple(
    (jitter, spread, snr)
    for jitter, spread in ((0.2, 1.0), (0.2, 2.0), (0.2, 3.0), (0.5, 2.0))
    for snr in (2.0, 5.0, 10.0, 20.0)
)
"""Jitter in px, spread in px, amplitude over noise."""

JUDGED = ((0.2, 2.0, 10.0), (0.5, 2.0, 5.0))
"""The cases of the grid."""

SPREADS = {"1 px": 1.0, "3 px": 3.0}
TIMES = {"2 s": 2.0, "10 s": 10.0}
MANOEUVRES = {"100 px/s^2": 100.0, "300 px/s^2": 300.0, "600 px/s^2": 600.0}
"""What the paper leaves open: its words to what they are here."""

PASSES = {"one pass": 1, "three passes": 3}


@final
@frozen
class FlirReproduction(Reproduction):
    """The extended Kalman filter on 8 x 8 pixels, with one pass as printed and iterated, against a bound and in trials.

    A filter that matches the truth is compared with the Riccati bound, and the paper's filter of eight states is run in the
    conditions that the paper names.

    Yang, Lee, Lee, development of an image tracking technique for moving targets (in Korean).
    """

    kind: ClassVar[str] = "flir"
    title: ClassVar[str] = (
        "A hot spot in infrared images: errors of dynamics and jitter against signal-to-noise ratio and spread"
    )
    default_runs: ClassVar[int] = 70
    full_runs: ClassVar[int] = 700
    grid_runs: ClassVar[int] = 40
    unsaid: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "manoeuvre": tuple(MANOEUVRES),
        "spread of the dynamics": tuple(SPREADS),
        "their correlation": tuple(TIMES),
    }
    elements: ClassVar[tuple[Element, ...]] = ELEMENTS

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all cases; the filters of a case see the same frames. What is varied takes half as many runs."""
        records = {}
        for i, case in enumerate(progress(CASES, "cases")):
            jitter, spread, snr = case
            records[case] = {
                name: keep(
                    f"case {i} {name}",
                    Record,
                    partial(record, passes, spread, snr, jitter, runs, np.random.default_rng((seed, i))),
                )
                for name, passes in PASSES.items()
            }
        part, varied = max(2, runs // 2), {}
        for i, variation in enumerate(progress(variations(), "variations")):
            varied[variation.label] = {
                name: keep(f"variation {i} {name}", Record, partial(variation.record, name, part, (seed, 1000 + i)))
                for name in variation.filters
            }
        tables = (*(_table(name, records) for name in PASSES), verdicts.table(varied))
        claims = verdicts.claims(verdicts.figures(records, varied), part)
        return Findings(self.title, runs, seed, tables, claims, charts(records, varied, claims))

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> tuple[Claim, ...]:
        """Return the claims with their verdicts at one point of the grid."""
        truth = Truth(SPREADS[point["spread of the dynamics"]], TIMES[point["their correlation"]])
        found = {
            case: {"three passes": record(3, case[1], case[2], case[0], runs, np.random.default_rng((seed, i)), truth)}
            for i, case in enumerate(JUDGED)
        }
        varied: dict[str, dict[str, Record]] = {}
        for i, each in enumerate(variations(truth, MANOEUVRES[point["manoeuvre"]])):
            varied[each.label] = {name: each.record(name, runs, (seed, 1000 + i)) for name in each.filters}
        return verdicts.claims(verdicts.figures(found, varied, truth), runs)


Found = dict[tuple[float, float, float], dict[str, Record]]


def _table(name: str, found: Found) -> Table:
    rows = []
    for (jitter, spread, snr), records in found.items():
        seen = records[name]
        kept = ~seen.lost
        errors = [
            rms_cell(part[kept].reshape(int(kept.sum()), part[0].size) ** 2)
            for part in (seen.dynamics, seen.jitter, seen.apparent)
        ]
        limits = [Cell(value) for value in bound(spread, snr, jitter)]
        pairs = [cell for pair in zip(errors, limits, strict=True) for cell in pair]
        rest = [
            Cell(information(spread, snr) ** -0.5),
            *(mean_cell(np.mean(part[kept], axis=1)) for part in (seen.nees, seen.nis)),
            share_cell(seen.lost),
        ]
        rows.append((f"jitter {jitter:g}, spread {spread:g}, SNR {snr:g}", (*pairs, *rest)))
    return Table(
        f"Errors per axis, the matched filter, {name}",
        ("dynamics", "bound", "jitter", "bound ", "sum", "bound  ", "one frame", "NEES/4", "NIS/2", "lost"),
        tuple(rows),
        "px; runs that were ever more than 4 px off are lost and count nowhere else. The bound is the steady Riccati "
        "equation's with a frame's full information; `one frame` is that without a past. Only the sum is seen: dynamics "
        "and jitter are told apart by their spectra alone. NEES/4 and NIS/2 are 1 for a filter that knows its errors. The "
        "paper has curves only, and states none of its parameters.",
    )
