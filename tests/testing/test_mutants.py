"""The laws bite: components with one thing wrong, each caught by the law that is named for it.

Run as a script it prints the table of mutants with what the law said.
"""

from collections import Counter
from itertools import count

import attrs
import numpy as np
import pytest
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette import Detections, Gaussian, MotionModel, Space, fields, kernels
from vedette.config.parameters import role_of
from vedette.filters.gaussian import Hypotheses
from vedette.testing import FAST, examine, laws_of
from vedette.testing.strategies import SENSOR, components
from vedette.types import Recording, Scan, Trajectory
from vedette_sim import Drawn, Look, Simulation
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm, Modes
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.singer import Singer
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

CALLS = count()
"""What a component that keeps a state between calls keeps it in."""


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
class Unwrapped(Space):
    """A space whose differences go the long way round."""

    def difference(self, a, b):
        return a - b


@frozen
class FromZero(Space):
    """A space whose angles run from 0 to 2 pi."""

    def canonical(self, x):
        return np.where([axis.period is not None for axis in self.axes], np.mod(x, 2 * np.pi), x)


@frozen
class Narrow(Space):
    """A space that wraps its plain axes too."""

    def canonical(self, x):
        return np.mod(x + 500.0, 1000.0) - 500.0


def over(space, cls):
    """The property that gives `space` as another class of space."""
    return property(lambda self: cls(space.axes))


def changed(values, change):
    """A copy of an array, changed in place by a function."""
    copy = np.array(values)
    change(copy)
    return copy


def put(matrix, row, column, value, symmetric=False):
    """The matrix with one entry replaced."""
    copy = np.array(matrix)
    copy[..., row, column] = value
    if symmetric:
        copy[..., column, row] = value
    return copy


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


def writes_in_place(self, x, dt):
    x[..., 0] += dt * x[..., 2]
    x[..., 1] += dt * x[..., 3]
    return x


CV, CT, RB, CP = ConstantVelocity, CoordinatedTurn, RangeBearing, CartesianPosition

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
    ("noise 5 % too large per step", CV, "noise_matches_draws",
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
]  # fmt: skip

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
    ("no noise on one axis", RB, "noise_is_positive_definite", {"noise": lambda s, x: np.diag([s.sigma_range**2, 0.0])}),
    ("noise not symmetric", CP, "noise_is_positive_definite",
     {"noise": lambda s, x: s.sigma**2 * np.array([[1.0, 0.5], [0.0, 1.0]])}),
    ("noise over-correlated", CP, "noise_is_positive_definite",
     {"noise": lambda s, x: s.sigma**2 * np.array([[1.0, 1.1], [1.1, 1.0]])}),
    ("detection above one", CP, "detection_is_a_probability", {"detects": lambda s, x: np.asarray(1.2)}),
    ("detection below zero far away", CP, "detection_is_a_probability", {"detects": lambda s, x: 1.0 - np.abs(x[..., 0])}),
    ("negative clutter", CP, "clutter_is_a_density", {"clutter": lambda s, z: z[..., 0]}),
    ("infinite clutter", CP, "clutter_is_a_density", {"clutter": lambda s, z: np.asarray(np.inf)}),
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
    ("a return's own noise ignored", CP, "takes_a_returns_own_noise", {"invert": lambda s, z, noise=None: CP.invert(s, z)}),
    ("moved by being placed", CP, "standing_elsewhere_keeps_the_axes",
     {"at": lambda s, pose: RB(1.0, 0.01)}),
    ("polar declared linear", RB, "linear_as_declared", {"linear": True}),
    ("slope over the whole state", CP, "further_axes_change_nothing", {"jacobian": lambda s, x: np.eye(2, 4)}),
    ("noise of crowded scenes", CP, "returns_match_the_model",
     {"noise": lambda s, x: s.sigma**2 * np.eye(2) * (1.5 if x.shape[0] > 100 else 1.0)}),
    ("detection of crowded scenes", CP, "returns_match_the_model",
     {"detects": lambda s, x: np.asarray(0.5 if x.shape[0] > 100 else 0.6)}),
]  # fmt: skip


def softmax(scores):
    likely = np.exp(scores - scores.max(axis=-1, keepdims=True))
    return likely / likely.sum(axis=-1, keepdims=True)


def greedy(self, scores, evidence):
    """Tracks choose one after the other."""
    weights = np.zeros_like(scores)
    for run in np.ndindex(scores.shape[:-2]):
        left = np.array(scores[run])
        for row in range(len(left)):
            best = int(np.argmax(left[row]))
            weights[run][row, best] = 1.0
            if best:
                left[row + 1 :, best] = -np.inf
    return weights


ASSOCIATORS = [
    ("weights not normalised", Pda, "rows_sum_to_one", {"associate": lambda s, a, e: 0.99 * softmax(a)}),
    ("a negative weight", Pda, "rows_sum_to_one",
     {"associate": lambda s, a, e: 1.5 * softmax(a) - 0.5 / a.shape[-1]}),
    ("no weight for a miss", Pda, "equals_brute_force",
     {"associate": lambda s, a, e: changed(softmax(a), lambda w: np.divide(w, 1 - 0.5 * w[..., :1], out=w) if w.shape[-1] > 1
                                           else None)}),
    ("scores halved", Pda, "equals_brute_force", {"associate": lambda s, a, e: softmax(0.5 * a)}),
    ("a floor under all weights", Pda, "forbidden_stays_forbidden",
     {"associate": lambda s, a, e: 0.99 * softmax(a) + 0.01 / a.shape[-1]}),
    ("claims a return twice", Nearest, "each_return_is_claimed_once", {"exclusive": True}),
    ("PDA declared exclusive", Pda, "each_return_is_claimed_once", {"exclusive": True}),
    ("tracks choose in turn", GlobalNearest, "equals_brute_force", {"associate": greedy}),
    ("the first track chooses first", GlobalNearest, "order_of_tracks_is_free", {"associate": greedy}),
    ("later returns count more", Pda, "order_of_returns_is_free",
     {"associate": lambda s, a, e: softmax(a + 0.1 * np.arange(a.shape[-1]))}),
    ("absolute scores count", Pda, "row_constants_change_nothing",
     {"associate": lambda s, a, e: softmax(np.minimum(a, 0.0))}),
    ("normalised over tracks", Pda, "rows_sum_to_one",
     {"associate": lambda s, a, e: (w := np.exp(a - a.max())) / w.sum(axis=-2, keepdims=True)}),
    ("one run's scale for all runs", Pda, "batches_as_it_loops",
     {"associate": lambda s, a, e: softmax(a / (1 + a.shape[0] * (a.ndim > 2)))}),
    ("returns counted, forbidden ones too", Pda, "a_far_return_changes_nothing",
     {"associate": lambda s, a, e: softmax(np.concatenate([a[..., :1] + np.log(a.shape[-1]), a[..., 1:]], -1))}),
    ("needs a return", Pda, "no_returns_is_a_miss",
     {"associate": lambda s, a, e: softmax(a) if a[..., 1:].max() > -np.inf or a.shape[-1] > 1 else a}),
    ("writes into the scores", Pda, "pure", {"associate": lambda s, a, e: softmax(np.subtract(a, a.max(), out=a))}),
    ("keeps a state between calls", Pda, "pure", {"associate": lambda s, a, e: softmax(a / (1 + next(CALLS)))}),
    ("joint probabilities without exclusion", Jpda, "equals_brute_force", {"associate": lambda s, a, e: softmax(a)}),
]  # fmt: skip


def without_joseph(self, belief, sensor, seen, p_gate):
    """P - K S K', which is the same on paper."""
    innovation = ExtendedKalman.evaluate(self, belief, sensor, seen, p_gate)
    x = belief.mean[..., self.state.locate(sensor.observes)]
    H = np.zeros((len(sensor.measurement), len(self.state)))
    H[:, self.state.locate(sensor.observes)] = sensor.jacobian(x)
    R = seen.noise if seen.noise is not None else sensor.noise(x)[..., None, :, :]
    P = belief.cov[..., None, :, :]
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    return evolve(innovation, detail=Hypotheses(innovation.detail.shift, P - K @ H @ P))


def mixed(self, belief, innovation, weights, spread=True, miss=True):
    """The mixture's moments, written out, with parts left out."""
    detail, w = innovation.detail, weights[..., 1:]
    shift = np.sum(w[..., None] * detail.shift, axis=-2)
    post = np.broadcast_to(detail.post, (*w.shape, *belief.cov.shape[-2:]))
    cov = np.sum(w[..., None, None] * post, axis=-3) + (weights[..., 0, None, None] * belief.cov if miss else 0)
    if spread:
        cov = cov + np.einsum("...k,...ki,...kj->...ij", w, detail.shift, detail.shift)
        cov = cov - shift[..., :, None] * shift[..., None, :]
    return Gaussian(self.state.displace(belief.mean, shift), cov)


def change_detail(innovation, **changes):
    return evolve(innovation, detail=evolve(innovation.detail, **changes))


def wider(belief, factor):
    return Gaussian(belief.mean, belief.cov * factor)


def predicted(self, belief, dt, change):
    if dt == 0:
        return belief
    F, Q = self.motion.jacobian(belief.mean, dt), self.motion.noise(belief.mean, dt)
    F, Q = change(F, Q)
    return Gaussian((F @ belief.mean[..., None])[..., 0], kernels.propagate(belief.cov, F, Q))


KF, EKF, UKF = Kalman, ExtendedKalman, UnscentedKalman
LINEAR = {"motion": st.just(CV(0.5))}
DRIFT = np.random.default_rng(7)


def fresh_points(self, belief, dt, rng, combined=None):
    moved = EKF.predict(self, belief, dt, rng, combined)
    return Gaussian(moved.mean + DRIFT.normal(0, 1e-3, moved.mean.shape), moved.cov)


def iterated(self, belief, innovation, weights):
    """The update again with the posterior as its prior: the return counts twice."""
    once = EKF.update(self, belief, innovation, weights)
    gain = np.linalg.solve(np.swapaxes(belief.cov, -1, -2), np.swapaxes(once.cov, -1, -2))
    return Gaussian(once.mean, np.swapaxes(gain, -1, -2) @ once.cov)


@frozen(eq=False)
class Shared:
    """A belief with an array that does not lead with the tracks."""

    belief: Gaussian
    extra: np.ndarray


ESTIMATORS = [
    ("dynamax's iterated update", KF, "equals_joint_conditioning", {"update": iterated}, LINEAR),
    ("no process noise", KF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng, c=None: predicted(s, b, dt, lambda F, Q: (F, 0 * Q))}, LINEAR),
    ("process noise twice", EKF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng, c=None: predicted(s, b, dt, lambda F, Q: (F, 2 * Q))}, LINEAR),
    ("F transposed", KF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng, c=None: predicted(s, b, dt, lambda F, Q: (F.T, Q))}, LINEAR),
    ("a gain of nine tenths", EKF, "equals_joint_conditioning",
     {"evaluate": lambda s, b, z, d, g: change_detail(i := EKF.evaluate(s, b, z, d, g), shift=0.9 * i.detail.shift)},
     LINEAR),
    ("weights of the points for another kappa", UKF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng, c=None: UKF.predict(s, wider(b, 4 / 5), dt, rng, c)}, LINEAR),
    ("Joseph's form missing", EKF, "covariances_survive_a_long_run", {"evaluate": without_joseph}, LINEAR),
    ("covariance not kept symmetric", EKF, "covariances_survive_a_long_run",
     {"update": lambda s, b, i, w: Gaussian((a := EKF.update(s, b, i, w)).mean, a.cov * np.triu(np.full((4, 4), 1 + 1e-8)) +
                                            np.tril(a.cov, -1))}, LINEAR),
    ("PDA without the spread", EKF, "soft_weights_give_the_mixtures_moments",
     {"update": lambda s, b, i, w: mixed(s, b, i, w, spread=False)}, LINEAR),
    ("PDA without the miss's covariance", EKF, "soft_weights_give_the_mixtures_moments",
     {"update": lambda s, b, i, w: mixed(s, b, i, w, miss=False) if w[..., 1:].any() else EKF.update(s, b, i, w)}, LINEAR),
    ("gate without its probability", EKF, "a_miss_has_its_probability",
     {"evaluate": lambda s, b, z, d, g: EKF.evaluate(s, b, z, d, 1.0)}, LINEAR),
    ("detection probability left out", EKF, "return_likelihood_is_a_density",
     {"evaluate": lambda s, b, z, d, g: evolve(i := EKF.evaluate(s, b, z, d, g), loglik=np.concatenate(
         [i.loglik[..., :1], i.loglik[..., 1:] + 0.05], -1))}, LINEAR),
    ("likelihood without 2 pi", UKF, "return_likelihood_is_a_density",
     {"evaluate": lambda s, b, z, d, g: evolve(i := UKF.evaluate(s, b, z, d, g), loglik=i.loglik + np.log(2 * np.pi) *
                                               len(z.measurement) / 2 * (np.arange(i.loglik.shape[-1]) > 0))}, LINEAR),
    ("noise over no time", EKF, "no_time_changes_nothing",
     {"predict": lambda s, b, dt, rng, c=None: wider(EKF.predict(s, b, dt, rng, c), 1.001)}, LINEAR),
    ("a miss widens", EKF, "a_missed_scan_equals_prediction",
     {"update": lambda s, b, i, w: wider(EKF.update(s, b, i, w), 1.01 if w.shape[-1] == 1 else 1.0)}, LINEAR),
    ("takes the nearest whatever its weight", EKF, "returns_of_weight_zero_change_nothing",
     {"update": lambda s, b, i, w: EKF.update(s, b, i, Nearest().associate(
         i.loglik - 1e6 * (np.arange(w.shape[-1]) < 1), None) if w.shape[-1] == 3 else w)}, LINEAR),
    ("the first return counts most", EKF, "order_of_returns_is_free",
     {"update": lambda s, b, i, w: EKF.update(s, b, i, w * (f := np.r_[1, 1.1, np.ones(w.shape[-1] - 2)]) /
                                              (w * f).sum(-1, keepdims=True) if w.shape[-1] > 1 else w)}, LINEAR),
    ("one track's covariance for all", EKF, "batches_as_it_loops",
     {"predict": lambda s, b, dt, rng, c=None: Gaussian(EKF.predict(s, b, dt, rng, c).mean,
                                                        np.broadcast_to(b.cov.reshape(-1, 4, 4)[0], b.cov.shape))}, LINEAR),
    ("writes into the belief", EKF, "pure",
     {"predict": lambda s, b, dt, rng, c=None: EKF.predict(s, Gaussian(b.mean.__iadd__(1e-3), b.cov), dt, rng, c)}, LINEAR),
    ("the seed ignored", EKF, "pure", {"predict": fresh_points}, LINEAR),
    ("start without correlations", EKF, "starts_at_its_prior",
     {"start": lambda s, p, a, rng: Gaussian((b := EKF.start(s, p, a, rng)).mean, b.cov * np.eye(4))}, LINEAR),
    ("start by position in the list", EKF, "starts_at_its_prior",
     {"start": lambda s, p, a, rng: Gaussian(p.mean[..., :4], p.cov[..., :4, :4])}, LINEAR),
    ("forgets correlations after a scan", EKF, "order_of_sensors_is_free",
     {"update": lambda s, b, i, w: Gaussian((a := EKF.update(s, b, i, w)).mean, a.cov * np.eye(4))}, LINEAR),
    ("posterior too sure by a third", UKF, "nees_and_nis_fit_matched_truth",
     {"update": lambda s, b, i, w: wider(UKF.update(s, b, i, w), 0.67)}, LINEAR),
    ("a fiftieth of the process noise", EKF, "nees_and_nis_fit_matched_truth",
     {"predict": lambda s, b, dt, rng, c=None: predicted(s, b, dt, lambda F, Q: (F, 0.02 * Q))},
     {"motion": st.just(CV(60.0))}),
    ("a belief with a shared array", EKF, "tracks_come_and_go",
     {"start": lambda s, p, a, rng: Shared(EKF.start(s, p, a, rng), np.zeros(1)),
      "predict": lambda s, b, dt, rng, c=None: Shared(EKF.predict(s, b.belief, dt, rng, c), b.extra),
      "moments": lambda s, b: b.belief}, LINEAR),
]  # fmt: skip

TWO = {
    "modes": st.just((EKF(CV(0.2)), EKF(CV(3.0)))),
    "transition": st.just([[0.9, 0.1], [0.3, 0.7]]),
    "rates": st.none(), "interval": st.none(), "initial": st.just([0.8, 0.2]), "absent": st.just({}),
}  # fmt: skip


def without_spread(self, belief):
    within = np.sum(np.exp(belief.log_prob)[..., None, None] * np.stack(self._each(belief)[1], axis=-3), axis=-3)
    return Gaussian(Imm.moments(self, belief).mean, within)


def wider_modes(self, belief):
    means, covs = Imm._each(self, belief)
    return means, [1.02 * cov for cov in covs]


def taken_together(self, belief):
    found = kernels.together(belief.log_prob, *Imm._each(self, belief), self._own, self._absent, self.state.periods)
    return Gaussian(*found)


def chain(matrix_of):
    """The prediction with other mode probabilities."""
    return lambda s, b, dt, rng, c=None: b if dt == 0 else Modes(Imm.predict(s, b, dt, rng, c).beliefs, matrix_of(s, b))


def likely_alone(self, belief, innovation, weights):
    """Modes judged by their likelihood alone, without what was predicted of them."""
    after = Imm.update(self, belief, innovation, weights)
    free = after.log_prob - belief.log_prob
    return Modes(after.beliefs, free - kernels.log_sum(free)[..., None])


MIXTURES = [
    ("old mode probabilities in the prior", Imm, "modes_follow_their_chain",
     {"predict": chain(lambda s, b: b.log_prob)}, TWO),
    ("transition matrix transposed", Imm, "modes_follow_their_chain",
     {"predict": chain(lambda s, b: np.log(n := np.exp(b.log_prob) @ s.transition.T) - np.log(n.sum(-1, keepdims=True)))},
     TWO),
    ("mode update without the predicted probabilities", Imm, "first_scan_is_the_exact_mixture",
     {"update": likely_alone}, TWO),
    ("combined without the spread of the modes", Imm, "first_scan_is_the_exact_mixture", {"moments": without_spread}, TWO),
    ("combined with equal weights", Imm, "first_scan_is_the_exact_mixture",
     {"moments": lambda s, b: Imm.moments(s, Modes(b.beliefs, 0 * b.log_prob - np.log(2)))}, TWO),
    ("the best mode's likelihood only", Imm, "first_scan_is_the_exact_mixture",
     {"evaluate": lambda s, b, z, d, g: evolve(i := Imm.evaluate(s, b, z, d, g), loglik=np.max(np.stack(
         [p.loglik for p in i.detail.innovations], -1) + b.log_prob[..., None, :], -1))}, TWO),
    ("mixing that widens", Imm, "equal_modes_are_one",
     {"_each": wider_modes, "moments": taken_together}, TWO),
    ("modes that all weigh the same", Imm, "modes_follow_their_chain",
     {"mode_prob": lambda s, b: np.full(b.log_prob.shape, 0.5)}, TWO),
]  # fmt: skip

SPREAD = {"spread": st.just({"vx": 5.0, "vy": 5.0})}

LIFECYCLES = [
    ("new tracks exist twice", MOfN, "newborn_tracks_exist_in_part",
     {"newborn": lambda s, n: (MOfN.newborn(s, n)[0], np.full(n, 2.0))}),
    ("one existence for all new tracks", MOfN, "newborn_tracks_exist_in_part",
     {"newborn": lambda s, n: (MOfN.newborn(s, n)[0], np.ones(1))}),
    ("existence grows with time", Existence, "survival_is_a_probability", {"survive": lambda s, e, dt: e * (1 + dt)}),
    ("existence falls per scan", Existence, "survival_is_a_probability", {"survive": lambda s, e, dt: 0.9 * e}),
    ("survival linear in time", Existence, "two_waits_make_one",
     {"survive": lambda s, e, dt: e * max(0.0, 1 - dt / s.lifetime)}),
    ("verdicts as numbers", MOfN, "verdicts_are_one_a_track",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1].astype(int), r[2]))(MOfN.review(s, m, e, h, x))}),
    ("only the best track is confirmed", Existence, "tracks_are_judged_alone",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], e == e.max(), r[2]))(Existence.review(s, m, e, h, x))}),
    ("keeps a state between calls", Existence, "pure",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1], r[2] & (next(CALLS) % 2 == 0)))(
         Existence.review(s, m, e, h, x))}),
    ("one run's verdict for all", Existence, "batches_as_it_loops",
     {"review": lambda s, m, e, h, x: (lambda r: (r[0], r[1] | (r[1].any() & (r[1].ndim > 1)), r[2]))(
         Existence.review(s, m, e, h, x))}),
    ("tracks that end though they last", MOfN, "lasting_as_declared", {"permanent": True}),
    ("a hit ends a track", MOfN, "a_hit_never_harms", {"review": lambda s, m, e, h, x: MOfN.review(s, m, e, 1.0 - h, x)}),
    ("explained returns start tracks", MOfN, "explained_returns_start_nothing",
     {"starts": lambda s, name, claimed: claimed > 0.2}),
    ("tracks start elsewhere", MOfN, "tracks_start_where_they_were_seen",
     {"prior": lambda s, seen, a, n: (lambda p: Gaussian(p.mean[:, [1, 0, 2, 3]], p.cov))(MOfN.prior(s, seen, a, n))}),
    ("velocity without doubt", MOfN, "tracks_start_where_they_were_seen",
     {"prior": lambda s, seen, a, n: (lambda p: Gaussian(p.mean, p.cov * np.diag([1, 1, 0, 0]) +
                                                         (p.cov - p.cov * np.eye(4))))(MOfN.prior(s, seen, a, n))}),
]  # fmt: skip

BOAT = Drawn(models=(CV(0.5),), start={"x": (0, 10), "y": (5, 10), "vx": (3, 1), "vy": (-2, 1)}, appears=1.0)
SCENE = {
    "duration": st.just(6.0),
    "looks": st.just({SENSOR: Look(interval=1.0, jitter=0.3)}),
    "drawn": st.just({"boat": BOAT}),
}


def rescanned(change):
    """A source whose scans are changed on the way out."""

    def open(self, sensors, rng):  # noqa: A001  # the role's own name
        recording = Simulation.open(self, sensors, rng)
        return Recording(tuple(change(recording.scans)), recording.truth)

    return {"open": open}


def fresh_seed(self, sensors, rng):
    return Simulation.open(self, sensors, np.random.default_rng(next(CALLS)))


def turned_truth(self, sensors, rng):
    recording = Simulation.open(self, sensors, rng)
    return Recording(recording.scans, tuple(Trajectory(t.name, t.space, t.times[::-1], t.states) for t in recording.truth))


SOURCES = [
    ("the seed ignored", Simulation, "the_seed_decides", {"open": fresh_seed}, SCENE),
    ("scans out of order", Simulation, "scans_come_in_time_order", rescanned(lambda scans: scans[::-1]), SCENE),
    ("a sensor that nobody has", Simulation, "scans_are_the_sensors",
     rescanned(lambda scans: [evolve(scan, sensor="sonar") for scan in scans]), SCENE),
    ("returns that are no numbers", Simulation, "scans_are_the_sensors",
     rescanned(lambda scans: [Scan(s.time, s.sensor, Detections.of(s.detections.z * np.nan, 2)) for s in scans]), SCENE),
    ("truth backwards", Simulation, "truth_is_in_order", {"open": turned_truth}, SCENE),
]  # fmt: skip

UC = UnbiasedConversion


def all_valid(scans):
    return {name: evolve(scan, detections=Detections.of(scan.detections.z)) for name, scan in scans.items()}


def overwrites(self, scans):
    for scan in scans.values():
        scan.detections.z[...] = 0.0
    return UC.process(self, scans)


def remade(change):
    return {"process": lambda s, scans: change(UC.process(s, scans))}


DETECTORS = [
    ("noise not definite", UC, "noise_is_positive_definite",
     remade(lambda d: Detections(d.z, d.valid, d.evidence, d.noise * np.array([[1.0, 0.0], [0.0, 0.0]])))),
    ("padding read", UC, "padding_changes_nothing", {"process": lambda s, scans: UC.process(s, all_valid(scans))}),
    ("returns that are no numbers", UC, "makes_finite_returns",
     remade(lambda d: Detections(d.z / np.where(d.valid, 1.0, 1.0)[..., None] * np.nan, d.valid, d.evidence, d.noise))),
    ("writes into the scan", UC, "pure", {"process": overwrites}),
    ("a return out of nothing", UC, "nothing_comes_of_nothing",
     {"process": lambda s, scans: UC.process(s, scans) if any(len(x.detections.z) for x in scans.values())
      else Detections.of([[1.0, 2.0]])}),
]  # fmt: skip

MUTANTS = [
    *((*row, {}) for row in (*MOTION, *SENSORS, *ASSOCIATORS, *DETECTORS)),
    *((*row, SPREAD) for row in LIFECYCLES),
    *ESTIMATORS, *MIXTURES, *SOURCES,
]  # fmt: skip


def mutant(base, methods):
    """A subclass of a component, which is final for everybody but this test, with something wrong."""
    return attrs.frozen(type(f"{base.__name__}Mutant", (base,), dict(methods)))


def tried(base, law_name, strategies):
    law = next(law for law in laws_of(base) if law.name == law_name)
    return examine(base, law, components(base, strategies), FAST)


@pytest.mark.parametrize(
    ("what", "base", "law", "methods", "strategies"), MUTANTS, ids=[f"{row[1].__name__}: {row[0]}" for row in MUTANTS]
)
def test_a_mutant_is_caught_by_the_law_named_for_it(what, base, law, methods, strategies):
    assert tried(mutant(base, methods), law, strategies).verdict == "failed"


UNMUTATED = sorted({(row[1], row[2], i) for i, row in enumerate(MUTANTS)}, key=lambda row: row[2])
FIRST = {(base, law): i for base, law, i in reversed(UNMUTATED)}


@pytest.mark.parametrize(("base", "law", "row"), [(*pair, i) for pair, i in FIRST.items() if "long" not in pair[1]])
def test_the_unmutated_component_passes(base, law, row):
    outcome = tried(base, law, MUTANTS[row][4])
    assert outcome.verdict in ("held", "skipped"), outcome.text  # skipped: the mutant declares what its base does not


def test_there_are_sixty_mutants_over_all_roles():
    roles = Counter(role_of(row[1]) for row in MUTANTS)
    assert sum(roles.values()) >= 60
    assert set(roles) == {"motion", "sensor", "associator", "estimator", "lifecycle", "preprocessor", "source"}


if __name__ == "__main__":
    caught = 0
    for what, base, law, methods, strategies in MUTANTS:
        outcome = tried(mutant(base, methods), law, strategies)
        caught += outcome.verdict == "failed"
        print(f"{role_of(base):10} {base.__name__:18} {what:50} {law:40} {outcome.verdict}: {outcome.text.splitlines()[:1]}")
    print(f"{caught} of {len(MUTANTS)} mutants caught by the law named for them")
