"""The likelihood of a scan: a density, exact where the tracker is, over joint associations."""

from itertools import product

import numpy as np
import pytest
from attrs import evolve
from scipy.stats import multivariate_normal, poisson

import vedette
from vedette import Detections, Gaussian, Scan, Space
from vedette.testing.sensors import Watch
from vedette.types import Recording
from vedette_standard.associators.jpda import Jpda
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.motion.random_walk import RandomWalk
from vedette_tools.tuning.evaluation import data_of, evaluate
from vedette_tools.tuning.field_of_view import Cover
from vedette_tools.tuning.likelihood import Predictive, joint_likelihood
from vedette_tools.tuning.unthresholded import unthresholded

HALF = 8.0
P_D, DENSITY = 0.7, 0.1


def test_it_is_the_density_of_all_measurements_of_a_linear_target():
    """Without clutter and misses, the scans' sum is that of one Gaussian over all measurements, by its whole covariance."""
    rng, times, q, r = np.random.default_rng(1), np.cumsum([0.0, 1.0, 0.5, 2.0, 1.0, 1.0, 3.0, 1.0, 0.2, 1.0, 1.0]), 0.7, 2.0
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": q}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": r}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": {"x": [1.0, 5.0], "y": [2.0, 4.0], "vx": [0.5, 3.0], "vy": [0.0, 2.0]}},
        "lifecycle": {"kind": "single_target"},
        "gate": "off",
    }
    z = rng.normal(size=(len(times), 2)) * 5.0
    recording = Recording(tuple(Scan(t, "radar", Detections.of([each])) for t, each in zip(times, z, strict=True)))
    found = evaluate(data_of(vedette.load(config), recording, 1.0), [], [], whole=True)
    t = times - times[0]
    early = np.minimum(t[:, None], t)
    whole = 0.0
    for axis, (mean, speed, sd, sd_speed) in enumerate([(1.0, 0.5, 5.0, 3.0), (2.0, 0.0, 4.0, 2.0)]):
        wiener = q**2 * (early**2 * np.maximum(t[:, None], t) / 2 - early**3 / 6)
        cov = sd**2 + sd_speed**2 * t[:, None] * t + wiener + r**2 * np.eye(len(t))
        whole += multivariate_normal(mean + speed * t, cov).logpdf(z[:, axis])
    assert found.loglik.sum() == pytest.approx(whole, rel=1e-9)


def test_joint_associations_are_summed():
    rng = np.random.default_rng(2)
    for tracks, returns in [(1, 3), (2, 2), (3, 3), (4, 2), (3, 5)]:
        scores = rng.normal(size=(tracks, 1 + returns)) * 3.0
        scores[0, 1] = -np.inf
        each = [
            sum(scores[t, a] for t, a in enumerate(choice))
            for choice in product(range(1 + returns), repeat=tracks)
            if len(set(choice) - {0}) == sum(a > 0 for a in choice)
        ]
        assert joint_likelihood(scores.copy()) == pytest.approx(np.logaddexp.reduce(each), abs=1e-9)


def over_sets(scores):
    """The sum over joint associations, track by track over the sets of returns that are taken."""
    sums = {frozenset(): 0.0}
    for row in scores:
        after = {}
        for taken, log in sums.items():
            for a in set(np.flatnonzero(np.isfinite(row)).tolist()) - taken:
                key = taken | {a} if a else taken
                after[key] = np.logaddexp(after.get(key, -np.inf), log + row[a])
        sums = after
    return np.logaddexp.reduce(list(sums.values()))


@pytest.mark.parametrize(("tracks", "returns"), [(40, 2), (33, 9), (9, 12), (12, 0)])
@pytest.mark.by_turns
def test_many_joint_associations_are_summed(tracks, returns):
    """Many tracks for few returns, as where targets report one at a time, and few for many."""
    rng = np.random.default_rng(tracks)
    for _ in range(5):
        scores = rng.normal(size=(tracks, 1 + returns)) * 3.0
        scores[:, 1:][rng.random((tracks, returns)) < (0.2 if returns < 3 else 0.7)] = -np.inf
        assert joint_likelihood(scores.copy()) == pytest.approx(over_sets(scores), abs=1e-9)


def line(birth=None):
    """A tracker on a line, where 1.6 false returns a scan lie between -8 and 8 m."""
    watch = Watch(observes=Space.of(x="m"), R=[[0.5]], probability=P_D, density=DENSITY)
    motion = RandomWalk(axes=("x",), unit="m", sigma=0.1)
    return vedette.Tracker(Kalman(motion), {"s": watch}, Jpda(), Existence(), birth)


def undetected():
    """0.8 undetected targets about 0, by a Gaussian."""
    place = {name: [0, 2] for name in ("x", "y", "vx", "vy")}
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": {"s": {"kind": "cartesian_position", "sigma": 1.0}},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "poisson", "appear": [{"at": place, "initial": 0.8, "rate": 0.0}]},
        "lifecycle": {"kind": "existence"},
    }
    return vedette.load(config).tracker.birth


def mass(tracker, state, expected, sums):
    """The probability of at most two returns by the likelihood, over a grid, and as `sums` has it."""
    grid = np.linspace(-HALF, HALF, 41)[:-1] + HALF / 40
    cover = Cover(grid[:, None], 2 * HALF)
    predictive = Predictive(tracker)

    def density(*z):
        scan = Scan(0.0, "s", Detections.of(np.array(z).reshape(-1, 1), 1))
        loglik, returns = predictive(tracker.expect(state, scan), cover)
        assert returns == pytest.approx(expected, rel=1e-3)
        return np.exp(loglik)

    step = 2 * HALF / 40
    one = sum(density(a) for a in grid) * step
    two = sum(density(a, b) for i, a in enumerate(grid) for b in grid[:i]) * step**2
    two += sum(density(a, a) for a in grid) * step**2 / 2
    assert [density(), one, two] == pytest.approx(sums, rel=5e-3)


def test_it_is_a_density_over_scans():
    """Summed over all scans of none, one and two returns, it is the probability of so many."""
    tracker = line()
    state = tracker.start(Gaussian(np.array([[-1.0], [1.5]]), np.array([[[1.0]], [[2.0]]])), 0.0)
    state = evolve(state, existence=np.array([0.6, 0.9]))
    hits = np.convolve([1 - 0.6 * P_D, 0.6 * P_D], [1 - 0.9 * P_D, 0.9 * P_D])
    false = poisson(2 * HALF * DENSITY).pmf(range(3))
    mass(tracker, state, 2 * HALF * DENSITY, np.convolve(hits, false)[:3])


def test_undetected_targets_count_by_what_the_birth_expects():
    """They are 0.8 about 0, by a Gaussian, and returns of theirs are no false ones."""
    tracker = line(undetected())
    state = tracker.start()
    expected = 2 * HALF * DENSITY + 0.8 * P_D
    mass(tracker, state, expected, poisson(expected).pmf(range(3)))


def test_where_a_lifecycle_keeps_no_existence_it_is_followed():
    """A track at a false return stops to count against the detection probability."""
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {
            "radar": {"kind": "cartesian_position", "sigma": 1.0, "detection_probability": 0.9, "clutter_density": 1e-6}
        },
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}, "initial": 0.5},
        "lifecycle": {"kind": "m_of_n", "hits": 2, "looks": 9, "misses": 9},
    }
    tracker = unthresholded(vedette.build(config), None, [])
    predictive, state, cover = Predictive(tracker), tracker.start(), Cover(np.zeros((1, 2)), 1e6)
    state = tracker.step(state, Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    e, found, wanted = 0.5, [], []
    for time in (1.0, 2.0):  # then it is given up
        scan = Scan(time, "radar", Detections.of([], 2))
        e *= np.exp(-1 / 600)
        wanted.append(np.log(1 - 0.9 * e) - 1.0)
        e = 0.1 * e / (1 - 0.9 * e)
        found.append(predictive(tracker.expect(state, scan), cover)[0])
        state = tracker.step(state, scan)
    assert found == pytest.approx(wanted, abs=1e-9)


def test_hypotheses_give_what_their_tracks_do_when_they_are_sure():
    """One track in one leaf is as likely under an associator of hypotheses as under JPDA."""
    base = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 3.0, "detection_probability": 0.9,
                              "clutter_density": 1e-5}},
        "birth": {"kind": "given", "start": {"x": [0, 5], "y": [0, 5], "vx": [0, 1], "vy": [0, 1]}},
        "lifecycle": {"kind": "existence"},
    }  # fmt: skip
    scan, cover = Scan(1.0, "radar", Detections.of([[1.0, 2.0], [4.0, -3.0]])), Cover(np.zeros((1, 2)), 1e5)
    found = []
    for kind in ("jpda", "n_scan"):
        tracker = vedette.build(base | {"associator": {"kind": kind}})
        found.append(Predictive(tracker)(tracker.expect(tracker.start(time=0.0), scan), cover)[0])
    assert found[0] == pytest.approx(found[1], abs=1e-9)


def test_a_return_with_a_time_of_its_own_is_as_likely_as_a_scan_of_that_time():
    """Of two tracks at 60 m/s, measured 2 s before the scan: 120 m of motion are 12 errors."""
    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": {"s": {"kind": "cartesian_position", "sigma": 10.0, "clutter_density": 1e-6}},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 60.0, "vy": 60.0}},
        "lifecycle": {"kind": "existence"},
    }
    tracker = vedette.load(config).tracker
    mean = np.array([[0.0, 0.0, 60.0, 0.0], [5000.0, 0.0, 0.0, 60.0]])
    state = tracker.start(Gaussian(mean, np.tile(np.diag([100.0, 100.0, 4.0, 4.0]), (2, 1, 1))), 0.0)
    state = evolve(state, existence=np.array([1.0, 0.7]))
    z, cover = np.array([[121.0, 3.0]]), Cover(np.zeros((1, 2)), 1e6)
    own = Scan(4.0, "s", evolve(Detections.of(z, 2), time=np.array([2.0])))
    found, _ = Predictive(tracker)(tracker.expect(state, own), cover)
    wanted, _ = Predictive(tracker)(tracker.expect(state, Scan(2.0, "s", Detections.of(z, 2))), cover)
    assert found == pytest.approx(wanted, abs=0.05)


@pytest.mark.parametrize("wrong", [0.0, 0.05])
def test_the_names_of_returns_count(wrong):
    """One target that is there, seen at one place in eleven scans: its name once known, another is likely as it is wrong."""
    codes, times = 50, np.arange(12.0)

    def loglik(last):
        config = {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0, "clutter_density": 1e-12}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": {"x": [0.0, 1.0], "y": [0.0, 1.0], "vx": [0.0, 1.0], "vy": [0.0, 1.0]}},
            "lifecycle": {"kind": "single_target"},
            "gate": "off",
            "identity": {"wrong": wrong, "codes": codes},
        }
        names = [7] * 11 + [last]
        scans = [
            Scan(t, "radar", evolve(Detections.of([[0.0, 0.0]]), identity=[name]))
            for t, name in zip(times, names, strict=True)
        ]
        return evaluate(data_of(vedette.load(config), Recording(tuple(scans)), 1.0), [], [], whole=True).loglik[-1]

    own, none, other = map(loglik, (7, -1, 8))
    assert own - none == pytest.approx(np.log(codes * (1 - wrong) + wrong), abs=0.01)
    if wrong:
        assert other - none == pytest.approx(np.log(wrong), abs=0.2)
    else:
        assert other < none - 15.0  # a false return, then
