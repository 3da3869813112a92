"""Errors of a sensor that go together along two axes are told, with their size; what is stated, and motion, are not."""

import numpy as np
import pytest

import vedette
from vedette import Space
from vedette_report.detector_errors.between_axes import Taken, _correlated, together

BEARINGS = Space.of(range="m", bearing="rad mod 2pi")
PLANE = Space.of(x="m", y="m")


def drawn(seed, correlation, stated=0.0, measured=PLANE, diagonal=0.0):
    """What is told of 300 returns, a tenth missed, of a target that wanders along the diagonal, by chance or smoothly."""
    rng, S = np.random.default_rng(seed), np.diag([10.0, 3.0 if measured is PLANE else 0.01])
    times = np.arange(300.0)[rng.random(300) < 0.9]
    path = np.cumsum(np.cumsum(rng.normal(0, diagonal, 300)))[times.astype(int)] + 2000 * np.sin(times / 100)
    errors = rng.multivariate_normal([0, 0], [[1, correlation], [correlation, 1]], len(times)) @ S
    z = measured.canonical(path[:, None] * (1.0 if measured is PLANE else [1.0, 0.002]) + errors)
    R = S @ np.array([[1, stated], [stated, 1]]) @ S
    part = Taken(times, z, np.broadcast_to(R, (len(times), 2, 2))).along(0, 1, measured)
    return _correlated([part])


@pytest.mark.parametrize("measured", [PLANE, BEARINGS], ids=["plane", "polar"])
def test_a_correlation_is_told_with_its_deviation(measured):
    """39 of 40 were; so 12 of 16 or more, but for once in 40,000 times. Each within four of its deviations."""
    told = [found for seed in range(16) if (found := drawn(seed, -0.7, measured=measured))]
    assert len(told) >= 12
    assert all(abs(found + 0.7) < 4 * deviation < 0.4 and not stated for found, deviation, stated, _ in told)


@pytest.mark.parametrize(("correlation", "stated"), [(0.0, 0.0), (0.7, 0.7)])
def test_what_is_as_stated_is_not_told(correlation, stated):
    """Of 1,000 draws none was."""
    assert not any(drawn(seed, correlation, stated) for seed in range(40))


def test_what_is_stated_and_is_not_is_told():
    assert any(drawn(seed, 0.0, 0.7) for seed in range(3))


def test_an_axis_without_errors_goes_with_none():
    """As of a target that rests in a cell of a coarse grid."""
    z = np.stack([np.full(300, 5.0), np.random.default_rng(0).normal(size=300)], axis=-1)
    part = Taken(np.arange(300.0), z, np.broadcast_to(np.eye(2), (300, 2, 2))).along(0, 1, PLANE)
    assert _correlated([part]) is None


@pytest.mark.parametrize("diagonal", [1.0, 5.0])
def test_motion_is_no_error(diagonal):
    assert not any(drawn(seed, 0.0, diagonal=diagonal) for seed in range(20))


@pytest.mark.parametrize(("correlation", "axes"), [(0.7, [("x", "y")]), (0.0, [])])
def test_it_is_told_of_the_returns_that_tracks_took(correlation, axes):
    moves = {"kind": "constant_velocity", "sigma_accel": 0.3}
    start = {"x": [0, 20], "y": [0, 20], "vx": [5, 2], "vy": [0, 2]}
    noise = {"kind": "linear", "axes": ["x", "y"], "R": [[100, 100 * correlation], [100 * correlation, 100]]}
    experiment = vedette.load(
        {
            "seed": 2,
            "gate": "off",
            "source": {
                "kind": "simulation", "duration": 300, "looks": {"radar": {"interval": 1.0}},
                "drawn": {"boat": {"models": [moves], "start": start}}, "sensors": {"radar": noise},
            },
            "sensors": {"radar": {"kind": "linear", "axes": ["x", "y"], "R": [[100, 0], [0, 100]]}},
            "estimator": {"kind": "kalman", "motion": moves},
            "associator": {"kind": "nearest"},
            "birth": {"kind": "given", "start": start},
            "lifecycle": {"kind": "single_target"},
        }
    )  # fmt: skip
    result = experiment.run()
    told = list(together(experiment.tracker, result.scans, result.tracks))
    assert [one.axes for one in told] == axes
    for one in told:
        assert abs(one.correlation - correlation) < 4 * one.deviation
        assert str(one).startswith("radar: ")
