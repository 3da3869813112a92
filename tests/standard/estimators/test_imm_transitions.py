"""The IMM's transitions over time, and what is refused."""

from functools import partial

import numpy as np
import pytest
from scipy.linalg import expm

from support.imm import NESTED, start, unlike
from vedette import MotionModel, Space
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unlike import velocity_problem
from vedette_standard.motion.constant_velocity import ConstantVelocity

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
TWO = Kalman(ConstantVelocity(0.1)), Kalman(ConstantVelocity(3.0))
SWITCH = np.array([[0.9, 0.1], [0.3, 0.7]])


def prob_after(imm, *times):
    belief = start(imm, 1)
    for dt in times:
        belief = imm.predict(belief, dt, RNG)
    return imm.mode_prob(belief)[0]


def test_scans_that_tell_nothing_leave_the_modes_and_give_the_moments_of_all_paths_of_modes():
    """Mixing loses nothing of the first two moments: steps differ from one by the switches between them alone."""
    imm, steps = Imm(TWO, rates=np.array([[-0.02, 0.02], [0.1, -0.1]]), initial=[0.7, 0.3]), 3
    belief = start(imm, 1)
    for _ in range(steps):
        belief = imm.predict(belief, 4.0, RNG)
    once = imm.predict(start(imm, 1), 4.0 * steps, RNG)
    np.testing.assert_allclose(imm.mode_prob(belief), imm.mode_prob(once), rtol=1e-12)
    p, paths = expm(4.0 * imm.rates), [(j, w, start(imm, 1).beliefs[j]) for j, w in enumerate(imm.initial)]
    for _ in range(steps):
        paths = [(j, w * p[i, j], TWO[j].predict(of, 4.0, RNG)) for i, w, of in paths for j in range(2)]
    weights, means = np.array([w for _, w, _ in paths]), np.array([of.mean[0] for _, _, of in paths])
    mean = weights @ means
    cov = np.einsum("p,pij->ij", weights, [of.cov[0] + np.outer(of.mean[0] - mean, of.mean[0] - mean) for _, _, of in paths])
    found = imm.moments(belief)
    np.testing.assert_allclose(found.mean[0], mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.cov[0], cov, rtol=1e-12, atol=1e-12)
    assert np.max(np.abs(imm.moments(once).cov[0] / cov - 1.0)) > 0.01


def test_a_transition_holds_per_scan_or_for_its_interval_or_follows_from_rates():
    p = np.array([0.2, 0.8])
    per_scan = Imm(TWO, transition=SWITCH, initial=p)
    per_interval = Imm(TWO, transition=SWITCH, interval=4.0, initial=p)
    rates = np.array([[-0.2, 0.2], [0.5, -0.5]])
    by_rates = Imm(TWO, rates=rates, initial=p)
    close = partial(np.testing.assert_allclose, rtol=1e-12)
    assert [imm.traits.per_scan for imm in (per_scan, per_interval, by_rates)] == [True, False, False]
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
    with pytest.raises(ValueError, match="interval: this transition matrix has no"):
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


class Headed(MotionModel):
    """Moves along a heading."""

    kind = "test_headed"
    state = Space.of(x="m", y="m", heading="rad mod 2pi", speed="m/s", turn_rate="rad/s")

    def move(self, x, dt):
        way = dt * x[..., 3, None] * np.stack([np.cos(x[..., 2]), np.sin(x[..., 2])], axis=-1)
        return np.concatenate([x[..., :2] + way, x[..., 2:]], axis=-1)

    def noise(self, x, dt):
        return 0.01 * dt * np.eye(5)


@pytest.mark.parametrize("stated", [{}, {"vx": (0, 6), "vy": (0, 6)}, {"speed": (6, 3)}])
def test_a_velocity_in_axes_of_its_own_is_not_certainly_0_without_a_word(stated):
    modes = TWO[0], ExtendedKalman(Headed())
    with pytest.raises(ValueError, match="absent: ") as error:
        Imm(modes, transition=SWITCH, absent=stated)
    missing = ", ".join(name for name in ("vx", "vy", "heading", "speed") if name not in stated)
    assert f" of {missing} in " in str(error.value)
    told = dict.fromkeys(("vx", "vy", "heading", "speed"), (0.0, 5.0))
    assert len(Imm(modes, transition=SWITCH, absent=told).state) == 7
    assert len(Imm(modes[:1], transition=[[1.0]]).state) == 4


@pytest.mark.parametrize("unit", ["kn", "NM/h", "px/s"])
def test_any_length_over_any_time_is_a_velocity(unit):
    along, headed, biased = Space.of(x="m", vx=unit), Space.of(x="m", speed=unit), Space.of(x="m", bias="m", rate="rad/s")
    assert " of vx, speed in " in str(velocity_problem([along, headed], {}))
    assert velocity_problem([along, biased], {}) is None
