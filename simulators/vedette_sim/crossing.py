"""Objects whose paths cross at one place and time."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Trajectory, fields
from vedette.sampling import common_state, draw_jump_markov, union_state
from vedette_sim.life import check_life, life
from vedette_sim.random_motion import check_models, switching

_PLANE = ("x", "y", "vx", "vy")


@final
@frozen
class Crossing:
    """`count` objects that come from different directions, meet near `at` at `time`, and go on.

    Each starts with `speed` on a course `angle` from its neighbour's and is drawn from the models; then its whole path is
    moved in the plane, so that at `time` it is at `at`, but for a Gaussian miss of `spread` an axis. Velocities are as the
    models have them; the models must not depend on where the object is. Their names are NAME.1, NAME.2, ...

    >>> from vedette_standard import ConstantVelocity
    >>> near = Crossing((ConstantVelocity(1e-9),), [30.0, -40.0], time=2.5, speed=8.0, count=3, angle=0.5, course=0.2,
    ...                 start={}, appears=1.0, disappears=6.0)
    >>> paths = near.members("m", np.arange(9.0), 8.0, np.random.default_rng(1))
    >>> v = 8.0 * np.array([np.cos(1.2), np.sin(1.2)])  # of the third: .2 + 2 .5
    >>> paths[2].name, paths[2].times.tolist()
    ('m.3', [1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0])
    >>> np.allclose(paths[2].states, [[*([30.0, -40.0] + (t - 2.5) * v), *v] for t in paths[2].times])
    True
    >>> wide = Crossing((ConstantVelocity(1e-9),), [30.0, -40.0], time=2.0, speed=8.0, count=900, spread=5.0, start={})
    >>> made = np.array([path.at(2.0) for path in wide.members("m", np.arange(9.0), 8.0, np.random.default_rng(1))])
    >>> np.allclose(np.std(made[:, :2] - [30.0, -40.0], axis=0), 5.0, rtol=0.1), np.allclose(made[:, 2:].mean(axis=0), 0.0)
    (True, True)
    """

    models: tuple[MotionModel, ...] = fields.part("how each moves; several models take turns at each scan time")
    at: Array = fields.pair("m", "[x, y] of the place where they meet")
    time: float = fields.quantity("s", "when they meet", at_least=0)
    speed: float = fields.quantity("m/s", "first speed", above=0)
    count: int = fields.integer("how many", default=2, at_least=2, at_most=1000)
    angle: float | None = fields.quantity(
        "rad", "from one's first course to the next one's; default: evenly around the circle", default=None
    )
    course: float = fields.quantity("rad", "first course of the first one, from the +x axis towards +y", default=0.0)
    spread: float = fields.quantity(
        "m", "standard deviation per axis of the place of each at `time`", default=0.0, at_least=0
    )
    start: dict[str, tuple[float, float]] = fields.table(
        "axis other than x, y, vx, vy to [mean, standard deviation] at the start",
        pairs=True,
        tried=({}, {"turn_rate": (0.05, 0.1)}),
    )
    transition: Array = switching()
    appears: float = fields.quantity("s", "time of their first states", default=0.0, at_least=0)
    disappears: float | None = fields.quantity("s", "time after which they are gone; default: they stay", default=None)

    def __attrs_post_init__(self) -> None:
        check_models(self.models, self.transition, self.start, _PLANE)
        check_life(self.appears, self.disappears)
        common = common_state(self.models)
        if lacking := [name for name in _PLANE if name not in common]:
            raise ValueError(f"models: must all have the axes {', '.join(_PLANE)}; {lacking[0]} is not in all of them")
        if not self.appears <= self.time or (self.disappears is not None and self.time > self.disappears):
            raise ValueError(f"time: must be while they are there, got {self.time:.6g} s")
        for i, model in enumerate(self.models):
            if not _moves_alike_everywhere(model):
                raise ValueError(f"models[{i}]: must move alike wherever an object is, but {model.kind!r} does not")

    def check(self, duration: float) -> None:
        """Raise ValueError if it does not come about within a scene of `duration` s."""
        if self.time > duration:
            raise ValueError(f"time: must be before the end at {duration:.6g} s, got {self.time:.6g} s")

    def members(self, name: str, scan_times: Array, duration: float, rng: np.random.Generator) -> list[Trajectory]:
        """Draw their trajectories over their life."""
        space, common = union_state(self.models), common_state(self.models)
        times = np.union1d(life(self.appears, self.disappears, scan_times, duration), [self.time])
        angle = 2 * np.pi / self.count if self.angle is None else self.angle
        course = self.course + angle * np.arange(self.count)
        first: dict[str, Any] = {"vx": self.speed * np.cos(course), "vy": self.speed * np.sin(course), "x": 0.0, "y": 0.0}
        x0 = np.empty((self.count, len(space)))
        for i, axis in enumerate(space.names):
            x0[:, i] = first[axis] if axis in first else rng.normal(*self.start[axis], self.count)
        _, states = draw_jump_markov(self.models, self.transition, x0, 0, times, rng, starts=self.start)
        states = states[..., space.locate(common)]
        plane = [common.names.index("x"), common.names.index("y")]
        met = self.at + self.spread * rng.standard_normal((self.count, 2))
        when = int(np.searchsorted(times, self.time))
        states[..., plane] += (met - states[:, when, plane])[:, None, :]
        return [Trajectory(f"{name}.{i + 1}", common, times, path) for i, path in enumerate(states)]


def _moves_alike_everywhere(model: MotionModel) -> bool:
    """Return whether a step from a state moved in the plane is the step moved in the plane, and its noise the same."""
    x = np.linspace(0.3, 0.7, len(model.state))
    far = np.array([100.0 if name in ("x", "y") else 0.0 for name in model.state.names])
    moved = model.state.difference(model.move(x + far, 1.0), model.move(x, 1.0))
    return bool(np.allclose(moved, far, atol=1e-6) and np.allclose(model.noise(x + far, 1.0), model.noise(x, 1.0)))
