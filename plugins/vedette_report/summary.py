"""The summary of a run, for people: what was read, what was tracked, how good it is, in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

import numpy as np

from vedette.config import installed_figures
from vedette.experiment import Experiment, Result
from vedette.metrics import Score, chi_square_band
from vedette.supporting import ImagingSensor
from vedette.tracking import Tracker
from vedette.types import LazyScans
from vedette.units import say
from vedette_files import Terms, utc
from vedette_report.columns import aligned
from vedette_report.figures import count, length_unit, unused
from vedette_report.registration import registered
from vedette_report.traces import BAND, Bands, Inside, Judged, mode_names
from vedette_report.track_rows import MOST_TRACKS, track_rows
from vedette_report.warnings import ENOUGH, warnings

FIRST = 5
"""Number of refused parts that the summary names."""

MOST_OBJECTS = 30
"""Number of true objects that the summary names and tells of; `summary.json` has all."""

FEW = 6
"""Number of objects, or of tracks, that a brief summary tells of."""

_MORE = ("bias", "first covered", "OSPA", "whole tracks")
"""What a brief summary leaves out of the comparison with the truth."""

FACTOR = 2.0
"""A mean NEES of one run that is off by less than this factor is no evidence against the covariance: see docs/metrics.md."""

CUT = 0.5
"""Errors are judged within the pairing radius. If a filter expects more than this part of it, a right one's NEES falls short
by 8 % and more in the plane: there is no verdict. Errors of less than half this part are cut by no radius: of a filter
that expects larger ones they show that it is wrong.
"""

RATIO = "Are the covariances right? Squared errors (NEES) and innovations (NIS) over what the filter states: 1 is right"
_TEXT, _WIDE = 21, 118
"""Columns at which texts begin and end, in characters."""

_EXACT = 0.01
"""A ratio below this is of errors a tenth of those stated: data drawn without noise, of which no filter can be right."""

_NOISE = 1e-9
"""Anything smaller than this is the rounding of sums, and reported as 0."""
_NOTHING = "nothing to judge by: no confirmed track"


def summary(experiment: Experiment, result: Result, score: Score, bands: Bands | None = None, *, brief: bool = False) -> str:
    """Return lines of text, the same in every run of one config and seed.

    `bands` are those that the judge counted; default: the result is judged anew. brief: what fits one screen.
    """
    bands = Judged.of(experiment, result).bands if bands is None else bands
    lines = _head(experiment, result, score)
    if score.coverage is not None:
        unit = length_unit(experiment)
        few = ", too few for parts in % to say much" if score.scans < ENOUGH else ""
        radius = f"a track within {experiment.judge.cover_radius:g} {unit} covers an object"
        lines += ["", f"Against the truth: {radius}; {count(score.scans, 'scan')} judged{few}"]
        told = ((name, text) for name, text in _against_truth(experiment, score, unit) if not (brief and name in _MORE))
        lines += [*rows(told), "", *_objects(score, unit, FEW if brief else MOST_OBJECTS)]
    elif score.false_tracks is not None:
        told_false = rows([("false tracks", f"{score.false_tracks:.3g} at a time")])
        lines += ["", f"Against the truth, by which nobody is there: {count(score.scans, 'scan')} judged", *told_false]
    if not (brief and score.coverage is not None) and (table := track_rows(result, FEW if brief else MOST_TRACKS)):
        lines += ["", *table]
    lines += ["", RATIO, *_consistency(experiment, score, bands, brief=brief)]
    return "\n".join(lines) + "\n"


def _head(experiment: Experiment, result: Result, score: Score) -> list[str]:
    """Return the lines on the input and the number of tracks."""
    title = experiment.title or "Run"
    lines = [title, "=" * len(title), "", *rows(("LOOKS WRONG", said) for said in warnings(experiment, result, score))]
    lines += [*rows(_read(experiment, result)), *_refused(result)]
    return [*lines, *rows(_tracked(result, score))]


def _tracked(result: Result, score: Score) -> Iterator[tuple[str, str]]:
    """Return how many tracks there were, and how often their weights were not exact."""
    yield "tracks", f"{score.tracks:,} confirmed of {result.begun:,} begun"
    for i, offset in enumerate(registered(result)):
        text = f"{offset.name} {say(offset.estimate, offset.unit)} +- {say(offset.deviation, offset.unit)}"
        seen = f"of the prior's variance {offset.observability:.1%} removed"
        yield (
            "" if i else "registration",
            f"{offset.name} REFUSED: {offset.refused}; {seen}" if offset.refused else f"{text}; {seen}",
        )
    intake = result.intake
    if intake.outside:
        told = f"{count(intake.outside, 'return')} of a code that a track bears lay outside its gate"
        yield "identity", f"{told}, or another took it: the codes are wrong, or the tracks"
    if intake.doubted:
        when = f"{intake.doubted:,} of {count(intake.frames, 'frame')}"
        yield "", f"a target was lost in {when}, where existence is below one half; at the end: {intake.lost:,}"
    if result.approximated:
        times = count(result.approximated, "time")
        if result.lost:
            share = f"{result.lost / result.approximated:.1%} of its probability on average, or less"
            yield (
                "association",
                f"a track's cluster had hypotheses that were dropped {times}: they had {share}",
            )
        else:
            yield "association", f"a track's weights were approximated {times}: its cluster was too large for exact sums"


def rows(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return a name and its text in a line each, or in more where the text is long."""
    lines = []
    for name, text in pairs:
        lines += wrap(text, _WIDE, initial_indent=f"  {name:<{_TEXT - 2}}", subsequent_indent=" " * _TEXT)
    return lines


def _read(experiment: Experiment, result: Result) -> Iterator[tuple[str, str]]:
    intake = result.intake
    for name, came in intake.came.items():
        frames = came.frames == came.scans
        yield (
            name,
            count(came.frames, "frame") if frames else f"{count(came.scans, 'scan')}, {count(came.returns, 'return')}",
        )
    for name, part in unused(result).items():
        others = (part.refused, "refused"), (part.left_out, "left out")
        rest = "".join(f", {number:,} {what}" for number, what in others if number)
        yield "read", f"{name}: {part.used:,} of {count(part.total, 'row')} used{rest}"
    if intake.times is not None:
        first, last = intake.times
        dated = Terms.of(result.recording.notes).dated
        ends = (utc(first), utc(last)) if dated else (f"{first:.3f} s", f"{last:.3f} s")
        yield "time", f"{ends[0]} to {ends[1]}: {last - first:.6g} s"
    else:
        yield "scans", "none was taken"
    if result.recording.truth:
        yield "truth", _named([path.name for path in result.recording.truth])
    for name, note in result.recording.notes.items():
        yield ("note", f"{name}: {note}")
    for name in _no_starters(experiment.tracker):
        yield "note", f"{name} starts no tracks: one of its returns gives no position"
    if result.interrupted:
        scans = result.recording.scans
        endless = isinstance(scans, LazyScans) and scans.once
        has = "" if endless else f"; the recording has {len(scans):,}"
        yield "interrupted", f"after {count(intake.scans, 'scan')}{has}"


def _no_starters(tracker: Tracker) -> Iterator[str]:
    """Yield the sensors that the birth does not leave out, and whose returns cannot start tracks."""
    if tracker.starts_tracks and tracker.birth is not None:
        for name, sensor in tracker.sensors.items():
            if name not in tracker.starters and tracker.birth.starts_from(name) and not isinstance(sensor, ImagingSensor):
                yield name


def _named(names: Sequence[str]) -> str:
    more = len(names) - MOST_OBJECTS
    return ", ".join(names[:MOST_OBJECTS]) + (f" and {more:,} more" if more > 0 else "")


def _refused(result: Result) -> list[str]:
    refused = result.intake.refused
    if not refused.count:
        return []
    told = [("refused", f"{count(refused.count, 'part')} of the input left out:")]
    told += [("", str(problem)) for problem in refused.first[:FIRST]]
    more = refused.count - FIRST
    return rows([*told, ("", f"and {more:,} more")] if more > 0 else told)


def _against_truth(experiment: Experiment, score: Score, unit: str) -> Iterator[tuple[str, str]]:
    judge = experiment.judge
    offset = "" if not np.any(judge.offset) else f", the known offset {_vector(judge.offset.tolist())} {unit} removed"
    yield "coverage", f"{_percent(score.coverage)} of the scans in which an object was there"
    yield "position error", _maybe(score.position_rmse_m, f"{unit} RMSE while covered") + offset
    if score.bias_m is not None:
        yield "bias", f"{_vector(score.bias_m)} {unit}"
    if score.velocity_rmse_mps is not None:
        yield "velocity error", f"{score.velocity_rmse_mps:.3g} {unit}/s RMSE while covered"
    yield "identity switches", f"{score.id_switches}"
    yield "lost", f"{_percent(score.lost)} of the objects"
    yield "first covered", _maybe(score.confirmed_after_s, "s after an object's first scan, on average")
    near = "" if judge.near is None else f" within {judge.near:g} {unit} of an object"
    yield "false tracks", f"{_maybe(score.false_tracks, 'at a time')}{near}"
    how = f"cut-off {judge.gospa_cutoff:g} {unit}, order {judge.gospa_order:g}"
    yield "GOSPA", f"{_maybe(score.gospa_m, unit)} a scan, {how}"
    if judge.far is not None:
        yield "", f"of tracks within {judge.far:g} {unit} of an object; {_maybe(score.gospa_all_m, unit)} with all"
    yield "OSPA", f"{_maybe(score.ospa_m, unit)} a scan"
    yield "whole tracks", ", ".join(_whole_tracks(score, unit))
    if score.position_bound_m is not None:
        yield "lower bound", f"{score.position_bound_m:.3g} {unit}: posterior Cramer-Rao bound of the position error"
    for figure in installed_figures():
        if score.more.get(figure.name) is not None:
            value = _maybe(score.more[figure.name], "" if figure.unit == "1" else figure.unit)
            yield figure.study or figure.name, f"{value}: {figure.about}"


def _whole_tracks(score: Score, unit: str) -> Iterator[str]:
    """Yield the figures of whole tracks that say most; the others are in the JSON."""
    if score.hota is None:
        yield "left out: so long a run keeps too little of them"
        return
    if score.trajectory_gospa_m is not None:
        yield f"trajectory GOSPA {score.trajectory_gospa_m:.3g} {unit} a scan"
    else:
        yield "no trajectory GOSPA, whose linear program is larger than judge.largest_program"
    shares = ", ".join(f"{name.upper()} {_maybe(getattr(score, name))}" for name in ("hota", "mota", "idf1"))
    yield f"OSPA(2) {_maybe(score.ospa2_m, unit)}, {shares}"


def _objects(score: Score, unit: str, most: int) -> list[str]:
    titles = ("object", "scans", "coverage", f"RMSE [{unit}]", "identity switches", "lost", "first covered [s]")
    table = [
        (
            fate.name,
            f"{fate.scans:,}",
            _percent(fate.coverage),
            _maybe(fate.position_rmse_m),
            f"{fate.id_switches}",
            {True: "yes", False: "no", None: "-"}[fate.lost],
            _maybe(fate.confirmed_after_s),
        )
        for fate in score.truths[:most]
    ]
    lines = [f"  {line}" for line in aligned((titles, *table))]
    more = len(score.truths) - most
    return [*lines, f"  and {more:,} more, which summary.json has"] if more > 0 else lines


def _consistency(experiment: Experiment, score: Score, bands: Bands, *, brief: bool) -> list[str]:
    """Return the table of ratios, what each says below it, and the modes."""
    table = [("", "ratio", f"single values in their {_percent(1 - BAND)} band")]
    told: list[tuple[str, str]] = []
    if score.nees_position is not None:
        table.append(("NEES of the position", f"{score.nees_position:.3g}", _inside(bands.nees)))
        told.append(("NEES", _nees_of(experiment, score, score.nees_position)))
    if score.nees_state is not None and not brief:
        table.append((f"NEES of {', '.join(score.nees_state_axes or ())}", f"{score.nees_state:.3g}", ""))
    if score.nis is not None and bands.nis.count:
        axes = float(sum(axes * count for axes, count in bands.nis.axes.items()))
        table.append(("NIS", f"{score.nis:.3g}", _inside(bands.nis)))
        told.append(("NIS", _nis_in_words(score.nis, axes, experiment)))
    if score.nees_position is None and score.nis is None:
        return rows([("", f"{_NOTHING} took a return" if score.tracks else _NOTHING)])
    if score.mode_prob is not None and not brief:
        names = mode_names(experiment, len(score.mode_prob))
        shares = (f"{name} {share:.2f}" for name, share in zip(names, score.mode_prob, strict=True))
        told.append(("modes", ", ".join(shares)))
    return [*(f"  {line}" for line in aligned(table)), *rows(told)]


def _nees_of(experiment: Experiment, score: Score, ratio: float) -> str:
    expected, radius, unit = score.position_deviation_m or 0.0, experiment.judge.cover_radius, length_unit(experiment)
    reaching = expected > CUT * radius and (score.position_rmse_m or 0.0) > CUT / 2 * radius
    if reaching and ratio <= FACTOR:
        cut = f"not judged: the pairing radius of {radius:g} {unit} cuts the errors, which the filter expects to be"
        return f"{cut} {expected:.3g} {unit}; set judge.cover_radius to {float(f'{3 * expected:.2g}'):g} or more"
    return _nees_in_words(ratio)


def _inside(seen: Inside) -> str:
    if seen.part is None:
        return "none at a single scan"
    return f"{_percent(seen.part)} of {seen.count:,}"


def _nees_in_words(ratio: float) -> str:
    """Judge one run's NEES, whose values are dependent, so that only a gross ratio means something."""
    if ratio < _EXACT:
        return "not judged: next to no error, as of a truth that the returns were made from without noise"
    if ratio > FACTOR:
        return f"the covariance is {ratio:.2g} times too small for the errors: the filter is overconfident"
    if ratio < 1 / FACTOR:
        return f"the covariance is {1 / ratio:.2g} times too large for the errors: the filter is underconfident"
    return f"the covariance fits the errors to within a factor of {FACTOR:g}, which is all that one run can tell"


def _nis_in_words(ratio: float, axes: float, experiment: Experiment) -> str:
    """Judge the NIS by the band of a correct linear filter whose returns are known to be its own."""
    if all(isinstance(sensor, ImagingSensor) for sensor in experiment.tracker.sensors.values()):
        return "not judged: a frame has no innovation of its own; how well it fits is in the likelihood of its pixels"
    if ratio < _EXACT:
        return "not judged: the returns have next to no noise"
    low, high = chi_square_band(axes, BAND)
    if experiment.tracker.estimator.traits.conservative and ratio < low:
        return "less than 1, as is meant: this estimator's covariance is larger than that of its errors on purpose"
    words = f"its {_percent(1 - BAND)} band is {low:.3g} to {high:.3g} where returns are known to be the target's"
    if low <= ratio <= high:
        return f"{words}: the innovations fit the models"
    factor, way = (ratio, "larger") if ratio > high else (1 / ratio, "smaller")
    size = f"{factor:.2g} times" if factor > 1.5 else f"{100 * abs(ratio - 1):.2g} %"
    return f"{words}: the squared innovations are {size} {way} than the models predict"


def _percent(part: float | None) -> str:
    return "-" if part is None else f"{100 * part:.3g} %"


def _maybe(value: float | None, unit: str = "") -> str:
    return "-" if value is None else f"{value:.3g} {unit}".rstrip()


def _vector(values: Sequence[float]) -> str:
    return f"({', '.join(f'{0.0 if abs(value) < _NOISE else value:.3g}' for value in values)})"
