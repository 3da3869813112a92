"""A simulated scene as a source of scans, with its truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from heapq import merge
from typing import ClassVar, final

import numpy as np
from attrs import Factory, frozen

from vedette import Array, ConfigError, Mask, Pose, Recording, Scan, Sensor, Source, Space, Trajectory, fields
from vedette.sampling import common_state, draw_clutter, returns, shuffled
from vedette_sim.convoy import Convoy
from vedette_sim.crossing import Crossing
from vedette_sim.life import life
from vedette_sim.lockstep import Gaze, drawn_states, look_together, ship_states
from vedette_sim.look import Look
from vedette_sim.looked_at import check_axes, check_sensors
from vedette_sim.population import Population
from vedette_sim.random_motion import Drawn
from vedette_sim.resolution import merged_returns
from vedette_sim.ships import PLANE, Ship, check_ownship
from vedette_sim.streamed_scene import BLOCK, LazyScene, Views
from vedette_study.scenes import Scenes

_MOST_SCANS = 1_000_000
"""More scans of one sensor are taken for a wrong unit."""
_WHOLE = 5_000
"""More scans than this are drawn as they are asked for, and not kept."""


@final
@frozen
class Simulation(Source):
    """A scene of ships and of randomly moving objects, seen by sensors that draw from their own model.

    z = h(x) + v for every object that is detected, and Poisson clutter with the density that the sensor states. So the
    truth matches a tracker with the same sensors; `sensors` gives the scene other ones, to study mismatch.

    Every object, every sensor, and every sensor's view of every object has a random stream of its own, found by name:
    another ship leaves the paths and returns of the others, and the clutter, as they are.

    >>> from vedette.sampling import Bounds
    >>> from vedette_standard import CartesianPosition, RangeBearing
    >>> late = Ship([300.0, 400.0], course=np.pi, speed=9.0, appears=3.0)
    >>> ships = {"a": Ship([-900.0, 4.0]), "b": Ship([-902.0, -4.0]), "c": late}  # a and b, within a cell, are seen as one
    >>> looks = {"radar": Look(2.0, first=1.0, resolution={"range": 10.0, "bearing": 0.02})}
    >>> sure = {"radar": RangeBearing(1e-6, 1e-9, detection_probability=1.0)}
    >>> rng = np.random.default_rng(0)
    >>> made = Simulation(6.0, looks, ships).open(sure, rng)
    >>> [(scan.time, len(scan.detections.z)) for scan in made.scans], [path.name for path in made.truth]
    ([(1.0, 1), (3.0, 2), (5.0, 2)], ['a', 'b', 'c'])
    >>> z, last = made.scans[0].detections.z[0], made.scans[2].detections.z
    >>> np.allclose([z[0], abs(z[1])], [(np.hypot(900, 4) + np.hypot(902, 4)) / 2, np.pi], atol=1e-4)
    True
    >>> np.allclose(last[np.argmin(last[:, 0])], [np.hypot(282, 400), np.arctan2(400, 282)])
    True
    >>> carrier = Ship([100.0, 50.0], course=0.5, speed=20.0)
    >>> away = Simulation(6.0, {"radar": Look(5.0, first=5.0)}, {"c": Ship([300.0, 400.0])}, ownship=carrier)
    >>> (scan,) = away.open(sure, rng).scans
    >>> x, y = 200 - 100 * np.cos(0.5), 350 - 100 * np.sin(0.5)
    >>> np.allclose(scan.detections.z, [[np.hypot(x, y), np.arctan2(y, x) - 0.5]], atol=1e-4), round(scan.pose.heading, 9)
    (True, 0.5)
    >>> half = {"eye": CartesianPosition(3.0, detection_probability=0.6, clutter_density=5e-4)}
    >>> often = {"eye": Look(0.5, clutter={"x": Bounds(0.0, 100.0), "y": Bounds(-50.0, 150.0)})}
    >>> drawn, brief = (Simulation(t, often, {"a": Ship([5000.0, 8.0])}, sensors=half) for t in (400.0, 2.0))
    >>> made = drawn.open({"eye": CartesianPosition(1.0)}, rng)
    >>> z = np.concatenate([scan.detections.z[scan.detections.valid] for scan in made.scans])
    >>> own, false = z[z[:, 0] > 4000.0], z[z[:, 0] < 4000.0]
    >>> found = [len(own) / 801, len(false) / 801, *own.std(axis=0), *false.mean(axis=0), *false.std(axis=0)]
    >>> np.allclose(found, [0.6, 5e-4 * 100 * 200, 3.0, 3.0, 50.0, 50.0, 100 / 12**0.5, 200 / 12**0.5], rtol=0.1)
    True
    >>> made = brief.open_together(half, [np.random.default_rng(i) for i in range(300)])
    >>> last = made.scans[4].detections
    >>> own = last.valid & (last.z[..., 0] > 4000.0)
    >>> np.allclose([own.sum() / 300, (last.valid & ~own).sum() / 300, *last.z[own].std(axis=0)], [0.6, 10, 3, 3], rtol=0.1)
    True
    >>> run, place = np.nonzero(own)  # anywhere among the others
    >>> np.allclose(np.mean((place + 0.5) / last.valid.sum(axis=1)[run]), 0.5, rtol=0.1), made.states[7, 4].tolist()
    (True, [5000.0, 8.0, 0.0, 0.0])
    >>> looks, eyes = {"a": Look(2.0), "b": Look(2.0, first=1.0)}, {"a": CartesianPosition(3.0), "b": CartesianPosition(3.0)}
    >>> two = Simulation(4.0, looks, {"a": Ship([5000.0, 8.0])}).open_together(eyes, [rng])
    >>> [(scan.time, scan.sensor) for scan in two.scans]
    [(0.0, 'a'), (1.0, 'b'), (2.0, 'a'), (3.0, 'b'), (4.0, 'a')]
    >>> Simulation(2.0, often, {"a": Ship([5000.0, 8.0], disappears=1.0)}, sensors=half).open_together(half, [rng])
    """

    kind: ClassVar[str] = "simulation"

    duration: float = fields.quantity("s", "length of the scene, from 0", above=0)
    looks: Mapping[str, Look] = fields.part("sensor name to when it looks")
    ships: Mapping[str, Ship] = fields.part("name to an object that goes by legs", default=Factory(dict))
    drawn: Mapping[str, Drawn] = fields.part("name to an object that moves at random", default=Factory(dict))
    populations: Mapping[str, Population] = fields.part("name to objects that appear by a rate", default=Factory(dict))
    crossings: Mapping[str, Crossing] = fields.part("name to objects that meet", default=Factory(dict))
    convoys: Mapping[str, Convoy] = fields.part("name to objects in formation", default=Factory(dict))
    ownship: Ship | None = fields.part("what carries the sensors; default: they stand still where they are", default=None)
    sensors: Mapping[str, Sensor] = fields.part("the scene's sensor where it is not the tracker's", default=Factory(dict))

    def __attrs_post_init__(self) -> None:
        if not self.looks:
            raise ValueError("looks: must hold at least one sensor's look, got none")
        for name, look in self.looks.items():
            if self.duration / look.interval > _MOST_SCANS:
                raise ValueError(f"looks.{name}.interval: makes more than {_MOST_SCANS} scans of {self.duration:.6g} s")
            if look.first > self.duration:
                raise ValueError(f"looks.{name}.first: must not be after the end at {self.duration:.6g} s")
        for table, objects in (("ships", self.ships), ("drawn", self.drawn)):
            for name, each in objects.items():
                if each.appears >= self.duration:
                    raise ValueError(f"{table}.{name}.appears: must be before the end at {self.duration:.6g} s")
        if both := [name for name in self.drawn if name in self.ships]:
            raise ValueError(f"drawn.{both[0]}: a ship has this name too")
        taken = {*self.ships, *self.drawn}  # members are called NAME.1, NAME.2, ...
        for place, group in self._groups():
            name = place[1]
            if name in taken or any(other.startswith(f"{name}.") for other in taken):
                raise ValueError(f"{place[0]}.{name}: another object has this name too")
            taken.add(name)
            try:
                group.check(self.duration)
            except ValueError as error:
                raise ValueError(f"{place[0]}.{name}.{error}") from None
        for name in self.sensors:
            if name not in self.looks:
                raise ValueError(f"sensors.{name}: never looks; there are looks of {', '.join(self.looks)}")
        if self.ownship is not None:
            check_ownship(self.ownship)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans in time order, and the truth at every scan time. ConfigError if scene and sensors disagree."""
        root = int(rng.integers(2**63))
        world = {**sensors, **self.sensors}
        check_sensors(self.looks, sensors, world)
        times = {name: look.times(self.duration, _stream(root, "look", name)) for name, look in self.looks.items()}
        truth = tuple(self._truth(root, np.concatenate(list(times.values()))))
        check_axes(self.looks, world, truth)

        def draw() -> Iterator[Scan]:
            """Yield the scans in time order, those of one time in the order of the looks."""
            looks = (self._scans(root, name, world[name], times[name], truth) for name in self.looks)
            return merge(*looks, key=lambda scan: scan.time)

        count = sum(map(len, times.values()))
        if count <= _WHOLE:
            return Recording(tuple(draw()), truth, nobody=not truth)
        next(draw())  # what a sensor of this scene cannot do is an error now
        return Recording(LazyScene(count, draw), truth, nobody=not truth)

    def open_together(self, sensors: Mapping[str, Sensor], rngs: Sequence[np.random.Generator]) -> Scenes | None:
        """Draw the scene of each generator in lock-step; None unless it has one permanent object and scans at fixed times.

        These draws differ from those of `open`: a run takes all its numbers from one generator, in a fixed order.
        """
        world = {**sensors, **self.sensors}
        check_sensors(self.looks, sensors, world)
        objects: list[tuple[str, Ship | Drawn]] = [*self.ships.items(), *self.drawn.items()]
        if len(objects) != 1 or any(self._groups()) or any(look.jitter > 0 or look.missing for look in self.looks.values()):
            return None
        ((name, one),) = objects
        still = np.random.default_rng(0)
        gazes = []
        for sensor, look in self.looks.items():
            times = look.times(self.duration, still)
            poses = tuple(self._pose(time) for time in times.tolist())
            with _blamed_on(f"looks.{sensor}"):
                placed = tuple(world[sensor].placed(pose) for pose in poses)
            gazes.append(Gaze(sensor, times, placed, poses, look.clutter))
        scan_times = np.concatenate([gaze.times for gaze in gazes])
        last = self.duration if one.disappears is None else min(one.disappears, self.duration)
        if not len(scan_times) or np.any((scan_times < one.appears) | (scan_times > last)):
            return None
        times = np.unique([one.appears, *scan_times, last])
        if isinstance(one, Ship):
            space, states = PLANE, ship_states(one, times, rngs)
        else:
            space, states = common_state(one.models), drawn_states(one.models, one.start, one.transition, times, rngs)
        check_axes(self.looks, world, (Trajectory(name, space, times, states[0]),))
        scans = []
        for gaze in gazes:
            if len(gaze.times):
                at = np.searchsorted(times, gaze.times)
                with _blamed_on(f"looks.{gaze.name}"):
                    x = states[:, at][..., space.locate(world[gaze.name].observes)]
                    scans += look_together(gaze, x, rngs)
        scans.sort(key=lambda scan: scan.time)
        return Scenes(tuple(scans), space, states[:, np.searchsorted(times, [scan.time for scan in scans])])

    def _truth(self, root: int, scan_times: Array) -> Iterator[Trajectory]:
        """Yield every object over its life: when it appears, at each scan, when it disappears."""
        for name, ship in self.ships.items():
            times = life(ship.appears, ship.disappears, scan_times, self.duration)
            yield Trajectory(name, PLANE, times, ship.states(times))
        for name, drawn in self.drawn.items():
            yield drawn.path(name, scan_times, self.duration, _stream(root, "path", name))
        for place, group in self._groups():
            yield from group.members(place[1], scan_times, self.duration, _stream(root, *place))

    def _groups(self) -> Iterator[tuple[tuple[str, str], Population | Crossing | Convoy]]:
        """Yield the place in the config and the draw of each group of objects."""
        for table, groups in (("populations", self.populations), ("crossings", self.crossings), ("convoys", self.convoys)):
            for name, group in groups.items():
                yield (table, name), group

    def _scans(self, root: int, name: str, sensor: Sensor, times: Array, truth: tuple[Trajectory, ...]) -> Iterator[Scan]:
        """Yield all scans of one sensor."""
        m, clutter = len(sensor.measurement), self.looks[name].clutter
        views = Views(len(times), m, lambda object_name: _stream(root, "view", name, object_name))
        false, order = _stream(root, "clutter", name), _stream(root, "order", name)
        cells, gaps = self.looks[name].cells(sensor.measurement), _stream(root, "missing", name)
        report = returns
        if np.any(np.isfinite(cells)):
            report = partial(merged_returns, cells=cells)
        elif sensor.unresolved(np.zeros((1, len(sensor.observes)))) is not None:
            report = partial(merged_returns, cells=None, rng=_stream(root, "merge", name))
        for begin in range(0, len(times), BLOCK):
            block = times[begin : begin + BLOCK]
            near = [each for each in truth if each.times[0] <= block[-1] and block[0] <= each.times[-1]]
            uniform, standard = views.block([each.name for each in near], begin, begin + len(block))
            alive = np.empty((len(block), len(near)), dtype=bool)
            x = np.empty((len(block), len(near), len(sensor.observes)))
            for j, path in enumerate(near):
                alive[:, j], x[:, j] = _states(path, block, sensor.observes)
            for i, time in enumerate(block.tolist()):
                pose, here = self._pose(time), np.flatnonzero(alive[i])
                with _blamed_on(f"looks.{name}"):
                    placed = sensor.placed(pose)
                    z, seen = report(placed, x[i, here], uniform[here, i], standard[here, i])
                    if clutter is not None:
                        more, kept = draw_clutter(placed, clutter, false)
                        z, seen = np.concatenate([z, more]), np.concatenate([seen, kept])
                yield Scan(time, name, self.looks[name].with_gaps(shuffled(z, seen, order), sensor, gaps), pose)

    def _pose(self, time: float) -> Pose | None:
        return None if self.ownship is None else self.ownship.pose(time)


def _states(path: Trajectory, times: Array, axes: Space) -> tuple[Mask, Array]:
    """Return when `path` is there, (s,), and its states over `axes` at those of `times` (s,), which are its own: (s, n)."""
    there = (path.times[0] <= times) & (times <= path.times[-1])
    at = np.minimum(np.searchsorted(path.times, times), len(path.times) - 1)
    return there, path.states[at][:, path.space.locate(axes)]


def _stream(root: int, *names: str) -> np.random.Generator:
    """Return the random stream of a named part of the scene, independent of all others."""
    return np.random.default_rng([root, *"\0".join(names).encode()])


@contextmanager
def _blamed_on(place: str) -> Iterator[None]:
    """Name the part of the config that an error comes from."""
    try:
        yield
    except (ValueError, NotImplementedError) as error:
        raise ConfigError.at(place, str(error)) from error
