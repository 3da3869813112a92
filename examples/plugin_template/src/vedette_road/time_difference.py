"""Two receivers that hear one emission, one after the other."""

import numpy as np
from attrs import frozen

import vedette


@frozen
class TimeDifference(vedette.Sensor):
    """The difference of the paths to two receivers, c times that of the arrival times: z = |p - a| - |p - b| + v.

    One return gives a hyperbola, hence no position. False ones lie uniformly between -|a - b| and |a - b|.
    Chan, Ho, A Simple and Efficient Estimator for Hyperbolic Location, IEEE T-SP 42, 1994.
    """

    kind = "time_difference"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(path_difference="m")
    sigma: float = vedette.fields.quantity("m", "standard deviation of the path difference", above=0)
    first: vedette.Array = vedette.fields.array("m", "x and y of the first receiver, a", ndim=1)
    second: vedette.Array = vedette.fields.array("m", "x and y of the second receiver, b", ndim=1)
    detection_probability: float = vedette.fields.probability("that a target is heard", default=0.9)
    clutter_per_scan: float = vedette.fields.quantity("1", "expected false returns in a scan", default=0.1, at_least=0)

    def __attrs_post_init__(self):
        if self.first.shape != (2,) or self.second.shape != (2,):
            raise ValueError("first: must be x and y, as must second")
        if np.array_equal(self.first, self.second):
            raise ValueError(f"second: must stand elsewhere than first, got {self.second.tolist()} m for both")

    def measure(self, x):
        return (np.linalg.norm(x - self.first, axis=-1) - np.linalg.norm(x - self.second, axis=-1))[..., None]

    def jacobian(self, x):
        unit = [(x - r) / np.maximum(np.linalg.norm(x - r, axis=-1, keepdims=True), 1e-9) for r in (self.first, self.second)]
        return (unit[0] - unit[1])[..., None, :]

    def noise(self, x):
        return np.array([[self.sigma**2]])

    def detects(self, x):
        return np.array(self.detection_probability)

    def clutter(self, z):
        return np.array(self.clutter_per_scan / (2 * np.linalg.norm(self.first - self.second)))
