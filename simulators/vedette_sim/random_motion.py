"""One object that moves at random, by the motion models that filters use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, Trajectory, fields
from vedette.sampling import common_state, draw_jump_markov, union_state
from vedette_sim.life import check_life, life

_PLANE = {"x": (0.0, 10.0), "y": (50.0, 20.0), "vx": (3.0, 1.0), "vy": (-2.0, 4.0)}
STARTS = (_PLANE, {**_PLANE, "turn_rate": (0.05, 0.1)})
"""What the kit tries: its motions are over one of these."""


def switching() -> Any:
    """Declare how several models take turns."""
    return fields.array(
        "1", "probability of each next model (column) given the model (row), at each scan time", ndim=2, default=((1.0,),)
    )


def check_models(
    models: Sequence[MotionModel], transition: Array, start: Mapping[str, object], given: Iterable[str]
) -> None:
    """Raise ValueError unless `transition` fits the models, and `start` gives all their axes but those `given` elsewhere."""
    if not models:
        raise ValueError("models: must hold at least one motion model, got none")
    r, elsewhere = len(models), set(given)
    if transition.shape != (r, r) or np.any(transition < 0) or np.any(np.abs(transition.sum(axis=1) - 1) > 1e-6):
        raise ValueError(
            f"transition: must be {r} x {r} with rows of probabilities that sum to 1, got {transition.tolist()}"
        )
    wanted = [name for name in union_state(models).names if name not in elsewhere]
    if sorted(start) != sorted(wanted):
        raise ValueError(f"start: must give the axes {', '.join(wanted) or 'none'}, got {', '.join(start) or 'none'}")


@final
@frozen
class Drawn:
    """An object whose trajectory is a random draw of motion models; with several, they switch at each scan time.

    The first of `models` holds when it appears, at a state drawn from `start`. An axis that a switch adds starts from the
    same [mean, standard deviation]. The truth holds the axes that all models have.

    >>> from vedette_standard import ConstantVelocity, RandomWalk
    >>> start = {"x": (5.0, 0.0), "y": (-2.0, 0.0), "vx": (3.0, 0.0), "vy": (1.0, 0.0)}
    >>> one = Drawn((ConstantVelocity(1e-9),), start, appears=1.5, disappears=4.0)
    >>> path = one.path("boat", np.arange(7.0), 6.0, np.random.default_rng(0))
    >>> path.name, path.times.tolist(), path.states.round(6).tolist()[-1]
    ('boat', [1.5, 2.0, 3.0, 4.0], [12.5, 0.5, 3.0, 1.0])
    >>> models = RandomWalk(0.1, ("x",)), RandomWalk(7.0, ("x",))
    >>> swaps = Drawn(models, {"x": (40.0, 3.0)}, np.array([[0.0, 1.0], [0.5, 0.5]]))
    >>> x = np.array([swaps.draw(np.array([0.0, 4.0, 8.0]), np.random.default_rng(i))[:, 0] for i in range(800)])
    >>> steps = np.array([9.0, 7.0**2 * 4, (0.1**2 + 7.0**2) / 2 * 4])  # the second model, then either
    >>> np.allclose([np.mean((x[:, 0] - 40) ** 2), *np.mean(np.diff(x) ** 2, axis=0)], steps, rtol=0.2)
    True
    """

    models: tuple[MotionModel, ...] = fields.part("how it moves; several models take turns")
    start: dict[str, tuple[float, float]] = fields.table(
        "axis to [mean, standard deviation] at the start", pairs=True, tried=STARTS
    )
    transition: Array = switching()
    appears: float = fields.quantity("s", "time of its first state", default=0.0, at_least=0)
    disappears: float | None = fields.quantity("s", "time after which it is gone; default: it stays", default=None)

    def __attrs_post_init__(self) -> None:
        check_models(self.models, self.transition, self.start, ())
        check_life(self.appears, self.disappears)

    @property
    def space(self) -> Space:
        """The axes of its truth."""
        return common_state(self.models)

    def draw(self, times: Array, rng: np.random.Generator) -> Array:
        """Draw a trajectory at `times` (s,) in s over the axes that all models have: (s, n)."""
        space = union_state(self.models)
        mean, deviation = np.array([self.start[name] for name in space.names]).T
        x0 = mean + deviation * rng.standard_normal(len(space))
        _, states = draw_jump_markov(self.models, self.transition, x0, 0, times, rng, starts=self.start)
        return states[:, space.locate(self.space)]

    def path(self, name: str, scan_times: Array, duration: float, rng: np.random.Generator) -> Trajectory:
        """Draw its trajectory over its life."""
        times = life(self.appears, self.disappears, scan_times, duration)
        return Trajectory(name, self.space, times, self.draw(times, rng))
