"""The target-oriented models, against their own equations, and what may be claimed of their study."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.metrics.consistency import nees
from vedette.montecarlo.lockstep import run_together
from vedette.sampling.trajectories import draw_gaussian, draw_jump_markov
from vedette_standard.motion.known_turn import KnownTurn
from vedette_target_oriented import accelerations
from vedette_target_oriented.along_velocity import chord
from vedette_target_oriented.certain import TargetOrientedCertain
from vedette_target_oriented.configs import FILTERS
from vedette_target_oriented.consistent import TargetOriented
from vedette_target_oriented.frames import cartesian, in_frame
from vedette_target_oriented.literal import TargetOrientedLiteral
from vedette_target_oriented.outcome import PHASES, against, claims
from vedette_target_oriented.reproduction import TargetOrientedReproduction, draw, record

EXAMPLES = Path(__file__).parents[2] / "examples" / "target_oriented"
FILES = {"Singer": "singer", "CAR": "car", "TOM literal": "tom_literal", "TOM certain": "tom_certain", "TOM": "tom"}
PROFILE = settings(max_examples=60, deadline=None, derandomize=True)
HEADINGS = st.floats(-np.pi, np.pi)
RESETTING = (TargetOrientedLiteral, TargetOrientedCertain)


def frame(heading):
    """Forward and right as columns, over position and velocity: the paper's equation 3."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, s], [s, -c]])


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def printed_noise(heading, forward, side, dt):
    """Equation 7 as printed: the plus and the missing cosine in q12 are the paper's."""
    c, s, f, a = np.cos(heading), np.sin(heading), forward**2, side**2
    Q = np.zeros((4, 4))
    Q[0, 0], Q[1, 1] = (f * c * c + a * s * s) * dt**4 / 4, (f * s * s + a * c * c) * dt**4 / 4
    Q[0, 1] = Q[1, 0] = (f + a) * s * dt**4 / 4
    Q[0, 2] = Q[2, 0] = f * c * dt**3 / 2
    Q[0, 3] = Q[3, 0] = a * s * dt**3 / 2
    Q[1, 2] = Q[2, 1] = f * s * dt**3 / 2
    Q[1, 3] = Q[3, 1] = -a * c * dt**3 / 2
    Q[2, 2], Q[3, 3] = f * dt**2, a * dt**2
    return Q


# Equations.


@pytest.mark.parametrize("kind", RESETTING)
@PROFILE
@given(HEADINGS, st.floats(0.1, 10), st.floats(0.1, 50), st.floats(0.01, 5))
def test_the_derived_noise_is_a_covariance_and_the_printed_one_is_not(kind, heading, forward, side, dt):
    """Printed and derived agree on every entry but q12, and on that where the heading is along x."""
    x = np.array([10.0, 20, 300, 5, heading, 0, 0])
    Q = kind(forward, side).noise(x, dt)
    gain = np.vstack([frame(heading) * dt**2 / 2, np.eye(2) * dt])
    derived = gain @ np.diag([forward**2, side**2]) @ gain.T
    np.testing.assert_allclose(Q[:4, :4], derived, rtol=1e-9, atol=1e-12 * np.trace(derived))
    assert not Q[4:].any()
    assert not Q[:, 4:].any()
    scale = np.sqrt(np.diag(derived))
    assert np.linalg.eigvalsh(derived / np.outer(scale, scale))[0] > -1e-12
    printed = printed_noise(heading, forward, side, dt)
    apart = np.abs(printed - derived) > 1e-9 * np.trace(derived)
    apart[0, 1] = apart[1, 0] = False
    assert not apart.any()


def test_the_printed_q12_fails_the_law_that_noise_is_a_covariance():
    headings = np.linspace(-np.pi, np.pi, 1001)
    printed = np.array([np.linalg.eigvalsh(printed_noise(h, 5.0, 10.0, 1.0))[0] for h in headings])
    assert np.mean(printed < -1e-6) > 0.98
    assert printed.min() < -25
    model = TargetOrientedLiteral(5.0, 10.0)
    x = np.zeros((1001, 7))
    x[:, 4] = headings
    assert np.linalg.eigvalsh(model.noise(x, 1.0)).min() > -1e-10


@pytest.mark.parametrize("kind", RESETTING)
def test_moving_is_equation_5(kind):
    x = np.array([10.0, 20, 300, 5, 0.7, 1, 2])
    moved = kind(2.0, 10.0).move(x, 1.5)
    np.testing.assert_allclose(moved[:2], [10, 20] + 1.5 * frame(0.7) @ [300, 5], rtol=1e-14)
    np.testing.assert_array_equal(moved[2:], x[2:])


@PROFILE
@given(HEADINGS, st.floats(5.0, 500.0), st.floats(0.05, 3.0), st.floats(-60.0, 60.0))
def test_the_consistent_model_turns_as_a_known_turn_of_that_rate(heading, speed, dt, accel):
    x = np.array([100.0, -50, speed * np.cos(heading), speed * np.sin(heading)])
    turned = KnownTurn(-accel / speed, 1.0)
    np.testing.assert_allclose(TargetOriented(3.0, 10.0, accel).move(x, dt), turned.move(x, dt), rtol=1e-9, atol=1e-9)


@PROFILE
@given(HEADINGS, st.floats(5.0, 500.0), st.floats(0.05, 3.0), st.floats(-60.0, 60.0), st.integers(0, 1000))
def test_the_consistent_model_is_the_papers_frame_turned_with_its_target(heading, speed, dt, accel, seed):
    """A step in the frame along the velocity, with velocity and covariance then turned into the frame of the new one.

    In the frame the velocity (v, 0) turns by d = -a T / v; the derivative of d by the forward speed is -d / v, that by the
    side speed 0, as the speed does not change to first order there. This is the independent form; ours stays in the plane.
    """
    model = TargetOriented(3.0, 10.0, accel)
    B = frame(heading)
    both = np.block([[np.eye(2), np.zeros((2, 2))], [np.zeros((2, 2)), B]])
    root = np.random.default_rng(seed).standard_normal((4, 4))
    P = both @ (root @ root.T) @ both.T
    x = np.array([0.0, 0, speed * np.cos(heading), speed * np.sin(heading)])
    d = -accel * dt / speed
    velocity_by_velocity = turn(d) @ B
    velocity_by_velocity[:, 0] += -d * np.array([-np.sin(d + heading), np.cos(d + heading)])
    F = np.block([[np.eye(2), np.zeros((2, 2))], [np.zeros((2, 2)), velocity_by_velocity]])
    steps = 2000  # the position is the integral of the velocity, here by Simpson's rule
    t = np.linspace(0, dt, steps + 1)
    rule = np.where(np.arange(steps + 1) % 2, 4.0, 2.0) * dt / steps / 3
    rule[[0, -1]] /= 2
    for time, share in zip(t, rule, strict=True):
        part = turn(d * time / dt) @ B
        angle = d * time / dt
        part[:, 0] += -angle * np.array([-np.sin(angle + heading), np.cos(angle + heading)])
        F[:2, 2:] += share * part
    gain = np.vstack([B * dt**2 / 2, B * dt])
    in_the_frame = F @ (root @ root.T) @ F.T + gain @ np.diag([9.0, 100.0]) @ gain.T
    J = model.jacobian(x, dt)
    np.testing.assert_allclose(J @ P @ J.T + model.noise(x, dt), in_the_frame, rtol=1e-7, atol=1e-9 * np.trace(in_the_frame))


def test_a_derivative_that_holds_the_turn_fixed_is_not_the_derivative():
    """Negative control of the term that the speed's part in the turned angle makes."""
    model, x = TargetOriented(3.0, 10.0, 60.0), np.array([0.0, 0, 300, 200])
    fixed = KnownTurn(-60.0 / np.hypot(300, 200), 1.0).jacobian(x, 2.0)
    numerical = np.stack([(model.move(x + h, 2.0) - model.move(x - h, 2.0)) / 2e-3 for h in 1e-3 * np.eye(4)], axis=-1)
    np.testing.assert_allclose(model.jacobian(x, 2.0), numerical, atol=1e-6)
    assert np.abs(fixed - numerical).max() > 0.1


def test_the_chord_near_no_turn_and_where_the_series_ends():
    angles = np.concatenate([[0.0, 1e-12, -1e-9, 1e-4], np.linspace(0.4, 0.6, 21), [3.0, -7.0]])
    mean, slope = chord(angles)
    t, weights = np.polynomial.legendre.leggauss(40)
    s = (t + 1) / 2
    np.testing.assert_allclose(mean, np.exp(1j * angles[:, None] * s) @ weights / 2, atol=1e-14)
    np.testing.assert_allclose(slope, (1j * s * np.exp(1j * angles[:, None] * s)) @ weights / 2, atol=1e-14)


# No motion, no heading.


def test_a_target_at_rest():
    model = TargetOriented(3.0, 10.0, side_accel=60.0)
    x = np.array([[1.0, 2, 0, 0], [1, 2, 0.3, 0.4], [1, 2, 1e-300, 0]])
    assert np.all(np.isfinite(model.jacobian(x, 1.0)))
    np.testing.assert_array_equal(model.move(x, 1.0)[0], x[0])
    Q = model.noise(x, 1.0)
    np.testing.assert_allclose(Q[0, 2:, 2:], (9.0 + 100.0) / 2 * np.eye(2))  # no direction is preferred
    assert np.all(np.linalg.eigvalsh(Q[:, 2:, 2:])[:, 0] >= 9.0 - 1e-9)
    np.testing.assert_allclose(np.trace(Q[:, 2:, 2:], axis1=1, axis2=2), 109.0)
    fast = model.noise(np.array([0.0, 0, 3, 4]), 1.0)[2:, 2:]
    np.testing.assert_allclose(np.linalg.eigvalsh(fast), [9.0, 100.0])


@pytest.mark.parametrize("kind", RESETTING)
@pytest.mark.parametrize("way", [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (3.0, -4.0), (0.0, -2.0)])
def test_the_reset(kind, way):
    """Heading from the last two combined positions, in its own quadrant; v_side anew; the covariance as the kind says."""
    combined = Gaussian(np.array([[10.0, 20, 5, 1, 0.1, 10 - way[0], 20 - way[1]]]), np.zeros((1, 7, 7)))
    root = np.tril(np.arange(1.0, 17).reshape(4, 4))
    cov = np.zeros((1, 7, 7))
    cov[0, :4, :4] = root @ root.T
    own = Gaussian(np.array([[11.0, 21, 6, 2, 0.2, 0, 0]]), cov)
    settled = kind(2.0, 10.0, side_speed=-70.0).reframe(own, combined)
    np.testing.assert_allclose(settled.mean[0], [11, 21, 6, -70, np.arctan2(way[1], way[0]), 10, 20])
    expected = cov.copy()
    if kind is TargetOrientedCertain:
        expected[0, 3] = expected[0, :, 3] = 0
    np.testing.assert_array_equal(settled.cov, expected)
    np.testing.assert_array_equal(own.mean[0, 3:], [2, 0.2, 0, 0])


@pytest.mark.parametrize("kind", RESETTING)
def test_the_heading_stays_where_there_was_no_motion(kind):
    still = Gaussian(np.array([[10.0, 20, 5, 1, -2.5, 10, 20]]), np.zeros((1, 7, 7)))
    assert kind(2.0, 10.0).reframe(still, still).mean[0, 4] == -2.5


@pytest.mark.parametrize("kind", [TargetOriented, *RESETTING])
@pytest.mark.parametrize(
    ("forward", "side", "message"), [(0, 1, "sigma_forward: must be > 0"), (1, -2, "sigma_side: must be > 0")]
)
def test_noise_that_is_none_is_refused(kind, forward, side, message):
    with pytest.raises(ValueError, match=message):
        kind(forward, side)


def test_there_and_back_again():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((5, 4, 4))
    prior = Gaussian(100 * rng.standard_normal((5, 4)), root @ np.swapaxes(root, -1, -2))
    framed = in_frame(prior, np.zeros((5, 2)))
    np.testing.assert_allclose(framed.mean[:, 3], 0, atol=1e-12)
    np.testing.assert_allclose(framed.mean[:, 2], np.hypot(*prior.mean[:, 2:].T))
    back = cartesian(TargetOrientedLiteral(1.0, 1.0).state, framed)
    np.testing.assert_allclose(back.mean, prior.mean, atol=1e-10)
    np.testing.assert_allclose(back.cov, prior.cov, atol=1e-10)


# Consistency on the truth of the models.


def jump_truth(runs, scans, rng):
    """Targets that switch between the consistent filter's own models, and positions of them with sigma 20 m."""
    tracker = vedette.load(FILTERS["TOM"]).tracker
    prior = Gaussian(np.array([0.0, 0, 400, 0]), np.diag([400.0, 400, 400, 400]))
    x0 = draw_gaussian(prior.mean, prior.cov, rng, (runs,))
    models = [mode.motion for mode in tracker.estimator.modes]
    _, states = draw_jump_markov(models, tracker.estimator.transition, x0, 0, np.arange(scans + 1.0), rng)
    z = states[:, 1:, :2] + 20 * rng.standard_normal((runs, scans, 2))
    valid = np.ones((runs, 1), dtype=bool)
    return prior, states[:, 1:], [Scan(1.0 + i, "radar", Detections(z[:, [i]], valid)) for i in range(scans)]


def pooled_nees(name, prior, truth, scans):
    """Mean NEES over position and velocity of each run."""
    config = FILTERS[name] | {"sensors": {"radar": {"kind": "cartesian_position", "sigma": 20.0}}}
    tracker = vedette.load(config | {"gate": {"probability": 0.9999999}, "source": None}).tracker
    start = Gaussian(np.broadcast_to(prior.mean, (len(truth), 1, 4)), np.broadcast_to(prior.cov, (len(truth), 1, 4, 4)))
    given = start if "heading" not in tracker.state else in_frame(start, start.mean[..., :2] - start.mean[..., 2:])
    runs = run_together(tracker, given, 0.0, scans)
    estimate = cartesian(runs.space, Gaussian(runs.mean, runs.cov))
    return np.mean(nees(estimate.mean - truth, estimate.cov), axis=1)


def test_on_jump_truth_the_consistent_model_is_in_its_band_and_the_literal_one_is_twice_off():
    """4.02 +- .06 in 3.5 to 4.5, and 10 +- .2 above 8: each fails with probability below 1e-9."""
    prior, truth, scans = jump_truth(100, 81, np.random.default_rng(7))
    consistent, literal = (pooled_nees(name, prior, truth, scans) for name in ("TOM", "TOM literal"))
    assert 3.5 < consistent.mean() < 4.5
    assert literal.mean() > 8


def side_error_over_variance(sigma_side, runs, rng):
    """Of one certain model on a straight line: mean square of the side error over the variance it reckons with, per run."""
    motion = {"kind": "target_oriented_certain", "sigma_forward": 5.0, "sigma_side": sigma_side}
    config = FILTERS["TOM certain"] | {"estimator": {"kind": "ekf", "motion": motion}, "associator": {"kind": "nearest"}}
    config |= {"sensors": {"radar": {"kind": "cartesian_position", "sigma": 20.0}}, "gate": {"probability": 1 - 1e-14}}
    tracker = vedette.load(config | {"source": None}).tracker
    times = np.arange(1.0, 81.0)
    z = np.stack([400 * times, np.zeros(80)], axis=-1) + 20 * rng.standard_normal((runs, 80, 2))
    valid = np.ones((runs, 1), dtype=bool)
    scans = [Scan(time, "radar", Detections(z[:, [i]], valid)) for i, time in enumerate(times)]
    start = Gaussian(np.tile([0.0, 0, 400, 0], (runs, 1, 1)), np.tile(np.diag([400.0, 400, 400, 400]), (runs, 1, 1, 1)))
    made = run_together(tracker, in_frame(start, start.mean[..., :2] - [400.0, 0]), 0.0, scans)
    return np.mean(made.mean[:, 30:, 1] ** 2 / made.cov[:, 30:, 1, 1], axis=1)


def test_a_side_speed_that_counts_as_known_is_right_at_one_noise_only():
    """(2 - a)/(4 - 3a) R against a R: equal at a = 2/3, sigma_side = 4/sqrt(3) sigma/T^2; 2.4 +- .05 at 10 m/s^2."""
    rng = np.random.default_rng(8)
    right = side_error_over_variance(4 / np.sqrt(3) * 20.0, 300, rng)
    assert abs(right.mean() - 1) < 0.02 + 5 * right.std() / np.sqrt(300)
    assert side_error_over_variance(10.0, 300, rng).mean() > 1.8


# The study.


@pytest.fixture(scope="module")
def records(pytestconfig):
    """All filters on the same draws: 200 runs, 1000 at night."""
    runs = 1000 if pytestconfig.getoption("vedette_profile") == "nightly" else 200
    experiments = {name: vedette.load(config) for name, config in FILTERS.items()}
    scene = draw(experiments["TOM"], runs, np.random.default_rng(30))
    return {name: record(experiment, scene) for name, experiment in experiments.items()}


@pytest.mark.parametrize("name", FILTERS)
def test_the_example_is_the_studys_filter(name):
    example = vedette.load(EXAMPLES / f"{FILES[name]}.toml")
    assert vedette.to_config(example) == vedette.to_config(vedette.load(FILTERS[name]))
    assert {path.stem for path in EXAMPLES.glob("*.toml")} == set(FILES.values())


def test_in_manoeuvres_the_error_is_a_fifth_below_singers_and_more(records):
    """The ratio is .69 +- .017 at 200 runs against .8: 6 standard errors."""
    for name in ("TOM literal", "TOM"):
        assert against(records, name, "Singer", "manoeuvres").measured <= 0.8


def test_against_known_turn_rates_it_is_a_tie(records):
    """Nothing near the 20 % that the paper's table would be: .97 +- .01 as printed, .96 consistent, against .88."""
    for name in ("TOM literal", "TOM"):
        assert against(records, name, "CAR", "manoeuvres").measured > 0.88
    verdicts = {claim.text: claim.verdict for claim in claims(records)}
    assert verdicts["It is better than known turn rates (CAR), by about 20 % in manoeuvres"] == "not reproduced"
    assert verdicts["RMS errors in metres (table 1)"] == "not testable"


def test_fails_are_few(records):
    """As printed .6 %. At 1000 runs 2 % are 20 against 6 expected; at 200, 5 % are 10 against 1.2: below 1e-6 both."""
    runs = len(records["TOM literal"].failed)
    failed = records["TOM literal"].failed.mean()
    assert failed <= (0.02 if runs >= 1000 else 0.05)
    if runs >= 1000:
        apart = records["TOM literal"].failed.astype(float) - records["Singer"].failed  # -1.5 % +- .5 %
        assert apart.mean() < 5 * apart.std() / np.sqrt(runs)


def test_the_phases_are_the_papers():
    """Scans at 21 ... 35 s and 56 ... 70 s manoeuvre."""
    times = np.arange(2, 91)
    assert times[PHASES["manoeuvres"]].tolist() == [*range(21, 36), *range(56, 71)]
    assert times[PHASES["total"]].tolist() == list(range(5, 91))
    assert not np.any(PHASES["straight"] & PHASES["manoeuvres"])


def test_the_trajectory_is_the_papers():
    scene = draw(vedette.load(FILTERS["TOM"]), 2, np.random.default_rng(0))
    speed, course = np.hypot(*scene.truth[:, 2:].T), np.unwrap(np.arctan2(scene.truth[:, 3], scene.truth[:, 2]))
    np.testing.assert_allclose(scene.truth[0], [21689, 10840, -8.3, -399.9], atol=0.02)
    np.testing.assert_allclose(speed, 400.0, rtol=1e-12)
    rate = np.diff(course)
    np.testing.assert_allclose(rate[20:35], -60 / 400, rtol=1e-9)  # to the right
    np.testing.assert_allclose(rate[55:70], 40 / 400, rtol=1e-9)
    np.testing.assert_allclose(np.delete(rate, [*range(20, 35), *range(55, 70)]), 0, atol=1e-12)


def test_the_same_seed_gives_the_same_study():
    first, again = (TargetOrientedReproduction().run(2, 5, lambda items, about: items) for _ in range(2))
    assert first.tables == again.tables
    assert first.claims == again.claims
    assert TargetOrientedReproduction().run(2, 6, lambda items, about: items).tables != first.tables


# Section 4.1.


def test_turning_the_axes_keeps_the_mean_square_to_the_last_digits():
    for part in accelerations.study(2, np.random.default_rng(1)).values():
        if part.own is not part.fixed:
            square = [np.sum(np.var(pair, axis=1) + np.mean(pair, axis=1) ** 2, axis=-1) for pair in (part.fixed, part.own)]
            np.testing.assert_allclose(*square, rtol=1e-12)


def test_correlation_is_that_of_numpy():
    pair = np.cumsum(np.random.default_rng(2).standard_normal((1, accelerations.SECONDS, 2)), axis=1)
    rho = accelerations.correlation(pair)[0]
    a, b = (pair[0] - pair[0].mean(axis=0)).T
    full = np.correlate(a, b, "full") / np.sqrt(np.sum(a**2) * np.sum(b**2))
    middle = accelerations.SECONDS - 1
    np.testing.assert_allclose(rho, full[middle - 100 : middle + 101], atol=1e-9)


def test_kurtosis_of_what_is_known():
    """A uniform's is 1.8, a two-valued one's 1."""
    np.testing.assert_allclose(accelerations.kurtosis(np.arange(10_001.0)[None]), 1.8, rtol=1e-6)
    np.testing.assert_allclose(accelerations.kurtosis(np.array([[1.0, -1] * 50])), 1.0)


def test_walks_start_anew_and_rest():
    walk = accelerations.pieces(3, np.random.default_rng(3))
    resting = walk == 0
    np.testing.assert_array_equal(resting[..., 0], resting[..., 1])
    begin = ~resting[:, 1:, 0] & resting[:, :-1, 0]
    after = walk[:, 1:][begin]  # the first step of each walk is one draw: standard deviation 1, whatever went before
    assert 0.45 < resting.mean() < 0.55  # half of the time: +- .01
    assert 0.9 < after.std() < 1.1  # 3000 draws: +- .013
