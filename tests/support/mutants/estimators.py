"""Estimators with one thing wrong."""

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from vedette import Estimator, Gaussian, Traits, fields, kernels
from vedette.filters import Hypotheses
from vedette_standard.associators.nearest import Nearest
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity

CV = ConstantVelocity
BOLD = Traits(takes_frames=True, bounded=True, conservative=True)


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


def one_for_all(innovation):
    """The innovation with the first track's posterior covariance for all, on an axis of one."""
    return change_detail(innovation, post=innovation.detail.post[:, :1])


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
HELD = {"of": st.just(EKF(CV(0.5)))}
DRIFT = np.random.default_rng(7)


@frozen
class Around(Estimator):
    """A third party's estimator that is another one, which is right: its mutants forget something."""

    kind = "around"
    drops = ("bounded",)
    of: Estimator = fields.part("the filter")
    state = property(lambda self: self.of.state)
    zero_variance = property(lambda self: self.of.zero_variance)

    def start(self, prior, axes, rng):
        return self.of.start(prior, axes, rng)

    def reframe(self, belief, combined):
        return self.of.reframe(belief, combined)

    def predict(self, belief, dt, rng):
        return self.of.predict(belief, dt, rng)

    def evaluate(self, belief, sensor, observed, p_gate):
        return self.of.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief, innovation, weights):
        return self.of.update(belief, innovation, weights)

    def moments(self, belief):
        return self.of.moments(belief)


def fresh_points(self, belief, dt, rng):
    moved = EKF.predict(self, belief, dt, rng)
    return Gaussian(moved.mean + DRIFT.normal(0, 1e-3, moved.mean.shape), moved.cov)


def jittered(self, belief, dt, rng):
    after = EKF.predict(self, belief, dt, rng)
    return Gaussian(after.mean + 1e-9 * rng.standard_normal(after.mean.shape), after.cov)


def iterated(self, belief, innovation, weights):
    """The update again with the posterior as its prior: the return counts twice."""
    once = EKF.update(self, belief, innovation, weights)
    gain = np.linalg.solve(np.swapaxes(belief.cov, -1, -2), np.swapaxes(once.cov, -1, -2))
    return Gaussian(once.mean, np.swapaxes(gain, -1, -2) @ once.cov)


def averaged(self, belief, innovation, weights):
    """Means under each return averaged as plain numbers: pi and -pi make 0."""
    after = EKF.update(self, belief, innovation, weights)
    each = self.state.displace(belief.mean[..., None, :], innovation.detail.shift)
    mean = np.sum(weights[..., 1:, None] * each, axis=-2) + weights[..., :1] * belief.mean
    return Gaussian(mean, after.cov)


def beyond(self, belief, innovation, weights):
    after = EKF.update(self, belief, innovation, weights)
    return Gaussian(belief.mean + self.state.difference(after.mean, belief.mean), after.cov)


@frozen(eq=False)
class Shared:
    """A belief with an array that does not lead with the tracks."""

    belief: Gaussian
    extra: np.ndarray


@frozen(eq=False)
class Ahead:
    """A belief that was predicted, which no other joins."""

    mean: np.ndarray
    cov: np.ndarray
    drawn: np.ndarray


ESTIMATORS = [
    ("dynamax's iterated update", KF, "equals_joint_conditioning", {"update": iterated}, LINEAR),
    ("no process noise", KF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (F, 0 * Q))}, LINEAR),
    ("process noise twice", EKF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (F, 2 * Q))}, LINEAR),
    ("F transposed", KF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (F.T, Q))}, LINEAR),
    ("a gain of nine tenths", EKF, "equals_joint_conditioning",
     {"evaluate": lambda s, b, z, d, g: change_detail(i := EKF.evaluate(s, b, z, d, g), shift=0.9 * i.detail.shift)},
     LINEAR),
    ("weights of the points for another kappa", UKF, "equals_joint_conditioning",
     {"predict": lambda s, b, dt, rng: UKF.predict(s, wider(b, 4 / 5), dt, rng)}, LINEAR),
    ("a prediction beyond the period", KF, "an_angle_has_no_seam",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (F, Q))}, LINEAR),
    ("an update beyond the period", EKF, "an_angle_has_no_seam", {"update": beyond}, LINEAR),
    ("headings averaged as numbers", EKF, "an_angle_has_no_seam", {"update": averaged}, LINEAR),
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
     {"predict": lambda s, b, dt, rng: wider(EKF.predict(s, b, dt, rng), 1.001)}, LINEAR),
    ("a scan in one call, without the gate", KF, "a_scan_in_one_call_is_its_parts",
     {"scan_step": lambda s, b, scan: KF.scan_step(s, b, evolve(scan, limit=1e9))}, LINEAR),
    ("a miss widens", EKF, "a_missed_scan_equals_prediction",
     {"update": lambda s, b, i, w: wider(EKF.update(s, b, i, w), 1.01 if w.shape[-1] == 1 else 1.0)}, LINEAR),
    ("takes the nearest whatever its weight", EKF, "returns_of_weight_zero_change_nothing",
     {"update": lambda s, b, i, w: EKF.update(s, b, i, Nearest().associate(
         i.loglik - 1e6 * (np.arange(w.shape[-1]) < 1), None) if w.shape[-1] == 3 else w)}, LINEAR),
    ("the first return counts most", EKF, "order_of_returns_is_free",
     {"update": lambda s, b, i, w: EKF.update(s, b, i, w * (f := np.r_[1, 1.1, np.ones(w.shape[-1] - 2)]) /
                                              (w * f).sum(-1, keepdims=True) if w.shape[-1] > 1 else w)}, LINEAR),
    ("one track's covariance for all", EKF, "batches_as_it_loops",
     {"predict": lambda s, b, dt, rng: Gaussian(EKF.predict(s, b, dt, rng).mean,
                                                        np.broadcast_to(b.cov.reshape(-1, 4, 4)[0], b.cov.shape))}, LINEAR),
    ("writes into the belief", EKF, "pure",
     {"predict": lambda s, b, dt, rng: EKF.predict(s, Gaussian(b.mean.__iadd__(1e-3), b.cov), dt, rng)}, LINEAR),
    ("the seed ignored", EKF, "pure", {"predict": fresh_points}, LINEAR),
    ("another prediction each time", EKF, "pure", {"predict": fresh_points}, LINEAR),
    ("draws and does not say so", EKF, "draws_only_if_it_says_so", {"predict": jittered}, LINEAR),
    ("start without correlations", EKF, "starts_at_its_prior",
     {"start": lambda s, p, a, rng: Gaussian((b := EKF.start(s, p, a, rng)).mean, b.cov * np.eye(4))}, LINEAR),
    ("start by position in the list", EKF, "starts_at_its_prior",
     {"start": lambda s, p, a, rng: Gaussian(p.mean[..., :4], p.cov[..., :4, :4])}, LINEAR),
    ("forgets correlations after a scan", EKF, "equals_joint_conditioning",
     {"update": lambda s, b, i, w: Gaussian((a := EKF.update(s, b, i, w)).mean, a.cov * np.eye(4))}, LINEAR),
    ("posterior too sure by a third", UKF, "nees_and_nis_fit_matched_truth",
     {"update": lambda s, b, i, w: wider(UKF.update(s, b, i, w), 0.67)}, LINEAR),
    ("a fiftieth of the process noise", EKF, "nees_and_nis_fit_matched_truth",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (F, 0.02 * Q))},
     {"motion": st.just(CV(60.0))}),
    ("called conservative, and too sure by a third", EKF, "nees_and_nis_fit_matched_truth",
     {"update": lambda s, b, i, w: wider(EKF.update(s, b, i, w), 0.67), "declares": BOLD},
     LINEAR),
    ("called conservative, and short of F P F'", EKF, "predicts_as_its_motion_linearised",
     {"predict": lambda s, b, dt, rng: predicted(s, b, dt, lambda F, Q: (0.8 * F, Q)), "declares": BOLD}, LINEAR),
    ("a frame that stays", EKF, "a_frame_turns_before_each_prediction", {"reframe": lambda s, b, combined: b}, LINEAR),
    ("turns no frame, and says it has seen to it", EKF, "a_frame_turns_before_each_prediction",
     {"drops": ("reframes",)}, LINEAR),
    ("says nothing of a frame that turns, and does not turn it", Around, "a_frame_turns_before_each_prediction",
     {"reframe": Estimator.reframe}, HELD),
    ("an innovation with a shared array", EKF, "tracks_come_and_go",
     {"evaluate": lambda s, b, sensor, seen, p_gate: one_for_all(EKF.evaluate(s, b, sensor, seen, p_gate))}, LINEAR),
    ("a belief with a shared array", EKF, "tracks_come_and_go",
     {"start": lambda s, p, a, rng: Shared(EKF.start(s, p, a, rng), np.zeros(1)),
      "predict": lambda s, b, dt, rng: Shared(EKF.predict(s, b.belief, dt, rng), b.extra),
      "evaluate": lambda s, b, sensor, seen, p_gate: EKF.evaluate(s, b.belief, sensor, seen, p_gate),
      "update": lambda s, b, i, w: Shared(EKF.update(s, b.belief, i, w), b.extra),
      "moments": lambda s, b: b.belief}, LINEAR),
    ("a belief that is another thing once it is predicted", EKF, "tracks_come_and_go",
     {"predict": lambda s, b, dt, rng: Ahead((g := EKF.predict(s, b, dt, rng)).mean, g.cov, g.mean),
      "moments": lambda s, b: Gaussian(b.mean, b.cov)}, LINEAR),
    ("a variance that grows by e in each second", EKF, "any_gap_leaves_a_belief",
     {"predict": lambda s, b, dt, rng: wider(EKF.predict(s, b, dt, rng), np.exp(dt))}, LINEAR),
    ("a gain without its root", EKF, "any_gap_leaves_a_belief",
     {"update": lambda s, b, i, w: Gaussian((a := EKF.update(s, b, i, w)).mean, a.cov - 1e-6 * b.cov)}, LINEAR),
    ("a distance by subtraction", EKF, "any_gap_leaves_a_belief",
     {"evaluate": lambda s, b, z, d, g: evolve(i := EKF.evaluate(s, b, z, d, g), nis=i.distance - 1.0)}, LINEAR),
]  # fmt: skip
