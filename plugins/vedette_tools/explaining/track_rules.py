"""Rules on how tracks start, are confirmed, end and are judged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vedette import Array, Detections, LazyScans
from vedette.units import say
from vedette_report.figures import MANY, WHOLE, extent
from vedette_report.warnings.rehearsal import rehearsed, silenced
from vedette_report.warnings.words import held
from vedette_tools.explaining.finding import Finding
from vedette_tools.explaining.lifetimes import LOOKS
from vedette_tools.explaining.paces import BEYOND, strange_paces
from vedette_tools.explaining.parameters import in_seconds
from vedette_tools.explaining.situation import Seen, Situation, deviation, positions
from vedette_tools.explaining.steady_state import SCANS, inverts

LEAST_SURVIVAL = 0.8
FALSE_TRACKS, FALSE_SHARE = 10.0, 0.2
MOST_RETURNS = 500


def _started(it: Situation) -> Iterator[tuple[Seen, Array, Array]]:
    """Yield each sensor whose track is known, with the mean and the standard deviations of its start."""
    for seen in it.sensors:
        if seen.settled is not None:
            start = seen.settled.start
            yield seen, start.mean[0], np.sqrt(np.diag(start.cov[0]))


def slow_prior(it: Situation) -> Iterator[Finding]:
    """Find true objects far faster than a new track may be."""
    speed = it.true_speed()
    for _, mean, sigma in _started(it):
        fast = [i for i, axis in enumerate(it.state.axes) if axis.unit == "m/s"]
        if speed is None or not fast:
            continue
        most = float(np.linalg.norm(np.abs(mean[fast]) + 5.0 * sigma[fast]))
        if speed > most:
            text = (
                f"true objects go at {say(speed, 'm/s')}, and a new track's speed is at most {say(most, 'm/s')} even at "
                "five standard deviations"
            )
            yield Finding("birth", text, "a standard deviation of half the largest speed")


def strange_pace(it: Situation) -> Iterator[Finding]:
    """Find returns that follow one another as a target's do, and move as a new track would hardly believe."""
    for seen, _, _ in _started(it):
        count, strange = strange_paces(it.experiment.tracker, seen)
        if 2 * len(strange) > count:
            pace = say(float(f"{np.median(np.linalg.norm(strange, axis=-1)):.2g}"), "m/s")
            text = (
                f"of {count} rows of returns of {seen.name!r} that move steadily, as a target's do, {len(strange)} move, at "
                f"some {pace}, in a way that is beyond {BEYOND:g} standard deviations of a new track's velocity"
            )
            yield Finding("birth", text, "a standard deviation of half the largest speed, around 0")


def fast_prior(it: Situation) -> Iterator[Finding]:
    """Find new tracks that may cross the whole view, or turn around, from one scan to the next."""
    for seen, _, sigma in _started(it):
        dt = seen.dt or 0.0
        for axis, each in zip(it.state.axes, sigma, strict=True):
            far = float(each) * dt
            if axis.unit == "m/s" and seen.far is not None and far > 0.5 * seen.far:
                text = (
                    f"a new track's {axis.name}, {say(float(each), 'm/s')}, takes it {say(far, 'm')} far within a scan "
                    f"interval of {say(dt, 's')}, and {seen.name!r} sees no farther than {say(seen.far, 'm')}"
                )
                yield Finding("birth", text, "a small part of the view")
            if axis.unit == "rad/s" and each * dt > 0.5 * np.pi:
                text = (
                    f"a new track's {axis.name} turns it by {np.degrees(each * dt):.3g} deg within a scan interval of "
                    f"{say(dt, 's')}"
                )
                yield Finding("birth", text, "at most some 30 deg")
        speed = it.true_speed()
        fast = [i for i, axis in enumerate(it.state.axes) if axis.unit == "m/s"]
        if speed is not None and speed > 0 and fast and np.min(sigma[fast]) > 30 * speed:
            text = f"a new track may go at {say(float(np.min(sigma[fast])), 'm/s')}, and true objects at {say(speed, 'm/s')}"
            yield Finding("birth", text, "a standard deviation of half the largest speed")


def wide_prior(it: Situation) -> Iterator[Finding]:
    """Find new tracks that may be beyond all that the sensor sees."""
    for seen, _, _ in _started(it):
        assert seen.settled is not None
        wide = deviation(seen.settled.start.cov[0], positions(it.state))
        if seen.far is not None and wide > seen.far:
            text = f"a new track's position is known to {say(wide, 'm')}, and {seen.name!r} sees {say(seen.far, 'm')} far"
            yield Finding("birth", text, "a part of the view")


def frozen_prior(it: Situation) -> Iterator[Finding]:
    """Find a velocity that is exactly 0 at the start, as if that were known."""
    fixed = it.experiment.tracker.estimator.zero_variance
    for _, mean, sigma in _started(it):
        for axis, x, each in zip(it.state.axes, mean, sigma, strict=True):
            if each == 0 and x == 0 and axis.unit in ("m/s", "rad/s") and axis not in fixed.axes:
                text = f"a new track's {axis.name} is exactly 0, as if that were known"
                yield Finding("birth", text, "its standard deviation among targets")


def held_axes(it: Situation) -> Iterator[Finding]:
    """Find axes that a birth is unsure of and a sensor sees, but the motion holds."""
    for said in held(it.experiment.tracker):
        yield Finding("birth", said, "a deviation of 0, or a motion that lets it change")


def unobserved(it: Situation) -> Iterator[Finding]:
    """Find positions that move and that no sensor observes, as heights over ranges and bearings of the plane."""
    observed = {name for seen in it.sensors for name in seen.sensor.observes.names}
    for i, axis in enumerate(it.state.axes):
        if axis.unit != "m" or f"v{axis.name}" not in it.state or axis.name in observed:
            continue
        variances = [
            (seen.settled.start.cov[0, i, i], seen.settled.updated[-1][i, i]) for seen in it.sensors if seen.settled
        ]
        if variances and all(last > first for first, last in variances):
            first, last = (say(float(f"{np.sqrt(each):.2g}"), "m") for each in variances[0])
            text = f"none observes {axis.name}: its error grows from {first} to {last} in {SCANS} scans"
            yield Finding("sensors", text, f"one that observes {axis.name}, or a motion without it")


def no_start(it: Situation) -> Iterator[Finding]:
    """Find births that say where undetected targets are, and of all returns there are start a track at none."""
    tracker, rng = it.experiment.tracker, np.random.default_rng(0)
    birth, estimator, p_gate = tracker.birth, tracker.estimator, tracker.gate.probability
    if birth is None or not birth.models_unseen:
        return
    for seen in it.sensors:
        z = seen.came.returns[np.isfinite(seen.came.returns).all(axis=-1)][:MOST_RETURNS]
        if seen.name not in tracker.starters or not len(z):
            continue
        sensor = seen.sensor.placed(seen.came.pose)
        memory = birth.predict(birth.initial_memory(estimator, rng), estimator, seen.dt or 0.0, rng)
        density, found = birth.reveal(memory, estimator, sensor, Detections.of(z), p_gate)
        begun = birth.begin(found, estimator, sensor, seen.name, Detections.of(z), np.zeros(len(z)))
        if density is not None and not len(begun.returns):
            text = f"of {len(z)} returns of {seen.name!r} none may start a track: none lies where targets are said to appear"
            usual = f"places narrow against their distance, if {estimator.kind!r} linearises the sensor there, or 'uniform'"
            yield Finding("birth", text, usual)


def short_life(it: Situation) -> Iterator[Finding]:
    """Find targets that are gone before the next scan, and times that end a track almost at once."""
    tracker = it.experiment.tracker
    known = [seen.dt for seen in it.sensors if seen.dt is not None]
    if not known:
        return
    dt = min(known)
    survives = float(tracker.lifecycle.predict(np.ones(1), dt)[0])
    if survives < LEAST_SURVIVAL:
        text = f"of all targets {100 * (1 - survives):.3g} % leave within one scan interval of {say(dt, 's')}"
        yield Finding("lifecycle", text, "a lifetime of 50 scans or more")
    times = in_seconds(tracker.lifecycle)
    for name, value in times.items():
        if value < 2 * dt and survives >= LEAST_SURVIVAL:
            text = f"{say(value, 's')} are fewer than two scan intervals of {say(dt, 's')}: a track ends almost at once"
            yield Finding(f"lifecycle.{name}", text, "5 scans or more")
    for name, value in in_seconds(tracker.birth).items() if tracker.birth is not None else ():
        if value < 2 * dt:
            text = f"{say(value, 's')} are fewer than two scan intervals of {say(dt, 's')}: unseen targets are gone before"
            yield Finding(f"birth.{name}", text, "50 scans or more")
        elif name in times and not 0.1 < value / times[name] < 10:
            text = f"a target stays {say(value, 's')} while it is unseen and {say(times[name], 's')} once it has a track"
            yield Finding(f"birth.{name}", text, "the same as the lifecycle's")


def confirmation(it: Situation) -> Iterator[Finding]:
    """Find false returns that become tracks, and targets that do not or are lost."""
    for seen in it.sensors:
        if seen.lives is None:
            continue
        lives, dt = seen.lives, seen.dt or 0.0
        starts = _false_starts(seen)
        if lives.false > FALSE_SHARE and starts is not None and 100 * starts * lives.false > FALSE_TRACKS:
            text = (
                f"of tracks that start at a false return {100 * lives.false:.3g} % are confirmed: in 100 scans with "
                f"{starts:.3g} false returns each, {100 * starts * lives.false:.4g} false tracks"
            )
            yield Finding("lifecycle", text, "below 1 false track in 100 scans")
        if lives.confirmed < 0.5:
            text = (
                f"of tracks that start at a target {100 * lives.confirmed:.3g} % are ever confirmed, with scans "
                f"{say(dt, 's')} apart and a detection probability of {seen.settled.detects if seen.settled else 0:.3g}"
            )
            yield Finding("lifecycle", text, "more than 90 %")
        elif lives.kept < 0.5:
            lost, time = 100 * (1 - lives.kept), say(LOOKS * dt, "s")
            text = f"of targets with a confirmed track {lost:.3g} % lose it within {LOOKS} scans, {time}"
            yield Finding("lifecycle", text, "below 5 %")


def rehearsal(it: Situation) -> Iterator[Finding]:
    """Find births whose tracks are never confirmed, and tracks that their targets lose, often or by another's silence."""
    recording = it.opened.recording
    if recording is None or isinstance(recording.scans, LazyScans) or any(seen.lives is not None for seen in it.sensors):
        return
    for play in (rehearsed, silenced):
        for place, text, better in play(it.experiment.tracker, recording.scans):
            yield Finding(place, text, better)


def _false_starts(seen: Seen) -> float | None:
    """Return the number of false returns a scan: in the view, if that ends, or where returns come from."""
    if seen.boxed is not None and seen.stated is not None:
        return min(seen.boxed * seen.stated, seen.came.per_scan or 0.0)
    plane = [axis.unit for axis in seen.sensor.measurement.axes] == ["m", "m"]
    if seen.far is not None and plane and seen.settled is not None:
        return float(np.pi * seen.far**2 * seen.settled.density)
    return None


def judge_against_errors(it: Situation) -> Iterator[Finding]:
    """Find a judge that asks for more than the estimates can be, or to whom all objects are one."""
    judge, where = it.experiment.judge, positions(it.state)
    errors = [
        deviation(seen.settled.updated[-1], where)
        for seen in it.sensors
        if seen.settled is not None
        and inverts(seen.sensor, seen.settled.measured)  # others need a manoeuvre, which is not run
    ]
    if not errors or not where or it.opened.recording is None or not it.opened.recording.truth:
        return
    best, width = min(errors), extent(it.opened.recording.truth)
    for name, value in (("cover_radius", judge.cover_radius), ("gospa_cutoff", judge.gospa_cutoff)):
        if value < best:
            text = (
                f"{say(value, 'm')} are less than one standard deviation, {say(best, 'm')}, of a track after {SCANS} scans"
            )
            yield Finding(f"judge.{name}", text, "3 to 10 standard deviations")
        elif value > max(WHOLE * width, MANY * best):
            text = f"{say(value, 'm')} reach over most of the {say(float(f'{width:.2g}'), 'm')} in which true objects are"
            yield Finding(f"judge.{name}", text, f"3 to 10 standard deviations, each {say(float(f'{best:.2g}'), 'm')}")


RULES = (
    slow_prior, strange_pace, fast_prior, wide_prior, frozen_prior, held_axes, unobserved, no_start, short_life,
    confirmation, rehearsal, judge_against_errors,
)  # fmt: skip
