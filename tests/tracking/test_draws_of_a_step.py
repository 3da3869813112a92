"""A step draws from the state's seed and the number of the step: the same whenever it is taken, alone or in a batch."""

import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette import Detections, Estimator, Gaussian, Scan
from vedette.sampling.seeds import NO_DRAWS, Seed
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_study.lockstep import run_together
from vedette_study.seeds import RunSeeds, sequence

CV = {"kind": "constant_velocity", "sigma_accel": 0.5}


def tracker(estimator, **parts):
    return vedette.build(
        {
            "estimator": estimator,
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
            **parts,
        }
    )


PARTICLES = {"kind": "bootstrap_particles", "motion": CV, "particles": 100}
KINDS = {
    "bootstrap": PARTICLES,
    "auxiliary": PARTICLES | {"kind": "auxiliary_particles"},
    "imm": {"kind": "imm", "modes": [{"kind": "kalman", "motion": CV}, PARTICLES], "transition": [[0.9, 0.1], [0.1, 0.9]]},
    "sum": {"kind": "gaussian_sum", "each": PARTICLES, "parts": 2},
    "kalman": {"kind": "kalman", "motion": CV},
}


def scan(k):
    return Scan(float(k), "radar", Detections.of([[3.0 * k, 0.0], [100.0, 5.0 * k]]))


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_twice_from_one_state_gives_the_same(kind):
    """Another state's steps in between, and a new track's draws, change nothing."""
    made = tracker(KINDS[kind])
    state = made.start(seed=4)
    for k in range(4):
        one = made.step(state, scan(k))
        made.step(made.step(state, scan(k)), scan(k + 1))
        other = made.step(state, scan(k))
        for a, b in zip(vars_of(made, one), vars_of(made, other), strict=True):
            np.testing.assert_array_equal(a, b)
        state = one
    assert state.steps == 5


def vars_of(made, state):
    estimate = made.estimate(state)
    return estimate.mean, estimate.cov, state.existence, state.weights


def test_draws_of_other_seeds_and_of_other_steps_differ():
    made = tracker(PARTICLES)
    ends = [made.step(made.start(seed=seed), scan(0)) for seed in (1, 2, 1)]
    means = [made.step(end, Scan(1.0, "radar", Detections.of([], 2))) for end in ends]
    first, second, third = (made.estimate(state).mean for state in means)
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(first, third)
    assert Seed(3).generator(0).random() != Seed(3).generator(1).random()


@pytest.mark.parametrize("kind", ["bootstrap", "imm"])
def test_a_run_draws_the_same_alone_and_among_others(kind):
    made = tracker(KINDS[kind], birth={"kind": "given"}, lifecycle={"kind": "single_target"})
    runs, prior = (2, 5, 9), Gaussian(np.zeros((1, 4)), np.diag([25.0, 25, 4, 4])[None])
    scans = [Detections(np.array([[[3.0 * k + r, 1.0]] for r in runs]), np.ones((3, 1), bool)) for k in range(1, 5)]
    many = Gaussian(np.broadcast_to(prior.mean, (3, 1, 4)), np.broadcast_to(prior.cov, (3, 1, 4, 4)))
    looks = [Scan(float(k), "radar", seen) for k, seen in enumerate(scans, 1)]
    together = run_together(made, many, 0.0, looks, RunSeeds(11, runs).child(1))
    for i, run in enumerate(runs):
        state = made.start(prior, 0.0, sequence(11, run, (1,)))
        for k, seen in enumerate(scans, 1):
            state = made.step(state, Scan(float(k), "radar", Detections(seen.z[i], seen.valid[i])))
        np.testing.assert_allclose(together.mean[i, -1], made.estimate(state).mean[0], rtol=1e-9, atol=1e-9)


def test_a_seed_is_a_value_of_whatever_it_is_made_from():
    assert Seed.of(5) == Seed.of(np.random.SeedSequence(5)) == Seed(5)
    assert Seed.of(Seed(5)) == Seed(5)
    assert Seed.of(sequence(5, 3, (1,))) == Seed(5, (3, 1))
    assert Seed.of(np.random.default_rng(1)) == Seed.of(np.random.default_rng(1)) != Seed.of(np.random.default_rng(2))
    rng = np.random.default_rng(1)
    assert Seed.of(rng) != Seed.of(rng)
    assert RunSeeds(5, (3,)).child(1).generators()[0].random() == np.random.default_rng(sequence(5, 3, (1,))).random()
    with pytest.raises(ValueError, match="must be a whole number >= 0"):
        Seed.of(-1)


@frozen
class Sly(Estimator):
    """A Kalman filter that jitters its prediction and does not say that it draws."""

    kind = "test_sly"
    drops = ("bounded",)
    inner: Kalman = Kalman(ConstantVelocity(0.5))

    @property
    def state(self):
        return self.inner.state

    def start(self, prior, axes, rng):
        return self.inner.start(prior, axes, rng)

    def predict(self, belief, dt, rng):
        after = self.inner.predict(belief, dt, rng)
        return Gaussian(after.mean + rng.normal(size=after.mean.shape), after.cov)

    def evaluate(self, belief, sensor, observed, p_gate):
        return self.inner.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief, innovation, weights):
        return self.inner.update(belief, innovation, weights)

    def moments(self, belief):
        return belief


def test_an_estimator_that_draws_must_say_so():
    made = tracker(KINDS["kalman"])
    made = vedette.Tracker(Sly(), made.sensors, made.associator, made.lifecycle, None)
    state = made.start()
    said = r"test_sly \(\S+Sly\)\.predict raised TypeError: rng\.normal: "
    with pytest.raises(vedette.PluginError, match=said):
        made.step(state, scan(0))
    for name in ("random", "standard_normal", "integers", "spawn", "bit_generator"):
        with pytest.raises(TypeError, match=name):
            getattr(NO_DRAWS, name)
