"""What a birth may remember: returns of the scan before, and the tracks that ended."""

from types import SimpleNamespace
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Gaussian, Newborn, Scan, Tracker
from vedette.tracking.births import recycled
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition


@frozen(eq=False)
class Waiting:
    """Returns (k, 2) that no track claimed, how long ago they were, and what ended."""

    z: Array
    ago: float
    ended: tuple[Any, ...] = ()


@final
@frozen
class TwoScans(Birth):
    """A track from two returns of consecutive scans that a target of up to 30 m/s can join."""

    kind: ClassVar[str] = "two_scans_test"
    models_unseen: ClassVar[bool] = True

    def initial_memory(self, estimator, rng):
        return Waiting(np.zeros((0, 2)), 0.0)

    def predict(self, memory, estimator, dt, rng):
        return Waiting(memory.z, memory.ago + dt, memory.ended)

    def update(self, memory, estimator, sensor, detections, claimed, p_gate):
        return Waiting(detections.z[claimed < 0.5], 0.0, memory.ended)

    def recycle(self, memory, estimator, ended, existence):
        return Waiting(memory.z, memory.ago, (*memory.ended, (ended, existence)))

    def begin(self, found, estimator, sensor, name, detections, claimed):
        n, means, returns = len(estimator.state), [], []
        for i, z in enumerate(detections.z):
            for before in found.z if found is not None and claimed[i] < 0.5 else ():
                speed = (z - before) / found.ago
                if np.linalg.norm(speed) < 30.0:
                    means.append([z[0], speed[0], z[1], speed[1]])
                    returns.append(i)
        axes = [("x", "vx", "y", "vy").index(name) for name in estimator.state.names]
        mean = np.array(means).reshape(-1, 4)[:, axes]
        cov = np.broadcast_to(25.0 * np.eye(n), (len(mean), n, n))
        return Newborn(np.array(returns, dtype=np.intp), Gaussian(mean, cov), np.ones(len(mean)))


def tracker():
    radar = CartesianPosition(3.0, 0.9, 1e-6)
    return Tracker(Kalman(ConstantVelocity(0.3)), {"radar": radar}, Pda(), MOfN(hits=1, looks=1, misses=1), TwoScans())


def test_a_birth_may_start_tracks_from_the_returns_of_two_scans():
    made = tracker()
    state = made.step(made.start(), Scan(0.0, "radar", Detections.of([[0.0, 0.0], [500.0, 500.0]])))
    assert len(state.ids) == 0
    state = made.step(state, Scan(2.0, "radar", Detections.of([[20.0, -10.0], [-400.0, 300.0]])))
    assert len(state.ids) == 1
    mean = dict(zip(made.state.names, made.estimate(state).mean[0], strict=True))
    assert mean == {"x": 20.0, "vx": 10.0, "y": -10.0, "vy": -5.0}
    again = made.step(state, Scan(4.0, "radar", Detections.of([[40.0, -20.0]])))
    assert again.ids.tolist() == [0], "the track claims its return, which starts no other"


def test_tracks_that_end_are_given_back():
    made = tracker()
    state = made.step(made.start(), Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    state = made.step(state, Scan(2.0, "radar", Detections.of([[20.0, -10.0]])))
    state = made.step(state, Scan(4.0, "radar", Detections.of([], 2)))
    assert len(state.ids) == 0
    ((estimate, existence),) = state.unseen.ended
    assert estimate.mean.shape == (1, 4)
    assert existence.tolist() == [1.0]


def test_what_ends_is_given_back_with_its_own_existence():
    belief = Gaussian(np.arange(12.0).reshape(3, 4), np.broadcast_to(np.eye(4), (3, 4, 4)))
    plan = SimpleNamespace(birth=TwoScans(), models_unseen=True, estimator=tracker().estimator)
    ended, existence = np.array([False, True, True]), np.array([0.1, 0.2, 0.3])
    after = recycled(SimpleNamespace(plan=plan), Waiting(np.zeros((0, 2)), 0.0), belief, ended, existence)
    ((estimate, given),) = after.ended
    assert given.tolist() == [0.2, 0.3]
    assert estimate.mean.tolist() == belief.mean[1:].tolist()
