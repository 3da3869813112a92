"""Scenes of nobody, of one look, of a world that closes on itself, of platforms that move, of positions alone, of km."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.source_scenes import WHOLE, in_order, seen
from vedette.space import Axis, Space


def straight(name, times, place, v):
    """Return a target that moves evenly in space."""
    states = np.concatenate([place + (times - times[0])[:, None] * v, np.broadcast_to(v, (len(times), 3))], axis=-1)
    return vedette.Trajectory(name, WHOLE, times, states)


@frozen
class Nobody(vedette.Source):
    """Looks at an empty world: scans without returns, no truth.

    Streit, Poisson Point Processes, 2010 (the void probability).
    """

    kind = "nobody"
    draws = False
    duration: float = vedette.fields.quantity("min", "from the first look to the last", default=1, at_least=0.5, at_most=9)

    def open(self, sensors, rng):
        times = np.linspace(0.0, 60.0 * self.duration, 12)
        scans = [
            scan for name, sensor in sensors.items() for scan in seen(name, sensor, [], times, np.random.default_rng(0))
        ]
        return vedette.Recording(in_order(scans), ())


@frozen
class Convoy(vedette.Source):
    """Three vehicles at one speed, some of which turn off; looks come in bursts with long gaps between them.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 11.3 (group tracking).
    """

    kind = "convoy"
    speed: float = vedette.fields.quantity("m/s", "of all", default=12, at_least=1, at_most=30)
    gap: float = vedette.fields.quantity("s", "between bursts of five looks", default=20, at_least=5, at_most=60)

    def open(self, sensors, rng):
        looks = np.concatenate([burst * (self.gap + 5.0) + np.arange(5.0) for burst in range(10)])
        times = np.arange(0.0, looks[-1] + 0.5, 0.5)
        paths = [straight(f"vehicle {i}", times, np.array([900.0, 700.0 + 400 * i, 0.0]), np.array([self.speed, 0.0, 0.0]))
                 for i in range(3)]  # fmt: skip
        scans = [scan for name, sensor in sensors.items() for scan in seen(name, sensor, paths, looks, rng)]
        return vedette.Recording(in_order(scans), tuple(paths))


@frozen
class Platforms(vedette.Source):
    """Two targets from a ship that sails and heads where it sails: each scan brings its pose, where the sensor takes one.

    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, chapter 1.
    """

    kind = "platforms"
    knots: float = vedette.fields.quantity("m/s", "of the ship, to the east", default=6, at_least=0, at_most=15)

    def open(self, sensors, rng):
        times, looks = np.arange(0.0, 121.0, 1.0), np.arange(1.0, 120.0, 3.0)
        paths = [straight(f"target {i}", times, np.array([2500.0, 1500.0 - 3000 * i, 40.0]), np.array([-5.0, 3.0 * i, 0.0]))
                 for i in range(2)]  # fmt: skip
        scans = []
        for name, sensor in sensors.items():
            for look in looks:
                pose = vedette.Pose(np.array([self.knots * look, 0.0]), np.array([self.knots, 0.0]), 0.3)
                try:
                    there = sensor.at(pose)
                except NotImplementedError:
                    pose, there = None, sensor
                ((scan),) = seen(name, there, paths, [look], rng)
                scans.append(vedette.Scan(scan.time, name, scan.detections, pose))
        return vedette.Recording(in_order(scans), tuple(paths))


@frozen
class Dots(vedette.Source):
    """Targets at rest, of whom the truth knows positions in space alone; a sensor that asks for velocities sees none move.

    Streit, Poisson Point Processes, 2010, chapter 2.
    """

    kind = "dots"
    number: int = vedette.fields.integer("of targets", default=4, at_least=2, at_most=6)

    def open(self, sensors, rng):
        space, times = Space.of(x="m", y="m", z="m"), 2.0 * np.arange(40)
        at = rng.uniform(-3000.0, 3000.0, (self.number, 3)) + np.array([0.0, 0.0, 3500.0])
        still = [np.concatenate([np.tile(one, (len(times), 1)), np.zeros((len(times), 3))], axis=-1) for one in at]
        whole = [vedette.Trajectory(f"dot {i}", WHOLE, times, states) for i, states in enumerate(still)]
        scans = [scan for name, sensor in sensors.items() for scan in seen(name, sensor, whole, times, rng)]
        truth = [vedette.Trajectory(path.name, space, path.times, path.states[:, :3]) for path in whole]
        return vedette.Recording(in_order(scans), tuple(truth))


@frozen
class Helixes(vedette.Source):
    """Aircraft that climb in circles, one after the other, with a course and a rate of turn in the truth beside velocities.

    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I, IEEE T-AES 39, 2003.
    """

    kind = "helixes"
    turn: float = vedette.fields.quantity("rad/s", "to the left", default=0.05, at_least=0.02, at_most=0.2)
    climb: float = vedette.fields.quantity("m/s", "upward", default=4, at_least=0, at_most=20)

    def open(self, sensors, rng):
        space = Space((*WHOLE.axes, Axis("heading", "rad", 2 * np.pi), Axis("turn_rate", "rad/s")))
        paths, looks = [], np.arange(1.0, 150.0, 4.0)
        for i in range(2):
            times = np.arange(0.0, 90.1, 0.1) + 60.0 * i
            a, v = self.turn * (times - times[0]) + i, 50.0
            c, s, one = np.cos(a), np.sin(a), np.ones(len(times))
            r, rise = v / self.turn, self.climb * (times - times[0])
            rows = [5000.0 * (1 - 2 * i) + r * s, -r * c, 800.0 + rise, v * c, v * s, self.climb * one, a, self.turn * one]
            states = space.canonical(np.stack(rows, axis=-1))
            paths.append(vedette.Trajectory(f"aircraft {i}", space, times, states))
        scans = [scan for name, sensor in sensors.items() for scan in seen(name, sensor, paths, looks, rng)]
        return vedette.Recording(in_order(scans), tuple(paths))


COMPONENTS = (
    Foreign("nobody", "source", Nobody),
    Foreign("convoy", "source", Convoy),
    Foreign("platforms", "source", Platforms),
    Foreign("dots", "source", Dots),
    Foreign("helixes", "source", Helixes),
)
