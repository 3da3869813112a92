"""The study of the paper on IMM-PDAF with a marine radar."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from time import process_time
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Mask, Progress, Reproduction, build
from vedette_marine import configs, outcome, scenes, verdicts
from vedette_marine.elements import ELEMENTS
from vedette_marine.outcome import COAST, FILTERS, Record
from vedette_marine.points import Points, by_frame_number, draw, first_late, near, prior
from vedette_report.findings import Claim, Element, Findings, Keep, afresh
from vedette_study.lockstep import run_together
from vedette_study.panels import mean_over_runs

CLUTTER = 1e-6
"""Clutter density per m^2 and scan: 1 per km^2."""

GRID = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4)
"""Values of the CV-PDAF's process noise in m/s^2 among which it is chosen."""

TURN_GRID = ((0.2, 0.05, 0.1, 0.4, 0.8), (1e-2, 1e-3, 3e-3, 3e-2))
"""The same for CT-PDAF: sigmas of its acceleration in m/s^2, of its turn rate in rad/s^2; searched from the first."""

TUNING_RUNS = 20

LOST = {"MANV-like": 100.0, "DARC-like": 300.0}
"""Error of the centre in m: a run with more in `IN_A_ROW` successive scans is lost."""

IN_A_ROW = 10

SCENES: dict[str, Any] = {"MANV-like": scenes.manoeuvres, "DARC-like": scenes.large_ship}
START = {"MANV-like": 10.0, "DARC-like": 90.0}
"""Standard deviation of the initial position in m: the greatest of 10 m, the antenna's offset, half the length."""
SIGMA = {"MANV-like": 6.0, "DARC-like": 20.0}
TUNED: dict[str, dict[str, Any]] = {"MANV-like": configs.TUNED_BOATS, "DARC-like": configs.TUNED_SHIP}


@final
@frozen
class MarineReproduction(Reproduction):
    """IMM-PDAF beside CV-PDAF and CT-PDAF on ships seen by a marine radar, judged against AIS and against the truth.

    Tables 4 and 5 of the paper on tracking maritime objects with radar and AIS (in Korean), on scenes like its recordings.
    The returns are drawn as the picture chain reports them; from pictures themselves:
    tests/marine/test_simulated_pictures.py.
    """

    kind: ClassVar[str] = "marine"
    title: ClassVar[str] = "Ships seen by a marine radar: IMM-PDAF against CV-PDAF and CT-PDAF, judged by AIS"
    default_runs: ClassVar[int] = 28
    full_runs: ClassVar[int] = 280
    grid_runs: ClassVar[int] = 20
    unsaid: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "clutter": {"1e-7 /m^2": 1e-7, "1e-6 /m^2": 1e-6, "1e-5 /m^2": 1e-5},
        "first return": {"at once": 0.0, "after 30 s": 30.0, "after 90 s": 90.0},
    }
    elements: ClassVar[tuple[Element, ...]] = ELEMENTS

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters on the same draws; the process noises of CV-PDAF and CT-PDAF are chosen on other draws."""
        records: dict[tuple[str, str], dict[str, Record]] = {}
        numbered: dict[tuple[str, str], dict[str, Record]] = {}
        late: dict[tuple[str, str], dict[str, Record]] = {}
        times, centres, returns, seconds = {}, {}, {}, {}
        for i, scene in enumerate(SCENES):
            points = draw(SCENES[scene](), runs, CLUTTER, np.random.default_rng([seed, i]))
            best = tuned(scene, seed, i, keep)
            sets = {"Table 6": (configs.TABLE_6, 10.0), "tuned": (best, SIGMA[scene])}
            work = [(name, target, tried) for name in sets for target in range(len(points.names)) for tried in FILTERS]
            for name, target, tried in progress(work, scene):
                judge = partial(record, scene, points, target, sets[name][0][tried], sets[name][1])
                key = (f"{scene} {points.names[target]}", name)
                records.setdefault(key, {})[tried] = keep(f"{key[0]}, {name}, {tried}", Record, judge)
                if name == "Table 6":
                    judge = partial(record, scene, first_late(points, COAST), target, configs.TABLE_6[tried], sets[name][1])
                    late.setdefault((key[0], "late"), {})[tried] = keep(f"{key[0]}, late, {tried}", Record, judge)
                if name == "tuned":
                    judge = partial(record, scene, by_frame_number(points), target, best[tried], SIGMA[scene], lost=np.inf)
                    by_number = keep(f"{key[0]}, by number, {tried}", Record, judge)
                    numbered.setdefault((key[0], "by number"), {})[tried] = by_number
                times[key[0]], centres[key[0]], returns[key[0]] = points.times, points.centres[target], near(points, target)
            seconds[scene] = run_times(scene, points, best, SIGMA[scene])
        notes = (
            "m; RMSE of the runs that were not lost, AIS: against interpolated reports, centre: against the hull's centre"
        )
        tables = (
            outcome.error_table("Table 4, parameters of Table 6 corrected", "Table 6", records, notes),
            outcome.error_table("Table 4, each filter tuned", "tuned", records, notes),
            outcome.ratio_table(records),
            outcome.error_table(
                f"Table 4 with an initial coast of {COAST:g} s", "late", late, f"{notes}; parameters of table 6 corrected"
            ),
            outcome.error_table(
                "Table 4 with the frame's number taken for its time", "by number", numbered, f"{notes}; each filter tuned"
            ),
        )
        claims = verdicts.claims(verdicts.figures(records, numbered, late), runs)
        charts = outcome.charts(times, centres, returns, records, tables[1], claims)
        return Findings(self.title, runs, seed, tables, claims, charts, (outcome.times_table(seconds),))

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> tuple[Claim, ...]:
        """Return the claims with their verdicts at one point of the grid."""
        clutter, gap = (values[point[name]] for name, values in self.unsaid.items())
        records: dict[tuple[str, str], dict[str, Record]] = {}
        numbered: dict[tuple[str, str], dict[str, Record]] = {}
        late: dict[tuple[str, str], dict[str, Record]] = {}
        for i, scene in enumerate(SCENES):
            whole = draw(SCENES[scene](), runs, clutter, np.random.default_rng([seed, i]))
            points, best = first_late(whole, gap), _tuned(scene, seed, i)
            for target, name in enumerate(points.names):
                key = f"{scene} {name}"
                records[key, "tuned"] = {each: record(scene, points, target, best[each], SIGMA[scene]) for each in FILTERS}
                counted = record(scene, by_frame_number(points), target, best[FILTERS[0]], SIGMA[scene], lost=np.inf)
                numbered[key, "by number"] = {FILTERS[0]: counted}
                coasting = first_late(whole, max(gap, COAST))
                late[key, "late"] = {each: record(scene, coasting, target, configs.TABLE_6[each], 10.0) for each in FILTERS}
        return verdicts.claims(verdicts.figures(records, numbered, late), runs)


@cache  # on runs of its own, at every point of the grid the same
def _tuned(scene: str, seed: int, number: int) -> dict[str, Any]:
    return tuned(scene, seed, number)


@frozen(eq=False)
class Chosen:
    """Process noises that err least: sigma of the CV-PDAF's acceleration, sigmas of the CT-PDAF's acceleration and rate."""

    cv: Array
    ct: Array


def tuned(scene: str, seed: int, number: int, keep: Keep = afresh) -> dict[str, Any]:
    """Return the tuned filters; those of one model err least against AIS in `TUNING_RUNS` runs of their own."""
    best = keep(f"{scene}, tuning", Chosen, partial(chosen, scene, seed, number))
    filters = {"CV-PDAF": configs.cv_pdaf(float(best.cv)), "CT-PDAF": configs.ct_pdaf(*best.ct.tolist())}
    return TUNED[scene] | filters


def chosen(scene: str, seed: int, number: int) -> Chosen:
    """Search CV-PDAF's grid, and CT-PDAF's along one of its two axes after the other."""
    points = draw(SCENES[scene](), TUNING_RUNS, CLUTTER, np.random.default_rng([seed, 1000 + number]))

    def error(estimator: dict[str, Any]) -> tuple[int, float]:
        records = [record(scene, points, target, estimator, SIGMA[scene]) for target in range(len(points.names))]
        return sum(int(each.lost.sum()) for each in records), sum(outcome.rms(each, "ais") ** 2 for each in records)

    cv = min(GRID, key=lambda sigma: error(configs.cv_pdaf(sigma)))
    accel = min(TURN_GRID[0], key=lambda sigma: error(configs.ct_pdaf(sigma, TURN_GRID[1][0])))
    rate = min(TURN_GRID[1], key=lambda sigma: error(configs.ct_pdaf(accel, sigma)))
    return Chosen(np.array(cv), np.array([accel, rate]))


def record(
    scene: str, points: Points, target: int, estimator: dict[str, Any], sigma: float, lost: float | None = None
) -> Record:
    """Run one filter on one target of all runs, started by its AIS; over `lost` m off for long is lost."""
    tracker = build(configs.tracker(estimator, sigma))
    given = prior(points, target, START[scene], tracker.state)
    tracks = run_together(tracker, given, float(points.times[0]), points.scans)
    spot = tracks.mean[..., :2]
    centre = _squares(spot - points.centres[target])
    modes = (None, None) if tracks.mode_prob is None else mean_over_runs(tracks.mode_prob)
    return Record(
        ais=_squares(spot - points.ais[:, target]),
        centre=centre,
        nis=tracks.nis / 2,
        lost=_lost(centre, LOST[scene] if lost is None else lost),
        modes=modes[0],
        path=spot[0],
        modes_doubt=modes[1],
    )


def run_times(scene: str, points: Points, estimators: dict[str, Any], sigma: float) -> tuple[float, float, float]:
    """Measure CPU seconds of each filter for the first run alone, over all targets."""
    alone = []
    for scan in points.scans:
        z, valid = scan.detections.z[:1], scan.detections.valid[:1]
        alone.append(evolve(scan, detections=Detections(z[:, valid[0]], valid[:, valid[0]])))
    first = evolve(points, ais=points.ais[:1], announced=points.announced[:1], scans=tuple(alone))
    took = []
    for name in FILTERS:
        before = process_time()
        for target in range(len(points.names)):
            record(scene, first, target, estimators[name], sigma)
        took.append(process_time() - before)
    return took[0], took[1], took[2]


def _lost(squares: Array, limit: float) -> Mask:
    """Return the runs (r,) that err by more than `limit` in `IN_A_ROW` successive scans; squares (r, s)."""
    far = np.lib.stride_tricks.sliding_window_view(squares > limit**2, IN_A_ROW, axis=-1)
    return np.any(np.all(far, axis=-1), axis=-1)


def _squares(error: Array) -> Array:
    return np.sum(error**2, axis=-1)
