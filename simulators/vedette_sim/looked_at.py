"""Whether a scene's looks fit its sensors, and its objects what these look at."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain

from vedette import ConfigError, Problem, Sensor, Trajectory
from vedette.sampling import corners
from vedette_sim.look import Look


def check_sensors(looks: Mapping[str, Look], sensors: Mapping[str, Sensor], world: Mapping[str, Sensor]) -> None:
    """Raise ConfigError if a look has no sensor in the `world`, or one that it does not fit, or unlike the tracker's."""
    _refuse(chain.from_iterable(_of_look(name, look, sensors, world) for name, look in looks.items()))


def check_axes(looks: Mapping[str, Look], world: Mapping[str, Sensor], truth: tuple[Trajectory, ...]) -> None:
    """Raise ConfigError if an object lacks an axis that a sensor observes."""
    _refuse(
        Problem(f"looks.{name}", f"it looks at {world[name].observes}, but {path.name!r} has only {path.space}")
        for name in looks
        for path in truth
        if any(axis not in path.space.axes for axis in world[name].observes.axes)
    )


def _refuse(found: Iterable[Problem]) -> None:
    if problems := list(found):
        raise ConfigError(problems)


def _of_look(name: str, look: Look, sensors: Mapping[str, Sensor], world: Mapping[str, Sensor]) -> Iterator[Problem]:
    if name not in world:
        yield Problem(f"looks.{name}", f"there is no such sensor; there are {', '.join(world) or 'none'}")
        return
    space = world[name].measurement
    if name in sensors and sensors[name].measurement != space:
        text = f"must measure what the tracker's does, {sensors[name].measurement}, got {space}"
        yield Problem(f"sensors.{name}", text)
    both = (world[name], sensors.get(name, world[name]))
    asked: dict[str, Callable[[], object]] = {
        "clutter": lambda: look.clutter is None or corners(space, look.clutter),
        "missing": lambda: [look.lacking(sensor) for sensor in both],
        "resolution": lambda: look.cells(space),
    }
    for part, ask in asked.items():
        try:
            ask()
        except ValueError as error:
            yield Problem(f"looks.{name}.{part}", str(error))
