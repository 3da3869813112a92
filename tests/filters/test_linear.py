"""Predictions by the derivative of a motion that has no compiled twin."""

import numpy as np
from attrs import frozen

from vedette import Gaussian, MotionModel, Space
from vedette.filters import predict_linearised


@frozen
class Meeting(MotionModel):
    """Two places that become their sum and the second: nothing declares that this is linear."""

    kind = "test_meeting"
    state = Space.of(a="m", b="m")

    def move(self, x, dt):
        return np.stack([x[..., 0] + x[..., 1], x[..., 1]], axis=-1)

    def jacobian(self, x, dt):
        return np.array([[1.0, 1.0], [0.0, 1.0]])

    def noise(self, x, dt):
        return np.zeros((2, 2))


def test_what_cancels_leaves_no_negative_variance():
    """Of two places whose sum is known far better than either, F P F' written out is rounding, and often below 0."""
    deviation = 1e6 * np.random.default_rng(2).uniform(1.0, 2.0, 200)
    lower = np.zeros((200, 2, 2))
    lower[:, 0, 0], lower[:, 1, 0], lower[:, 1, 1] = deviation, -deviation * (1.0 + 1e-9), 1e-3
    P = lower @ np.swapaxes(lower, -1, -2)
    written_out = P[:, 0, 0] + 2.0 * P[:, 0, 1] + P[:, 1, 1]
    assert np.mean(written_out < 0) > 0.1
    ahead = predict_linearised(Gaussian(np.zeros((200, 2)), P), Meeting(), 1.0)
    assert np.all(ahead.cov[:, 0, 0] >= 0.0)
    assert np.all(ahead.cov[:, 0, 0] < 1e-3)
