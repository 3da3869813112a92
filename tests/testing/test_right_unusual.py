"""Right components of shapes that no installed kind has keep every law; each fault that was once listed has its mutant."""

import numpy as np
import pytest
from attrs import evolve, frozen
from hypothesis import strategies as st

from support.mutants.table import MUTANTS
from vedette import (
    Detections,
    Gaussian,
    ImagingSensor,
    MotionModel,
    Preprocessor,
    Recording,
    Scan,
    Sensor,
    Source,
    Space,
    Trajectory,
    fields,
)
from vedette.sampling import returns
from vedette.space import Axis
from vedette.testing import FAST, examine, laws_of
from vedette.testing.strategies import components
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

AMPLITUDE, SPREAD = 40.0, 2.0
RING = Space((Axis("s", "m", 10_000.0),))


@frozen
class PolarCamera(ImagingSensor):
    """Places a round spot of known looks by its distance and direction from a corner of the picture."""

    kind = "test_polar_camera"
    observes = Space.of(x="px", y="px")
    measurement = Space.of(radius="px", azimuth="rad mod 2pi")

    def measure(self, x):
        return np.stack([np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])], axis=-1)

    def noise(self, x):
        out = self._out(x)
        H = np.linalg.inv(out)
        return H @ np.swapaxes(H, -1, -2) * 2.0 / (np.pi * AMPLITUDE**2)

    def detects(self, x):
        return np.ones(())

    def _out(self, x):
        """The derivative of the place to radius and azimuth."""
        r, angle = np.moveaxis(self.measure(x), -1, 0)
        r = np.maximum(r, 1.0)
        return np.stack(
            [np.stack([np.cos(angle), -r * np.sin(angle)], -1), np.stack([np.sin(angle), r * np.cos(angle)], -1)], -2
        )

    def _spot(self, x, shape, corner):
        rows, columns = np.indices(shape)
        d = np.stack([columns, rows]) + np.reshape(corner, (2, 1, 1)) - x[..., None, None]
        return d / SPREAD**2, AMPLITUDE * np.exp(-np.sum(d * d, axis=-3) / (2 * SPREAD**2))

    def information(self, x, frame, at):
        slope, image = self._spot(at, frame.pixels.shape[-2:], np.zeros(2) if frame.corner is None else frame.corner)
        pixels = frame.pixels if frame.pixels.ndim == 2 else frame.pixels[..., None, :, :]
        seen = np.broadcast_to(~np.isnan(pixels), image.shape)
        rest = np.where(seen, np.nan_to_num(pixels) - image, 0.0)
        D = slope * (image * seen)[..., None, :, :]
        J, g = np.einsum("...ahw,...bhw->...ab", D, D), np.einsum("...ahw,...hw->...a", D, rest)
        out = self._out(at)
        llr = np.sum(np.where(seen, image * (rest + 0.5 * image), 0.0), axis=(-2, -1))
        return np.swapaxes(out, -1, -2) @ J @ out, (np.swapaxes(out, -1, -2) @ g[..., None])[..., 0], llr

    def draw_frame(self, x, shape, rng):
        return self._spot(x, shape, np.zeros(2))[1] + rng.standard_normal((*x.shape[:-1], *shape))


@frozen
class WithMiddles(Preprocessor):
    """Passes returns on, and between two that are close gives a third, less sharp one."""

    kind = "test_with_middles"
    sensors: dict[str, CartesianPosition] = fields.part("the one sensor")
    near: float = fields.quantity("m", "distance below which two have a middle", above=0)

    @property
    def measurement(self):
        return Space.of(x="m", y="m")

    def process(self, scans):
        ((name, scan),) = scans.items()
        z, valid, k = scan.detections.z, scan.detections.valid, scan.detections.z.shape[-2]
        i, j = np.triu_indices(k, 1)
        close = valid[..., i] & valid[..., j] & (np.linalg.norm(z[..., i, :] - z[..., j, :], axis=-1) < self.near)
        R = (
            np.broadcast_to(self.sensors[name].noise(z), (*z.shape, 2))
            if scan.detections.noise is None
            else scan.detections.noise
        )
        middle = 0.5 * (z[..., i, :] + z[..., j, :])
        wide = R[..., i, :, :] + R[..., j, :, :] + self.near**2 * np.eye(2)
        own = np.zeros(valid.shape) if scan.detections.evidence is None else scan.detections.evidence
        evidence = np.concatenate([own, np.zeros(close.shape)], axis=-1)
        codes, time = scan.detections.identity, scan.detections.time
        return Detections(
            np.concatenate([z, middle], -2), np.concatenate([valid, close], -1), evidence, np.concatenate([R, wide], -3),
            identity=None if codes is None else np.concatenate([codes, np.full(close.shape, -1)], -1),
            time=None if time is None else np.concatenate([time, np.maximum(time[i], time[j])]),
        )  # fmt: skip


@frozen
class Flight(Source):
    """One target that rises steadily, for any sensor of position and velocity in space."""

    kind = "test_flight"
    duration: float = fields.quantity("s", "length", above=0)

    def open(self, sensors, rng):
        ((name, sensor),) = list(sensors.items())[-1:]
        space = Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s")
        times = np.arange(0.0, self.duration, 0.5)
        v = np.array([30.0, -20.0, 5.0])
        states = np.concatenate([[500.0, 300.0, 100.0] + times[:, None] * v, np.broadcast_to(v, (len(times), 3))], axis=-1)
        x, scans = states[:, space.locate(sensor.observes)], []
        for time, own in zip(times.tolist(), x, strict=True):
            z, seen = returns(sensor, own[None], rng.random(1), rng.standard_normal((1, len(sensor.measurement))))
            scans.append(Scan(time, name, Detections.of(z[seen], len(sensor.measurement))))
        return Recording(tuple(scans), (Trajectory("flight", space, times, states),))


@frozen
class Ring(Sensor):
    """The place on a track of 10 km that closes on itself, from where it is turned to."""

    kind = "test_ring"
    observes = RING
    measurement = RING
    sigma: float = fields.quantity("m", "deviation", above=0)

    def measure(self, x):
        return self.measurement.canonical(x)

    def noise(self, x):
        return self.sigma**2 * np.eye(1)

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z):
        return np.array(1e-4)

    def invert(self, z, noise=None):
        R = self.noise(z) if noise is None else noise
        return Gaussian(z, np.broadcast_to(R, (*z.shape, 1)))


@frozen
class Compass(Sensor):
    """A bearing from a platform that heads somewhere; `wraps` is right."""

    kind = "test_compass"
    observes = Space.of(x="m", y="m")
    measurement = Space.of(bearing="rad mod 2pi")
    heading: float = fields.quantity("rad", "of the platform")
    wraps: bool = fields.flag("angles are brought back to the circle", default=True)

    def measure(self, x):
        angle = (np.arctan2(x[..., 1], x[..., 0]) - self.heading)[..., None]
        return self.measurement.canonical(angle) if self.wraps else angle

    def noise(self, x):
        return np.array([[1e-4]])

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z):
        return np.array(0.01)


def turned(x, angle):
    return x @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


@frozen
class Clock(MotionModel):
    """A hand that turns steadily and surely; linear, and states no Jacobian."""

    kind = "test_clock"
    linear = True
    rate: float = fields.quantity("rad/s", "turn", at_least=-1, at_most=1)
    state = Space.of(a="m", b="m")

    def move(self, x, dt):
        return turned(x, self.rate * dt)

    def noise(self, x, dt):
        return np.zeros((2, 2))


@frozen
class Askew(Sensor):
    """A position in a frame that is turned; linear, and states no Jacobian."""

    kind = "test_askew"
    linear = True
    observes = Space.of(x="m", y="m")
    measurement = Space.of(a="m", b="m")
    angle: float = fields.quantity("rad", "of the frame", at_least=-3, at_most=3)

    def measure(self, x):
        return turned(x, -self.angle)

    def noise(self, x):
        return np.eye(2)

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z):
        return np.array(1e-6)


def outcomes(cls, seed=0, **given):
    return [examine(cls, law, components(cls, given), evolve(FAST, shrink=False, seed=seed)) for law in laws_of(cls)]


SHAPES = [
    pytest.param(PolarCamera, {}, 19, id="a camera over polar axes"),
    pytest.param(WithMiddles, {"sensors": st.just({"radar": CartesianPosition(5.0)}), "near": st.floats(10.0, 99.0)}, 6,
                 id="a preprocessor of two kinds of return"),
    pytest.param(Flight, {"duration": st.floats(5.0, 20.0)}, 10, id="a source in space, with velocities"),
    pytest.param(Ring, {}, 12, id="a period of 10 km"),
    pytest.param(Clock, {}, 12, id="a linear motion without a Jacobian"),
    pytest.param(Askew, {}, 11, id="a linear sensor without a Jacobian"),
    pytest.param(Compass, {"wraps": st.just(True)}, 11, id="a heading"),
    pytest.param(ExtendedKalman, {"motion": st.just(ConstantVelocity(0.5, axes=("y", "x")))}, 30, id="y before x"),
]  # fmt: skip


@pytest.mark.costly
@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.parametrize(("cls", "given", "least"), SHAPES)
def test_right_components_of_other_shapes_keep_the_laws(cls, given, least):
    found = outcomes(cls, **given)
    assert [(one.law.name, one.text) for one in found if one.verdict == "failed"] == []
    assert sum(one.verdict == "held" for one in found) >= least


@pytest.mark.costly
def test_a_bearing_from_a_heading_must_wrap():
    assert any(one.verdict == "failed" for one in outcomes(Compass, wraps=st.just(False)))


LISTED = (
    "score of the wrong sign", "dead pixels as dark ones", "a corner that is forgotten", "rows for columns", "J by sigma",
    "half a pixel", "half a pixel, in a box", "a quarter of the noise", "the background kept", "bearings beyond a turn",
    "velocities of the wrong sign", "targets that are always seen", "returns in the order of targets",
    "surer the more it is claimed", "the thirty-first return", "ties by chance", "keeps in place",
    "evidence that is dropped", "a range in the plane", "returns in a row", "R over the other axes",
    "ends above its least existence",
)  # fmt: skip
"""What an outsider's list of missed faults names, by the words of our mutants; `test_mutants` shows that each is caught."""


def test_each_listed_fault_has_a_mutant():
    assert set(LISTED) <= {row[0] for row in MUTANTS}
    assert {row[2] for row in MUTANTS} >= {"headings_lead_the_way", "velocities_move_their_positions"}
