"""The IMM: batches, nesting, unlike modes, axes that modes lack, and what single returns do."""

import numpy as np
import pytest
from attrs import frozen

from support.imm import NESTED, pool, start, step, unlike
from support.models import LinearStep, Looking
from vedette import Detections, Gaussian, MotionModel, Space
from vedette.tracking import pytrees
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
RADAR = RangeBearing(10.0, 0.01, detection_probability=0.9, max_range=5000.0, clutter_per_scan=20.0)


def scene(sensor, *batch, scans=6, k=3, seed=1):
    """Returns (*b, k, m) about a boat under way, some of them padding."""
    rng = np.random.default_rng(seed)
    for i in range(scans):
        x = np.array([800.0 - 15 * i, 500.0 + 8 * i]) + rng.normal(size=(*batch, k, 2)) * [15, 15]
        valid = rng.random((*batch, k)) < 0.8
        yield Detections(sensor.measure(x), valid)


def alone(imm, belief, i):
    """Entry `i` of the batch, as a belief of its own."""
    return pytrees.take(belief, i, 0)


def run(imm, belief, sensor, seen, associator=None):
    for detections in seen:
        belief = step(imm, belief, sensor, detections, 1.5, associator=associator)[-1]
    return belief


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
    belief = run(imm, belief, Looking(np.eye(1), np.eye(1), 0.8), [Detections.of([[0.5]])])
    found = imm.moments(belief)
    assert found.mean[0, 1] == pytest.approx(-np.pi + 0.2)  # 1.5 s at .1 and .3 rad/s, across the cut
    np.testing.assert_array_equal(found.cov[0] > 0, [[True, False], [False, False]])


def test_settle_gets_each_modes_mixed_belief_and_the_estimate_over_its_axes():
    told = []

    class Settling(LinearStep):
        reframes = True

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


def test_there_is_at_least_one_mode_and_each_must_take_the_sensor():
    with pytest.raises(ValueError, match=r"modes: must hold at least.*got none"):
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
    motions = LinearStep(0.2 * np.eye(1), 0.01 * np.eye(1)), LinearStep(0.9 * np.eye(1), 0.01 * np.eye(1))
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
