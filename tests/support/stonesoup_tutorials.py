"""Scenes and trackers as in Stone Soup's tutorials, of its own objects; imports nothing of it before it is asked."""

from datetime import datetime, timedelta

import numpy as np

from vedette import Gaussian, Space

START = datetime(2026, 3, 1, 12)
PLANE = Space.of(x="m", vx="m/s", y="m", vy="m/s")
PRIOR = np.diag([1.5, 0.5, 1.5, 0.5])
CLUTTER, P_DETECT, P_GATE = 0.125, 0.9, 0.95


def motion():
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity

    return CombinedLinearGaussianTransitionModel([ConstantVelocity(0.005), ConstantVelocity(0.005)])


def positions(variance=0.75):
    from stonesoup.models.measurement.linear import LinearGaussian

    return LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=variance * np.eye(2))


def polar():
    from stonesoup.models.measurement.nonlinear import CartesianToBearingRange

    covar, offset = np.diag([np.radians(0.2), 1.0]), np.array([[50.0], [0.0]])
    return CartesianToBearingRange(ndim_state=4, mapping=(0, 2), noise_covar=covar, translation_offset=offset)


def exact_polar():
    """Return the same with the derivative written out: Stone Soup takes differences, which are right to 1e-8."""
    model = polar()

    def jacobian(state, **kwargs):
        dx, dy = np.asarray(state.state_vector, dtype=float).ravel()[[0, 2]] - model.translation_offset.ravel()[:2]
        r = np.hypot(dx, dy)
        return np.array([[-dy / r**2, 0.0, dx / r**2, 0.0], [dx / r, 0.0, dy / r, 0.0]])

    model.jacobian = jacobian
    return model


def moved(start, steps=20, seed=0):
    """Return a ground-truth path."""
    from stonesoup.types.groundtruth import GroundTruthPath, GroundTruthState

    np.random.seed(seed)  # noqa: NPY002 - Stone Soup's models draw from the global generator
    model, path = motion(), GroundTruthPath([GroundTruthState(start, timestamp=START)])
    for k in range(1, steps + 1):
        state = model.function(path[-1], noise=True, time_interval=timedelta(seconds=1))
        path.append(GroundTruthState(state, timestamp=START + timedelta(seconds=k)))
    return path


def seen(paths, model, seed=1, detected=1.0, clutter=0):
    """Return pairs of a time and a set of detections, from the second state on; false ones lie within 10 of each path."""
    from stonesoup.types.detection import Clutter, TrueDetection

    np.random.seed(seed)  # noqa: NPY002
    rng, scans = np.random.default_rng(seed), []
    for k in range(1, len(paths[0])):
        found, time = set(), paths[0][k].timestamp
        for path in paths:
            if rng.random() <= detected:
                z = model.function(path[k], noise=True)
                found.add(TrueDetection(z, timestamp=time, measurement_model=model, groundtruth_path=path))
            for _ in range(rng.poisson(clutter)):
                centre = np.asarray(path[k].state_vector, dtype=float).ravel()[[0, 2]]
                place = (centre + rng.uniform(-10, 10, 2))[:, None]
                found.add(Clutter(place, timestamp=time, measurement_model=model))
        scans.append((time, found))
    return scans


def prior(start):
    from stonesoup.types.state import GaussianState

    return GaussianState(np.array(start, dtype=float)[:, None], PRIOR, timestamp=START)


def follow(scans, starts, associator, updater):
    """Run Stone Soup's loop over given tracks; return their states' means and covariances, a scan an entry."""
    from stonesoup.functions import gm_reduce_single
    from stonesoup.types.array import StateVectors
    from stonesoup.types.track import Track
    from stonesoup.types.update import GaussianStateUpdate

    tracks, ends = [Track([prior(start)]) for start in starts], []
    for time, found in scans:
        chosen = associator.associate(tracks, found, time)
        for track in tracks:
            hypotheses = chosen[track]
            if hasattr(hypotheses, "single_hypotheses"):
                posts = [updater.update(one) if one else one.prediction for one in hypotheses]
                weights = np.array([one.probability for one in hypotheses])
                covars = np.stack([post.covar for post in posts], axis=2)
                mean, covar = gm_reduce_single(StateVectors([post.state_vector for post in posts]), covars, weights)
                track.append(GaussianStateUpdate(mean, covar, hypotheses, time))
            else:
                track.append(updater.update(hypotheses) if hypotheses else hypotheses.prediction)
        ends.append([(np.asarray(track[-1].mean, dtype=float).ravel(), np.array(track[-1].covar)) for track in tracks])
    return ends


def given(starts):
    """Return the same start for Vedette."""
    mean = np.array(starts, dtype=float)
    return Gaussian(mean, np.tile(PRIOR, (len(mean), 1, 1)))
