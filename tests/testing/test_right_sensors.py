"""Sensors that laws once failed although right, or held although wrong: a tail of clutter, a velocity across the sight."""

import re

import numpy as np
import pytest
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette import Array, Gaussian, Sensor, Space, fields
from vedette.testing import FAST, Misuse, examine, laws_of
from vedette.testing.strategies import components
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate


def verdict(cls, name, **given):
    law = next(law for law in laws_of(cls) if law.name == name)
    return examine(cls, law, components(cls, given), evolve(FAST, shrink=False)).verdict


@frozen
class Fading(Sensor):
    """Ranges, with false returns that fade as exp(-r / reach) and have no end."""

    kind = "test_fading"
    observes = Space.of(x="m", y="m")
    measurement = Space.of(range="m", bearing="rad mod 2pi")
    clutter_per_scan: float = fields.quantity("1", "false returns", at_least=0)
    reach: float = fields.quantity("m", "their mean range", above=0)
    factor: float = fields.quantity("1", "how many times too many, or with 0 without its norm", default=1, at_least=0)

    def measure(self, x):
        return np.stack([np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])], axis=-1)

    def noise(self, x):
        return np.diag([1.0, 1e-4])

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z: Array) -> Array:
        norm = self.factor / self.reach if self.factor else 1.0
        return norm * self.clutter_per_scan * np.exp(-np.maximum(z[..., 0], 0.0) / self.reach) / (2 * np.pi)


@pytest.mark.parametrize(("factor", "wanted"), [(1.0, "held"), (1.1, "failed"), (0.0, "failed")])
def test_clutter_that_fades_without_end_is_integrated(factor, wanted):
    given = {"clutter_per_scan": st.floats(1.0, 9.0), "reach": st.floats(5.0, 300.0), "factor": st.just(factor)}
    assert verdict(Fading, "false_returns_add_up", **given) == wanted


@frozen
class Secondary(Sensor):
    """Slant range, bearing and height, whose box `covers` alone tells; `shape` says what of it, and with which density."""

    kind = "test_secondary"
    observes = Space.of(x="m", y="m", z="m")
    measurement = Space.of(range="m", bearing="rad mod 2pi", height="m")
    clutter_per_scan: float = fields.quantity("1", "false returns", at_least=0)
    factor: float = fields.quantity("1", "how many times too many", default=1, at_least=0)
    shape: str = fields.choice("what it covers", ["box", "open", "skew"], default="box")
    max_range: float = fields.quantity("m", "range", default=9000, above=0)
    top: float = fields.quantity("m", "height", default=3000, above=0)

    def measure(self, x):
        return np.stack([np.sqrt(np.sum(x**2, axis=-1)), np.arctan2(x[..., 1], x[..., 0]), x[..., 2]], axis=-1)

    def noise(self, x):
        return np.diag([1.0, 1e-4, 1.0])

    def detects(self, x):
        return np.array(0.9)

    def covers(self, z):
        if self.shape == "open":
            return np.ones((), dtype=bool)
        low = 0.5 * z[..., 0] if self.shape == "skew" else 0.0
        return (z[..., 0] <= self.max_range) & (low <= z[..., 2]) & (z[..., 2] <= low + self.top)

    def clutter(self, z: Array) -> Array:
        return np.array(self.factor * self.clutter_per_scan / (self.max_range * 2 * np.pi * self.top))


@pytest.mark.parametrize(
    ("factor", "shape", "wanted"),
    [
        (1.0, "box", "held"),
        (2.0, "box", "failed"),
        (1e6, "box", "failed"),
        (0.0, "box", "failed"),
        (1e6, "open", "skipped"),
        (0.0, "open", "skipped"),
        (1.0, "skew", "skipped"),
    ],
)
def test_clutter_is_integrated_over_what_is_covered_or_not_judged(factor, shape, wanted):
    """An axis without an end was held whatever its density: a draw of no false returns at all was right."""
    size = {"max_range": st.just(9000.0), "top": st.just(3000.0), "factor": st.just(factor), "shape": st.just(shape)}
    drawn = {"clutter_per_scan": st.sampled_from([0.0, 1.0, 7.0]), **size}
    assert verdict(Secondary, "false_returns_add_up", **drawn) == wanted


@frozen
class Arrivals(Sensor):
    """Differences of ranges to four stations: false returns in the box of what there can be."""

    kind = "test_arrivals"
    observes = Space.of(x="m", y="m")
    measurement = Space.of(d1="m", d2="m", d3="m")
    stations: Array = fields.array("m", "x and y of each of four stations, a row each", ndim=2)
    clutter_per_scan: float = fields.quantity("1", "false returns", default=1, at_least=0)
    factor: float = fields.quantity("1", "how many times too many", default=1, at_least=0)

    def __attrs_post_init__(self):
        if self.stations.shape != (4, 2):
            raise ValueError(f"stations: must be four rows of x and y, got shape {self.stations.shape}")

    def measure(self, x):
        r = np.linalg.norm(x[..., None, :] - self.stations, axis=-1)
        return r[..., 1:] - r[..., :1]

    def noise(self, x):
        return np.eye(3) + 1.0

    def detects(self, x):
        return np.array(0.9)

    def covers(self, z):
        return np.all(np.abs(z) <= np.linalg.norm(self.stations[1:] - self.stations[0], axis=-1), axis=-1)

    def clutter(self, z: Array) -> Array:
        apart = np.linalg.norm(self.stations[1:] - self.stations[0], axis=-1)
        return np.array(self.factor * self.clutter_per_scan / np.prod(2 * apart))


@pytest.mark.parametrize(("factor", "wanted"), [(1.0, "held"), (8.0, "failed")])
def test_clutter_over_axes_without_a_parameter_of_their_own(factor, wanted):
    corners = st.just(np.array([(0.0, 0.0), (3000.0, 100.0), (-200.0, 2500.0), (2500.0, 3000.0)]))
    assert verdict(Arrivals, "false_returns_add_up", stations=corners, factor=st.just(factor)) == wanted


def test_what_a_class_refuses_of_all_that_is_guessed_is_named():
    with pytest.raises(Misuse, match=r"Arrivals.*stations.*four"):
        verdict(Arrivals, "false_returns_add_up")


def test_where_a_sensor_sees_what_it_does_not_cover_is_told():
    law = next(law for law in laws_of(Secondary) if law.name == "sees_nothing_where_it_covers_nothing")
    told = examine(Secondary, law, components(Secondary), FAST)
    x, y, z = (float(value) for value in re.search(r"at x (\S+), y (\S+), z (\S+)", told.text).groups())
    assert z < 0 or z > 3000 or np.hypot(np.hypot(x, y), z) > 1


@frozen
class Turned(RangeBearingRate):
    """Allows, in the velocity along the line of sight, for the bearing's error times the unknown velocity across it."""

    kind = "test_turned"
    share: float = fields.quantity("1", "of that allowance", default=1, at_least=0)

    def invert(self, z, noise=None):
        found = RangeBearingRate.invert(self, z, noise)
        R = np.broadcast_to(self.noise(z) if noise is None else noise, (*z.shape, 3))
        angle = z[..., 1] + np.asarray(self._pose.heading)
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        cov = np.array(found.cov)
        more = self.share * self.crossing_speed**2 * R[..., 1, 1]
        cov[..., 2:, 2:] += more[..., None, None] * along[..., :, None] * along[..., None, :]
        return Gaussian(found.mean, cov)


@pytest.mark.parametrize(("share", "wanted"), [(1.0, "held"), (10.0, "failed")])
@pytest.mark.parametrize("law", ["a_sharp_return_inverts_exactly", "inverts_where_it_stands"])
@pytest.mark.by_turns
def test_an_inverse_may_allow_for_what_a_bearings_error_makes_of_an_unknown_velocity(law, share, wanted):
    given = {"sigma_bearing": st.just(0.1), "sigma_rate": st.just(1.0), "crossing_speed": st.just(20.0)}
    given |= {"max_range": st.just(5000.0), "max_rate": st.just(50.0), "clutter_density": st.just(0.0)}
    assert verdict(Turned, law, **given, share=st.just(share)) == wanted
