"""Rules on motion and modes: process noise against measurement noise, scan interval and speed; switching against scans."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from vedette import Array, Axis, Estimator, MotionModel
from vedette.tracking import parts
from vedette.units import say
from vedette_files import Terms
from vedette_tools.explaining.finding import Finding
from vedette_tools.explaining.manoeuvres import Manoeuvre, strongest
from vedette_tools.explaining.parameters import square
from vedette_tools.explaining.situation import Seen, Situation
from vedette_tools.explaining.steady_state import inverts

LOUD, QUIET_SCANS = 10.0, 300
LAG = 3.0
"""Standard deviations of its own innovations by which a filter may lag: a gate that keeps 99 % reaches as far."""
LEAST_STAY, MOST_STAY = 2.0, 1e4
NEVER = 1e11  # scans
FEWEST, UNEVEN = 10, 3.0
"""Gaps between scans from which on they are said to be uneven, and the ratio of a long one to a short one. By hand."""
HALF_PI = 0.5 * np.pi


def loud_motion(it: Situation) -> Iterator[Finding]:
    """Find process noise of one scan interval that is far larger than the sensor's: predictions say nothing."""
    for place, motion, seen in _settled(it):
        ratio, axis = _noise_ratio(it, motion, seen, seen.dt or 0.0)
        if ratio > LOUD:
            text = (
                f"within a scan interval of {say(seen.dt or 0.0, 's')} the process noise moves {axis.name} by {ratio:.3g} "
                f"standard deviations of sensor {seen.name!r}: a prediction says next to nothing, and every gate is wide"
            )
            yield Finding(place, text, "about 1, or less")


def quiet_motion(it: Situation) -> Iterator[Finding]:
    """Find process noise that is not felt within QUIET_SCANS scans: the filter comes to believe itself alone."""
    for seen in it.sensors:
        long = QUIET_SCANS * (seen.dt or 0.0)
        noisy = {place: _noise_ratio(it, motion, seen, long)[0] for place, motion, other in _settled(it) if other is seen}
        if noisy and max(noisy.values()) < 1.0:
            text = (
                f"in {QUIET_SCANS:,} scans, {say(long, 's')}, the process noise moves a target by {max(noisy.values()):.2g} "
                f"standard deviations of sensor {seen.name!r}: the filter soon stops learning, and loses a target that turns"
            )
            yield Finding(next(iter(noisy)), text, "at least 1, reached within some 10 to 100 scans")


def slow_to_turn(it: Situation) -> Iterator[Finding]:
    """Find manoeuvres of the truth that a settled filter does not follow with any sensor: its gate loses the target."""
    truth = () if it.opened.recording is None else it.opened.recording.truth
    looking = [seen for seen in it.sensors if seen.dt]
    if not truth or not looking or not it.motions:
        return
    dt = 1.0 / sum(1.0 / (seen.dt or np.inf) for seen in looking)  # as if all saw it by turns
    turns: list[tuple[Seen, float, Manoeuvre]] = []
    for seen in looking:
        if seen.settled is None or not inverts(seen.sensor, seen.settled.measured):
            continue
        reach = float(np.sqrt(it.experiment.tracker.gate.for_sensor(seen.sensor).threshold))
        turn = strongest(it.experiment, seen.sensor, seen.came.pose, dt, seen.settled, truth)
        if turn is None or turn.lag <= max(LAG, reach if np.isfinite(reach) else 0.0):
            return
        turns.append((seen, reach, turn))
    if turns:
        seen, reach, turn = min(turns, key=lambda each: each[2].lag)
        when = Terms.of(it.opened.recording.notes if it.opened.recording is not None else {}).when
        most = f"the gate, which reaches {reach:.2g}, loses the target" if np.isfinite(reach) else "no gate would keep it"
        text = (
            f"true object {turn.name!r} accelerates by {say(_short(turn.acceleration), 'm/s^2')}, in speed or course, "
            f"{say(_short(turn.acceleration * dt), 'm/s')} in a scan interval{_allowed(it, seen, dt)}: the predictions of a "
            f"settled track of sensor {seen.name!r} lag by {say(_short(turn.off), 'm')} at {when(turn.time)}, "
            f"{turn.lag:.2g} of their own standard deviations, scans in a row, and {most}"
        )
        yield Finding(it.motions[0][0] if len(it.motions) == 1 else "estimator", text, f"below {LAG:g} standard deviations")


def _allowed(it: Situation, seen: Seen, dt: float) -> str:
    """Return in words how much speed the process noise of the only motion model allows for in `dt` s."""
    motion = it.motions[0][1]
    fast = [i for i, axis in enumerate(motion.state.axes) if axis.unit == "m/s"] if len(it.motions) == 1 else []
    x = _at(it, motion, seen) if fast else None
    if x is None:
        return ""
    allowed = float(np.sqrt(np.max(np.diag(motion.noise(x, dt))[fast])))
    return f", and the process noise allows for {say(_short(allowed), 'm/s')} (standard deviation)"


def _short(value: float) -> float:
    """Return a value to two digits."""
    return float(f"{value:.2g}")


def noise_against_speed(it: Situation) -> Iterator[Finding]:
    """Find speeds that may change in one scan by more than they may be at all."""
    for place, motion, seen in _settled(it):
        start, dt = seen.settled.start if seen.settled else None, seen.dt or 0.0
        x = _at(it, motion, seen)
        for i, axis in enumerate(motion.state.axes):
            if start is None or x is None or axis.unit != "m/s" or axis not in it.state.axes:
                continue
            j = it.state.axes.index(axis)
            speed = max(abs(start.mean[0, j]), np.sqrt(start.cov[0, j, j]), _speed(it, seen))
            change = float(np.sqrt(motion.noise(x, dt)[i, i]))
            if speed > 0 and change > 3.0 * speed:
                text = (
                    f"the process noise changes {axis.name} by {say(change, 'm/s')} within {say(dt, 's')}, a scan interval, "
                    f"and a new track's is {say(float(speed), 'm/s')} at most to one standard deviation"
                )
                yield Finding(place, text, "a fraction of the speed per scan")


def wild_turns(it: Situation) -> Iterator[Finding]:
    """Find noise of the turn rate that makes the course random within a scan."""
    for place, motion, seen in _settled(it):
        x, dt = _at(it, motion, seen), seen.dt or 0.0
        for i, axis in enumerate(motion.state.axes):
            if x is None or axis.unit != "rad/s":
                continue
            turned = float(np.sqrt(motion.noise(x, dt)[i, i])) * dt
            if turned > HALF_PI:
                text = (
                    f"the process noise of {axis.name} turns the course by {np.degrees(turned):.3g} deg within a scan "
                    f"interval of {say(dt, 's')}: it is random from scan to scan"
                )
                yield Finding(place, text, "a few degrees per scan")


def modes_alike(it: Situation) -> Iterator[Finding]:
    """Find two modes that predict the same: no return tells them apart, and their probabilities mean nothing."""
    for place, modes in _mixtures(it):
        for seen in it.sensors:
            for (i, one), (j, other) in combinations(enumerate(modes), 2):
                if seen.settled is not None and seen.dt is not None and _alike(it, one, other, seen, seen.dt):
                    text = (
                        f"predicts what {place}.modes[{i}] predicts: over {say(seen.dt, 's')} their means are the same and "
                        "their standard deviations differ by less than 10 %, so no return tells the two apart"
                    )
                    yield Finding(f"{place}.modes[{j}]", text, "process noises that differ by a factor of 3 to 30")


def switching(it: Situation) -> Iterator[Finding]:
    """Find modes that are left before a scan can show them, and modes that are never left."""
    known = [seen.dt for seen in it.sensors if seen.dt is not None]
    dt = min(known) if known else None
    for place, estimator in parts(it.experiment.tracker.estimator, "estimator"):
        interval = getattr(estimator, "interval", None)
        for name, matrix in _transitions(estimator):
            scale = 1.0 if interval is None or dt is None else interval / dt
            yield from _stays(f"{place}.{name}", scale / np.maximum(1.0 - np.diag(matrix), 1e-12), dt)
        for name, matrix in square(estimator, "1/s").items():
            if dt is not None:
                yield from _stays(f"{place}.{name}", 1.0 / np.maximum(-np.diag(matrix) * dt, 1e-12), dt)


def uneven_switching(it: Situation) -> Iterator[Finding]:
    """Find modes that switch at each scan where scans come at uneven times, as those of several sensors do."""
    gaps = np.diff(sorted({scan.time for seen in it.sensors for scan in seen.came.scans}))
    short, long = np.quantile(gaps, (0.1, 0.9)) if len(gaps) >= FEWEST else (1.0, 1.0)
    if long < UNEVEN * short:
        return
    for place, estimator in parts(it.experiment.tracker.estimator, "estimator"):
        if not isinstance(estimator, Estimator) or not estimator.traits.per_scan:
            continue
        for name, matrix in _transitions(estimator):
            text = (
                f"holds from one scan to the next, and those of all sensors come {say(_short(short), 's')} to "
                f"{say(_short(long), 's')} apart: modes switch {long / short:.2g} times as often where scans are dense"
            )
            if np.any(matrix != np.eye(len(matrix))):
                yield Finding(f"{place}.{name}", text, "the same with `interval`, the s that it is meant for, or `rates`")


def _transitions(part: object) -> Iterator[tuple[str, Array]]:
    """Yield the name and the matrix of each parameter that holds probabilities of the next mode."""
    for name, matrix in square(part, "1").items():
        if np.allclose(matrix.sum(axis=1), 1.0) and not np.any(matrix < 0):
            yield name, matrix


def _stays(place: str, scans: Array, dt: float | None) -> Iterator[Finding]:
    if np.all(scans >= NEVER):  # modes that never switch are on purpose: which one of several models a target is
        return
    for i, stay in enumerate(scans):
        time = "" if dt is None else f", {say(float(stay) * dt, 's')},"
        if stay < LEAST_STAY:
            text = f"mode {i} lasts {stay:.3g} scans{time} on average: it is over before a scan can show it"
            yield Finding(place, text, "5 to 100 scans")
        elif stay > MOST_STAY:
            text = f"mode {i}, once it holds, lasts {stay:.3g} scans{time} on average: it is as good as never left"
            yield Finding(place, text if stay < NEVER else f"mode {i}, once it holds, is never left", "5 to 100 scans")


def _mixtures(it: Situation) -> Iterator[tuple[str, list[MotionModel]]]:
    """Yield each estimator with several others as its `modes`, and their motion models, if each has one."""
    for place, estimator in parts(it.experiment.tracker.estimator, "estimator"):
        modes = getattr(estimator, "modes", None)
        if isinstance(estimator, Estimator) and isinstance(modes, tuple) and len(modes) > 1:
            motions = [getattr(mode, "motion", None) for mode in modes]
            if all(isinstance(motion, MotionModel) for motion in motions):
                yield place, motions  # type: ignore[misc]


def _alike(it: Situation, one: MotionModel, other: MotionModel, seen: Seen, dt: float) -> bool:
    x, y = _at(it, one, seen), _at(it, other, seen)
    if one.reframes or other.reframes:  # each predicts in a frame of its own
        return False
    if x is None or y is None or set(one.state.names) != set(other.state.names):
        return False
    order = other.state.locate(one.state)
    a, b = one.noise(x, dt), other.noise(y, dt)[np.ix_(order, order)]
    moved = one.state.difference(one.move(x, dt), other.move(y, dt)[order])
    free = np.diag(a) + np.diag(b) > 0
    ratio = np.sqrt((np.diag(a)[free] + 1e-300) / (np.diag(b)[free] + 1e-300))
    return bool(np.all(np.abs(np.log(ratio)) < 0.1) and np.all(moved**2 <= 0.01 * (np.diag(a) + 1e-12)))


def _settled(it: Situation) -> Iterator[tuple[str, MotionModel, Seen]]:
    """Yield each motion model with each sensor whose scan interval and track are known."""
    for place, motion in it.motions:
        for seen in it.sensors:
            if seen.settled is not None and seen.dt is not None:
                yield place, motion, seen


def _at(it: Situation, motion: MotionModel, seen: Seen) -> Array | None:
    """Return a state of this model as it is after the first scans of a track, or None if the estimates lack an axis."""
    if seen.settled is None or any(axis not in it.state.axes for axis in motion.state.axes):
        return None
    return seen.settled.start.mean[0, it.state.locate(motion.state)]


def _speed(it: Situation, seen: Seen) -> float:
    """Return the speed that is known of targets, in m/s: of a new track by its standard deviations, of true ones."""
    assert seen.settled is not None
    fast = [i for i, axis in enumerate(it.state.axes) if axis.unit == "m/s"]
    return max(float(np.max(np.sqrt(np.diag(seen.settled.start.cov[0]))[fast], initial=0.0)), it.true_speed() or 0.0)


def _noise_ratio(it: Situation, motion: MotionModel, seen: Seen, dt: float) -> tuple[float, Axis]:
    """Return the process noise of `dt` s over the measurement noise, on the measured axis where that is largest."""
    sensor = seen.sensor.placed(seen.came.pose)
    x, settled = _at(it, motion, seen), seen.settled
    assert settled is not None
    axes = [sensor.measurement.axes[at] for at in settled.has]
    if x is None:
        return 1.0, axes[0]
    Q = motion.noise(x, dt)
    observed = settled.start.mean[0, it.state.locate(sensor.observes)]
    H = sensor.jacobian(observed)
    wide = np.zeros((len(sensor.observes),) * 2)
    names = [(i, motion.state.names.index(name)) for i, name in enumerate(sensor.observes.names) if name in motion.state]
    for i, a in names:
        for j, b in names:
            wide[i, j] = Q[a, b]
    ratios = np.sqrt(np.diag(H @ wide @ H.T)[settled.has] / np.diag(settled.R))
    return float(np.max(ratios)), axes[int(np.argmax(ratios))]


RULES = (loud_motion, quiet_motion, slow_to_turn, noise_against_speed, wild_turns, modes_alike, switching, uneven_switching)
