"""Components that are wrong in what they state of units, of false returns, of biases and of frames."""

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from vedette import Gaussian, Space
from vedette_flir.camera import Camera
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sensors.elliptic_spot import EllipticSpot
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_target_oriented.literal import TargetOrientedLiteral

RB, PWA, TURNS = RangeBearing, ConstantVelocityPiecewise, TargetOrientedLiteral
BIASED = {
    "of": st.just(RB(10.0, 0.01)), "add": st.just({"bearing": "turned"}), "offset": st.just({}), "lag": st.just(""),
    "spread": st.just({"turned": 0.01}),
}  # fmt: skip


def believed(change):
    """What one return gives, changed on the way out."""

    def invert(self, z, noise=None):
        found = type(self).__mro__[1].invert(self, z, noise)
        return Gaussian(found.mean, change(found.cov))

    return {"invert": invert}


def alone(cov):
    """Position and bias as if they had nothing to do with each other."""
    return cov * np.kron(np.eye(2), np.ones((2, 2)))[:3, :3]


def astern(self, own, combined):
    """A frame that lies north, wherever the target goes."""
    found = TURNS.reframe(self, own, combined)
    mean = np.array(found.mean)
    mean[..., 4] = 0.5
    return evolve(found, mean=mean)


def framed(self, x, frame, at):
    """A frame with a black border."""
    wide = np.pad(frame.pixels, ((0, 12), (0, 12)))
    return GaussianSpot.information(self, x, evolve(frame, pixels=wide), at)


STATED = [
    ("a centroid in rows for columns", BoxCentroid, "worked_examples_hold", {"information": lambda s, x, frame, at: (
        BoxCentroid.information(s, x, evolve(frame, pixels=frame.pixels.T), at))}, {}),
    ("clutter even over range and stated over area", RB, "false_returns_spread_as_stated",
     {"clutter": lambda s, z: RB.clutter(evolve(s, clutter_uniform_over="range"), z)}, {}),
    ("a density per m for one per area", PolarPosition, "false_returns_spread_as_stated",
     {"clutter": lambda s, z: np.hypot(z[..., 0], z[..., 1]) * PolarPosition.clutter(s, z)}, {}),
    ("a lag that moves along alone", Biased, "a_lag_goes_along_the_velocity",
     {"measure": lambda s, x: Biased.measure(s, x * [1, 1, 1, 0, 1])},
     BIASED | {"lag": st.just("late"), "add": st.just({})}),
    ("a deviation for a variance of a bias", Biased, "inverts_what_it_measures",
     believed(lambda cov: cov * np.where(np.arange(9).reshape(3, 3) == 8, 100.0, 1.0)), BIASED),
    ("a bias that moves no position", Biased, "a_sharp_return_inverts_exactly", believed(alone), BIASED),
    ("speeds in km/h", PositionVelocity, "differences_undo_steps",
     {"measurement": property(lambda s: Space.of(x="m", y="m", vx="km/h", vy="km/h"))}, {}),
    ("a gain of T^3 / 2", PWA, "velocities_move_their_positions",
     {"covariance": lambda s, dt: s.sigma_accel**2 * np.outer([dt**3 / 2, dt], [dt**3 / 2, dt])}, {}),
    ("saturated pixels that count", GaussianSpot, "unseen_pixels_are_as_dead_ones",
     {"information": lambda s, x, frame, at: GaussianSpot.information(evolve(s, camera=Camera(3.0)), x, frame, at)},
     {"camera": st.just(Camera(3.0, saturation=200.0))}),
    ("learns twice as fast as its gains", GaussianSpot, "learning_leaves_the_place",
     {"learn": lambda s, x, frame: 2.0 * GaussianSpot.learn(s, x, frame) - x}, {}),
    ("spots wider than their spread", GaussianSpot, "frames_look_as_named", {"draw_frame": lambda s, x, shape, rng: (
        GaussianSpot.draw_frame(s, x * [1.0, 1.0, 1.0, 1.1, 1.0], shape, rng))}, {}),
    ("spots that lean the other way", EllipticSpot, "frames_look_as_named", {"draw_frame": lambda s, x, shape, rng: (
        EllipticSpot.draw_frame(s, x * [1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0], shape, rng))}, {}),
    ("black beyond the edge", GaussianSpot, "unseen_pixels_are_as_dead_ones", {"information": framed}, {}),
    ("a twin's returns that count less", ExtendedKalman, "sees_by_a_twin_as_without",
     {"evaluate": lambda s, belief, sensor, observed, p_gate: ExtendedKalman.evaluate(
         s, belief, sensor, observed, p_gate * (0.9 if sensor.twin else 1.0))}, {}),
    ("a frame that does not turn", TURNS, "reframing_keeps_a_belief", {"reframe": astern}, {}),
]  # fmt: skip
