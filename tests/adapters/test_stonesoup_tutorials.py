"""Stone Soup's tutorials through its own data objects and models: its answers beside Vedette's."""

from datetime import timedelta

import numpy as np
import pytest

import vedette
from support.stonesoup_tutorials import (
    CLUTTER,
    P_DETECT,
    P_GATE,
    PLANE,
    START,
    exact_polar,
    follow,
    given,
    motion,
    moved,
    polar,
    positions,
    prior,
    seen,
)
from vedette_adapters.stonesoup import StoneSoupSource, tracks_of
from vedette_adapters.stonesoup_models import StoneSoupMotion, StoneSoupSensor

pytest.importorskip("stonesoup", reason="stonesoup is not installed: its tutorials were not compared")

ONE, TWO = [[0.0, 1.0, 0.0, 1.0]], [[0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 20.0, -1.0]]


def tracker_of(estimator, model, associator="nearest", gate="off", **sensor):
    """Return a tracker of Stone Soup's models."""
    return vedette.build(
        {
            "estimator": {"kind": estimator, "motion": StoneSoupMotion(motion(), PLANE)},
            "sensors": {"s": StoneSoupSensor(model, PLANE, **sensor)},
            "associator": {"kind": associator},
            "birth": None,
            "lifecycle": {"kind": "single_target"},
            "gate": gate,
        }
    )


def agree(tracker, scans, starts, ends, tolerance=1e-9):
    """Each scan's states and covariances agree, to 1e-9 of the deviations."""
    recording = StoneSoupSource(scans, "s", start=START).open(tracker.sensors, np.random.default_rng(0))
    state = tracker.start(given(starts), 0.0, 1)
    assert len(recording.scans) == len(ends)
    for scan, end in zip(recording.scans, ends, strict=True):
        state = tracker.step(state, scan)
        found = tracker.estimate(state)
        for i, (mean, cov) in enumerate(end):
            spread = np.sqrt(np.diagonal(cov))
            assert np.max(np.abs(found.mean[i] - mean) / spread) < tolerance
            assert np.max(np.abs(found.cov[i] - cov) / (spread[:, None] * spread)) < tolerance


class Only:
    """An associator that gives a track the one detection there is."""

    def __init__(self, predictor):
        self.predictor = predictor

    def associate(self, tracks, found, time):
        from stonesoup.types.hypothesis import SingleHypothesis

        (detection,) = found
        return {track: SingleHypothesis(self.predictor.predict(track[-1], timestamp=time), detection) for track in tracks}


@pytest.mark.parametrize(
    ("estimator", "model", "tolerance"),
    [("kalman", positions, 1e-9), ("ekf", exact_polar, 1e-9), ("ukf", positions, 1e-9), ("ukf", polar, 1e-4)],
)
def test_tutorials_1_to_3_one_target_without_clutter(estimator, model, tolerance):
    """Unscented: with alpha = 1, beta = 0, kappa = 1, so without negative weights. Bearings are averaged otherwise there."""
    from stonesoup.predictor import kalman as predictors
    from stonesoup.updater import kalman as updaters

    points = {"alpha": 1.0, "beta": 0.0, "kappa": 1.0} if estimator == "ukf" else {}
    name = {"kalman": "Kalman", "ekf": "ExtendedKalman", "ukf": "UnscentedKalman"}[estimator]
    measured = model()
    scans = seen([moved([0, 1, 0, 1])], measured)
    only = Only(getattr(predictors, f"{name}Predictor")(motion(), **points))
    ends = follow(scans, ONE, only, getattr(updaters, f"{name}Updater")(None, **points))
    agree(tracker_of(estimator, measured), scans, ONE, ends, tolerance)


def parts():
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.updater.kalman import KalmanUpdater

    predictor, updater = KalmanPredictor(motion()), KalmanUpdater(positions())
    return predictor, updater, PDAHypothesiser(predictor, updater, CLUTTER, P_DETECT, P_GATE)


def test_tutorial_5_the_nearest_neighbour_in_clutter():
    """A detection within three deviations is taken, however little it says against clutter: so hardly any is expected."""
    from scipy.stats import chi2
    from stonesoup.dataassociator.neighbour import NearestNeighbour
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.measures import Mahalanobis

    predictor, updater, _ = parts()
    scans = seen([moved([0, 1, 0, 1])], positions(), detected=P_DETECT, clutter=5)
    nearest = NearestNeighbour(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=3))
    ends = follow(scans, ONE, nearest, updater)
    sensor = {"detection_probability": P_DETECT, "clutter_density": 1e-12}
    gate = {"probability": float(chi2.cdf(9.0, 2))}
    agree(tracker_of("kalman", positions(), gate=gate, **sensor), scans, ONE, ends)


@pytest.mark.parametrize(("starts", "associator"), [(ONE, "pda"), (TWO, "jpda")])
def test_tutorials_7_and_8_probabilistic_association(starts, associator):
    from stonesoup.dataassociator.probability import JPDA, PDA

    _, updater, hypothesiser = parts()
    paths = [moved(start, seed=i) for i, start in enumerate(starts)]
    scans = seen(paths, positions(), detected=P_DETECT, clutter=2)
    ends = follow(scans, starts, (PDA if associator == "pda" else JPDA)(hypothesiser), updater)
    sensor = {"detection_probability": P_DETECT, "clutter_density": CLUTTER}
    tracker = tracker_of("kalman", positions(), associator, {"probability": P_GATE}, **sensor)
    agree(tracker, scans, starts, ends)


def initiated(seed):
    """Return the scores of Vedette's tracks and of Stone Soup's, of three targets in clutter that start by themselves."""
    from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
    from stonesoup.deleter.time import UpdateTimeStepsDeleter
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.initiator.simple import MultiMeasurementInitiator
    from stonesoup.measures import Mahalanobis
    from stonesoup.tracker.simple import MultiTargetTracker

    predictor, updater, _ = parts()
    starts = [[0, 1, 0, 1], [0, 1, 60, -1], [40, 0.5, 40, 0.5]]
    paths = [moved(start, steps=30, seed=10 * seed + i) for i, start in enumerate(starts)]
    scans = seen(paths, positions(), seed, detected=P_DETECT, clutter=0.2)
    data = GNNWith2DAssignment(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=3))
    deleter = UpdateTimeStepsDeleter(4)
    initiator = MultiMeasurementInitiator(prior([0, 0, 0, 0]), deleter, data, updater, positions(), min_points=3)
    theirs = set()
    for _, tracks in MultiTargetTracker(initiator, deleter, scans, data, updater):
        theirs |= tracks
    experiment = vedette.load(
        {
            "source": StoneSoupSource(scans, "s", paths, PLANE, START),
            "estimator": {"kind": "kalman", "motion": StoneSoupMotion(motion(), PLANE)},
            "sensors": {
                "s": StoneSoupSensor(positions(), PLANE, detection_probability=P_DETECT, clutter_density=5e-4),
            },
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 0.7, "vy": 0.7}},
            "lifecycle": {"kind": "m_of_n", "hits": 3, "looks": 4, "misses": 4},
            "retroactive": True,
            "judge": {"cover_radius": 3.0, "gospa_cutoff": 3.0},
        }
    )
    result = experiment.run()
    both = (result.tracks, tracks_of(theirs, PLANE, START))
    return [vedette.metrics.judge(one, result.recording.truth, result.scans, experiment.judge) for one in both]


@pytest.mark.costly
def test_tutorial_9_initiated_tracks_by_their_metrics(pytestconfig):
    """Means over seeds lie beside Stone Soup's: none is worse by more than a tenth and two standard errors."""
    scores = [initiated(seed) for seed in range(10 if pytestconfig.getoption("vedette_profile") == "nightly" else 3)]
    for name, sign in (("coverage", -1.0), ("position_rmse_m", 1.0), ("gospa_m", 1.0)):
        ours, theirs = (np.array([getattr(pair[i], name) for pair in scores]) for i in (0, 1))
        worse = sign * (ours - theirs)
        print(name, ours.mean(), theirs.mean(), worse.std(ddof=1) / np.sqrt(len(worse)))
        assert worse.mean() < 2 * worse.std(ddof=1) / np.sqrt(len(worse)) + 0.1 * theirs.mean(), name
        assert np.all(theirs > 0)


def test_a_step_of_a_day_is_a_step_of_a_day():
    """Times are s since the start, however they are told."""
    assert StoneSoupSource([(START + timedelta(days=1), set())], "s", start=START).open(
        {"s": StoneSoupSensor(positions(), PLANE)}, np.random.default_rng(0)
    ).scans[0].time == pytest.approx(86400.0)
