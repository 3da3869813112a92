"""Targets that come in at known places, unseen until they are detected: a Poisson intensity of standing Gaussians."""

import numpy as np
from attrs import frozen

import vedette


@frozen
class Entrance:
    """A place where targets come in, with what is known of their state there."""

    start: dict[str, tuple[float, float]] = vedette.fields.table(
        "state axis to mean and standard deviation there", pairs=True
    )
    arrivals: float = vedette.fields.quantity("1/h", "targets that come in", default=60, above=0)


@frozen(eq=False)
class Unseen:
    """The belief about a target at each place, tracks of the estimator (c,), and how many are expected there (c,)."""

    belief: object
    expected: vedette.Array


@frozen
class Entrances(vedette.Birth):
    """Tracks start where returns are better explained by a target that came in than by clutter, whatever the sensor.

    With mu_c unseen targets at place c, return z has the density u(z) = sum_c mu_c P_D N(z; h_c, S_c). Its track exists with
    probability u / (u + clutter), times that of its being no other track's, and has the moments of the places given z.
    Over time mu' = mu_0 + (mu - mu_0) exp(-dt / stay), mu_0 = stay * arrivals; a scan leaves mu (1 - P_D P_G).
    Williams, Marginal Multi-Bernoulli Filters, IEEE T-AES 51, 2015.
    """

    kind = "entrances"
    models_unseen = True
    places: tuple[Entrance, ...] = vedette.fields.part("where targets come in")
    stay: float = vedette.fields.quantity("s", "mean time that a target stays where it came in", default=10, above=0)
    least: float = vedette.fields.probability("existence below which no track starts", default=0.1, above=0)

    def __attrs_post_init__(self):
        if not self.places:
            raise ValueError("places: must hold at least one, got none")

    def _prior(self, state):
        for i, place in enumerate(self.places):
            if lacking := [name for name in state.names if name not in place.start]:
                raise ValueError(f"places[{i}].start: must state [mean, standard deviation] of {', '.join(lacking)}")
        pairs = np.array([[place.start[name] for name in state.names] for place in self.places])
        return vedette.Gaussian(pairs[..., 0], pairs[..., 1, None] ** 2 * np.eye(len(state)))

    def initial_memory(self, estimator, rng):
        return Unseen(estimator.start(self._prior(estimator.state), estimator.state, rng), self._expected())

    def _expected(self):
        return np.array([place.arrivals for place in self.places]) * self.stay / 3600.0

    def predict(self, memory, estimator, dt, rng):
        full = self._expected()
        return Unseen(memory.belief, full + (memory.expected - full) * np.exp(-dt / self.stay))

    def update(self, memory, estimator, sensor, detections, claimed, p_gate):
        nothing = vedette.Detections.of([], len(sensor.measurement))
        passed = estimator.evaluate(memory.belief, sensor, nothing, p_gate).loglik[..., 0]
        return Unseen(memory.belief, memory.expected * np.exp(passed))

    def reveal(self, memory, estimator, sensor, detections, p_gate):
        innovation = estimator.evaluate(memory.belief, sensor, detections, p_gate)
        density = memory.expected[:, None] * np.exp(innovation.loglik[..., 1:])
        return density.sum(axis=0), (memory.belief, innovation, density)

    def begin(self, found, estimator, sensor, name, detections, claimed):
        n, k = len(estimator.state), len(claimed)
        mean, cov, existence = np.zeros((k, n)), np.zeros((k, n, n)), np.zeros(k)
        if found is None:  # asked when a tracker is built: does each place state what its estimator wants to know?
            self._prior(estimator.state)
        else:
            belief, innovation, density = found
            rate = density.sum(axis=0)
            existence = (1.0 - claimed) * rate / (rate + sensor.clutter(detections.z)) * detections.valid
        returns = np.flatnonzero(existence >= self.least)
        for i in returns:
            chosen = np.broadcast_to(np.arange(1 + k) == 1 + i, innovation.loglik.shape).astype(float)
            each, share = estimator.moments(estimator.update(belief, innovation, chosen)), density[:, i] / rate[i]
            mean[i], apart = estimator.state.mean(each.mean, share)
            cov[i] = np.einsum("c,cij->ij", share, each.cov + apart[:, :, None] * apart[:, None, :])
        return vedette.Newborn(returns, vedette.Gaussian(mean[returns], cov[returns]), existence[returns])
