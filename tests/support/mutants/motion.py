"""Motion models with one thing wrong."""

import numpy as np
from attrs import frozen

from support.mutants.parts import CALLS, FromZero, Unwrapped, changed, over, put
from vedette import Gaussian, MotionModel, Space, fields
from vedette_standard.estimators.least_squares import Noiseless
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_piecewise import CoordinatedTurnPiecewise
from vedette_standard.motion.curvilinear import Curvilinear
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.random_walk import RandomWalk
from vedette_standard.motion.singer import Singer


@frozen
class Heading(MotionModel):
    """Constant speed along a heading that wraps, and a mark that is carried along: a model of this test's own, right."""

    kind = "test_heading"
    sigma: float = fields.quantity("rad", "heading gained in 1 s", default=0.02, above=0)

    @property
    def state(self):
        return Space.of(x="m", y="m", speed="m/s", heading="rad mod 2pi", mark="m")

    @property
    def zero_variance(self):
        return Space.of(mark="m")

    def move(self, x, dt):
        moved = x.copy()
        moved[..., 0] += dt * x[..., 2] * np.cos(x[..., 3])
        moved[..., 1] += dt * x[..., 2] * np.sin(x[..., 3])
        return moved

    def noise(self, x, dt):
        return np.diag([1e-4, 1e-4, 0.01, self.sigma**2, 0.0]) * dt


@frozen
class Narrow(Space):
    """A space that wraps its plain axes too."""

    def canonical(self, x):
        return np.mod(x + 500.0, 1000.0) - 500.0


def discrete_noise(self, x, dt):
    block = np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
    return self.sigma_accel**2 * np.kron(block, np.eye(2))


def printed_target_oriented_noise(self, x, dt, forward=1.0, sideways=3.0):
    """Piecewise constant noise along and across the velocity, with the sign of q12 as it was printed."""
    c, s = np.cos(phi := np.arctan2(x[..., 3], x[..., 2])), np.sin(phi)
    f, g = forward**2, sideways**2
    Q = np.zeros((*x.shape, 4))
    Q[..., 0, 0], Q[..., 1, 1] = (f * c**2 + g * s**2) * dt**4 / 4, (f * s**2 + g * c**2) * dt**4 / 4
    Q[..., 0, 1] = Q[..., 1, 0] = (f + g) * s * dt**4 / 4
    Q[..., 0, 2] = Q[..., 2, 0] = f * c * dt**3 / 2
    Q[..., 0, 3] = Q[..., 3, 0] = g * s * dt**3 / 2
    Q[..., 1, 2] = Q[..., 2, 1] = f * s * dt**3 / 2
    Q[..., 1, 3] = Q[..., 3, 1] = -g * c * dt**3 / 2
    Q[..., 2, 2], Q[..., 3, 3] = f * dt**2, g * dt**2
    return Q


def careless_turn(self, x, dt):
    a = x[..., 4] * dt
    with np.errstate(all="ignore"):
        s, c = dt * np.sin(a) / a, dt * (1 - np.cos(a)) / a
    moved = CoordinatedTurn.move(self, x, dt)
    moved[..., 0] = x[..., 0] + s * x[..., 2] - c * x[..., 3]
    return moved


def turns_the_other_way(self, x, dt):
    """The velocity turns to the left, and the path bends to the right."""
    moved, other = CoordinatedTurn.move(self, x, dt), CoordinatedTurn.move(self, x * [1, 1, 1, 1, -1], dt)
    return np.concatenate([other[..., :2], moved[..., 2:]], axis=-1)


def turns_in_degrees(self, x, dt):
    scale = np.array([1.0, 1.0, 1.0, 1.0, np.pi / 180.0])
    return CoordinatedTurn.move(self, x * scale, dt) / scale


def fades_twice(self, x, dt):
    """A turn rate of time constant 10 s turns by its integral, and is left as if it were of 5 s."""
    turned = x * [1.0, 1.0, 1.0, 1.0, -10.0 * np.expm1(-dt / 10.0) / dt if dt else 1.0]
    return np.concatenate([CoordinatedTurn.move(self, turned, dt)[..., :4], np.exp(-dt / 5.0) * x[..., 4:]], axis=-1)


def writes_in_place(self, x, dt):
    x[..., 0] += dt * x[..., 2]
    x[..., 1] += dt * x[..., 3]
    return x


CV, CT = ConstantVelocity, CoordinatedTurn
MOTION = [
    ("jacobian without its turn-rate column", CT, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x, dt: changed(CT.jacobian(s, x, dt), lambda F: F[..., :4, 4].fill(0))}),
    ("jacobian with a wrong sign", CT, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x, dt: put(F := CT.jacobian(s, x, dt), 3, 2, -F[..., 3, 2])}),
    ("jacobian with one term missing", CT, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x, dt: put(CT.jacobian(s, x, dt), 0, 4, 0.0)}),
    ("jacobian at the moved state", CT, "jacobian_is_the_derivative",
     {"jacobian": lambda s, x, dt: CT.jacobian(s, CT.move(s, x, dt), dt)}),
    ("noise not positive semi-definite", CV, "noise_is_a_covariance",
     {"noise": lambda s, x, dt: put(Q := CV.noise(s, x, dt), 0, 2, 2 * Q[0, 2], symmetric=True)}),
    ("noise not symmetric", CV, "noise_is_a_covariance",
     {"noise": lambda s, x, dt: put(CV.noise(s, x, dt), 0, 2, 0.0)}),
    ("the target-oriented paper's printed q12", CV, "noise_is_a_covariance",
     {"noise": printed_target_oriented_noise, "divisible": False, "linear": False}),
    ("FilterPy's discrete noise declared divisible", CV, "two_steps_make_one", {"noise": discrete_noise}),
    ("noise proportional to the time", CV, "two_steps_make_one", {"noise": lambda s, x, dt: dt * CV.noise(s, x, 1.0)}),
    ("turn declared divisible", CT, "two_steps_make_one", {"divisible": True}),
    ("noise that does not turn", KnownTurn, "two_steps_make_one",
     {"noise": lambda s, x, dt: CV(s.sigma_accel).noise(x, dt)}),
    ("Singer's noise of another time constant", Singer, "two_steps_make_one",
     {"noise": lambda s, x, dt: Singer.noise(Singer(2 * s.tau, s.sigma_accel), x, dt)}),
    ("noise 5 % too large per step", CV, "two_steps_make_one",
     {"noise": lambda s, x, dt: CV.noise(s, x, dt) * (1.0 + 0.3 * np.sqrt(dt))}),
    ("noise at no time", CV, "zero_step_changes_nothing", {"noise": lambda s, x, dt: CV.noise(s, x, dt) + 1e-9 * np.eye(4)}),
    ("a step of one second whatever the time", CT, "zero_step_changes_nothing",
     {"move": lambda s, x, dt: CT.move(s, x, 1.0)}),
    ("writes into its argument", CV, "pure", {"move": writes_in_place}),
    ("keeps a state between calls", CV, "pure", {"move": lambda s, x, dt: CV.move(s, x, dt) + 1e-3 * next(CALLS)}),
    ("first state's turn rate for all", CT, "batches_as_it_loops",
     {"move": lambda s, x, dt: CT.move(s, np.concatenate([x[..., :4], 0 * x[..., 4:] + x.reshape(-1, 5)[:1, 4]], -1), dt)
      if x.size else x}),
    ("mean over the batch", CV, "batches_as_it_loops",
     {"move": lambda s, x, dt: CV.move(s, x, dt) - 0.01 * x.mean(axis=0, keepdims=x.ndim > 1) if x.size else x}),
    ("one batch axis only", CT, "batches_as_it_loops",
     {"move": lambda s, x, dt: np.concatenate([CT.move(s, x, dt)[..., :1, :], x[..., 1:, :]], -2) if x.ndim > 2
      else CT.move(s, x, dt)}),
    ("turn declared linear", CT, "linear_as_declared", {"linear": True}),
    ("noise of the speed, declared linear", CV, "linear_as_declared",
     {"noise": lambda s, x, dt: CV.noise(s, x, dt) * (1 + np.abs(x[..., 2])[..., None, None])}),
    ("divides by a turn rate of zero", CT, "gives_finite_numbers", {"move": careless_turn}),
    ("difference of headings the long way round", Heading, "differences_undo_steps",
     {"state": over(Heading().state, Unwrapped)}),
    ("heading from 0 to 2 pi", Heading, "angles_wrap", {"state": over(Heading().state, FromZero)}),
    ("position wrapped", Heading, "differences_undo_steps", {"state": over(Heading().state, Narrow)}),
    ("noise on a zero_variance axis", Heading, "zero_variance_axes_have_no_noise",
     {"noise": lambda s, x, dt: Heading.noise(s, x, dt) + 0.01 * dt * np.eye(5)}),
    ("settles to what is no covariance", CV, "reframing_keeps_a_belief",
     {"reframe": lambda s, own, combined: Gaussian(own.mean, own.cov - 2 * np.eye(4) * own.cov)}),
    ("a frame within that nobody is told of", Noiseless, "frames_within_turn",
     {"reframes": False, "reframe": MotionModel.reframe}),
    ("a frame within that stays", Noiseless, "frames_within_turn", {"reframe": lambda s, own, combined: own}),
    ("a path that bends the other way", CoordinatedTurn, "paths_bend_with_their_velocities", {"move": turns_the_other_way}),
    ("a turn rate in deg/s", CoordinatedTurn, "turn_rates_turn", {"move": turns_in_degrees}),
    ("a turn rate that fades twice as fast as it turns less", CoordinatedTurn, "turn_rates_turn", {"move": fades_twice}),
    ("a deviation for its square", ConstantVelocity, "noise_has_its_units",
     {"noise": lambda s, x, dt: ConstantVelocity.noise(s, x, dt) / s.sigma_accel}),
    ("a deviation's third power", ConstantVelocity, "noise_has_its_units",
     {"noise": lambda s, x, dt: ConstantVelocity.noise(s, x, dt) * s.sigma_accel}),
    ("a density without its time", ConstantVelocity, "noise_has_its_units",
     {"noise": lambda s, x, dt: ConstantVelocity.noise(s, x, dt) * dt}),
    ("a power of a time constant", Singer, "noise_has_its_units",
     {"noise": lambda s, x, dt: Singer.noise(s, x, dt) * s.tau}),
    ("a deviation that is not used", RandomWalk, "deviations_count",
     {"noise": lambda s, x, dt: RandomWalk.noise(s, x, dt) / s.sigma**2}),
    ("a density's third power", Curvilinear, "deviations_count",
     {"noise": lambda s, x, dt: Curvilinear.noise(s, x, dt) * s.sigma_normal}),
    ("a mean noise of another model", CV, "mean_noise_is_a_mean",
     {"mean_noise": lambda s, x, cov, dt: 1.01 * CV.noise(s, x, dt)}),
    ("a speed that grows by e in each minute", CV, "any_gap_can_be_moved_over",
     {"move": lambda s, x, dt: CV.move(s, x, dt) * np.exp(dt / 60.0)}),
    ("a noise by subtraction", CV, "any_gap_can_be_moved_over",
     {"noise": lambda s, x, dt: (CV.noise(s, x, dt) + 1e9 * np.eye(4)) - 1e9 * np.eye(4) - 1e-7 * dt * np.eye(4)}),
    ("a twin of another noise", CoordinatedTurn, "says_what_the_motion_says",
     {"twin": property(lambda s: CoordinatedTurnPiecewise(s.sigma_accel, s.sigma_turn_rate).twin)}),
]  # fmt: skip
