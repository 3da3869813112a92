"""What an estimator declares is what happens: nobody looks at its class, and what contradicts itself is refused."""

import numpy as np
import pytest
from attrs import field, frozen

from vedette import Detections, Gaussian, MotionModel, PluginError, Registry, Space, Tracker, Traits, fields
from vedette.filters import GaussianFilter, contradiction, predicted
from vedette.testing import laws_of
from vedette.testing.comparisons import Misuse
from vedette.testing.sensors import Watch
from vedette_flir.estimators.monitored import ResidualMonitored
from vedette_flir.motion.constant_axes import Carrying
from vedette_standard.associators.nearest import Nearest
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.fading_memory import FadingMemory
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.least_squares import LeastSquares
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.lifecycles.single_target import SingleTarget
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.product import Product
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_target_oriented.literal import TargetOrientedLiteral

CV = ConstantVelocity(0.5)
PRIOR = Gaussian(np.array([[1.0, 2.0, 3.0, 4.0]]), np.diag([4.0, 9.0, 1.0, 1.0])[None])
RNG = np.random.default_rng(0)
PARTS = {"radar": CartesianPosition(10.0)}, Nearest(), SingleTarget()


@frozen
class Wide(GaussianFilter):
    """A filter that keeps its belief in other units: its covariance is 100 times what the belief holds."""

    kind = "test_wide"

    motion: MotionModel = fields.part("how the target moves")
    _inner: ExtendedKalman = field(init=False)

    @_inner.default
    def _extended(self):
        return ExtendedKalman(self.motion)

    def start(self, prior, axes, rng):
        inner = self._inner.start(prior, axes, rng)
        return Gaussian(inner.mean, inner.cov / 100)

    def predict(self, belief, dt, rng):
        ahead = self._inner.predict(Gaussian(belief.mean, 100 * belief.cov), dt, rng)
        return Gaussian(ahead.mean, ahead.cov / 100)

    def evaluate(self, belief, sensor, observed, p_gate):
        return self._inner.evaluate(Gaussian(belief.mean, 100 * belief.cov), sensor, observed, p_gate)

    def update(self, belief, innovation, weights):
        after = self._inner.update(Gaussian(belief.mean, 100 * belief.cov), innovation, weights)
        return Gaussian(after.mean, after.cov / 100)

    def moments(self, belief):
        return Gaussian(belief.mean, 100 * belief.cov)


@pytest.mark.parametrize("modes", [(Wide(CV),), (Wide(CV), Wide(CV)), (Wide(CV), ExtendedKalman(CV))])
def test_a_mixture_asks_a_mode_whose_belief_is_its_own(modes):
    """Of modes that estimate the same the mixture estimates that, whatever they keep."""
    imm = Imm(modes, transition=np.full((len(modes),) * 2, 1 / len(modes)))
    watch, z = Watch(Space.of(x="m", y="m"), np.eye(2)), Detections.of([[5.0, 5.0]])
    found = []
    for estimator in (imm, ExtendedKalman(CV)):
        belief = estimator.start(PRIOR, CV.state, RNG)
        for _ in range(3):
            belief = predicted(estimator, belief, 1.0, RNG)
            belief = estimator.update(belief, estimator.evaluate(belief, watch, z, 0.99), np.array([[0.2, 0.8]]))
        found.append(estimator.moments(belief))
    np.testing.assert_allclose(found[0].mean, found[1].mean, rtol=1e-12)
    np.testing.assert_allclose(found[0].cov, found[1].cov, rtol=1e-12, atol=1e-12)


def test_a_filter_that_adapts_the_noise_needs_the_belief_itself():
    with pytest.raises(ValueError, match=r"^of: .*'test_wide'"):
        ResidualMonitored(Wide(CV))


@pytest.mark.parametrize(
    ("member", "value"),
    [
        ("traits", Traits(draws=True)),
        ("traits", property(lambda self: Traits(draws=True))),
        ("drops", ("reframe",)),
        ("drops", "reframes"),
        ("takes_frames", True),
        ("draws", property(lambda self: True)),
    ],
)
def test_a_class_that_contradicts_itself_is_refused_wherever_it_is_given(member, value):
    contrary = frozen(type("Contrary", (Wide,), {"kind": "test_contrary", member: value}))
    assert member in contradiction(contrary)
    with pytest.raises(PluginError, match=f"Contrary.*{member}"):
        Registry.of(contrary)
    with pytest.raises(Misuse, match=f"Contrary.*{member}"):
        laws_of(contrary)
    with pytest.raises(ValueError, match=rf"^estimator\.modes\[1\]: .*{member}"):
        Tracker(Imm((Kalman(CV), contrary(CV)), transition=np.eye(2)), *PARTS)


def test_traits_are_those_that_a_class_declares_and_those_of_what_it_holds():
    assert Kalman(CV).traits == Traits(exact_when_linear=True, takes_frames=True, bounded=True)
    mixture = Imm((Kalman(CV), FadingMemory(CV, 1.1)), transition=np.eye(2))
    assert mixture.traits == Traits(takes_frames=True, bounded=True, conservative=True, per_scan=True)
    assert Imm((Kalman(CV), UnscentedKalman(CV)), transition=np.eye(2)).traits == Traits(bounded=True, per_scan=True)
    assert Imm((Kalman(CV), BootstrapParticles(CV)), transition=np.eye(2)).traits == Traits(draws=True, per_scan=True)
    assert ResidualMonitored(FadingMemory(CV, 1.1)).traits == Traits(takes_frames=True, conservative=True)
    assert LeastSquares(CV).traits == Traits(exact_when_linear=True)
    assert LeastSquares(CV, forgetting=0.9).traits == Traits(conservative=True)


@frozen
class Turning(MotionModel):
    kind = "test_turning"

    state = CV.state

    def move(self, x, dt):
        return x

    def noise(self, x, dt):
        return dt * np.eye(4)

    def reframe(self, own, combined):
        return Gaussian(combined.mean + 1.0, own.cov)


@frozen
class Declared(Turning):
    kind = "test_declared"
    reframes = True


def test_a_frame_that_turns_without_saying_so_is_refused():
    with pytest.raises(PluginError, match=r"Turning.*`reframe`"):
        Registry.of(Turning)
    assert contradiction(Declared) == contradiction(TargetOrientedLiteral) == contradiction(Carrying) == ""
    for estimator in (Imm, ExtendedKalman, SquareRootKalman, ResidualMonitored, BootstrapParticles):
        assert contradiction(estimator) == ""


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman, SquareRootKalman])
def test_wrappers_forward_what_they_wrap(kind):
    carried = Carrying(Declared(), {"width": "m"})
    assert carried.reframes
    assert kind(carried).traits.reframes
    assert not kind(Carrying(CV, {"width": "m"})).traits.reframes
    if kind is ExtendedKalman:
        assert ResidualMonitored(kind(carried)).traits.reframes
    mixture = Imm((kind(carried), kind(carried)), transition=np.eye(2))
    assert not mixture.traits.reframes, "a mixture re-expresses its modes itself"
    with pytest.raises(ValueError, match=r"models\[0\]: 'carrying' turns its frame"):
        Product((carried,))
    Product((Carrying(CV, {"width": "m"}),))


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman, SquareRootKalman])
def test_whoever_predicts_the_outermost_estimator_reframes_it(kind):
    estimator = kind(Declared())
    belief = estimator.start(PRIOR, CV.state, RNG)
    np.testing.assert_allclose(estimator.moments(predicted(estimator, belief, 1.0, RNG)).mean, PRIOR.mean + 1)
    assert predicted(estimator, belief, 0.0, RNG) is belief
    np.testing.assert_allclose(estimator.moments(estimator.predict(belief, 1.0, RNG)).mean, PRIOR.mean)


def test_a_mixture_reframes_its_modes_by_its_own_estimate_and_one_inside_it_by_its_own():
    far = Gaussian(PRIOR.mean + 100.0, PRIOR.cov)
    mode = ExtendedKalman(Declared())
    imm = Imm((mode, mode), transition=[[0.5, 0.5], [0.5, 0.5]])
    belief = imm.start(PRIOR, CV.state, RNG)
    apart = type(belief)((belief.beliefs[0], far), belief.log_prob)
    for part in imm.predict(apart, 1.0, RNG).beliefs:
        np.testing.assert_allclose(part.mean, PRIOR.mean + 50 + 1)
    outer = Imm((imm, Kalman(CV)), transition=np.eye(2))
    inner = outer.predict(outer.start(PRIOR, CV.state, RNG), 1.0, RNG).beliefs[0]
    np.testing.assert_allclose(imm.moments(inner).mean, PRIOR.mean + 1)


def test_a_motion_that_only_carries_axes_along_is_no_hindrance():
    motion = Carrying(CV, {"width": "m"})
    prior = Gaussian(np.array([[1.0, 2.0, 3.0, 4.0, 7.0]]), np.diag([4.0, 9.0, 1.0, 1.0, 0.0])[None])
    particles = BootstrapParticles(motion)
    belief = particles.predict(particles.start(prior, motion.state, RNG), 1.0, RNG)
    np.testing.assert_allclose(particles.moments(belief).mean[0, 4], 7.0)
    for kind in (ExtendedKalman, UnscentedKalman, SquareRootKalman):
        wide, plain = kind(motion), kind(CV)
        now, just = wide.start(prior, motion.state, RNG), plain.start(PRIOR, CV.state, RNG)
        found = wide.moments(wide.smooth_step(now, wide.predict(now, 1.0, RNG), 1.0, RNG))
        expected = plain.moments(plain.smooth_step(just, plain.predict(just, 1.0, RNG), 1.0, RNG))
        np.testing.assert_allclose(found.mean[..., :4], expected.mean, rtol=1e-12)
        np.testing.assert_allclose(found.cov[..., :4, :4], expected.cov, atol=1e-9)
        turning = kind(Declared())
        start = turning.start(PRIOR, CV.state, RNG)
        with pytest.raises(NotImplementedError, match="turns its frame"):
            turning.smooth_step(start, start, 1.0, RNG)
