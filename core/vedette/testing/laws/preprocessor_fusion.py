"""Laws of preprocessors that make positions of several sensors' returns."""

from __future__ import annotations

import numpy as np

from vedette.config.parameters import parameters
from vedette.metrics.consistency import nees
from vedette.sampling import returns
from vedette.space import Array
from vedette.supporting import Preprocessor
from vedette.testing.bands import judge_run_means
from vedette.testing.comparisons import Closed, Lacking, Unlike, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.preprocessor_cases import Raw, exactly, made_of, scan_of
from vedette.types import Detections, Scan


def others_far_away_change_nothing(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it makes positions: what one sensor sees far away, on any side, changes no return here."""
    exact = exactly(preprocessor, drawn, several=True)
    axes = [i for i in exact.where if next(iter(preprocessor.sensors.values())).observes.axes[i].unit == "m"]
    if not len(exact.made.z) or not axes or len(np.unique(exact.made.z, axis=0)) < len(exact.made.z):
        raise Closed("it makes no return in m, or several at one place")
    beyond = np.repeat(exact.states[:1], 2 * len(axes), axis=0)
    beyond[range(len(beyond)), 2 * axes] += 3e5 * np.repeat([1.0, -1.0], len(axes))
    for name, sensor in preprocessor.sensors.items():
        z = np.concatenate([exact.scans[name].detections.z, sensor.measure(beyond)])
        more = made_of(preprocessor, exact.scans | {name: scan_of(name, z, len(z))})
        near = [int(np.argmin(np.linalg.norm(more.z - one, axis=-1))) for one in exact.made.z] if len(more.z) else []
        same(f"returns, with others of {name!r} far away", more.z[near], exact.made.z, 1e-9)
        for what in ("noise", "evidence"):
            if (before := getattr(exact.made, what)) is not None:
                same(f"{what}, with returns of {name!r} far away", getattr(more, what)[near], before, 1e-9)


def sensors_confirm_within_the_threshold(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it fuses sensors and has `threshold` in m: returns nearer than that make one, and those farther apart none."""
    units = {parameter.name: parameter.unit for parameter in parameters(type(preprocessor))}
    exact, limit = exactly(preprocessor, drawn, several=True), getattr(preprocessor, "threshold", 0.0)
    closed_if(len(preprocessor.sensors) < 2, Unlike("it does not fuse sensors"))
    closed_if(units.get("threshold") != "m", Lacking("threshold", "it has no `threshold` in m"))
    for share, wanted in ((0.9, 1), (1.1, 0)):
        scans = {}
        for number, (name, sensor) in enumerate(preprocessor.sensors.items()):
            x = exact.states[:1].copy()
            x[0, exact.where[0]] += share * limit * (number if share > 1 else number > 0)
            scans[name] = scan_of(name, sensor.measure(x), 1)
        made = len(made_of(preprocessor, scans).z)
        told = f"returns: of those {share} times the threshold of {limit:g} m apart, {made} are made, must be {wanted}"
        demand(made == wanted, told)


def evidence_is_a_likelihood_ratio(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it fuses sensors and gives evidence: exp(-evidence) of targets' returns is 1 on average.

    E exp(-log p(e | target) / p(e | clutter)) = 1, whatever is told of a return; half and twice that are allowed.
    """
    found = _of_targets(preprocessor, drawn)[1].evidence
    if found is None:
        raise Closed("it gives no evidence")
    runs = np.array([np.mean(np.exp(-part)) for part in np.array_split(found, 30)])
    judge_run_means("exp(-evidence) of targets' returns", runs, 0.5, 2.0, 1e-9)


def errors_are_as_stated(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it fuses sensors: returns err as their noise states, of little noise as of much, give or take a third."""
    x, made = _of_targets(preprocessor, drawn)
    if made.noise is None:
        raise Closed("its returns bring no noise")
    far = nees(x - made.z, made.noise) / x.shape[-1]
    order = np.argsort(np.trace(made.noise, axis1=-2, axis2=-1), kind="stable")
    for part, which in zip((order, *np.array_split(order, 2)), ("any", "less", "more"), strict=True):
        runs = np.array([np.mean(far[each]) for each in np.array_split(part, 24)])
        judge_run_means(f"squared errors of returns of {which} noise", runs, 0.75, 1.4, drawn.alpha / 3)


def _of_targets(preprocessor: Preprocessor, drawn: Raw) -> tuple[Array, Detections]:
    """Return where targets are that are far apart, and what is made of their returns."""
    closed_if(len(preprocessor.sensors) < 2, Unlike("it does not fuse sensors"))
    exact = exactly(preprocessor, drawn, several=True)
    rng = np.random.default_rng(len(exact.states))
    x = np.repeat(exact.states[:1], 600, axis=0)
    x[:, exact.where[0]] += 1e4 * np.arange(len(x))
    scans = {}
    for name, sensor in preprocessor.sensors.items():
        standard = rng.standard_normal((len(x), len(sensor.measurement)))
        z, seen = returns(sensor, x, rng.random(len(x)), standard)  # in 20 runs, as pairs of 600 take long
        scans[name] = Scan(5.0, name, Detections(z.reshape(20, -1, z.shape[-1]), seen.reshape(20, -1)))
    made, at = made_of(preprocessor, scans), x[:, exact.where]
    closed_if(len(made.z) < 120, "it makes few returns of targets")
    return at[np.clip(np.rint((made.z[:, 0] - at[0, 0]) / 1e4).astype(int), 0, len(at) - 1)], made


LAWS = (
    *(Law(law, share=4) for law in (others_far_away_change_nothing, sensors_confirm_within_the_threshold)),
    *(Law(law, effort="statistical") for law in (evidence_is_a_likelihood_ratio, errors_are_as_stated)),
)
