"""Sensors with one thing wrong."""

import numpy as np

from support.mutants.parts import CALLS, FromZero, Unwrapped, changed, over, put
from vedette import Space, Twin
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RB, CP = RangeBearing, CartesianPosition
POLAR = RB(1, 0.01).measurement
SENSORS = [
    ("bearing's slope with a wrong sign", RB, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x: put(H := RB.jacobian(s, x), 1, 0, -H[..., 1, 0])}),
    ("bearing's slope without 1 / range", RB, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x: changed(H := RB.jacobian(s, x), lambda c: np.copyto(c[..., 1, 0], -H[..., 0, 1]))}),
    ("slope in degrees", RB, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x: RB.jacobian(s, x) * [[1.0], [57.3]]}),
    ("atan instead of atan2", RB, "inverts_what_it_measures",
     {"measure": lambda s, x: changed(RB.measure(s, x), lambda z: np.copyto(
         z[..., 1], np.where(np.abs(z[..., 1]) > np.pi / 2, z[..., 1] - np.pi * np.sign(z[..., 1]), z[..., 1])))}),
    ("a bearing without a period", RB, "angles_wrap",
     {"measurement": property(lambda s: Space.of(range="m", bearing="rad"))}),
    ("residuals not wrapped", RB, "differences_undo_steps", {"measurement": over(POLAR, Unwrapped)}),
    ("bearing from 0 to 2 pi", RB, "measurement_lies_in_its_domain",
     {"measure": lambda s, x: np.mod(RB.measure(s, x), [np.inf, 2 * np.pi])}),
    ("canonical bearing from 0 to 2 pi", RB, "angles_wrap", {"measurement": over(POLAR, FromZero)}),
    ("a deviation's third power", CP, "noise_has_its_units", {"noise": lambda s, x: s.sigma**3 * np.eye(2)}),
    ("a deviation that is not used", CP, "deviations_count", {"noise": lambda s, x: 25.0 * np.eye(2)}),
    ("no noise on one axis", RB, "noise_is_positive_definite", {"noise": lambda s, x: np.diag([s.sigma_range**2, 0.0])}),
    ("noise not symmetric", CP, "noise_is_positive_definite",
     {"noise": lambda s, x: s.sigma**2 * np.array([[1.0, 0.5], [0.0, 1.0]])}),
    ("noise over-correlated", CP, "noise_is_positive_definite",
     {"noise": lambda s, x: s.sigma**2 * np.array([[1.0, 1.1], [1.1, 1.0]])}),
    ("cells not symmetric", CP, "noise_is_positive_definite",
     {"unresolved": lambda s, x: 100.0 * np.array([[1.0, 0.5], [0.0, 1.0]])}),
    ("one cell for the whole batch", CP, "batches_as_it_loops",
     {"unresolved": lambda s, x: np.eye(2) * (1.0 + np.abs(x).sum())}),
    ("detection above one", CP, "detection_is_a_probability", {"detects": lambda s, x: np.asarray(1.2)}),
    ("detection below zero far away", CP, "detection_is_a_probability", {"detects": lambda s, x: 1.0 - np.abs(x[..., 0])}),
    ("negative clutter", CP, "clutter_takes_any_number_of_returns", {"clutter": lambda s, z: z[..., 0]}),
    ("infinite clutter", CP, "clutter_takes_any_number_of_returns", {"clutter": lambda s, z: np.asarray(np.inf)}),
    ("writes into its argument", CP, "pure", {"measure": lambda s, x: np.add(x, 1.0, out=x)}),
    ("keeps a state between calls", CP, "pure", {"noise": lambda s, x: np.eye(2) * (1 + next(CALLS))}),
    ("first state's slope for all", RB, "batches_as_it_loops",
     {"jacobian": lambda s, x: RB.jacobian(s, x.reshape(-1, 2)[0]) if x.size else RB.jacobian(s, x)}),
    ("one detection for the whole batch", RB, "batches_as_it_loops",
     {"detects": lambda s, x: 0.5 + 0.4 * np.tanh(x[..., 0].mean() / 1e3) if x.size else np.asarray(0.5)}),
    ("axes swapped in the inverse", CP, "inverts_what_it_measures",
     {"invert": lambda s, z, noise=None: CP.invert(s, z[..., ::-1], noise)}),
    ("inverse without the bearing's sense", RB, "inverts_what_it_measures",
     {"invert": lambda s, z, noise=None: RB.invert(s, z * [1, -1], noise)}),
    ("a return's own noise ignored", CP, "a_sharp_return_inverts_exactly",
     {"invert": lambda s, z, noise=None: CP.invert(s, z)}),
    ("moved by being placed", CP, "standing_elsewhere_keeps_the_axes",
     {"at": lambda s, pose: RB(1.0, 0.01)}),
    ("polar declared linear", RB, "linear_as_declared", {"linear": True}),
    ("slope over the whole state", CP, "jacobian_is_the_derivative", {"jacobian": lambda s, x: np.eye(2, 4)}),
    ("noise of crowded scenes", CP, "batches_as_it_loops",
     {"noise": lambda s, x: s.sigma**2 * np.eye(2) * (1.5 if x.shape[0] > 100 else 1.0)}),
    ("detection of crowded scenes", CP, "batches_as_it_loops",
     {"detects": lambda s, x: np.asarray(0.5 if x.shape[0] > 100 else 0.6)}),
    ("a twin that turns the other way", RB, "says_what_the_sensor_says",
     {"twin": property(lambda s: (t := RB.twin.fget(s)) and Twin(t.function, t.parameters * [1, 1, -1, *(1,) * 6]))}),
    ("a twin that takes deviations for variances", RB, "says_what_the_sensor_says",
     {"twin": property(lambda s: (t := RB.twin.fget(s)) and Twin(t.function, np.sqrt(np.maximum(t.parameters, 0.0))))}),
    ("a twin that stays where it was built", RB, "says_what_the_sensor_says",
     {"twin": property(lambda s: RB.twin.fget(RB(s.sigma_range, s.sigma_bearing, sigma_extent=s.sigma_extent)))}),
]  # fmt: skip
