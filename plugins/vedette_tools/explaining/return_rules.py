"""Rules on sensors, clutter and gate: what a scan brings, against what is stated of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from vedette import Array, ImagingSensor, Pose, Trajectory
from vedette.metrics import nees
from vedette.units import say
from vedette_standard import stands
from vedette_tools.explaining.finding import Finding
from vedette_tools.explaining.situation import Seen, Situation
from vedette_tools.explaining.steady_state import ball, ring

MOST_IN_NEW_GATE, MOST_IN_GATE = 3.0, 1.5
LEAST_GATE, LEAST_DETECTION = 0.8, 0.3
FACTOR = 10.0
RAREST = 1e-6
"""Fewer false returns in a scan are as good as none: by hand."""

LOOKS, DETECTS, SIGMAS = 100, 0.1, 5.0
"""Of so many looks at true objects a share of detections is told that is off by so much, and so many deviations: by hand."""
NEAR, CROWDED = 25.0, 0.1
"""A return so near to a true object, in squared deviations, is its own, where fewer false ones lie there: by hand."""


def odd_input(it: Situation) -> Iterator[Finding]:
    """Find what the source says of its values, and a source that refuses most of its rows."""
    recording = it.opened.recording
    if recording is None:
        return
    refused, used = (sum(getattr(rows, part) for rows in recording.rows.values()) for part in ("refused", "used"))
    if recording.refused and refused > used:
        text = f"refuses {refused:,} rows and uses {used:,}; the first that it refuses: {recording.refused[0]}"
        yield Finding("source", text, "none refused")
    for said in recording.warnings:
        yield Finding("source", said, "values within their range")


def crowded_gate(it: Situation) -> Iterator[Finding]:
    """Find more false returns in the gate of a track than its own."""
    for seen in it.sensors:
        if seen.settled is None or it.experiment.tracker.gate.clutter != "sensor":
            continue
        threshold = it.experiment.tracker.gate.for_sensor(seen.sensor).threshold
        if not math.isfinite(threshold):
            continue
        count = seen.settled.density * seen.settled.gate_volumes(threshold)
        if count[-1] > MOST_IN_GATE:
            text = (
                f"the clutter puts {count[-1]:.3g} false returns into the gate of a settled track in every scan: its own is "
                "one among them"
            )
            yield Finding(seen.place, text, "below 0.3")
        elif count[0] > MOST_IN_NEW_GATE:
            text = (
                f"the clutter puts {count[0]:.3g} false returns into the first gate of a new track (a settled one has "
                f"{count[-1]:.2g}): a narrower prior, or shorter scan intervals, would tell its own from them"
            )
            yield Finding("birth", text, "below 1")


def no_clutter(it: Situation) -> Iterator[Finding]:
    """Find existence judged against clutter where there is said to be none."""
    tracker = it.experiment.tracker
    for seen in it.sensors:
        judged = tracker.starters and not tracker.lifecycle.certain and tracker.gate.clutter == "sensor"
        none = seen.settled is not None and seen.settled.density == 0 and not seen.stated
        rate = seen.boxed * seen.stated if seen.boxed and seen.stated else np.inf
        if judged and (none or rate < RAREST):
            stated = "no clutter" if none else f"a false return in {1 / rate:.2g} scans where returns are"
            text = (
                f"states {stated}, and {tracker.lifecycle.kind} weighs each return against clutter: the first one proves "
                "that its track exists"
            )
            yield Finding(seen.place, text, "the number of false returns per scan, however rough")


def clutter_against_data(it: Situation) -> Iterator[Finding]:
    """Compare the stated clutter with the number of returns that come."""
    for seen in it.sensors:
        if seen.boxed is None or seen.stated is None or seen.came.per_scan is None:
            continue
        expected, came = seen.boxed * seen.stated, seen.came.per_scan
        recording = it.opened.recording
        targets = len(recording.truth) if recording is not None else 0
        if expected > FACTOR * (came + 1):
            text = f"states {expected:.3g} false returns a scan where returns are, and {came:.3g} come, targets included"
            yield Finding(seen.place, text, "no more than come")
        elif it.experiment.tracker.gate.clutter == "sensor" and came - targets > FACTOR * (expected + 1):
            beside = f" beside {targets} true objects" if targets else ""
            text = f"states {expected:.2g} false returns a scan where returns are, and {came:.3g} returns come{beside}"
            yield Finding(seen.place, text, "as many as come and are no target's")


def detection_against_truth(it: Situation) -> Iterator[Finding]:
    """Compare the stated detection probability with how often a return lies where a true object is measured."""
    recording = it.opened.recording
    for seen in it.sensors:
        looks = np.array([look for path in (recording.truth if recording else ()) for look in _looks(seen, path)])
        if len(looks) < LOOKS:
            continue
        stated, found = np.mean(looks, axis=0).tolist()
        if abs(found - stated) > max(DETECTS, SIGMAS * np.sqrt(found * (1.0 - found) / len(looks))):
            text = (
                f"states that {stated:.2g} of the looks at true objects detect them, and in {found:.2g} of {len(looks):,} a "
                f"return lies within {math.sqrt(NEAR):.0f} deviations"
            )
            yield Finding(seen.place, text, "the share that is found, if returns do not lie beside the truth")


def _looks(seen: Seen, path: Trajectory) -> Iterator[tuple[float, bool]]:
    """Yield of each scan how probably a return is to lie near where an object is measured, a false one too, and does."""
    sensor = seen.sensor
    if isinstance(sensor, ImagingSensor) or not set(sensor.observes.names) <= set(path.space.names):
        return
    for scan in seen.came.scans:
        x, z = path.at(scan.time), scan.detections.z[scan.detections.valid]
        if x is None or scan.detections.missing is not None or scan.detections.time is not None:
            continue
        placed, x = sensor.placed(scan.pose), x[path.space.locate(sensor.observes)]
        there, R = placed.measure(x), placed.noise(x)
        false = float(np.max(placed.clutter(there[None]))) * ball(len(there), NEAR) * math.sqrt(np.linalg.det(R))
        if false < CROWDED:
            p = float(placed.detects(x))
            near = nees(placed.measurement.difference(z, there), R) < NEAR
            yield p + (1.0 - p) * false, bool(np.any(near))


def rarely_detects(it: Situation) -> Iterator[Finding]:
    """Find sensors that miss nearly always, all of them."""
    best = [seen.settled.detects for seen in it.sensors if seen.settled is not None]
    for seen in it.sensors:
        if seen.settled is not None and 0 < seen.settled.detects < LEAST_DETECTION and max(best) == seen.settled.detects:
            text = f"detects a target with {seen.settled.detects:.3g} a scan: a hit among clutter is rarer than a miss"
            yield Finding(seen.place, text, "0.5 to 0.99")


def never_misses(it: Situation) -> Iterator[Finding]:
    """Find misses that are taken to be impossible, so that one ends or breaks a track that may end."""
    if it.experiment.tracker.lifecycle.permanent:
        return
    for seen in it.sensors:
        if seen.settled is not None and seen.settled.detects * it.experiment.tracker.gate.probability >= 1.0:
            text = (
                "with a gate of probability 1 and a detection probability of 1, a scan without a return of the target is "
                "impossible: the first miss proves that there is none"
            )
            yield Finding(seen.place, text, "a detection probability of 0.99 at most")


def out_of_view(it: Situation) -> Iterator[Finding]:
    """Find targets or returns where the sensor is said to detect nothing."""
    seen_at_all = any(seen.settled.detects > 0 for seen in it.sensors if seen.settled is not None)
    for seen in it.sensors:
        if isinstance(seen.sensor, ImagingSensor):
            continue
        reach = "" if seen.far is None else f", its reach being {say(seen.far, 'm')}"
        if seen.settled is not None and seen.settled.detects == 0 and not seen_at_all:
            yield Finding(seen.place, f"detects nothing where the first track starts{reach}", "tracks start in view")
            continue
        share = _out_of_reach(seen)
        if share > 0.2:
            text = f"{100 * share:.3g} % of its first returns lie where it is said to detect nothing{reach}"
            yield Finding(seen.place, text, "none")


def _out_of_reach(seen: Seen) -> float:
    """Return the share of returns at whose places nothing is detected."""
    out = []
    for z, pose in list(zip(seen.came.returns, seen.came.poses, strict=True))[:100]:
        sensor = seen.sensor.placed(pose)
        try:
            x: Array = sensor.invert(z[None]).mean
        except NotImplementedError:
            return 0.0
        out.append(float(np.max(sensor.detects(x))) == 0.0)
    return float(np.mean(out)) if len(out) >= 10 else 0.0


def long_reach(it: Situation) -> Iterator[Finding]:
    """Find a reach far beyond all returns, which spreads the clutter over places that no return comes from."""
    for seen in it.sensors:
        where = [i for i, axis in enumerate(seen.sensor.measurement.axes) if axis.unit == "m"]
        if seen.far is None or len(seen.came.returns) < 20 or not where:
            continue
        own = stands(seen.sensor)
        farthest = max(
            float(np.linalg.norm(z[where] - _from(own if pose is None else pose, len(where))))
            for z, pose in zip(seen.came.returns, seen.came.poses, strict=True)
        )
        if seen.far > 30 * farthest:
            text = f"reaches {say(seen.far, 'm')}, and no return comes from farther than {say(farthest, 'm')}"
            yield Finding(seen.place, text, "the range scale of the sensor")


def _from(pose: Pose | None, axes: int) -> Array | float:
    """Return the place that positions over so many axes are counted from; one axis is a range already."""
    return 0.0 if axes == 1 or pose is None else pose.position[:axes]


def coarse_sensor(it: Situation) -> Iterator[Finding]:
    """Find measurement errors as large as the view."""
    for seen in it.sensors:
        if isinstance(seen.sensor, ImagingSensor) or seen.settled is None:
            continue
        x = ring(seen.sensor, seen.far or 0.0) if seen.far else None
        has, m = seen.settled.has, len(seen.sensor.measurement)
        R = seen.settled.R if x is None else np.broadcast_to(seen.sensor.noise(x), (8, m, m))[0][np.ix_(has, has)]
        for at, variance in zip(has, np.diag(R), strict=True):
            axis, sigma = seen.sensor.measurement.axes[at], math.sqrt(variance)
            if axis.period is not None and sigma > axis.period / 18:
                text = (
                    f"errs in {axis.name} by {np.degrees(sigma):.3g} deg: the direction is hardly known. Is its unit right?"
                )
                yield Finding(seen.place, text, "0.1 to 5 deg")
            elif axis.unit == "m" and seen.far is not None and sigma > seen.far / 5:
                text = f"errs in {axis.name} by {say(sigma, 'm')} at its reach of {say(seen.far, 'm')}"
                yield Finding(seen.place, text, "below a hundredth of the view")


def gate_against_target(it: Situation) -> Iterator[Finding]:
    """Find a gate that leaves the target's own returns out."""
    gate, when = it.experiment.tracker.gate, " before its track is confirmed" if it.experiment.tracker.starters else ""
    if gate.probability < LEAST_GATE:
        text = f"leaves {100 * (1 - gate.probability):.3g} % of the target's own returns out, in every scan{when}"
        yield Finding("gate.probability", text, "0.99 to 0.9999")
    for seen in it.sensors:
        if gate.largest_distance is None or isinstance(seen.sensor, ImagingSensor):
            continue
        from scipy.special import gammainc

        m = len(seen.sensor.measurement)
        within = float(gammainc(m / 2, gate.largest_distance / 2))
        if within < gate.probability - 0.05:
            text = (
                f"{gate.largest_distance:g} keeps {100 * within:.3g} % of a target's returns of {m} axes, and "
                f"gate.probability promises {100 * gate.probability:.4g} %: a miss counts for more than it is"
            )
            yield Finding("gate.largest_distance", text, "beyond the gate's own limit")


def open_gate(it: Situation) -> Iterator[Finding]:
    """Find tracks without a gate that weigh every return of a crowded scan."""
    gate = it.experiment.tracker.gate
    for seen in it.sensors:
        crowd = seen.came.per_scan or 0.0
        if (
            gate.probability == 1
            and gate.largest_distance is None
            and crowd > 50
            and not isinstance(seen.sensor, ImagingSensor)
        ):
            text = f"is off, and {crowd:.4g} returns come in a scan of {seen.name!r}: every track weighs all of them"
            yield Finding("gate", text, "a probability of 0.9999, or a largest_distance of 30")


RULES = (
    odd_input, crowded_gate, no_clutter, clutter_against_data, detection_against_truth, rarely_detects, never_misses,
    out_of_view, long_reach, coarse_sensor, gate_against_target, open_gate,
)  # fmt: skip
