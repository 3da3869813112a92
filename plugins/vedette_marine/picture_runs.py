"""The marine study from pictures: simulated radar screens, the picture chain, and the same filters."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Progress, Reproduction
from vedette_marine import configs, outcome, verdicts
from vedette_marine.outcome import FILTERS, Record
from vedette_marine.points import Points, near, see
from vedette_marine.reproduction import SCENES, SIGMA, record, tuned
from vedette_report.findings import Findings, Keep, afresh

DETECTORS = {"MANV-like": configs.BOATS_IN_PICTURES, "DARC-like": configs.SHIP_IN_PICTURES}


@final
@frozen
class MarinePicturesReproduction(Reproduction):
    """The study `marine` with returns that the picture chain finds in pictures of a simulated radar; a minute a run.

    The process noises of CV-PDAF and CT-PDAF are chosen on drawn returns of other runs.
    """

    kind: ClassVar[str] = "marine_pictures"
    title: ClassVar[str] = "Ships in radar pictures: IMM-PDAF against CV-PDAF and CT-PDAF, judged by AIS"
    default_runs: ClassVar[int] = 20
    full_runs: ClassVar[int] = 20

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters on the same pictures."""
        records: dict[tuple[str, str], dict[str, Record]] = {}
        times, centres, returns = {}, {}, {}
        for i, scene in enumerate(SCENES):
            points = seen(scene, runs, seed, progress, keep)
            filters = tuned(scene, seed, i, keep)
            for target, name in enumerate(points.names):
                key = f"{scene} {name}"
                records[key, "tuned"] = {
                    each: record(scene, points, target, filters[each], SIGMA[scene]) for each in FILTERS
                }
                times[key], centres[key], returns[key] = points.times, points.centres[target], near(points, target)
        note = "m; RMSE of the runs that were not lost, AIS: against interpolated reports, centre: against the hull's centre"
        tables = (
            outcome.error_table("Table 4 from pictures, each filter tuned", "tuned", records, note),
            outcome.ratio_table(records),
        )
        claims = verdicts.claims(verdicts.figures(records, {}), runs, pictures=True)
        charts = outcome.charts(times, centres, returns, records, tables[0], claims)
        return Findings(self.title, runs, seed, tables, claims, charts)


def seen(scene: str, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Points:
    """Return what the chain finds in the scene's pictures; run i of 3 is also run i of 20."""
    rng = np.random.default_rng([seed, 2000 + list(SCENES).index(scene)])
    return see(SCENES[scene](), DETECTORS[scene], runs, rng, progress, scene, keep)
