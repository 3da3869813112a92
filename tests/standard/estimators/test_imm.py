"""The IMM: exact where it is defined to be, the textbook's IMM-PDAF, unlike modes, transitions over time, consistency."""

from functools import partial

import numpy as np
import pytest
from attrs import frozen
from scipy import stats
from scipy.linalg import expm

from vedette import Detections, Gate, Gaussian, MotionModel, Sensor, Space, kernels
from vedette.tracking import trees
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
REAL = {name: getattr(kernels, name) for name in kernels.__all__}


@frozen(eq=False)
class Linear(MotionModel):
    """x' = F x + w, w ~ N(0, Q), whatever the time."""

    F: np.ndarray
    Q: np.ndarray
    kind = "test_linear"
    linear = True

    @property
    def state(self):
        return Space.of(**{f"x{i}": "m" for i in range(len(self.F))})

    def jacobian(self, x, dt):
        return self.F

    def move(self, x, dt):
        return x @ self.F.T

    def noise(self, x, dt):
        return self.Q


@frozen(eq=False)
class Looking(Sensor):
    """z = H x + v, v ~ N(0, R), seen with probability `p` and among clutter of density `density`."""

    H: np.ndarray
    R: np.ndarray
    p: float = 0.8
    density: float = 0.02
    kind = "test_looking"
    linear = True

    @property
    def observes(self):
        return Space.of(**{f"x{i}": "m" for i in range(self.H.shape[1])})

    @property
    def measurement(self):
        return Space.of(**{f"z{i}": "m" for i in range(len(self.H))})

    def measure(self, x):
        return x @ self.H.T

    def jacobian(self, x):
        return self.H

    def noise(self, x):
        return self.R

    def detects(self, x):
        return np.asarray(self.p)

    def clutter(self, z):
        return np.asarray(self.density)


def covariance(rng, n):
    a = rng.normal(size=(n, n))
    return a @ a.T + 0.2 * np.eye(n)


def step(imm, belief, sensor, seen, dt=1.0, gate=None, associator=None):
    """Prior, association weights, posterior of one scan for tracks (*b, t)."""
    gate = gate or Gate(0.99)
    prior = imm.predict(belief, dt, RNG)
    innovation = imm.evaluate(prior, sensor, seen, gate.probability)
    ones = np.ones(innovation.loglik.shape[:-1])
    scores = gate.scores(innovation, sensor, seen, ones, gate.for_sensor(sensor))
    weights = (associator or Pda()).associate(scores, None)
    return prior, innovation, weights, imm.update(prior, innovation, weights)


def normal(nu, S):
    return np.exp(-0.5 * nu @ np.linalg.solve(S, nu)) / np.sqrt(np.linalg.det(2 * np.pi * S))


def pool(parts):
    """Mean and covariance of weighted Gaussians (weight, mean, covariance)."""
    mean = sum(w * x for w, x, _ in parts)
    second = sum(w * (P + np.outer(x, x)) for w, x, P in parts)
    return mean, second - np.outer(mean, mean)


WIDE = Gate(1 - 1e-12)


def check_against_all_mode_sequences(seed):
    """From a common Gaussian prior: the first posterior and the second prior, by summing over every sequence of modes and
    every origin of the returns.
    """
    rng = np.random.default_rng(seed)
    n, m, r = 3, 2, 3
    motions = [Linear(rng.normal(size=(n, n)), covariance(rng, n)) for _ in range(r)]
    T, initial = rng.dirichlet(np.ones(r), size=r), rng.dirichlet(np.ones(r))
    imm = Imm(tuple(map(Kalman, motions)), transition=T, initial=initial)
    sensor = Looking(rng.normal(size=(m, n)), covariance(rng, m))
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
def test_equals_the_textbooks_imm_pdaf_over_fifty_scans(seed):
    check_against_the_textbook(seed)


def interact_keeping_old_probabilities(log_prob, *rest):
    return log_prob, *REAL["interact"](log_prob, *rest)[1:]


def interact_mixing_nothing(log_prob, log_transition, xs, Ps, *rest):
    return REAL["interact"](log_prob, log_transition, xs, Ps, *rest)[0], xs, Ps


def interact_without_spread(log_prob, log_transition, xs, Ps, *rest):
    predicted, means, _ = REAL["interact"](log_prob, log_transition, xs, Ps, *rest)
    return predicted, means, REAL["interact"](log_prob, log_transition, [0 * x for x in xs], Ps, *rest)[2]


def together_without_spread(log_prob, xs, Ps, *rest):
    mean, _ = REAL["together"](log_prob, xs, Ps, *rest)
    return mean, REAL["together"](log_prob, [0 * x for x in xs], Ps, *rest)[1]


def absorb_without_spread(x, P, shift, post, weights, periods):
    within = np.sum(weights[..., 1:, None, None] * post, axis=-3) + weights[..., :1, None] * P
    return REAL["weighted_update"](x, P, shift, post, weights, periods)[0], within


def innovate_without_likelihood(*given):
    loglik, *rest = REAL["evaluate_returns"](*given)
    return np.concatenate([loglik[..., :1], np.full_like(loglik[..., 1:], -5.0)], axis=-1), *rest


def innovate_with_evidence_counted_twice(*given):
    loglik, *rest = REAL["evaluate_returns"](*given)
    return np.concatenate([loglik[..., :1], 2 * loglik[..., 1:]], axis=-1), *rest


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
    (kernels, "interact", interact_keeping_old_probabilities),
    (kernels, "interact", interact_mixing_nothing),
    (kernels, "interact", interact_without_spread),
    (kernels, "together", together_without_spread),
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


def unlike(transition=None, **more):
    """CV, CA, a turn by an EKF, a turn by a UKF: states of 4, 6, 5 and 5 axes."""
    modes = (
        Kalman(ConstantVelocity(0.3)),
        ExtendedKalman(ConstantAcceleration(0.3)),
        ExtendedKalman(CoordinatedTurn(0.3, 0.01)),
        UnscentedKalman(CoordinatedTurn(0.3, 0.02)),
    )
    if transition is None and "rates" not in more:
        transition = np.full((4, 4), 0.05) + 0.8 * np.eye(4)
    return Imm(modes, transition=transition, **more)


RADAR = RangeBearing(10.0, 0.01, detection_probability=0.9, max_range=5000.0, clutter_per_scan=20.0)


def start(imm, *batch, seed=0):
    """Boats 1 km off, some m/s fast, hardly known to accelerate or turn."""
    rng = np.random.default_rng(seed)
    typical = {"x": (800.0, 20.0), "y": (500.0, 20.0), "vx": (-10.0, 3.0), "vy": (5.0, 3.0)}
    mean, deviation = np.array([typical.get(name, (0.0, 0.05)) for name in imm.state.names]).T
    n = len(mean)
    a = deviation[:, None] * (np.eye(n) + rng.normal(size=(*batch, n, n)) / 4)
    return imm.start(Gaussian(mean + deviation * rng.normal(size=(*batch, n)), a @ np.swapaxes(a, -1, -2)), imm.state, rng)


def scene(sensor, *batch, scans=6, k=3, seed=1):
    """Returns (*b, k, m) about a boat under way, some of them padding."""
    rng = np.random.default_rng(seed)
    for i in range(scans):
        x = np.array([800.0 - 15 * i, 500.0 + 8 * i]) + rng.normal(size=(*batch, k, 2)) * [15, 15]
        valid = rng.random((*batch, k)) < 0.8
        yield Detections(sensor.measure(x), valid)


def alone(imm, belief, i):
    """Entry `i` of the batch, as a belief of its own."""
    return trees.take(belief, i, 0)


def run(imm, belief, sensor, seen, associator=None):
    for detections in seen:
        belief = step(imm, belief, sensor, detections, 1.5, associator=associator)[-1]
    return belief


NESTED = Imm(
    (
        Imm((Kalman(ConstantVelocity(0.1)), ExtendedKalman(ConstantVelocity(1.0))), transition=[[0.9, 0.1], [0.1, 0.9]]),
        UnscentedKalman(CoordinatedTurn(0.3, 0.02)),
    ),
    rates=[[-0.1, 0.1], [0.2, -0.2]],
)
FILTERED = CartesianPosition(10.0, 0.9, clutter_density=1e-5)


@pytest.mark.parametrize(("imm", "sensor"), [(unlike(), FILTERED), (NESTED, FILTERED)], ids=["unlike", "nested"])
@pytest.mark.parametrize("associator", [Pda(), Jpda(), GlobalNearest(), Nearest()], ids=lambda a: a.kind)
def test_a_batch_of_runs_is_the_loop_over_them(imm, sensor, associator):
    belief, seen = start(imm, 3, 2), list(scene(sensor, 3))
    together = run(imm, belief, sensor, seen, associator)
    gaussian, prob = imm.moments(together), imm.mode_prob(together)
    np.testing.assert_allclose(prob.sum(axis=-1), 1, rtol=1e-12)
    assert np.linalg.eigvalsh(gaussian.cov).min() > 0
    assert np.abs(gaussian.mean[..., :2] - [715, 540]).max() < 40
    np.testing.assert_array_equal(gaussian.cov, np.swapaxes(gaussian.cov, -1, -2))
    for i in range(3):
        one = run(imm, alone(imm, belief, i), sensor, [Detections(s.z[i], s.valid[i]) for s in seen], associator)
        np.testing.assert_allclose(prob[i], imm.mode_prob(one), rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(gaussian.mean[i], imm.moments(one).mean, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(gaussian.cov[i], imm.moments(one).cov, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("batch", [(0,), (2, 0), (1,)])
@pytest.mark.parametrize("k", [0, 2])
def test_no_tracks_and_no_returns_are_no_special_case(batch, k):
    imm = unlike()
    z = np.broadcast_to([700.0, 0.5], (*batch[:-1], k, 2))
    prior, innovation, weights, posterior = step(
        imm, start(imm, *batch), FILTERED, Detections(z, np.ones(z.shape[:-1], bool))
    )
    assert innovation.loglik.shape == weights.shape == (*batch, 1 + k)
    assert innovation.nis.shape == innovation.distance.shape == (*batch, k)
    assert imm.mode_prob(posterior).shape == (*batch, 4)
    assert imm.moments(posterior).cov.shape == (*batch, 7, 7)
    if k == 0:
        for found, expected in zip(posterior.beliefs, prior.beliefs, strict=True):
            np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-14)
            np.testing.assert_allclose(found.cov, expected.cov, rtol=1e-12)


def test_one_mode_is_its_estimator_and_single_modes_nest_without_a_trace():
    modes = Kalman(ConstantVelocity(0.3)), UnscentedKalman(CoordinatedTurn(0.3, 0.02))
    T = [[0.9, 0.1], [0.3, 0.7]]
    flat = Imm(modes, transition=T)
    nested = Imm(tuple(Imm((mode,), transition=[[1.0]]) for mode in modes), transition=T)
    seen = list(scene(FILTERED))
    one, other = (run(imm, start(imm, 1), FILTERED, seen) for imm in (flat, nested))
    np.testing.assert_allclose(flat.mode_prob(one), nested.mode_prob(other), rtol=1e-9)
    np.testing.assert_allclose(flat.moments(one).mean, nested.moments(other).mean, rtol=1e-9)
    np.testing.assert_allclose(flat.moments(one).cov, nested.moments(other).cov, rtol=1e-9, atol=1e-9)
    only = Imm(modes[:1], transition=[[1.0]])
    filtered, single = run(only, start(only, 1), FILTERED, seen), start(modes[0], 1)
    for detections in seen:
        single = step(modes[0], single, FILTERED, detections, 1.5)[-1]
    np.testing.assert_allclose(only.moments(filtered).mean, single.mean, rtol=1e-10)
    np.testing.assert_allclose(only.moments(filtered).cov, single.cov, rtol=1e-10, atol=1e-10)


def test_a_nested_imm_starts_each_prediction_from_its_initial_probabilities():
    """The outer one mixes through means and covariances alone."""
    prior, inner = NESTED.predict(start(NESTED, 1), 2.0, RNG), NESTED.modes[0]
    far = NESTED.evaluate(prior, FILTERED, Detections.of([[1500.0, 500.0]]), 0.99)
    belief = NESTED.update(prior, far, np.array([[0.0, 1.0]]))
    assert inner.mode_prob(belief.beliefs[0])[0, 1] > 0.6
    np.testing.assert_allclose(inner.mode_prob(NESTED.predict(belief, 1.0, RNG).beliefs[0]), [[0.5, 0.5]], rtol=1e-12)


def test_an_axis_that_a_mode_lacks_is_there_as_declared():
    modes = Kalman(ConstantVelocity(0.3)), ExtendedKalman(CoordinatedTurn(0.3, 0.02))
    prior = Gaussian(np.array([[0.0, 0.0, 1.0, 1.0, 0.3]]), np.diag([1.0, 1.0, 1.0, 1.0, 0.04])[None])
    for declared, mean, variance in (({}, 0.0, 0.0), ({"turn_rate": [0.1, 0.2]}, 0.1, 0.04)):
        imm = Imm(modes, transition=[[0.9, 0.1], [0.2, 0.8]], initial=[0.25, 0.75], absent=declared)
        found = imm.moments(imm.start(prior, imm.state, RNG))
        expected = pool([(0.25, np.array([mean]), np.array([[variance]])), (0.75, np.array([0.3]), np.array([[0.04]]))])
        np.testing.assert_allclose(found.mean[0, 4], expected[0][0], rtol=1e-12)
        np.testing.assert_allclose(found.cov[0, 4, 4], expected[1][0, 0], rtol=1e-12)


@frozen(eq=False)
class Headed(MotionModel):
    """x stays, and a zero_variance heading of its own."""

    turn: float
    kind = "test_headed"

    @property
    def state(self):
        return Space.of(x0="m", heading="rad mod 2pi")

    @property
    def zero_variance(self):
        return Space.of(heading="rad mod 2pi")

    def move(self, x, dt):
        return self.state.displace(x, np.array([0.0, self.turn * dt]))

    def noise(self, x, dt):
        return np.diag([dt, 0.0])


def test_carried_axes_stay_without_variance_where_modes_disagree_about_them():
    imm = Imm((ExtendedKalman(Headed(0.1)), UnscentedKalman(Headed(0.3))), transition=[[0.5, 0.5], [0.5, 0.5]])
    assert imm.zero_variance.names == ("heading",)
    belief = imm.start(Gaussian(np.array([[0.0, np.pi - 0.1]]), np.eye(2)[None]), imm.state, RNG)
    belief = run(imm, belief, Looking(np.eye(1), np.eye(1)), [Detections.of([[0.5]])])
    found = imm.moments(belief)
    assert found.mean[0, 1] == pytest.approx(-np.pi + 0.2)  # 1.5 s at .1 and .3 rad/s, across the cut
    np.testing.assert_array_equal(found.cov[0] > 0, [[True, False], [False, False]])


def test_settle_gets_each_modes_mixed_belief_and_the_estimate_over_its_axes():
    told = []

    class Settling(Linear):
        def reframe(self, own, combined):
            told.append((own, combined))
            return own

    imm = Imm(
        tuple(ExtendedKalman(Settling(f * np.eye(1), np.eye(1))) for f in (1.0, 2.0)), transition=[[0.8, 0.2], [0.2, 0.8]]
    )
    belief = imm.start(Gaussian(np.ones((1, 1)), np.ones((1, 1, 1))), imm.state, RNG)
    apart = imm.predict(belief, 1.0, RNG)
    told.clear()
    imm.predict(apart, 0.0, RNG)
    assert not told
    imm.predict(apart, 1.0, RNG)
    estimate = imm.moments(apart)
    assert [own.mean.item() for own, _ in told] == pytest.approx([1.2, 1.8])
    for _, combined in told:
        np.testing.assert_allclose(combined.mean, estimate.mean)
        np.testing.assert_allclose(combined.cov, estimate.cov)


TWO = Kalman(ConstantVelocity(0.1)), Kalman(ConstantVelocity(3.0))
SWITCH = np.array([[0.9, 0.1], [0.3, 0.7]])


def prob_after(imm, *times):
    belief = start(imm, 1)
    for dt in times:
        belief = imm.predict(belief, dt, RNG)
    return imm.mode_prob(belief)[0]


def test_a_transition_holds_per_scan_or_for_its_interval_or_follows_from_rates():
    p = np.array([0.2, 0.8])
    per_scan = Imm(TWO, transition=SWITCH, initial=p)
    per_interval = Imm(TWO, transition=SWITCH, interval=4.0, initial=p)
    rates = np.array([[-0.2, 0.2], [0.5, -0.5]])
    by_rates = Imm(TWO, rates=rates, initial=p)
    close = partial(np.testing.assert_allclose, rtol=1e-12)
    close(prob_after(per_scan, 0.5), p @ SWITCH)
    close(prob_after(per_scan, 7.0), p @ SWITCH)
    close(prob_after(per_interval, 4.0), p @ SWITCH)
    close(prob_after(per_interval, 2.0, 2.0), p @ SWITCH)
    close(prob_after(per_interval, 1.0, 3.0, 4.0), p @ SWITCH @ SWITCH)
    close(prob_after(by_rates, 1.5), p @ expm(rates * 1.5))
    close(prob_after(by_rates, 1.0, 0.5), p @ expm(rates * 1.5))


def test_no_time_leaves_the_belief():
    for imm in (unlike(), NESTED):
        belief = start(imm, 2)
        assert imm.predict(belief, 0.0, RNG) is belief


NO_GENERATOR = [[[0.4, 0.6], [0.6, 0.4]], [[0.9, 0.1, 0.0], [0.0, 0.9, 0.1], [0.1, 0.0, 0.9]], [[0.5, 0.5], [0.5, 0.5]]]


@pytest.mark.parametrize("matrix", [*NO_GENERATOR, [[0.0, 1.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]])
def test_an_interval_is_refused_where_the_matrix_has_no_generator(matrix):
    modes = TWO + TWO[: len(matrix) - 2]
    Imm(modes, transition=matrix)
    with pytest.raises(ValueError, match="interval: this transition matrix has no generator"):
        Imm(modes, transition=matrix, interval=1.0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "transition: give either `transition` or `rates`"),
        ({"transition": SWITCH, "rates": [[0, 0], [0, 0]]}, "transition: give either"),
        ({"transition": [[0.9, 0.2], [0.1, 0.9]]}, "transition: each row must sum to 1, row 0 sums to 1.1"),
        ({"transition": [[1.1, -0.1], [0.1, 0.9]]}, "transition: probabilities must be >= 0, got -0.1"),
        ({"transition": [[0.9, 0.1]]}, "transition: must be square, got 1 x 2"),
        ({"transition": [[1.0]]}, "transition: must have one row for each of the 2 modes, got 1"),
        ({"rates": [[0.1, -0.1], [0.1, -0.1]]}, "rates: rates from one mode to another must be >= 0 per s, got -0.1"),
        ({"rates": [[-0.1, 0.2], [0.1, -0.1]]}, "rates: each row must sum to 0"),
        ({"rates": [[-0.1, 0.1], [0.1, -0.1]], "interval": 1.0}, "interval: goes with `transition`"),
        ({"transition": SWITCH, "initial": [0.5, 0.4]}, "initial: must be probabilities > 0 that sum to 1"),
        ({"transition": SWITCH, "initial": [1.0, 0.0]}, "initial: must be probabilities > 0 that sum to 1"),
        ({"transition": SWITCH, "initial": [1.0]}, "initial: must have one row for each of the 2 modes, got 1"),
        ({"transition": SWITCH, "interval": 0}, "interval: must be > 0, got 0 s"),
        ({"transition": SWITCH, "absent": {"turn_rate": [0, 1]}}, "absent.turn_rate: no mode has this axis"),
        ({"transition": [[np.nan, 1], [0.1, 0.9]]}, "transition: must be finite numbers"),
    ],
)
def test_what_is_wrong_with_a_parameter_is_said(parameters, message):
    with pytest.raises(ValueError, match=message.replace("[", r"\[")):
        Imm(TWO, **parameters)


def test_there_is_at_least_one_mode_and_each_must_take_the_sensor():
    with pytest.raises(ValueError, match="modes: must hold at least one estimator, got none"):
        Imm((), transition=np.empty((0, 0)))
    assert "'range_bearing'" in Imm(TWO, transition=SWITCH).refuses(RADAR)
    assert unlike().refuses(FILTERED) is None


@pytest.mark.parametrize(
    "transition",
    [[[1.0, 0.0], [0.1, 0.9]], [[0.0, 1.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]]],
)
def test_impossible_switches_give_no_nan(transition):
    """Also where a mode cannot be reached at all, and is then left with no variance on an axis of its own."""
    modes = Kalman(ConstantVelocity(0.3)), UnscentedKalman(CoordinatedTurn(0.3, 0.02))
    imm = Imm(modes, transition=transition)
    belief, prob = start(imm, 2), np.array([0.5, 0.5])
    for detections in scene(FILTERED):
        belief = imm.predict(belief, 1.5, RNG)
        np.testing.assert_allclose(imm.mode_prob(belief) - prob @ np.array(transition), 0, atol=1e-14)
        belief = step(imm, belief, FILTERED, detections, 0.0)[-1]
        prob = imm.mode_prob(belief)
        for part in (imm.moments(belief), *belief.beliefs):
            assert np.all(np.isfinite(part.mean))
            assert np.all(np.linalg.eigvalsh(part.cov) > -1e-9)
        np.testing.assert_allclose(prob.sum(axis=-1), 1, rtol=1e-12)
    if transition[0][1] == transition[1][1] == 0.0:
        np.testing.assert_array_equal(prob, [[1.0, 0.0]] * 2)


def test_a_far_return_still_tells_the_modes_apart():
    """1000 deviations away both likelihoods underflow; their ratio does not."""
    imm = Imm(TWO, transition=SWITCH)
    prior = imm.predict(start(imm, 1), 1.0, RNG)
    for far in (1e3, 1e4, 1e6):
        innovation = imm.evaluate(prior, FILTERED, Detections.of([[800.0 + far, 500.0]]), 0.99)
        posterior = imm.update(prior, innovation, np.array([[0.0, 1.0]]))
        distance = [part.distance[0, 0] for part in innovation.detail.innovations]
        volume = [part.log_volume[0] for part in innovation.detail.innovations]
        assert max(distance) > 500
        odds = posterior.log_prob[0, 1] - posterior.log_prob[0, 0]
        before = prior.log_prob[0, 1] - prior.log_prob[0, 0]
        expected = before + 0.5 * (distance[0] - distance[1]) - (volume[1] - volume[0])
        np.testing.assert_allclose(odds, expected, rtol=1e-9)
        assert imm.mode_prob(posterior)[0, 1] > 0.99


class SeesTheFast(Looking):
    """Detects with a probability that is the state itself."""

    def detects(self, x):
        return np.clip(x[..., 0], 0.0, 1.0)


def test_a_miss_moves_the_modes_only_as_their_detection_probabilities_differ():
    motions = Linear(0.2 * np.eye(1), 0.01 * np.eye(1)), Linear(0.9 * np.eye(1), 0.01 * np.eye(1))
    imm = Imm(tuple(map(ExtendedKalman, motions)), transition=SWITCH)
    prior = imm.predict(imm.start(Gaussian(np.ones((1, 1)), 0.01 * np.ones((1, 1, 1))), imm.state, RNG), 1.0, RNG)
    c, nothing = imm.mode_prob(prior), Detections.of([], 1)
    for sensor, miss in (
        (Looking(np.eye(1), np.eye(1), 0.7), [1.0, 1.0]),
        (SeesTheFast(np.eye(1), np.eye(1)), [0.802, 0.109]),
    ):
        innovation = imm.evaluate(prior, sensor, nothing, 0.99)
        posterior = imm.update(prior, innovation, np.ones((1, 1)))
        expected = c * miss / np.sum(c * miss)
        np.testing.assert_allclose(imm.mode_prob(posterior), expected, rtol=1e-12)
        np.testing.assert_allclose(imm.moments(posterior).mean[0], expected[0] @ [0.2, 0.9], rtol=1e-12)


def test_hard_weights_are_the_update_by_that_return_alone():
    imm, returns = unlike(), Detections.of([[790.0, 510.0], [805.0, 497.0]])
    prior = imm.predict(start(imm, 1), 1.5, RNG)
    chosen = imm.update(prior, imm.evaluate(prior, FILTERED, returns, 0.99), np.array([[0.0, 0.0, 1.0]]))
    only = imm.update(prior, imm.evaluate(prior, FILTERED, Detections.of(returns.z[1:]), 0.99), np.array([[0.0, 1.0]]))
    np.testing.assert_allclose(imm.mode_prob(chosen), imm.mode_prob(only), rtol=1e-12)
    np.testing.assert_allclose(imm.moments(chosen).mean, imm.moments(only).mean, rtol=1e-12)


def jump_markov(modes, T, initial, prior, sensor, runs, scans, dt, seed):
    """Truth (runs, 1, n) and returns (runs, 1, m) of each scan, drawn from the IMM's own models, all runs at once."""
    rng = np.random.default_rng(seed)
    mode = rng.choice(len(T), size=runs, p=initial)
    x = rng.multivariate_normal(prior.mean, prior.cov, size=(runs, 1))
    for _ in range(scans):
        mode = (rng.random((runs, 1)) > np.cumsum(T, axis=1)[mode]).sum(axis=1)
        L = np.linalg.cholesky(np.stack([m.noise(x, dt) for m in modes]))[mode]
        x = modes[0].move(x, dt) + (L @ rng.normal(size=(runs, 4, 1)))[..., 0][:, None, :]
        yield x, sensor.measure(x[..., :2]) + sensor.sigma * rng.normal(size=(runs, 1, 2))


def test_nis_of_an_imm_has_mean_m_where_its_prior_is_exact():
    """From a common prior the predicted mixture is exact, so over 20000 runs the mean lies within 5.4 standard errors of m:
    false alarms below 1e-7. Weights that do not know the return, and the least distance, do not have that mean.
    """
    runs, sensor, initial = 20000, CartesianPosition(3.0), [0.5, 0.5]
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([10.0, 10.0, 1.0, 1.0]))
    _, z = next(jump_markov([mode.motion for mode in TWO], SWITCH, initial, prior, sensor, runs, 1, 2.0, seed=5))
    imm = Imm(TWO, transition=SWITCH, initial=initial)
    spread = Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4)))
    predicted = imm.predict(imm.start(spread, imm.state, RNG), 2.0, RNG)
    innovation = imm.evaluate(predicted, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
    each = np.stack([part.nis[:, 0, 0] for part in innovation.detail.innovations], axis=-1)

    def is_two(nis):
        return abs(nis.mean() - 2) < 5.4 * nis.std() / np.sqrt(runs)

    assert is_two(innovation.nis[:, 0, 0])
    assert not is_two(each @ imm.mode_prob(predicted)[0, 0])
    assert not is_two(each.min(axis=-1))


def within_a_tenth(values, freedom):
    """Whether the mean of `values` (scans, runs) over `freedom` lies in .9 to 1.1 by all of 5.2 of its standard errors.

    The run is the unit: values within one are not independent. A mean outside passes once in 1e7.
    """
    of_runs = np.mean(values, axis=0) / freedom
    margin = 5.2 * of_runs.std(ddof=1) / np.sqrt(of_runs.size)
    return bool(margin < 0.06 and 0.9 + margin < of_runs.mean() < 1.1 - margin)


@pytest.mark.parametrize(
    ("switch", "sigma", "consistent"),
    [(SWITCH, 10.0, True), (SWITCH, 8.8, False), (np.array([[0.999, 0.001], [0.5, 0.5]]), 10.0, False)],
    ids=["matched", "too sure of the returns", "hardly ever switches"],
)
def test_nees_and_nis_of_an_imm_on_jump_markov_truth(switch, sigma, consistent):
    """3000 runs of 30 scans, truth drawn from its own modes and switches; standard errors of about .006.

    By normal theory the matched case fails less than once in 1e9 while the filter's own mean is within .98 to 1.02.
    """
    modes, initial = (ConstantVelocity(0.2), ConstantVelocity(3.0)), np.array([0.75, 0.25])
    sensor, runs = CartesianPosition(10.0), 3000
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([400.0, 400.0, 25.0, 25.0]))
    imm = Imm(tuple(map(Kalman, modes)), transition=switch, initial=initial)
    belief = imm.start(
        Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4))), imm.state, RNG
    )
    nees, nis = [], []
    for x, z in jump_markov(modes, SWITCH, initial, prior, sensor, runs, 30, 2.0, seed=3):
        belief = imm.predict(belief, 2.0, RNG)
        innovation = imm.evaluate(belief, CartesianPosition(sigma), Detections(z, np.ones((runs, 1), bool)), 1.0)
        belief = imm.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        found = imm.moments(belief)
        error = x - found.mean
        nees.append((error[..., None, :] @ np.linalg.solve(found.cov, error[..., None]))[:, 0, 0, 0])
        nis.append(innovation.nis[:, 0, 0])
    assert (within_a_tenth(nees, 4) and within_a_tenth(nis, 2)) == consistent


@pytest.mark.parametrize("estimator", [Kalman(ConstantVelocity(1.0)), Imm(TWO, transition=SWITCH)], ids=["kalman", "imm"])
def test_nis_under_pda_is_that_of_a_return_in_the_gate(estimator):
    """Among clutter the weighted squared distance over the weight of a return estimates E[d | d < gate] = m F_m+2 / F_m,
    here 1.69 of 2 axes.

    Truth, its detection and the clutter are drawn from the models; one scan of 40000 runs, false alarms 2e-7. The plain m
    is far outside the band. An IMM's gate is the union of its modes', so there the figure is only near.
    """
    runs, gate, dt = 40000, Gate(0.95), 2.0
    rng = np.random.default_rng(6)
    sensor = CartesianPosition(10.0, 0.8, clutter_density=2e-4)
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([100.0, 100.0, 4.0, 4.0]))
    modes = [mode.motion for mode in getattr(estimator, "modes", [estimator])]
    chain = (SWITCH, [0.5, 0.5]) if len(modes) == 2 else (np.ones((1, 1)), [1.0])
    x, z = next(jump_markov(modes, *chain, prior, sensor, runs, 1, dt, seed=7))
    side, most = 240.0, 40
    clutter = x[..., :2] + rng.uniform(-side / 2, side / 2, (runs, most, 2))
    counts = np.minimum(rng.poisson(2e-4 * side**2, runs), most)
    valid = np.concatenate([rng.random((runs, 1)) < 0.8, np.arange(most) < counts[:, None]], axis=1)
    detections = Detections(np.concatenate([z, clutter], axis=1), valid)
    spread = Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4)))
    _, innovation, weights, _ = step(estimator, estimator.start(spread, estimator.state, RNG), sensor, detections, dt, gate)
    used = np.sum(weights[:, 0, 1:] * innovation.nis[:, 0], axis=-1)
    hit = 1 - weights[:, 0, 0]
    if len(modes) == 1:
        threshold = gate.threshold(2)
        expected = 2 * stats.chi2.cdf(threshold, 4) / stats.chi2.cdf(threshold, 2)
        excess = used - expected * hit
        margin = 5.4 * excess.std() / np.sqrt(runs)
        assert abs(excess.mean()) < margin
        assert abs((used - 2.0 * hit).mean()) > 2 * margin
        assert abs(hit.mean() - 0.8 * 0.95) < 5.4 * hit.std() / np.sqrt(runs)
    assert 1.6 < used.sum() / hit.sum() < 1.8
