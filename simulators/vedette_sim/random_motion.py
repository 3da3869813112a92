"""One object that moves at random, by the motion models that filters use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, Trajectory, fields
from vedette.sampling import common_state, draw_jump_markov, union_state


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


def check_life(appears: float, disappears: float | None) -> None:
    """Raise ValueError if an object is gone before it comes."""
    if disappears is not None and disappears <= appears:
        raise ValueError(f"disappears: must be after it appears at {appears:.6g} s, got {disappears:.6g} s")


def life(appears: float, disappears: float | None, scan_times: Array, duration: float) -> Array:
    """Return the times at which an object is known: when it appears, at each scan, when it is gone or the scene ends."""
    last = duration if disappears is None else min(disappears, duration)
    return np.unique([appears, *scan_times[(scan_times > appears) & (scan_times < last)], last])


@final
@frozen
class Drawn:
    """An object whose trajectory is a random draw of motion models; with several, they switch at each scan time.

    The first of `models` holds when it appears, at a state drawn from `start`. An axis that a switch adds starts from the
    same [mean, standard deviation]. The truth holds the axes that all models have.
    """

    models: tuple[MotionModel, ...] = fields.part("how it moves; several models take turns")
    start: dict[str, tuple[float, float]] = fields.table("axis to [mean, standard deviation] at the start", pairs=True)
    transition: Array = fields.array(
        "1", "probability of each next model (column) given the model (row), at each scan time", ndim=2, default=((1.0,),)
    )
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
