"""Whether a tracker's covariance fits its errors: Monte Carlo on matched truth, judged with one overall false-alarm rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec

import attrs
import numpy as np
from attrs import frozen

from vedette import Array, Experiment, Tracker, build
from vedette.display import html_table
from vedette.fields import ABSURD
from vedette.metrics import chi_square_band, free_axes, nees
from vedette.testing import Misuse
from vedette_report.consistency import SOUGHT, Verdict
from vedette_report.drawing.brought import drawing
from vedette_report.whole_trackers.covariances import (
    distance_verdicts,
    error_verdict,
    innovation_verdicts,
    modes_verdict,
    tail_verdicts,
)
from vedette_report.whole_trackers.culprits import likely_cause
from vedette_report.whole_trackers.runs import Runs, play, prior_of
from vedette_report.whole_trackers.verdicts import (
    LAGS,
    REPORTED,
    bias_of,
    calibration,
    calibration_verdict,
    hits_verdicts,
    lost_runs,
    lost_verdict,
    nees_verdict,
    nis_verdicts,
    normalised_innovations,
    reported_innovations,
    returns_verdicts,
    whiteness_verdicts,
    without,
)
from vedette_report.whole_trackers.world import World, world_of

FAMILIES = 10
"""NEES, NIS, NIS by distance, tails, whiteness, bias, calibration, both whole covariances and hits share alpha equally with
lost tracks, false returns, modes and what the estimator reports of innovations, where these are judged, so that all together
alarm no more often.
"""

NOT_SHOWN = f"not shown to be consistent, as a covariance {SOUGHT:g} times too small or too large is not excluded (see ?)"

P = ParamSpec("P")
Config = Mapping[str, Any] | str | Path


@frozen(eq=False)
class Report:
    """What a tracker's errors say about its covariance.

    `nees` (s,) is the mean NEES over runs at each of `times`, and `calibration` (d, s) the mean squared error over the
    variance along each of `directions`, both scaled so that 1 is expected, as is `nis` of each sensor, with the bands of one
    point; `exact` says whether these bands hold, and `why` not. `errors` are one standard error of each mean, by what it is
    of: "nees", "calibration" or a sensor. `verdicts` are judged with `alpha` in all. `cause` says which parameter is likely
    wrong, and by how much.
    """

    runs: int
    seed: int
    alpha: float
    exact: bool
    why: str
    times: Array
    nees: Array
    nees_band: tuple[float, float]
    directions: tuple[str, ...]
    calibration: Array
    calibration_band: tuple[float, float]
    nis: Mapping[str, Array]
    nis_band: Mapping[str, Array]
    errors: Mapping[str, Array]
    verdicts: tuple[Verdict, ...]
    cause: str = ""

    def __str__(self) -> str:
        return self.text

    @property
    def consistent(self) -> bool:
        """Whether every figure lies in its band, and each band is narrow enough to show something."""
        return all(verdict.inside and verdict.shown for verdict in self.verdicts)

    @property
    def wrong(self) -> set[str]:
        """The names of the verdicts whose figures leave their bands."""
        return {verdict.name for verdict in self.verdicts if not verdict.inside}

    @property
    def headline(self) -> str:
        """Whether it is consistent, or not, or whether that was not shown, and how this was judged."""
        how = "chi-square" if self.exact else f"run means, as {self.why}"
        kind = "consistent" if self.consistent else "NOT consistent" if self.wrong else NOT_SHOWN
        alarms = f"seed {self.seed}, false-alarm rate {self.alpha:g} in all"
        return f"{kind}: {self.runs} runs, {alarms}, judged by {how}; 1 is right"

    @property
    def told(self) -> list[tuple[str, Verdict]]:
        """The verdicts, each with its word, with what is wrong first and then what is not shown."""
        ordered = sorted(self.verdicts, key=lambda verdict: (verdict.inside, verdict.shown))
        return [("WRONG" if not one.inside else "ok" if one.shown else "?", one) for one in ordered]

    @property
    def text(self) -> str:
        """The verdict in words."""
        lines = [self.headline, *(f"  {word:5} {verdict.text}" for word, verdict in self.told)]
        return "\n".join([*lines, *([f"  likely {self.cause}"] if self.cause else [])])

    def _repr_html_(self) -> str:
        rows = [(f"{word}: {verdict.name}", verdict.text) for word, verdict in self.told]
        return html_table(self.headline, [*rows, *([("likely", self.cause)] if self.cause else [])])

    def plot(self, path: str | Path) -> None:
        """Draw NEES, NIS and calibration over time with their bands, as a PNG, SVG or PDF; needs matplotlib."""
        drawing().save("consistency", self, Path(path))


def consistency(
    tracker: Tracker | Experiment | Config,
    *,
    prior: Mapping[str, tuple[float, float]] | None = None,
    runs: int = 200,
    scans: int = 50,
    interval: float | tuple[float, float] = 1.0,
    alpha: float = 1e-6,
    band: tuple[float, float] = (0.85, 1.15),
    seed: int = 0,
    world: Tracker | World | None = None,
) -> Report:
    """Draw truth from the tracker's own models, run it `runs` times in one batch, and judge its errors.

    A linear Gaussian tracker is judged by chi-square. Any other (a mixture, a nonlinear model, clutter) is only known to
    have a mean over runs near 1: it must not contradict `band`.

    Parameters
    ----------
    tracker
        A tracker, an experiment, whose source is not used, or a config.
    prior
        Axis to [mean, standard deviation] at the start, in the axis' unit; default: as the birth states it. It is what the
        tracker takes its target to start from.
    runs, scans
        Number of runs, at least 30, and of scans of each sensor in a run, at least 10.
    interval
        Time between scans in s; or the least and the most of uneven ones, which are even in their logarithms and come in an
        order that the seed draws, the same in all runs: a noise that does not fit uneven times shows.
    alpha
        Probability with which a consistent tracker is found not to be, over all verdicts together.
    band
        Where the mean NEES, NIS and calibration may lie, as a share of what is expected, if chi-square does not hold.
    seed
        Of all draws: the same seed gives the same report.
    world
        A tracker that has at least this one's axes, and sensors of the same names that measure the same, from whose models
        truth and returns are drawn instead, to see how far this tracker's may be off. Truth starts as its own birth states
        it, or else from the prior. A `World` may say besides how a sensor's errors are not white.

    Returns
    -------
    Report
        Figures over time with their bands, the verdicts, and which parameter is likely wrong.

    Raises
    ------
    Misuse
        If an option is out of its range, or no truth can be drawn.
    ConfigError
        For a wrong config.
    """
    _check_options(runs, scans, interval, alpha, seed)
    if isinstance(tracker, Experiment):
        tracker = tracker.tracker
    elif not isinstance(tracker, Tracker):
        tracker = build(tracker)
    times = _times(interval, scans, seed)
    start = prior_of(tracker, prior)
    scene = world_of(tracker, world, start)
    played = play(tracker, start, times, runs, np.random.default_rng(seed), scene)
    usual = None
    if isinstance(world, Tracker) and world is not tracker and played.surprise is not None:
        assert scene.start is not None
        usual = play(world, scene.start, times, runs, np.random.default_rng(seed), scene).surprise
    report = judge(played, alpha, band, seed, usual)
    wrong = report.wrong
    cause = likely_cause(played, wrong, tracker, scene, start, runs, seed, usual) if wrong else ""
    return attrs.evolve(report, cause=cause)


def _times(interval: float | tuple[float, float], scans: int, seed: int) -> Array:
    """Return the times (1 + scans,) of the start and of all scans."""
    low, high = np.resize(interval, 2).tolist()
    times: Array = low * np.arange(scans + 1.0)
    if low < high:
        times[1:] = np.cumsum(np.random.default_rng([seed, scans]).permutation(np.geomspace(low, high, scans)))
    return times


def _check_options(runs: int, scans: int, interval: float | tuple[float, float], alpha: float, seed: int) -> None:
    """Raise Misuse for options with which nothing can be judged."""
    for name, given, least in (("runs", runs, 30), ("scans", scans, 2 * LAGS), ("seed", seed, 0)):
        if not _is(given, int | np.integer) or given < least:
            raise Misuse(f"{name}: must be a whole number of at least {least}, got {given!r}")
    several = list(interval) if isinstance(interval, list | tuple | np.ndarray) else [interval]
    for name, values, most, said in (
        ("interval", several, ABSURD, "a number of s above 0, or the least and the most"),
        ("alpha", [alpha], 1.0, "between 0 and 1"),
    ):
        wrong = [value for value in values if not _is(value, int | float | np.number) or not 0 < value < most]
        if wrong or not values:
            raise Misuse(f"{name}: must be {said}, got {wrong[0] if wrong else values!r}")
    if len(several) > 2 or several[0] > several[-1]:
        raise Misuse(f"interval: must be a number of s, or the least and the most, got {interval!r}")


def _is(value: object, kinds: Any) -> bool:
    """Return whether a value is of some kinds of numbers; True is none."""
    return isinstance(value, kinds) and not isinstance(value, bool)


def _asserted(judged: Callable[P, Report]) -> Callable[P, Report]:
    @wraps(judged)
    def checked(*args: P.args, **kwargs: P.kwargs) -> Report:
        report = judged(*args, **kwargs)
        if not report.consistent:
            raise AssertionError(report.text)
        return report

    checked.__name__ = checked.__qualname__ = "assert_consistent"
    checked.__doc__ = "Call `consistency`, whose arguments it takes; AssertionError where a figure leaves its band."
    return checked


assert_consistent = _asserted(consistency)


def judge(played: Runs, alpha: float, band: tuple[float, float], seed: int, usual: Array | None = None) -> Report:
    """Return every verdict on some runs, with `alpha` shared among them all.

    `usual` (r, s) is the surprise at the true mode of a mixture that is the world's own.
    """
    total, scans = played.error.shape[:2]
    clutter = any(looks.candidates.any() for looks in played.looks.values())
    modes = usual is not None and played.surprise is not None
    reported = reported_innovations(played)
    share = alpha / (FAMILIES + (not played.exact) + clutter + modes + bool(reported))
    lost, whole = lost_runs(played), played
    if not played.exact and lost.mean() < 0.5:
        played = without(played, lost)
        reported = {name: values[~lost] for name, values in reported.items()}
    runs = len(played.error)
    free = free_axes(played.cov[:, 0])
    values = nees(played.error, played.cov) / free[:, None]
    directions, squares = calibration(played)
    nis = {name: normalised_innovations(looks) for name, looks in played.looks.items()}
    verdicts = [
        nees_verdict(played, values, free, share, band),
        *nis_verdicts(played, nis, share, band),
        *nis_verdicts(played, reported, share, band, REPORTED),
        *whiteness_verdicts(played, share),
        bias_of(played, share),
        calibration_verdict(played, directions, squares, share, band),
        *hits_verdicts(whole, share),
        *returns_verdicts(whole, share),
        *innovation_verdicts(played, share, band),
        *distance_verdicts(played, share, band),
        *tail_verdicts(played, share),
        *([] if (errors := error_verdict(played, share, band)) is None else [errors]),
    ]
    if usual is not None and whole.surprise is not None:
        verdicts.append(modes_verdict(whole.surprise, usual, share))
    if not played.exact:
        verdicts.append(lost_verdict(int(lost.sum()), total, share))
    return Report(
        total, seed, alpha, played.exact, played.why, played.times, values.mean(axis=0),
        chi_square_band(float(free.sum()), share / scans), directions, squares.mean(axis=1),
        chi_square_band(runs, share / scans / len(directions)),
        {name: np.nanmean(one, axis=0) for name, one in nis.items()},
        {name: _nis_band(one, played.looks[name].residual.shape[-1], share / scans) for name, one in nis.items()},
        {"nees": _error(values), "calibration": _error(squares, 1), **{name: _error(one) for name, one in nis.items()}},
        tuple(verdicts),
    )  # fmt: skip


def _nis_band(values: Array, measured: int, share: float) -> Array:
    """Return the band (2, s) of the mean over the runs that saw the target at each scan, NaN where none did."""
    counts = np.isfinite(values).sum(axis=0)
    bands = {count: chi_square_band(count * measured, share) for count in np.unique(counts[counts > 0]).tolist()}
    return np.array([bands.get(count, (np.nan, np.nan)) for count in counts.tolist()]).T


def _error(values: Array, runs: int = 0) -> Array:
    """Return one standard error of the mean over the finite values along the axis of the runs."""
    count = np.isfinite(values).sum(axis=runs)
    with np.errstate(invalid="ignore", divide="ignore"):
        error: Array = np.sqrt(np.nanvar(values, axis=runs) * count / (count - 1) / count)
    return error
