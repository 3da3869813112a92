"""Objects that move in formation."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Trajectory, fields
from vedette.sampling import draw_states
from vedette_sim.random_motion import Drawn


@final
@frozen
class Convoy:
    """`count` objects that follow one drawn path in a row: astern of the leader, or abreast of it.

    Member i stands i times `spacing` behind, or to port of, the leader's place, by the course on which the leader starts.
    The formation does not turn: all have the leader's velocity. `wander` adds to each its own deviation from its place,
    leader's included: a draw of that model from 0, as axes of the same names. Their names are NAME.1, NAME.2, ...

    >>> from vedette_standard import ConstantVelocity, RandomWalk
    >>> start = {"x": (100.0, 0.0), "y": (200.0, 0.0), "vx": (3.0, 0.0), "vy": (4.0, 0.0)}
    >>> leader, rng = Drawn((ConstantVelocity(1e-9),), start, appears=1.0, disappears=5.0), np.random.default_rng(1)
    >>> for formation in ("astern", "abreast"):
    ...     paths = Convoy(leader, 50.0, formation, count=3).members("c", np.arange(9.0), 8.0, rng)
    ...     paths[2].name, paths[2].times.tolist(), paths[2].states[-1].round(6).tolist()  # from 112, 216
    ('c.3', [1.0, 2.0, 3.0, 4.0, 5.0], [52.0, 136.0, 3.0, 4.0])
    ('c.3', [1.0, 2.0, 3.0, 4.0, 5.0], [32.0, 276.0, 3.0, 4.0])
    >>> paths = Convoy(leader, 1e-9, "astern", 1000, RandomWalk(6.0, ("y",))).members("c", np.arange(9.0), 8.0, rng)
    >>> y = np.array([path.states[:, 1] for path in paths]) - [200.0, 204.0, 208.0, 212.0, 216.0]
    >>> np.allclose(np.mean(y**2, axis=0), [0.0, 36.0, 72.0, 108.0, 144.0], rtol=0.2)
    True
    """

    leader: Drawn = fields.part("the path that all follow")
    spacing: float = fields.quantity("m", "from one to the next", above=0)
    formation: str = fields.choice("where the others are: behind the leader, or beside it", ("astern", "abreast"))
    count: int = fields.integer("how many, the leader included", default=2, at_least=2, at_most=1000)
    wander: MotionModel | None = fields.part("how each deviates from its place; default: it does not", default=None)

    def __attrs_post_init__(self) -> None:
        space = self.leader.space
        if lacking := [name for name in ("x", "y", "vx", "vy") if name not in space]:
            raise ValueError(f"leader.models: must all have the axes x, y, vx, vy; {lacking[0]} is not in all of them")
        if self.wander is not None and (other := [axis for axis in self.wander.state.axes if axis not in space.axes]):
            raise ValueError(f"wander: has the axis {other[0].name}, which is not among the leader's: {space}")

    def check(self, duration: float) -> None:
        """Raise ValueError if it does not appear within a scene of `duration` s."""
        if self.leader.appears >= duration:
            raise ValueError(f"leader.appears: must be before the end at {duration:.6g} s")

    def members(self, name: str, scan_times: Array, duration: float, rng: np.random.Generator) -> list[Trajectory]:
        """Draw their trajectories over the leader's life."""
        leader = self.leader.path(name, scan_times, duration, rng)
        space, times = leader.space, leader.times
        states = np.repeat(leader.states[None], self.count, axis=0)
        x, y, vx, vy = (space.names.index(axis) for axis in ("x", "y", "vx", "vy"))
        course = np.arctan2(states[0, 0, vy], states[0, 0, vx]) + (np.pi if self.formation == "astern" else np.pi / 2)
        away = self.spacing * np.arange(self.count)
        states[..., x] += (away * np.cos(course))[:, None]
        states[..., y] += (away * np.sin(course))[:, None]
        if self.wander is not None:
            wandering = space.locate(self.wander.state)
            states[..., wandering] += draw_states(self.wander, np.zeros(len(wandering)), times, rng, size=(self.count,))
        return [Trajectory(f"{name}.{i + 1}", space, times, space.canonical(path)) for i, path in enumerate(states)]
