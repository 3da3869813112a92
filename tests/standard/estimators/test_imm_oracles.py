"""The IMM is exact where it is defined to be, and the textbook's IMM-PDAF."""

from functools import partial

import numpy as np
import pytest
from attrs import evolve
from scipy import stats

from support.imm import pool, step
from support.models import LinearStep, Looking
from vedette import Detections, Gate, Gaussian, kernels
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
REAL = {name: each for name, each in vars(kernels).items() if callable(each)}


def covariance(rng, n):
    a = rng.normal(size=(n, n))
    return a @ a.T + 0.2 * np.eye(n)


def normal(nu, S):
    return np.exp(-0.5 * nu @ np.linalg.solve(S, nu)) / np.sqrt(np.linalg.det(2 * np.pi * S))


WIDE = Gate(1 - 1e-12)


def check_against_all_mode_sequences(seed):
    """From a common Gaussian prior: the first posterior and the second prior, by summing over every sequence of modes and
    every origin of the returns.
    """
    rng = np.random.default_rng(seed)
    n, m, r = 3, 2, 3
    motions = [LinearStep(rng.normal(size=(n, n)), covariance(rng, n)) for _ in range(r)]
    T, initial = rng.dirichlet(np.ones(r), size=r), rng.dirichlet(np.ones(r))
    imm = Imm(tuple(map(Kalman, motions)), transition=T, initial=initial)
    sensor = Looking(rng.normal(size=(m, n)), covariance(rng, m), 0.8)
    x0, P0, z = rng.normal(size=n), covariance(rng, n), rng.normal(size=(2, m))

    belief = imm.start(Gaussian(x0[None], P0[None]), imm.state, RNG)
    prior, _, weights, posterior = step(imm, belief, sensor, Detections.of(z), gate=WIDE)
    second = imm.predict(posterior, 1.0, RNG)

    reached = []  # (last mode, weight, mean, covariance), by first mode, next mode and the target's return or none
    origins = np.zeros(3)
    first_prior = []
    for i in range(r):
        for j in range(r):
            F, Q = motions[j].F, motions[j].Q
            x, P = F @ x0, F @ P0 @ F.T + Q
            first_prior.append((initial[i] * T[i, j], x, P))
            S = sensor.H @ P @ sensor.H.T + sensor.R
            K = P @ sensor.H.T @ np.linalg.inv(S)
            reached.append((j, 0, initial[i] * T[i, j] * (1 - sensor.p), x, P))
            for o, nu in enumerate(z - sensor.H @ x, start=1):
                likely = initial[i] * T[i, j] * sensor.p * normal(nu, S) / sensor.density
                reached.append((j, o, likely, x + K @ nu, P - K @ S @ K.T))
    total = sum(weight for _, _, weight, _, _ in reached)
    for _, o, weight, _, _ in reached:
        origins[o] += weight / total
    close = partial(np.testing.assert_allclose, rtol=1e-9, atol=1e-9)
    close(imm.mode_prob(prior)[0], initial @ T)
    for found, expected in zip(both(imm, prior), pool(first_prior), strict=True):
        close(found, expected)
    close(weights[0], origins)
    prob = np.array([sum(w / total for j, _, w, _, _ in reached if j == mode) for mode in range(r)])
    close(imm.mode_prob(posterior)[0], prob)
    for found, expected in zip(both(imm, posterior), pool([(w / total, x, P) for _, _, w, x, P in reached]), strict=True):
        close(found, expected)
    close(imm.mode_prob(second)[0], prob @ T)
    onward = []
    for i, _, w, x, P in reached:
        for j in range(r):
            F, Q = motions[j].F, motions[j].Q
            onward.append((w / total * T[i, j], F @ x, F @ P @ F.T + Q))
    for found, expected in zip(both(imm, second), pool(onward), strict=True):
        close(found, expected)


def both(imm, belief):
    gaussian = imm.moments(belief)
    return gaussian.mean[0], gaussian.cov[0]


@pytest.mark.parametrize("seed", range(10))
def test_equals_the_sum_over_all_mode_sequences(seed):
    check_against_all_mode_sequences(seed)


def textbook_imm_pdaf(models, T, mu, x0, P0, H, R, p_detect, p_gate, density, scans):
    """Blom and Bar-Shalom's IMM with a PDAF (Bar-Shalom, Fortmann) in each mode, one track, all modes' gates united.

    `models` are (F, Q), `scans` lists of returns. Yields prior mode probabilities, mean, covariance, then the posterior's.
    """
    r, m = len(models), len(R)
    threshold = stats.chi2.ppf(p_gate, m)
    xs, Ps = [x0] * r, [P0] * r
    for returns in scans:
        c = [sum(T[i, j] * mu[i] for i in range(r)) for j in range(r)]
        mixed = [pool([(T[i, j] * mu[i] / c[j], xs[i], Ps[i]) for i in range(r)]) for j in range(r)]
        xs = [F @ x for (F, _), (x, _) in zip(models, mixed, strict=True)]
        Ps = [F @ P @ F.T + Q for (F, Q), (_, P) in zip(models, mixed, strict=True)]
        yield np.array(c), *pool(list(zip(c, xs, Ps, strict=True)))
        Ss = [H @ P @ H.T + R for P in Ps]
        inside = [
            z for z in returns
            if any((z - H @ x) @ np.linalg.solve(S, z - H @ x) <= threshold for x, S in zip(xs, Ss, strict=True))
        ]  # fmt: skip
        lambdas = []
        for j in range(r):
            nus = [z - H @ xs[j] for z in inside]
            likely = [p_detect * normal(nu, Ss[j]) / density for nu in nus]
            missed = 1 - p_detect * p_gate
            lambdas.append(missed + sum(likely))
            beta0, betas = missed / lambdas[j], [one / lambdas[j] for one in likely]
            K = Ps[j] @ H.T @ np.linalg.inv(Ss[j])
            nu = sum((b * v for b, v in zip(betas, nus, strict=True)), np.zeros(m))
            spread = sum((b * np.outer(v, v) for b, v in zip(betas, nus, strict=True)), np.zeros((m, m))) - np.outer(nu, nu)
            xs[j] = xs[j] + K @ nu
            Ps[j] = beta0 * Ps[j] + (1 - beta0) * (Ps[j] - K @ Ss[j] @ K.T) + K @ spread @ K.T
        mu = np.array(c) * lambdas
        mu /= mu.sum()
        yield mu, *pool(list(zip(mu, xs, Ps, strict=True)))


def check_against_the_textbook(seed):
    """50 scans of a boat that turns in the middle, 60 % detected, two false returns a gate; every prior and posterior."""
    rng = np.random.default_rng(seed)
    sensor = CartesianPosition(5.0, 0.6, clutter_density=1e-3)
    modes = ConstantVelocity(0.2), ConstantVelocity(3.0)
    T, dt = np.array([[0.95, 0.05], [0.1, 0.9]]), 1.5
    imm, gate = Imm(tuple(map(Kalman, modes)), transition=T, initial=[0.6, 0.4]), Gate(0.97)
    x0, P0 = np.array([0.0, 0.0, 8.0, 0.0]), np.diag([25.0, 25.0, 4.0, 4.0])
    x, scans = x0, []
    for k in range(50):
        F, turn = modes[0].jacobian(x, dt), 0.15 if 20 <= k < 30 else 0.0
        x = F @ x + np.concatenate([np.zeros(2), turn * dt * np.array([-x[3], x[2]])])
        seen = [x[:2] + 5 * rng.normal(size=2)] if rng.random() < 0.6 else []
        scans.append(seen + [x[:2] + rng.uniform(-60, 60, 2) for _ in range(rng.poisson(14))])
    models = [(mode.jacobian(x0, dt), mode.noise(x0, dt)) for mode in modes]
    expected = textbook_imm_pdaf(
        models, T, np.array([0.6, 0.4]), x0, P0, np.eye(2, 4), 25 * np.eye(2), 0.6, 0.97, 1e-3, scans
    )
    belief = imm.start(Gaussian(x0[None], P0[None]), imm.state, RNG)
    for returns in scans:
        prior, _, _, belief = step(imm, belief, sensor, Detections.of(returns, 2), dt, gate)
        for found in (prior, belief):
            prob, mean, cov = next(expected)
            np.testing.assert_allclose(imm.mode_prob(found)[0], prob, rtol=1e-9)
            np.testing.assert_allclose(imm.moments(found).mean[0], mean, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(imm.moments(found).cov[0], cov, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_turns
def test_equals_the_textbooks_imm_pdaf_over_fifty_scans(seed):
    check_against_the_textbook(seed)


def interact_keeping_old_probabilities(log_prob, *rest):
    return REAL["mix_modes"](log_prob, *rest)._replace(log_prob=log_prob)


def interact_mixing_nothing(log_prob, log_transition, xs, Ps, *rest):
    return REAL["mix_modes"](log_prob, log_transition, xs, Ps, *rest)._replace(beliefs=tuple(map(Gaussian, xs, Ps)))


def interact_without_spread(log_prob, log_transition, xs, Ps, *rest):
    mixed = REAL["mix_modes"](log_prob, log_transition, xs, Ps, *rest)
    alike = REAL["mix_modes"](log_prob, log_transition, [0 * x for x in xs], Ps, *rest)
    return mixed._replace(beliefs=tuple(evolve(a, cov=b.cov) for a, b in zip(mixed.beliefs, alike.beliefs, strict=True)))


def together_without_spread(log_prob, xs, Ps, *rest):
    alike = REAL["mixture_moments"](log_prob, [0 * x for x in xs], Ps, *rest)
    return evolve(REAL["mixture_moments"](log_prob, xs, Ps, *rest), cov=alike.cov)


def absorb_without_spread(x, P, shift, post, weights, periods):
    within = np.sum(weights[..., 1:, None, None] * post, axis=-3) + weights[..., :1, None] * P
    return evolve(REAL["weighted_update"](x, P, shift, post, weights, periods), cov=within)


def innovate_without_likelihood(*given):
    innovation = REAL["evaluate_returns"](*given)
    loglik = innovation.loglik
    return evolve(innovation, loglik=np.concatenate([loglik[..., :1], np.full_like(loglik[..., 1:], -5.0)], axis=-1))


def innovate_with_evidence_counted_twice(*given):
    innovation = REAL["evaluate_returns"](*given)
    loglik = innovation.loglik
    return evolve(innovation, loglik=np.concatenate([loglik[..., :1], 2 * loglik[..., 1:]], axis=-1))


def absorb_by_track(self, belief, innovation, weights):
    """Every mode with the track's weights, as if the modes did not differ in which return they believe."""
    detail = innovation.detail
    joint = np.log(np.maximum(weights, 1e-300))[..., None] + detail.log_share
    beliefs = tuple(
        mode.update(part, inner, weights)
        for mode, part, inner in zip(self.modes, belief.beliefs, detail.innovations, strict=True)
    )
    return type(belief)(beliefs, kernels.log_sum(joint, axis=-2))


REAL_INNOVATE = Imm.evaluate


def innovate_without_gate_correction(self, belief, sensor, seen, p_gate):
    return REAL_INNOVATE(self, belief, sensor, seen, 1.0)


MUTANTS = [
    (kernels, "mix_modes", interact_keeping_old_probabilities),
    (kernels, "mix_modes", interact_mixing_nothing),
    (kernels, "mix_modes", interact_without_spread),
    (kernels, "mixture_moments", together_without_spread),
    (kernels, "weighted_update", absorb_without_spread),
    (kernels, "evaluate_returns", innovate_without_likelihood),
    (kernels, "evaluate_returns", innovate_with_evidence_counted_twice),
    (Imm, "update", absorb_by_track),
]


@pytest.mark.parametrize("check", [check_against_all_mode_sequences, check_against_the_textbook])
@pytest.mark.parametrize(("where", "name", "mutant"), MUTANTS, ids=[mutant.__name__ for _, _, mutant in MUTANTS])
def test_both_oracles_bite(monkeypatch, check, where, name, mutant):
    monkeypatch.setattr(where, name, mutant)
    with pytest.raises(AssertionError):
        check(0)


def test_the_textbook_bites_on_the_gate_correction(monkeypatch):
    monkeypatch.setattr(Imm, "evaluate", innovate_without_gate_correction)
    with pytest.raises(AssertionError):
        check_against_the_textbook(0)
