"""Mixtures of estimators with one thing wrong."""

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from vedette import Gaussian, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm, Modes
from vedette_standard.motion.constant_velocity import ConstantVelocity

CV = ConstantVelocity
EKF = ExtendedKalman
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
    return kernels.mixture_moments(belief.log_prob, *Imm._each(self, belief), self._own, self._absent, self.state.periods)


def chain(matrix_of):
    """The prediction with other mode probabilities."""
    return lambda s, b, dt, rng: b if dt == 0 else Modes(Imm.predict(s, b, dt, rng).beliefs, matrix_of(s, b))


def alone(self, belief, dt, rng):
    """Each mode predicted from its own belief, in the frame that it has."""
    parts = zip(self.modes, belief.beliefs, strict=True)
    return Modes(tuple(mode.predict(part, dt, rng) for mode, part in parts), belief.log_prob)


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
    ("smoothed modes that forget what came after", Imm, "modes_smooth_as_their_pairs",
     {"smooth_step": lambda s, b, after, dt, rng: Modes(Imm.smooth_step(s, b, after, dt, rng).beliefs, b.log_prob)}, TWO),
    ("modes whose frames stay", Imm, "a_frame_turns_before_each_prediction", {"predict": alone}, TWO),
]  # fmt: skip
