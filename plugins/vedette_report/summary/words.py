"""The summary of a run, for people: what was read, what was tracked, how good it is, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vedette import Experiment, ImagingSensor, Result, Tracker
from vedette.metrics import Score
from vedette.types import come_once
from vedette.units import say
from vedette_files import Terms, utc
from vedette_report.columns import rows
from vedette_report.figures import count, length_unit, unused
from vedette_report.pixels import pixel_figures
from vedette_report.registration import registered
from vedette_report.series.traces import Bands, Judged
from vedette_report.summary.ratios import RATIO, ratios
from vedette_report.summary.tracks import MOST_TRACKS, track_rows
from vedette_report.summary.truth import against_truth, objects
from vedette_report.warnings.words import ENOUGH, First, warnings

FIRST = 5
"""Number of refused parts that the summary names."""

MOST_OBJECTS = 30
"""Number of true objects that the summary names and tells of; `summary.json` has all."""

MUCH = 0.25
"""The share of a cluster's probability from which on dropped hypotheses are a reason for another associator. Chosen on a
drawn scene of twelve targets, P_D .5 and 100 false returns a scan: 56 % dropped by `k_best`, GOSPA 159 m, 46 m by `lmb`;
65 m since clusters part (`vedette_standard.associators.parting`).
"""

FEW = 6
"""Number of objects, or of tracks, that a brief summary tells of."""

_MORE = ("bias", "first covered", "OSPA", "whole tracks")
"""What a brief summary leaves out of the comparison with the truth."""


def summary(
    experiment: Experiment,
    result: Result,
    score: Score,
    bands: Bands | None = None,
    *,
    brief: bool = False,
    first: First | None = None,
) -> str:
    """Return lines of text, the same in every run of one config and seed.

    `bands` are those that the judge counted; default: the result is judged anew. brief: what fits one screen. first: the
    first scans and the tracks in these, of a run that keeps no others.
    """
    bands = Judged.of(experiment, result).bands if bands is None else bands
    lines = _head(experiment, result, score, first)
    if score.coverage is not None:
        unit = length_unit(experiment)
        few = ", too few for parts in % to say much" if score.scans < ENOUGH else ""
        radius = f"a track within {experiment.judge.cover_radius:g} {unit} covers an object"
        lines += ["", f"Against the truth: {radius}; {count(score.scans, 'scan')} judged{few}"]
        every = against_truth(experiment, score, unit, result.recording.truth)
        told = [(name, text) for name, text in every if not (brief and name in _MORE)]
        if (overlap := pixel_figures(result.tracks, result.recording.truth).get("overlap")) is not None:
            told.append(("overlap", f"{overlap:.3g}: intersection over union of the track's and the true box"))
        lines += [*rows(told), "", *objects(score, unit, FEW if brief else MOST_OBJECTS)]
    elif score.false_tracks is not None:
        told_false = rows([("false tracks", f"{score.false_tracks:.3g} at a time")])
        lines += ["", f"Against the truth, by which nobody is there: {count(score.scans, 'scan')} judged", *told_false]
    if not (brief and score.coverage is not None) and (table := track_rows(result, FEW if brief else MOST_TRACKS)):
        lines += ["", *table]
    lines += ["", RATIO, *ratios(experiment, score, bands, brief=brief)]
    return "\n".join(lines) + "\n"


def _head(experiment: Experiment, result: Result, score: Score, first: First | None) -> list[str]:
    """Return the lines on the input and the number of tracks."""
    title = experiment.title or "Run"
    wrong = warnings(experiment, result, score, first)
    lines = [title, "=" * len(title), "", *rows(("LOOKS WRONG", said) for said in wrong)]
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
            share = result.lost / result.approximated
            told = f"they had {share:.1%} of its probability on average, or less"
            cure = "; 'lmb' drops none, as it keeps each track's own" if share > MUCH else ""
            yield "association", f"a track's cluster had hypotheses that were dropped {times}: {told}{cure}"
        else:
            yield "association", f"a track's weights were approximated {times}: its cluster was too large for exact sums"


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
        endless = come_once(scans)
        has = "" if endless else f"; the recording has {len(scans):,}"
        yield "interrupted", f"after {count(intake.scans, 'scan')}{has}"


def _no_starters(tracker: Tracker) -> Iterator[str]:
    """Yield the sensors that the birth does not leave out, and whose returns cannot start tracks."""
    if tracker.starters and tracker.birth is not None:
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
