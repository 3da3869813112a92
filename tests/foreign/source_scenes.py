"""Scenes: targets that cross in turn, circle, lie at anchor, wander; one that is given, and one that is filmed."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from vedette.sampling import Bounds, draw_detections

WHOLE = vedette.Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s")


def seen(name, sensor, paths, times, rng, region=None):
    """Return a scan at each time of those that are there, in random order, and false returns within a region."""
    scans = []
    for time in times:
        states = [(path, path.at(time)) for path in paths]
        x = [state[path.space.locate(sensor.observes)] for path, state in states if state is not None]
        x = np.reshape(x, (len(x), len(sensor.observes)))
        scans.append(vedette.Scan(float(time), name, draw_detections(sensor, x, rng, region)))
    return scans


def in_order(scans):
    return tuple(sorted(scans, key=lambda scan: scan.time))


@frozen
class Procession(vedette.Source):
    """Aircraft pass one after the other at their own heights, each seen for a while; sensors look in turn.

    Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, chapter 1 (periodic surveillance).
    """

    kind = "procession"
    period: float = vedette.fields.quantity("s", "between looks", default=4, at_least=1, at_most=10)
    number: int = vedette.fields.integer("aircraft", default=3, at_least=1, at_most=5)

    def open(self, sensors, rng):
        rngs, paths = rng.spawn(1 + len(sensors)), []
        for i in range(self.number):
            v = np.array([60.0, 20.0, 1.0]) * rngs[0].uniform(0.8, 1.2, 3)
            times = 20.0 * i + np.arange(0.0, 61.0, 5.0)
            place = np.array([2000.0 + 300 * i, -4000.0 * i, 900.0]) + (times - times[0])[:, None] * v
            states = np.concatenate([place, np.broadcast_to(v, place.shape)], axis=-1)
            paths.append(vedette.Trajectory(f"aircraft {i + 1}", WHOLE, times, states))
        end, scans = max(path.times[-1] for path in paths), []
        for k, (name, sensor) in enumerate(sensors.items()):
            times = np.arange(self.period * k / len(sensors), end, self.period)
            scans += seen(name, sensor, paths, times, rngs[1 + k])
        return vedette.Recording(in_order(scans), tuple(paths))


@frozen
class Roundabout(vedette.Source):
    """Vehicles go round on a circle at a steady speed; looks come at random times.

    Kingman, Poisson Processes, 1993.
    """

    kind = "roundabout"
    radius: float = vedette.fields.quantity("m", "of the circle", default=800, at_least=100, at_most=5000)
    speed: float = vedette.fields.quantity("m/s", "along it", default=15, at_least=2, at_most=40)
    wait: float = vedette.fields.quantity("s", "mean time between looks", default=2, at_least=0.5, at_most=5)

    def open(self, sensors, rng):
        looks = np.cumsum(rng.exponential(self.wait, 60))
        times, w = np.arange(0.0, looks[-1] + 0.1, 0.05), self.speed / self.radius
        paths = []
        for i, phase in enumerate((0.0, 2.0)):
            c, s = np.cos(w * times + phase), np.sin(w * times + phase)
            flat = np.zeros(len(times))
            states = [3000 + self.radius * c, 1000 + self.radius * s, flat, -self.speed * s, self.speed * c, flat]
            paths.append(vedette.Trajectory(f"vehicle {i}", WHOLE, times, np.stack(states, axis=-1)))
        ((name, sensor), *others) = sensors.items()
        scans = [seen(each, of, paths, looks, rng) for each, of in ((name, sensor), *others)]
        return vedette.Recording(in_order([scan for each in scans for scan in each]), tuple(paths))


@frozen
class AtAnchor(vedette.Source):
    """Vessels that do not move; false returns by the sensor's own density in a square, no more than 36 in a scan.

    Streit, Poisson Point Processes, 2010.
    """

    kind = "at_anchor"
    looks: int = vedette.fields.integer("looks", default=30, at_least=10, at_most=100)

    def open(self, sensors, rng):
        times = np.arange(self.looks) * 3.0
        at = rng.uniform(-2000.0, 2000.0, (3, 2))
        rest = np.zeros((len(times), 4))
        paths = [
            vedette.Trajectory(f"vessel {i}", WHOLE, times, np.concatenate([np.tile(one, (len(times), 1)), rest], axis=-1))
            for i, one in enumerate(at)
        ]
        scans = []
        for name, sensor in sensors.items():
            plain = set(sensor.measurement.names) == {"x", "y"}
            dense = float(np.max(sensor.clutter(np.zeros((1, 2))))) if plain else 0.0
            side = min(3000.0, 3.0 / np.sqrt(max(dense, 1e-12)))  # no more than 36 in a scan
            region = dict.fromkeys("xy", Bounds(-side, side)) if plain else None
            scans += seen(name, sensor, paths, times, rng, region)
        return vedette.Recording(in_order(scans), tuple(paths))


@frozen
class Wanderers(vedette.Source):
    """Velocities of an Ornstein-Uhlenbeck process, integrated in fine steps; looks jitter about their period.

    Millefiori et al., Modeling vessel kinematics using a stochastic mean-reverting process, IEEE TAES 52, 2016.
    """

    kind = "wanderers"
    memory: float = vedette.fields.quantity("s", "of a velocity", default=30, at_least=5, at_most=200)
    speed: float = vedette.fields.quantity("m/s", "deviation of a velocity", default=8, at_least=0.5, at_most=20)

    def open(self, sensors, rng):
        step, count = 0.25, 500
        keep = np.exp(-step / self.memory)
        times, paths = step * np.arange(count), []
        for i in range(2):
            v = np.zeros((count, 3))
            v[0] = self.speed * rng.standard_normal(3)
            for k in range(1, count):
                v[k] = keep * v[k - 1] + self.speed * np.sqrt(1 - keep**2) * rng.standard_normal(3)
            moved = np.concatenate([np.zeros((1, 3)), np.cumsum(step * (v[1:] + v[:-1]) / 2, axis=0)])
            place = moved + np.array([1500.0, -900.0 + 4000.0 * i, 50.0])
            paths.append(vedette.Trajectory(f"wanderer {i}", WHOLE, times, np.concatenate([place, v], axis=-1)))
        looks, scans = 2.0 * np.arange(1, 60), []
        for name, sensor in sensors.items():
            scans += seen(name, sensor, paths, looks + rng.uniform(-0.5, 0.5, len(looks)), rng)
        return vedette.Recording(in_order(scans), tuple(paths))


@frozen
class Given(vedette.Source):
    """Twenty looks at one target that somebody wrote down, for a sensor of whatever axes: nothing is drawn."""

    kind = "written_down"
    draws = False
    shift: float = vedette.fields.quantity("m", "where it begins, along x", default=100, at_least=-1000, at_most=1000)

    def open(self, sensors, rng):
        times, v = 5.0 * np.arange(20), np.array([3.0, -2.0, 0.0])
        place = np.array([self.shift, 400.0, 20.0]) + times[:, None] * v
        path = vedette.Trajectory("boat", WHOLE, times, np.concatenate([place, np.tile(v, (20, 1))], axis=-1))
        scans = []
        for name, sensor in sensors.items():
            z = sensor.measurement.canonical(sensor.measure(path.states[:, WHOLE.locate(sensor.observes)]))
            scans += [
                vedette.Scan(time, name, vedette.Detections.of(one[None], z.shape[-1]))
                for time, one in zip(times.tolist(), z, strict=True)
            ]
        return vedette.Recording(in_order(scans), (path,))


@frozen
class Filmed(vedette.Source):
    """A dark box crosses a bright picture in white noise.

    Gonzalez, Woods, Digital Image Processing, 2018, chapter 5 (additive noise).
    """

    kind = "filmed"
    sigma: float = vedette.fields.quantity("1", "noise of a pixel, in counts", default=2, at_least=0.5, at_most=5)
    level: float = vedette.fields.quantity("1", "of the background, in counts", default=90, at_least=50, at_most=120)

    def open(self, sensors, rng):
        if not all(isinstance(sensor, vedette.ImagingSensor) for sensor in sensors.values()):
            raise vedette.errors.ConfigError.at("sensors", "must be cameras")
        times, space = 0.04 * np.arange(12), vedette.Space.of(x="px", y="px", vx="px/s", vy="px/s")
        v = np.array([40.0, 15.0])
        at = np.array([18.0, 14.0]) + times[:, None] * v
        path = vedette.Trajectory("box", space, times, np.concatenate([at, np.tile(v, (len(times), 1))], axis=-1))
        rows, columns = np.indices((40, 60))
        scans = []
        for time, (x, y) in zip(times.tolist(), at, strict=True):
            box = (np.abs(columns - x) < 3) & (np.abs(rows - y) < 2)
            pixels = self.level + self.sigma * rng.standard_normal(box.shape) - 40.0 * box
            scans += [vedette.Scan.image(time, name, vedette.Frame(pixels)) for name in sensors]
        return vedette.Recording(tuple(scans), (path,))


COMPONENTS = (
    Foreign("procession", "source", Procession),
    Foreign("roundabout", "source", Roundabout),
    Foreign("at anchor", "source", AtAnchor),
    Foreign("wanderers", "source", Wanderers),
    Foreign("written down", "source", Given),
    Foreign("filmed", "source", Filmed),
)
