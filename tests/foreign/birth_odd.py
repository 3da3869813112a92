"""Births of strong returns alone, of one sensor alone, of a given roll, by chance, and of none."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.birth_returns import inverted, placed, whole


def started(birth, estimator, sensor, detections, chosen, existence):
    """Return tracks at the chosen returns (j,), with their existence (j,)."""
    prior = inverted(sensor, detections)
    spread = getattr(birth, "spread", {})
    at = placed(estimator.state, spread, sensor.observes, prior.mean[chosen], prior.cov[chosen])
    return vedette.Newborn(chosen, at, existence)


@frozen
class Strong(vedette.Birth):
    """Returns of more evidence start surer tracks: their odds are `odds` e^evidence (1 - claimed), held to a range.

    Musicki, Suvorova, Tracking in Clutter Using IMM-IPDA-based Algorithms, IEEE T-AES 44, 2008.
    """

    kind = "strong"
    odds: float = vedette.fields.quantity("1", "of a return without evidence", default=0.1, at_least=0.01, at_most=1)
    spread: dict[str, float] = vedette.fields.table("state axis that sensors do not observe to its standard deviation")

    def begin(self, found, estimator, sensor, name, detections, claimed):
        own = np.zeros(len(claimed)) if detections.evidence is None else detections.evidence
        odds = self.odds * np.exp(np.clip(own, -5.0, 5.0))
        existence = odds / (1 + odds) * (1 - claimed)
        chosen = np.flatnonzero(whole(detections) & (existence > 1e-4))
        return started(self, estimator, sensor, detections, chosen, existence[chosen])


@frozen
class OneSensor(vedette.Birth):
    """Only returns of some sensors start tracks, each with the same existence; returns that are rather claimed start none.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.2.
    """

    kind = "one_sensor"
    sensors: tuple[str, ...] = vedette.fields.words("whose returns start tracks; none: those of all", default=())
    initial: float = vedette.fields.probability("existence of a new track", default=0.2, above=0.01)
    spread: dict[str, float] = vedette.fields.table("state axis that sensors do not observe to its standard deviation")

    @property
    def initial_existence(self):
        return self.initial

    def starts_from(self, sensor):
        return not self.sensors or sensor in self.sensors

    def begin(self, found, estimator, sensor, name, detections, claimed):
        chosen = np.flatnonzero(whole(detections) & (claimed < 0.5) & self.starts_from(name))
        return started(self, estimator, sensor, detections, chosen, np.full(len(chosen), self.initial))


@frozen
class Roll(vedette.Birth):
    """Two targets that somebody knows of before, side by side; nothing else starts.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 1.3.
    """

    kind = "roll"
    apart: float = vedette.fields.quantity("m", "distance of the two", default=200, at_least=1, at_most=1e4)

    def starts_from(self, sensor):
        return False

    def given(self, state, recording):
        mean, cov = np.zeros((2, len(state))), np.repeat(np.eye(len(state))[None], 2, axis=0)
        for i, axis in enumerate(state.axes):
            cov[:, i, i] = {"m": 20.0, "m/s": 5.0}.get(axis.unit, 0.1) ** 2
            mean[:, i] = [0.0, self.apart] if axis.name == "x" else 0.0
        return vedette.Gaussian(mean, cov)

    def begin(self, found, estimator, sensor, name, detections, claimed):
        n = len(estimator.state)
        return vedette.Newborn(
            np.zeros(0, dtype=np.intp), vedette.Gaussian(np.zeros((0, n)), np.zeros((0, n, n))), np.zeros(0)
        )


@frozen
class EvenSea(vedette.Birth):
    """Unseen targets are even over an area, in a Poisson number that comes to rest: n' = n e^(-dt/T) + arrivals T (1 - ...).

    The rate of their returns is n P_D P_G over the area; a track exists with the odds of that rate to clutter.
    Streit, Poisson Point Processes, 2010, chapter 6.
    """

    kind = "even_sea"
    models_unseen = True
    arrivals: float = vedette.fields.quantity("1/s", "targets that come", default=0.02, above=0, at_most=1)
    lifetime: float = vedette.fields.quantity("s", "mean time for which one stays", default=500, at_least=10, at_most=1e4)
    side: float = vedette.fields.quantity("m", "of the square area", default=5e4, at_least=1e4, at_most=1e5)
    spread: dict[str, float] = vedette.fields.table("state axis that sensors do not observe to its standard deviation")

    def initial_memory(self, estimator, rng):
        return np.array(self.arrivals * self.lifetime)

    def predict(self, memory, estimator, dt, rng):
        kept = np.exp(-dt / self.lifetime)
        return memory * kept + self.arrivals * self.lifetime * -np.expm1(-dt / self.lifetime)

    def _rates(self, memory, sensor, detections, p_gate):
        prior = inverted(sensor, detections)
        seen = np.broadcast_to(sensor.detects(prior.mean), prior.mean.shape[:-1])
        area = np.ones(len(prior.mean))
        if tuple(sensor.measurement.names) != ("x", "y"):
            area = np.abs(np.linalg.det(np.broadcast_to(sensor.jacobian(prior.mean), (len(area), 2, 2))))
        return memory * seen * p_gate / self.side**2 / np.maximum(area, 1e-12)

    def reveal(self, memory, estimator, sensor, detections, p_gate):
        rates = self._rates(memory, sensor, detections, p_gate)
        return rates, rates

    def begin(self, found, estimator, sensor, name, detections, claimed):
        found = np.zeros(len(claimed)) if found is None else found
        clutter = np.broadcast_to(sensor.clutter(detections.z), found.shape)
        existence = found / np.maximum(found + clutter, 1e-300) * (1 - claimed)
        chosen = np.flatnonzero(whole(detections) & (existence > 1e-6))
        return started(self, estimator, sensor, detections, chosen, existence[chosen])

    def update(self, memory, estimator, sensor, detections, claimed, p_gate):
        seen = np.asarray(sensor.detects(np.zeros((1, len(sensor.observes)))), dtype=float)
        return memory * (1 - np.mean(seen) * p_gate)


COMPONENTS = (
    Foreign("strong", "birth", lambda: Strong(spread={"vx": 10.0, "vy": 10.0})),
    Foreign("one sensor", "birth", lambda: OneSensor(spread={"vx": 10.0, "vy": 10.0})),
    Foreign("roll", "birth", Roll),
    Foreign("even sea", "birth", lambda: EvenSea(spread={"vx": 10.0, "vy": 10.0})),
)
