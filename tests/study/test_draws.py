"""What the runs of a study draw: each from its own stream, the same at every point, or a clear refusal."""

import numpy as np
import pytest

import vedette
from vedette.metrics import judge
from vedette.sampling import follow, psd_root
from vedette.sampling.seeds import NotInLockStep
from vedette_study.chunk import goes_together, run_chunk
from vedette_study.seeds import RunSeeds, sequence

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
CONFIG = {
    "source": {
        "kind": "simulation",
        "duration": 6,
        "looks": {"radar": {"interval": 1}},
        "drawn": {"boat": {"models": [CV], "start": START}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "estimator": {"kind": "kalman", "motion": CV},
    "associator": {"kind": "pda"},
    "birth": {"kind": "given", "start": START},
    "lifecycle": {"kind": "single_target"},
}
ALLOWED = {"random", "standard_normal"}


def estimator(kind):
    return CONFIG | {"estimator": {"kind": kind, "motion": CV, "particles": 100}}


def seeds(runs):
    return RunSeeds(3, tuple(runs))


def depends_on_company(make):
    """Whether the draws of run 4 differ between its being alone and among others."""
    many, alone = make(seeds([2, 4, 7])), make(seeds([4]))
    same = [np.array_equal(draw(many, 3)[1], draw(alone, 1)[0]) for draw in (uniforms, normals, uniforms)]
    return not all(same)


def uniforms(rng, runs):
    return rng.random((runs, 5))


def normals(rng, runs):
    return rng.standard_normal((runs, 2, 3))


@pytest.mark.parametrize("seed", [0, 1, 2**31, 2**32, 2**70 + 5, 2**150 + 1])
@pytest.mark.parametrize("branch", [(), (1,), (0, 7), (2**40,)])
def test_streams_are_numpys_own(seed, branch):
    runs = (0, 1, 5, 999, 10**6, 2**32 - 1)
    for run, found in zip(runs, RunSeeds(seed, runs, branch).generators(), strict=True):
        expected = np.random.Generator(np.random.PCG64(sequence(seed, run, branch)))
        assert found.bit_generator.state == expected.bit_generator.state


def test_a_run_draws_the_same_in_any_company():
    assert not depends_on_company(lambda given: given.generator(4))
    assert depends_on_company(lambda given: np.random.default_rng(sequence(3, given.runs[0]))), "a shared stream must show"


@pytest.mark.parametrize("name", sorted(name for name in dir(np.random.Generator) if name[0] != "_" and name not in ALLOWED))
def test_any_other_draw_is_refused(name):
    with pytest.raises(NotInLockStep, match=f"{name}: draws of runs in lock-step are"):
        getattr(seeds(range(3)).generator(0), name)


@pytest.mark.parametrize("size", [None, 2, (2, 3), ()])
def test_a_size_that_does_not_lead_with_the_runs_is_refused(size):
    for draw in ALLOWED:
        with pytest.raises(NotInLockStep, match="leads with the runs, 3"):
            getattr(seeds(range(3)).generator(0), draw)(size)


def test_an_estimator_that_draws_goes_in_lock_step():
    made = vedette.load(estimator("bootstrap_particles"))
    assert goes_together(made)
    many, alone = run_chunk(made, 3, range(5), True), run_chunk(made, 3, range(3, 4), True)
    for name, values in many.figures.items():
        np.testing.assert_allclose(alone.figures[name], values[3:4], 1e-9, 1e-12)


def test_one_whose_draws_do_not_lead_with_the_runs_goes_run_by_run():
    """It draws pairs for all runs at once, so that of two runs in lock-step each would meet the other's numbers."""
    made = estimator("auxiliary_particles")
    assert not goes_together(vedette.load(made))
    found = vedette.monte_carlo(made, 3, 3)
    assert not found.plan.together
    assert np.all(found.figures["position_rmse"] > 0)


def test_a_point_that_must_go_run_by_run_takes_the_others_with_it():
    """Else the points would meet other truths, and their paired differences would compare nothing."""
    trackers = {
        "kept": {},
        "found": {"birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}}, "lifecycle": {"kind": "m_of_n"}},
    }
    both = vedette.monte_carlo(CONFIG, 3, 3, trackers=trackers)
    assert set(both.figures) >= {"gospa", "coverage"}
    experiment = vedette.load(CONFIG)
    for run, squares in enumerate(both.figures["position_rmse"][0]):
        alone = experiment.run(seeds=sequence(3, run))
        score = judge(
            alone.tracks, alone.recording.truth, alone.scans, experiment.judge, experiment.tracker.gate.probability
        )
        assert squares == score.position_rmse_m**2


@pytest.mark.parametrize(
    ("config", "alike"),
    [(CV, True), ({"kind": "target_oriented", "sigma_forward": 0.5, "sigma_side": 2.0}, False)],
)
def test_paths_take_the_noise_of_each_state_and_step(config, alike):
    """As step by step, over steps of two lengths; where noise depends on the state it is not taken from another."""
    model = vedette.load(CONFIG | {"estimator": {"kind": "ekf", "motion": config}}).tracker.estimator.motion
    n, rng = len(model.state), np.random.default_rng(1)
    x0, times = rng.normal(5, 2, (3, n)), np.array([0.0, 1.0, 3.0, 4.0, 6.0])
    standard = rng.standard_normal((3, 4, n))
    x = model.state.canonical(x0)
    assert (model.noise(x, 1.0).ndim == 2) == alike
    for k, dt in enumerate(np.diff(times)):
        lower = np.broadcast_to(psd_root(model.noise(x, dt)), (3, n, n))
        x = model.state.displace(model.move(x, dt), (lower @ standard[:, k, :, None])[..., 0])
        np.testing.assert_allclose(follow(model, x0, times, standard)[:, k + 1], x, rtol=0, atol=1e-12)
