"""Where truth is given, the errors of a sensor are known: it is told whether R is wrong, and if not, that it is Q."""

import re

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Space
from vedette_report.detector_errors.off_truth import Returns
from vedette_report.recorded import recorded
from vedette_report.recorded.by_truth import by_truth
from vedette_report.recorded.off_path import OffPath

N = 300


def returns(size=1.0, correlation=0.0, offset=0.0, seed=0):
    """Returns of a radar whose R is 25 m^2, less the truth; errors along x have `size` times that variance."""
    u = np.random.default_rng(seed).standard_normal((N, 2))
    for k in range(1, N):
        u[k] = correlation * u[k - 1] + np.sqrt(1 - correlation**2) * u[k]
    noise = np.broadcast_to(25.0 * np.eye(2), (N, 2, 2))
    apart = 5.0 * u * [np.sqrt(size), 1.0] + offset
    return OffPath(
        "radar", Space.of(x="m", y="m"), Returns(apart, np.zeros((N, 2)), noise, np.arange(N) // 30), np.ones(N) > 0
    )


def squares(size, seed=1):
    """Squared errors of 4 axes, over what is stated, that are `size` times too large."""
    return size * np.random.default_rng(seed).chisquare(4, N) / 4


Q = "by the truth returns are as R says: likely Q is too "
R = "by the truth, if that is exact, R of radar along x is "


@pytest.mark.parametrize(
    ("off", "size", "slow", "told", "words"),
    [
        (returns(), 1.0, 0.0, False, ""),
        (returns(), 2.0, 0.0, False, Q + "small"),
        (returns(), 0.5, 0.0, False, Q + "large"),
        (returns(), 1.0, 0.3, True, Q + "small"),
        (returns(), 1.0, -0.3, True, Q + "large"),
        (returns(size=2.0), 1.0, 0.3, True, R + r"(1\.[89]|2|2\.[0-3]) \+- "),
        (returns(size=0.25), 1.0, -0.3, True, R + r"[34](\.\d)? \+- \S+ times too l"),
        (returns(size=0.75), 0.7, -0.3, True, ""),
        (returns(correlation=0.6), 2.0, 0.3, True, ""),
        (returns(offset=10.0), 2.0, 0.3, True, ""),
        (evolve(returns(), sampled=np.zeros(N) > 0), 2.0, 0.3, True, ""),
    ],
)  # fmt: skip
def test_r_is_named_by_its_size_and_else_q_where_errors_are_white_and_truth_is_known(off, size, slow, told, words):
    found = by_truth([off], squares(size), slow, told)
    assert re.match(words, found) if words else found == ""


def test_errors_that_are_large_in_a_part_of_the_run_are_no_q():
    nees = squares(1.0)
    nees[200:260] = 5.0
    assert by_truth([returns()], nees, 0.0, False) == ""


def sailed(seed, **believed):
    """Return the hint on a boat in one run of 300 scans, with truth, of a filter that believes otherwise."""
    motion = {"kind": "constant_velocity", "sigma_accel": 0.3}
    radar = {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9}
    start = {"x": [0, 20], "y": [0, 20], "vx": [5, 2], "vy": [0, 2]}
    source = {"kind": "simulation", "duration": N, "looks": {"radar": {"interval": 1}}, "sensors": {"radar": radar}}
    experiment = vedette.load(
        {
            "seed": seed, "source": source | {"drawn": {"boat": {"models": [motion], "start": start}}}, "gate": "off",
            "sensors": {"radar": radar | {"sigma": believed.get("sigma", 10.0)}},
            "estimator": {"kind": "kalman", "motion": motion | {"sigma_accel": believed.get("sigma_accel", 0.3)}},
            "associator": {"kind": "pda"}, "birth": {"kind": "given", "start": start},
            "lifecycle": {"kind": "single_target"},
        }
    )  # fmt: skip
    (told,) = recorded(experiment, experiment.run(keep_states=True), ())
    return told.hint


@pytest.mark.costly
def test_a_q_that_is_too_small_is_not_called_an_r():
    """Its innovations are white and 1.2 times too large, of which it was said that R is likely 1.2 times too small."""
    hints = [sailed(seed, sigma_accel=0.15) for seed in range(6)]
    assert set(hints) <= {Q + "small", ""}
    assert hints.count("") <= 1
    assert [sailed(seed) for seed in range(3)] == [""] * 3


@pytest.mark.costly
def test_an_r_that_is_wrong_is_told_with_its_size():
    for sigma, words in ((7.0, "small"), (14.0, "large")):
        told = re.fullmatch(
            r"by the truth, .*R of radar along x is ([\d.]+) \+- [\d.]+ times too (\w+), R .*", sailed(0, sigma=sigma)
        )
        assert float(told[1]) == pytest.approx(2.0, rel=0.3)
        assert told[2] == words
