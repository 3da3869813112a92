"""Laws of motion models whose velocities change: what their axes' names say of a curved path."""

from __future__ import annotations

import numpy as np

from vedette.roles import MotionModel
from vedette.space import Array, Space
from vedette.testing.comparisons import Broken, Closed, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.states import speeds_of

STEP = 1e-2
"""Time of a step, in s."""
TURNING = ("x", "y", "vx", "vy", "heading", "speed", "turn_rate")
_RATES = {"rad/s": 1.0, "deg/s": np.pi / 180.0}


def paths_bend_with_their_velocities(model: MotionModel, drawn: Moves) -> None:
    """An axis vx is the velocity of x: what vx gains in a short time, x gains with it, and not the other way.

    From 0 to twice dt * what vx gains is right: a model may move by the velocity at the beginning, or at the end, of a step.
    """
    names = model.state.names
    closed_if(not (pairs := speeds_of(model.state)), "it has no velocity of a position")
    places, speeds = (list(each) for each in zip(*pairs, strict=True))
    once, twice = (model.state.difference(model.move(drawn.x, k * STEP), drawn.x) for k in (1, 2))
    bend, gain = twice[:, places] - 2 * once[:, places], STEP / 2 * twice[:, speeds]
    off, most = np.linalg.norm(bend - gain, axis=-1), 1.3 * np.linalg.norm(gain, axis=-1)
    rounding = 1e-11 * (1.0 + np.max(np.abs(drawn.x[:, places]), axis=-1))
    F = np.broadcast_to(model.jacobian(drawn.x, STEP), (*drawn.x.shape, len(names)))[..., speeds, speeds]
    calm = np.all(np.abs(F - 1.0) < 0.05, axis=-1)  # a stiff model loses its velocity even in this time
    for i in np.flatnonzero(calm & (off > most + rounding)):
        moved, changed = (", ".join(names[k] for k in each) for each in (places, speeds))
        told = f"move: in a short time dt {changed} gain dt * {_told(gain[i] / STEP**2)}, so {moved} must bend by about"
        raise Broken(f"{told} dt^2 / 2 * the same, bend by dt^2 / 2 * {_told(bend[i] / STEP**2)}")


def turn_rates_turn(model: MotionModel, drawn: Moves) -> None:
    """An axis `turn_rate` says how fast the velocity, or the heading, turns, either way, also while it changes."""
    state, names = model.state, model.state.names
    turned = "heading" in names or {"vx", "vy"} <= {*names}
    units = {axis.name: axis.unit for axis in state.axes}
    closed_if(units.get("turn_rate") not in _RATES or not turned, "it has no `turn_rate` that turns something")
    unit = _RATES[units["turn_rate"]] / _RATES.get(f"{units.get('heading')}/s", 1.0)
    x = np.where([name in TURNING for name in names], drawn.x, 0.0)  # nothing else that could turn it
    r = names.index("turn_rate")
    rate = unit * np.abs(x[:, r])
    with np.errstate(all="ignore"):
        once, twice = (model.move(x, k * STEP) for k in (1, 2))
        found, on = (np.abs(_turned(state, x, after)) / STEP for after in (once, twice))
    for i in np.flatnonzero(np.isfinite(found) & (np.abs(found - rate) > 0.05 * rate + 1e-6)):
        told = f"{x[i, r]:.6g} {units['turn_rate']} must turn it that fast, turns it by {found[i] / unit:.6g}"
        raise Broken(f"move: a turn_rate of {told}")
    gain, bend = unit * np.sign(x[:, r]) * (twice - x)[:, r] / 2, on - 2 * found
    off = np.min([np.abs(bend - k * gain) for k in (0.0, 1.0, 2.0)], axis=0)  # by the rate before, amid or after a step
    for i in np.flatnonzero((np.abs(gain) < 0.1 * rate) & (off > 0.2 * np.abs(gain) + 1e-10)):
        demand(False, f"move: turn_rate gains {gain[i] / STEP:.4g} rad/s^2, what turns by it {bend[i] / STEP:.4g} rad/s^2")


def _turned(state: Space, x: Array, after: Array) -> Array:
    """Return how far the heading, or else the velocity, turned (k,); NaN for one that stood."""
    if "heading" in state.names:
        return np.asarray(state.difference(after, x)[:, state.names.index("heading")])
    v, w = (each[:, [state.names.index("vx"), state.names.index("vy")]] for each in (x, after))
    return np.where(np.hypot(*v.T) > 1e-3, _angle(v, w), np.nan)


def _angle(v: Array, w: Array) -> Array:
    return np.asarray(np.arctan2(v[:, 0] * w[:, 1] - v[:, 1] * w[:, 0], np.sum(v * w, axis=-1)))


def headings_lead_the_way(model: MotionModel, drawn: Moves) -> None:
    """Axes `heading` and `speed` beside x and y: it moves by speed * dt, and its way turns as the heading does."""
    state, names = model.state, model.state.names
    if not {"x", "y", "heading", "speed"} <= {*names} or state.axes[names.index("heading")].unit != "rad":
        raise Closed("it has no `heading` and `speed` beside x and y")
    places, h, v = [names.index("x"), names.index("y")], names.index("heading"), names.index("speed")
    x = np.where([name in ("x", "y", "heading", "speed") for name in names], drawn.x, 0.0)
    turned = np.array(x)
    turned[:, h] += 0.5
    ways = [state.difference(model.move(each, STEP), each)[:, places] for each in (x, state.canonical(turned))]
    fast = np.abs(x[:, v]) > 1e-3
    far = np.hypot(*ways[0].T)[fast]
    same("way of a step, in m", far, STEP * np.abs(x[fast, v]), 0.05)
    turn = _angle(*ways)[fast]
    otherwise = f"move: a heading turned by .5 rad must turn the way by that, turns it by {turn.tolist()}"
    demand(np.all(np.abs(np.abs(turn) - 0.5) < 0.02) and len(set(np.sign(turn).tolist())) < 2, otherwise)


def _told(values: Array) -> str:
    return f"[{', '.join(f'{value:.3g}' for value in values)}]"


LAWS = (Law(paths_bend_with_their_velocities), Law(turn_rates_turn), Law(headings_lead_the_way))
