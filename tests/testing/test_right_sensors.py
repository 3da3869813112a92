"""Sensors that laws once failed although right, or held although wrong: a tail of clutter, a velocity across the sight."""

import numpy as np
import pytest
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette import Array, Gaussian, Sensor, Space, fields
from vedette.testing import FAST, examine, laws_of
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
