"""Laws of births: what a return's noise does, sensors that cannot start a track, targets that nobody has seen, and names.

`spread` (standard deviations by axis), `initial` (existence) and `sensors` (whose returns start tracks) are taken at
their word.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette.supporting import Birth
from vedette.testing.comparisons import Closed, Lacking, closed_if, covariance, demand, same, stated, varied
from vedette.testing.law import Law
from vedette.testing.laws.birth_cases import P_GATE, Returns, begun, rate_of, unseen, unseen_after_nothing
from vedette.testing.strategies import SENSOR, usual
from vedette.types import Detections, Recording, Scan, Trajectory


def a_sharper_return_starts_a_surer_track(birth: Birth, drawn: Returns) -> None:
    """A return that brings a small noise of its own starts a track whose position is known better."""
    k = len(drawn.claimed)
    where = drawn.estimator.state.locate(drawn.sensor.observes)
    traces = []
    for scale in (1.0, 0.01):
        own = np.broadcast_to(scale * drawn.sensor.noise(np.zeros(2)), (k, 2, 2))
        scan = Detections(drawn.detections.z, drawn.detections.valid, None, own)
        newborn = begun(birth, evolve(drawn, detections=scan), np.zeros(k))
        cov = newborn.prior.cov[:, where, :][..., where]
        traces.append(dict(zip(newborn.returns.tolist(), np.trace(cov, axis1=-2, axis2=-1), strict=True)))
    for i in traces[0].keys() & traces[1].keys():
        demand(traces[1][i] < traces[0][i], f"begin: return {i} with a hundredth of the noise starts no surer a track")


def refuses_what_starts_no_track(birth: Birth, drawn: Returns) -> None:
    """If single returns start its tracks: a sensor of which one return gives no position is refused, not ignored."""
    k = len(drawn.claimed)
    closed_if(birth.models_unseen or not len(begun(birth, drawn, np.zeros(k)).returns), "no single return starts a track")
    bearing = usual("sensor", "bearing_only")
    scan = Detections.of(np.linspace(-1.0, 1.0, k)[:, None], 1)
    try:
        newborn = birth.begin(None, drawn.estimator, bearing(0.02), SENSOR, scan, np.zeros(k))
    except (ValueError, NotImplementedError):
        return
    demand(len(newborn.returns), "begin: bearings alone start no track, and nothing says so: raise ValueError")


def spread_as_stated(birth: Birth, drawn: Returns) -> None:
    """If it has `spread`: new tracks have that standard deviation along each of its axes."""
    spread = getattr(birth, "spread", None)
    if not isinstance(spread, dict) or birth.models_unseen:
        raise Lacking("spread")
    newborn, state = begun(birth, drawn), drawn.estimator.state
    for axis, deviation in spread.items():
        if axis in state and axis not in drawn.sensor.observes:
            i = state.names.index(axis)
            found = np.sqrt(newborn.prior.cov[:, i, i])
            same(f"deviation of {axis}", found, np.full(len(found), float(deviation)), 1e-6)


def exists_as_stated(birth: Birth, drawn: Returns) -> None:
    """If it has `initial`: new tracks exist with that probability at most; if it states `initial_existence`, with that."""
    every, known = birth.initial_existence, begun(birth, drawn).existence
    initial = getattr(birth, "initial", every)
    if not isinstance(initial, float):
        raise Lacking("initial")
    demand(np.all(known <= initial + 1e-9), f"existence: must be `initial`, {initial:g}, got {known}")
    demand(every is None or np.allclose(known, every), f"existence: must be `initial_existence`, {every}, got {known}")


def starts_from_its_sensors(birth: Birth, drawn: Returns) -> None:
    """If it states `sensors`: returns of those start tracks, and of no others; of all if it names none."""
    closed_if(type(birth).sensors is Birth.sensors, Lacking("sensors"))
    if not birth.sensors:
        demand(birth.starts_from("kit_other"), "starts_from: must be true of any sensor, as `sensors` names none")
        return
    for name in birth.sensors:
        demand(birth.starts_from(name), f"starts_from: must be true of {name!r}, one of its sensors")
    demand(not birth.starts_from("kit_other"), "starts_from: must be false of a sensor that is none of its own")


def given_tracks_start_as_stated(birth: Birth, drawn: Returns) -> None:
    """If it gives tracks: they are Gaussians over the state; `start`, `spread` and `offset`, if it has them, say where."""
    state, rng = drawn.estimator.state, drawn.rng()
    path = Trajectory("kit", state, np.array([-1.0, 0.0, 1.0]), rng.uniform(-50.0, 50.0, (3, len(state))))
    later = evolve(path, name="later", times=path.times + 1.5, states=path.states + 99.0)
    nothing = Detections.of([], 2)
    recording = Recording((Scan(0.0, SENSOR, nothing), Scan(1.0, SENSOR, nothing)), (later, path))
    tables = {name: getattr(birth, name, None) for name in ("start", "spread", "offset")}
    start, spread, offset = (table if isinstance(table, Mapping) else {} for table in tables.values())
    try:
        prior = birth.given(state, recording)
    except ValueError as refusal:
        demand(not set(state.names) <= {*start, *spread}, f"given: every axis is stated, and it refuses: {refusal}")
        raise Closed(f"it gives no tracks there: {refusal}") from None
    if prior is None:
        raise Closed("it gives no tracks")
    t, n = prior.mean.shape[0], len(state)
    demand(prior.mean.shape == (t, n) and prior.cov.shape == (t, n, n), f"given: is of shape {prior.mean.shape}")
    covariance("given", prior.cov, definite=False)
    for i, name in enumerate(state.names if start or spread else ()):
        mean, deviation = start.get(name, (path.states[1, i] + offset.get(name, 0.0), spread.get(name)))
        same(f"given: mean of {name}", prior.mean[:, i], np.full(t, float(mean)), 1e-9, 1.0 + abs(mean))
        if deviation is not None:
            same(f"given: variance of {name}", prior.cov[:, i, i], np.full(t, float(deviation) ** 2), 1e-9)


def _lifetime(birth: Birth) -> float:
    closed_if(not birth.models_unseen, "it does not say that it models targets without a track")
    return stated(birth, "lifetime", "s")


PLACES = np.stack(np.meshgrid(*[np.linspace(-400.0, 400.0, 9)] * 2), axis=-1).reshape(-1, 2)


def a_look_thins_the_unseen(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track: a scan that detects none leaves 1 - P_D P_G of them."""
    memory = unseen(birth, drawn)
    before = rate_of(birth, memory, drawn, PLACES)
    after = unseen_after_nothing(birth, memory, drawn)
    left = 1.0 - float(drawn.sensor.detects(np.zeros(2))) * P_GATE
    same("density after a look at nothing", rate_of(birth, after, drawn, PLACES), left * before, 1e-6)
    same("density of the memory that was passed in", rate_of(birth, memory, drawn, PLACES), before, 0.0)
    known = birth.update(memory, drawn.estimator, drawn.sensor, drawn.detections, np.ones(len(drawn.claimed)), P_GATE)
    same("density after returns of known tracks", rate_of(birth, known, drawn, PLACES), left * before, 1e-6)


def the_unseen_come_and_go_with_time(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track: densities stay >= 0 over any time, and parts of a time do what it does."""
    begin = unseen(birth, drawn)
    for dt in (1.0, 100.0, 1e5):
        rate = rate_of(birth, birth.predict(begin, drawn.estimator, dt, drawn.rng()), drawn, PLACES)
        told = f"reveal: after {dt:g} s densities must be >= 0, got {rate.min():.3g}"
        demand(np.all(np.isfinite(rate) & (rate >= 0)), told)
    total, parts = 0.25, 32  # short enough that those who appear hardly move meanwhile
    # After a look there are fewer than come and go in the long run: a time step then changes something.
    thinned = unseen_after_nothing(birth, begin, drawn)
    for start, when in ((begin, ""), (thinned, " after a look at nothing")):
        memory = start
        for _ in range(parts):
            memory = birth.predict(memory, drawn.estimator, total / parts, drawn.rng())
        at_once = birth.predict(start, drawn.estimator, total, drawn.rng())
        before = rate_of(birth, start, drawn, PLACES)
        grown = [float(np.sum(rate_of(birth, one, drawn, PLACES) - before)) for one in (at_once, memory)]
        scale = max(abs(grown[0]), 0.02 * float(before.sum()))
        told = f"{total:g} s change the densities by {grown[0]:.3g} at once, by {grown[1]:.3g} in {parts} parts"
        demand(abs(grown[1] - grown[0]) <= 0.6 * scale, f"predict{when}: {told}")


def _are_left(birth: Birth, drawn: Returns, gaps: tuple[float, ...]) -> list[Array]:
    """Return how dense those are, after each gap, that a look at nothing would take away before: no newcomers."""
    many = unseen(birth, drawn)
    few = unseen_after_nothing(birth, many, drawn)
    left: list[Array] = []
    for dt in gaps:
        ends = [birth.predict(memory, drawn.estimator, dt, drawn.rng()) for memory in (many, few)]
        left.append(rate_of(birth, ends[0], drawn, PLACES) - rate_of(birth, ends[1], drawn, PLACES))
    if left[0].sum() <= 1e-9 * np.max(rate_of(birth, many, drawn, PLACES), initial=1e-300):
        raise Closed("there are none where the kit looks")
    return left


def the_unseen_move(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track and has `lifetime`: as long as they live they move, as they have velocities."""
    _lifetime(birth)
    shapes = [there / max(float(there.sum()), 1e-300) for there in _are_left(birth, drawn, (0.0, 120.0))]
    closed_if(np.ptp(shapes[0]) < 0.01 * shapes[0].max(), "there are as many everywhere")
    demand(np.abs(shapes[1] - shapes[0]).sum() > 0.01, "predict: after 120 s all unseen targets are where they were")


def the_unseen_fade(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track and has `lifetime`: they leave as exp(-dt / lifetime)."""
    _lifetime(birth)
    brief = varied(birth, lifetime=0.1)  # so short that they hardly move meanwhile
    before, left = _are_left(brief, drawn, (0.0, 0.1))
    share = float(left.sum() / before.sum())
    demand(abs(share - np.exp(-1.0)) < 0.08, f"predict: after its lifetime, {share:.3g} are left, must be 0.368")


def the_unseen_settle(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track and has `lifetime`: in time as many leave as come, in steps of any length."""
    lifetime = _lifetime(birth)
    begin = unseen(birth, drawn)
    ends = [birth.predict(begin, drawn.estimator, lives * lifetime, drawn.rng()) for lives in (25.0, 50.0)]
    before, soon, late = (rate_of(birth, memory, drawn, PLACES) for memory in (begin, *ends))
    same("density after 50 lifetimes", late, soon, 1e-6, scale=max(float(before.max()), float(soon.max()), 1e-30))


def a_track_of_the_unseen_exists_by_their_density(birth: Birth, drawn: Returns) -> None:
    """If it models targets without a track: a new one exists with e / (e + clutter) at most, e their density there."""
    rate, newborn = rate_of(birth, unseen(birth, drawn), drawn), begun(birth, drawn)
    clutter = np.broadcast_to(drawn.sensor.clutter(drawn.detections.z), rate.shape)
    most = rate / np.maximum(rate + clutter, 1e-300) * (1.0 - drawn.claimed)
    over = newborn.existence - most[newborn.returns]
    more = over.max(initial=0.0)
    demand(more <= 1e-6, f"existence: must be at most e (1 - claimed) / (e + clutter), is {more:.3g} more")
    if isinstance(least := getattr(birth, "least", None), float):
        idle = sorted(set(np.flatnonzero(most > 1.001 * least + 1e-12).tolist()) - set(newborn.returns.tolist()))
        demand(not idle, f"begin: returns {idle} start no track, and would exist with more than `least`, {least:g}")


LAWS: tuple[Law, ...] = (*map(Law, (
    a_sharper_return_starts_a_surer_track, refuses_what_starts_no_track, spread_as_stated, exists_as_stated,
    starts_from_its_sensors, given_tracks_start_as_stated, the_unseen_move, the_unseen_fade, the_unseen_settle,
)), *(Law(law, needs="models_unseen") for law in (
    a_look_thins_the_unseen, the_unseen_come_and_go_with_time, a_track_of_the_unseen_exists_by_their_density,
)))  # fmt: skip
