"""Which parameter of a tracker is likely wrong, and by how much: what truth and innovations say of it, in words."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array, Gaussian, Tracker, VedetteError
from vedette_report.detector_errors.off_truth import Returns, beside
from vedette_report.noises import sized
from vedette_report.whole_trackers.covariances import modes_verdict
from vedette_report.whole_trackers.culprits.drawn import LEAST, stated, told
from vedette_report.whole_trackers.culprits.estimators import own_innovations, too_few_points
from vedette_report.whole_trackers.culprits.search import culprits
from vedette_report.whole_trackers.culprits.worlds import Knob, knobs_of
from vedette_report.whole_trackers.runs import Runs, play
from vedette_report.whole_trackers.verdicts import lost_runs
from vedette_report.whole_trackers.world import World

SHAPES = {
    "distance": "errors of {} change with the distance of the target: R should say so",
    "tails": "errors of {} have heavy tails: many are far larger than R says",
    "lag": "errors of {} are correlated in time, by {:.2g} from one to the next: a bias that drifts is among them",
}
"""Errors of a sensor that no R describes."""
MANOEUVRES = {
    "tails": "the target manoeuvres: what moves it is mostly small, and at times far larger",
    "lag": "the target's motion is another: what moves it goes on, by {1:.2g} a scan, as in a turn; a larger Q may do",
}
"""Motion that no Q describes."""
CHAIN = ("transition", "interval", "rates")


def likely_cause(
    played: Runs, wrong: set[str], tracker: Tracker, world: World, prior: Gaussian, runs: int, seed: int,
    usual: Array | None = None,
) -> str:  # fmt: skip
    """Say which parameter is likely wrong, and by how much, from the names of the verdicts that are `wrong`."""
    if wrong & {"hits", "false returns"}:
        return "the detection probability or clutter density above; judge Q and R when these are right"
    if "lost" in wrong and (len(wrong) == 1 or lost_runs(played).mean() > 0.5):
        return "that it loses its targets: too much clutter for the associator, or far too small a Q; judge it in less"
    times = np.concatenate([[0.0], played.times])
    if own := own_innovations(played, wrong):
        return own
    if usual is not None and _by_transition(played, tracker, world, prior, times, runs, seed, usual):
        return "the chain by which the modes switch: with the world's own the mode probabilities are right"
    if off := _off_truth(played):
        return off
    if "bias" in wrong:
        return f"a bias{_shift(played)}: `move`, `measure` or the start, before Q and R"
    said, right, motion = by_truth(played, prior)
    if said:
        return ", ".join(said) + (f"; not {', '.join(right)}" if right else "")
    if few := too_few_points(played, tracker, world, prior, times, runs, seed):
        return few
    try:
        found = culprits(tracker, world, prior, times, runs, seed)
    except (VedetteError, ValueError, TypeError, np.linalg.LinAlgError):  # the models cannot be made noisier
        return ""
    if not found.explained:
        return "neither Q nor R alone: no factors of theirs explain innovations and errors"
    parts = [text for part in zip(found.knobs, found.turns, found.errors, strict=True) if (text := _sized(*part, world))]
    if not parts:
        return f"none of Q, R and the start that {runs} runs tell: what is wrong is within chance; more runs may tell"
    whose = "what the estimator makes of its models, not what they state: " if motion else ""
    names = {knob.name for knob in found.knobs}
    rest = [
        knob.name for knob in knobs_of(world) if knob.name not in names and len(knob.axes) < 2 and knob.sensor != "start"
    ]
    return whose + ", ".join(parts) + (f"; not {', '.join(rest)}" if rest else "")


def by_truth(played: Runs, prior: Gaussian) -> tuple[list[str], list[str], bool]:
    """Say what is wrong of the noises that the tracker states, which are right, and whether Q is among those asked."""
    said, right, motion = list[str](), list[str](), False
    for one in stated(played, prior):
        wrong, cleared = told(one)
        words = SHAPES if one.sensor else MANOEUVRES
        shapes = {kind: found for kind, found in one.shapes().items() if kind in words} if one.u.shape[1] > 1 else {}
        kind = max(shapes, key=lambda kind: shapes[kind][2], default="")
        motion |= one.name == "Q"
        if kind and shapes[kind][2] > 1:
            said.append(words[kind].format(one.sensor, shapes[kind][0]))
            wrong, cleared = [] if words is MANOEUVRES and kind == "lag" else wrong, []
        said += wrong
        right += cleared if one.name != "the covariance of the start" else []
    return said, right, motion


def _off_truth(played: Runs) -> str:
    """Say of which sensors returns lie beside the truth or are late; "" if none do. Runs are independent, scans are not."""
    found_of, axes, truth = [], played.tracker.state, played.truth[:, 1:]
    for name, looks in played.looks.items():
        sensor = played.tracker.sensors[name]
        rates = np.empty(looks.real.shape)
        for k in range(len(played.times)):
            before, after = max(k - 1, 0), min(k + 1, len(played.times) - 1)
            step = played.times[after] - played.times[before]
            rates[:, k] = sensor.measurement.difference(looks.real[:, after], looks.real[:, before]) / step
        R = sensor.noise(truth[..., axes.locate(sensor.observes)])
        noise = np.broadcast_to(R, (*looks.seen.shape, *R.shape[-2:]))[looks.seen]
        seen = Returns(looks.apart[looks.seen], rates[looks.seen], noise, np.nonzero(looks.seen)[0])
        if found := beside(name, sensor.measurement, seen):
            kinds = ["a bias"] * bool(np.isfinite(found.bias).any()) + ["wrong times"] * bool(np.isfinite(found.lag))
            found_of.append(f"{(' or ' if found.either else ' and ').join(kinds)}: returns of {name} lie {found.said}")
    return "; ".join(found_of) + ": mend `measure` or times before Q and R" * bool(found_of)


def _by_transition(
    played: Runs, tracker: Tracker, world: World, prior: Gaussian, times: Array, runs: int, seed: int, usual: Array
) -> bool:
    """Return whether the tracker's mode probabilities are wrong, and right once its modes switch as the world's do."""
    if played.surprise is None or modes_verdict(played.surprise, usual, 3e-3).inside:
        return False
    own = {name: getattr(world.estimator, name) for name in CHAIN if hasattr(world.estimator, name)}
    try:
        switched = evolve(tracker, estimator=evolve(tracker.estimator, **own))  # type: ignore[misc]
        surprise = play(switched, prior, times, runs, np.random.default_rng(seed), world).surprise
    except (VedetteError, ValueError, TypeError):
        return False
    return surprise is not None and modes_verdict(surprise, usual, 3e-3).inside


def _sized(knob: Knob, turn: float, error: float, world: World) -> str:
    """Say by how much a noise of the tracker is off, "" if by nothing that counts: the world's is right if so turned."""
    if len(knob.axes) == 2:
        if abs(turn) <= max(4 * error, 0.05):
            return ""
        sensor = world.sensors[knob.sensor]
        assert world.start is not None
        R = sensor.noise(world.start.mean[world.estimator.state.locate(sensor.observes)])
        i, j = knob.axes
        real = float(R[..., i, j] / np.sqrt(R[..., i, i] * R[..., j, j]))
        return f"{knob.name} is correlated by {real:.2g}, not by {real + turn:.2g} +- {error:.1g}"
    return sized(knob.name, 1.0 / (1.0 + turn), error / (1.0 + turn) ** 2, LEAST)


def _shift(played: Runs) -> str:
    """Say when and along which measured axis innovations are shifted most, if any are plainly."""
    most, text = 6.0, ""
    for name, looks in played.looks.items():
        u = np.where(looks.seen[..., None], looks.residual / np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1)), 0.0)
        mean, error = u.mean(axis=0), u.std(axis=0, ddof=1) / np.sqrt(len(u))
        k, i = np.unravel_index(int(np.argmax(np.abs(mean) / np.maximum(error, 1e-300))), mean.shape)
        if abs(mean[k, i]) > most * error[k, i]:
            most, axis = abs(mean[k, i]) / error[k, i], played.tracker.sensors[name].measurement.names[i]
            text = f", innovations of {name} are {mean[k, i]:+.2g} deviations off along {axis} at {played.times[k]:g} s"
    return text
