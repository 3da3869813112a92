"""Trajectories made of legs, in closed form: no time step, so no integration error."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import Factory, asdict, field, frozen

from vedette import Array, Pose, Space, fields
from vedette_sim.life import check_life

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
"""The axes of a ship's state."""

_TAKES: dict[str, tuple[tuple[str, ...], ...]] = {
    "straight": (("seconds",),),
    "turn": (("seconds", "rate"), ("seconds", "lateral_accel")),
    "accelerate": (("seconds", "accel"),),
    "stop": (("decel",),),
    "push": (("seconds", "push"),),
}


@final
@frozen
class Leg:
    """One manoeuvre: `straight` keeps course and speed, `turn` the speed, `accelerate` and `stop` the course, `push` none.

    Each takes only the parameters that it needs: straight seconds; turn seconds and either rate or lateral_accel;
    accelerate seconds and accel; stop decel, and lasts until the ship is at rest; push seconds and push.
    """

    do: str = fields.choice("the manoeuvre", tuple(_TAKES))
    seconds: float | None = fields.quantity("s", "how long it lasts", default=None, above=0)
    rate: float | None = fields.quantity("rad/s", "turn rate, positive from +x towards +y", default=None)
    lateral_accel: float | None = fields.quantity(
        "m/s^2", "acceleration across the course, positive from +x towards +y: rate = lateral_accel / speed", default=None
    )
    accel: float | None = fields.quantity("m/s^2", "acceleration along the course, negative to slow down", default=None)
    decel: float | None = fields.quantity("m/s^2", "how hard it brakes to rest", default=None, above=0)
    push: Array | None = fields.pair("m/s^2", "acceleration [x, y] that stays as it is whatever the course", default=None)

    def __attrs_post_init__(self) -> None:
        given = [name for name, value in asdict(self, recurse=False).items() if name != "do" and value is not None]
        if all(sorted(given) != sorted(takes) for takes in _TAKES[self.do]):
            right = ", or ".join(" and ".join(takes) for takes in _TAKES[self.do])
            raise ValueError(f"do: {self.do!r} takes {right}; got {' and '.join(given) or 'none of these'}")


def _lay(ship: Ship) -> Array:
    """Return a row for each leg and for what follows: begin in s, x, y, course, speed, turn rate, acceleration, push."""
    begin, (x, y), course, speed = ship.appears, ship.start, ship.course, ship.speed
    rows = []
    for i, leg in enumerate(ship.legs):
        rate, accel = leg.rate or 0.0, leg.accel or 0.0
        if leg.lateral_accel is not None:
            if speed == 0:
                raise ValueError(f"legs[{i}].lateral_accel: the ship is at rest there, and a turn needs speed")
            rate = leg.lateral_accel / speed
        if leg.decel is not None:
            accel = -leg.decel
        seconds = speed / leg.decel if leg.decel is not None else (leg.seconds or 0.0)
        after = 0.0 if leg.do == "stop" else speed + accel * seconds
        if after < 0:
            raise ValueError(
                f"legs[{i}].accel: takes the speed from {speed:.6g} to {after:.6g} m/s; to rest, use do = 'stop'"
            )
        push = (0.0, 0.0) if leg.push is None else leg.push
        rows.append([begin, x, y, course, speed, rate, accel, *push])
        _, x, y, pushed_course, pushed_speed = _move(np.array(rows[-1]), np.asarray(begin + seconds))
        begin, course, speed = begin + seconds, course + rate * seconds, after
        if leg.push is not None:
            course, speed = float(pushed_course), float(pushed_speed)
    return np.array([*rows, [begin, x, y, course, speed, 0.0, 0.0, 0.0, 0.0]])


def _move(legs: Array, times: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Move along legs (*s, 9) to each time (*s) in s: return the times, x, y, course and speed there, (*s) each.

    An arc's chord is its length times sinc of half the turn, and points half the turn from the first course; without turn it
    is the straight line.
    """
    begin, x, y, course, speed, rate, accel, push_x, push_y = (legs[..., i] for i in range(9))
    t = times - begin
    chord = (speed + 0.5 * accel * t) * t * np.sinc(0.5 * rate * t / np.pi)
    along = course + 0.5 * rate * t
    pushed = (push_x != 0) | (push_y != 0)
    vx, vy = speed * np.cos(course) + push_x * t, speed * np.sin(course) + push_y * t
    return (
        times,
        x + chord * np.cos(along) + 0.5 * push_x * t**2,
        y + chord * np.sin(along) + 0.5 * push_y * t**2,
        np.where(pushed, np.arctan2(vy, vx), course + rate * t),
        np.where(pushed, np.hypot(vx, vy), speed + accel * t),
    )


@final
@frozen
class Ship:
    """An object that moves in legs: it appears at `start`, follows `legs`, and then keeps its course and speed.

    >>> legs = Leg("turn", seconds=4.0, rate=0.25), Leg("accelerate", seconds=3.0, accel=2.0), Leg("stop", decel=7.0)
    >>> ship = Ship(start=np.array([10.0, 20.0]), course=0.5, speed=8.0, legs=legs, appears=2.0)
    >>> x, y = 10 + 32 * (np.sin(1.5) - np.sin(0.5)), 20 - 32 * (np.cos(1.5) - np.cos(0.5))  # an arc of radius 32 m
    >>> c, s = np.cos(1.5), np.sin(1.5)
    >>> after = [x + 33 * c, y + 33 * s, 14 * c, 14 * s], [x + 47 * c, y + 47 * s, 0, 0]  # 3 (8 + 14) / 2 m, 14^2 / 14 m
    >>> np.allclose(ship.states([6.0, 9.0, 99.0]), [[x, y, 8 * c, 8 * s], *after]), ship.heading([4.0, 99.0]).tolist()
    (True, [1.0, 1.5])
    >>> legs = Leg("turn", seconds=2.0, lateral_accel=4.0), Leg("push", seconds=2.0, push=np.array([1.0, -3.0]))
    >>> ship, v = Ship(start=np.zeros(2), speed=8.0, legs=legs), 8 * np.array([np.cos(1.0), np.sin(1.0)])
    >>> place = [16 * np.sin(1.0), 16 - 16 * np.cos(1.0)] + 2 * v + [2.0, -6.0]
    >>> pushed = v + [2.0, -6.0]  # which stays
    >>> np.allclose(ship.states([4.0, 7.0]), [[*place, *pushed], [*(place + 3 * pushed), *pushed]])
    True
    """

    start: Array = fields.pair("m", "position [x, y] where it appears")
    course: float = fields.quantity("rad", "first course, from the +x axis towards +y", default=0.0)
    speed: float = fields.quantity("m/s", "first speed", default=0.0, at_least=0)
    legs: tuple[Leg, ...] = fields.part("manoeuvres, one after the other", default=())
    appears: float = fields.quantity("s", "time of its first leg", default=0.0, at_least=0)
    disappears: float | None = fields.quantity("s", "time after which it is gone; default: it stays", default=None)
    _legs: Array = field(init=False, repr=False, eq=False, default=Factory(_lay, takes_self=True))

    def __attrs_post_init__(self) -> None:
        check_life(self.appears, self.disappears)

    def states(self, times: Array) -> Array:
        """Return x, y, vx, vy at `times` (*s) in s, none of them before it appears: (*s, 4)."""
        _, x, y, course, speed = self.at(times)
        return np.stack([x, y, speed * np.cos(course), speed * np.sin(course)], axis=-1)

    def heading(self, times: Array) -> Array:
        """Return the course in rad at `times` (*s), also at rest; not wrapped: (*s)."""
        return self.at(times)[3]

    def pose(self, time: float) -> Pose:
        """Return the pose of what it carries; the heading is from the +x axis towards +y."""
        state = self.states(np.array(time))
        return Pose(state[:2], state[2:], float(self.heading(np.array(time))))

    def at(self, times: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return `times` (*s) in s, none of them before it appears, and x, y, course and speed there, (*s) each."""
        times = np.asarray(times, dtype=float)
        if not np.all((times >= self.appears) & np.isfinite(times)):
            raise ValueError(f"times: must be finite and no earlier than it appears at {self.appears:.6g} s, got {times}")
        return _move(self._legs[np.searchsorted(self._legs[:, 0], times, side="right") - 1], times)


def check_ownship(carrier: Ship) -> None:
    """Raise ValueError unless what carries the sensors is there all the time."""
    if carrier.appears > 0 or carrier.disappears is not None:
        raise ValueError("ownship: must be there all the time, without `appears` and `disappears`")
