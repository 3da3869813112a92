"""Lifecycles that judge by existence with hysteresis, and by the odds of their hits."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


@frozen
class Hysteresis(vedette.Lifecycle):
    """Confirmed above `upper`, no longer below `lower`; ended below `least`. Existence decays with `life`.

    Musicki, Evans, Stankovic, Integrated Probabilistic Data Association, IEEE TAC 39, 1994 (thresholds of existence).
    """

    kind = "hysteresis"
    upper: float = vedette.fields.probability("existence that confirms", default=0.95, at_least=0.7, at_most=0.999)
    lower: float = vedette.fields.probability("existence below which it is not", default=0.5, at_least=0.3, at_most=0.6)
    least: float = vedette.fields.probability("existence below which a track ends", default=0.05, at_least=1e-4, at_most=0.2)
    life: float = vedette.fields.quantity("s", "of a target", default=600, at_least=30, at_most=1e5)

    @property
    def least_existence(self):
        return self.least

    def start(self, existence):
        return existence >= self.upper

    def predict(self, existence, dt):
        return existence * np.exp(-dt / self.life)

    def review(self, memory, scan):
        confirmed = (scan.existence >= self.upper) | (memory & (scan.existence >= self.lower))
        alive = scan.existence >= self.least
        return confirmed, confirmed, alive


@frozen(eq=False)
class Odds:
    """Log-odds of hits against misses (*b, t), and whether the track was ever confirmed."""

    log: vedette.Array
    confirmed: vedette.Mask


@frozen
class HitOdds(vedette.Lifecycle):
    """Wald's test of a track that is hit as detection says against one that is hit a `share` as often; doubt grows in time.

    log += hit log(1 / share) + (1 - hit) [log((1 - p) / (1 - share p)) - dt / patience], p = min(P_D, .99).
    Wald, Sequential Analysis, 1947.
    """

    kind = "hit_odds"
    certain = True
    share: float = vedette.fields.quantity("1", "of hits that a false track has", default=0.2, at_least=0.01, at_most=0.3)
    patience: float = vedette.fields.quantity("s", "in which doubt grows by a nat", default=60, at_least=10, at_most=3600)
    confirm: float = vedette.fields.quantity("1", "nats that confirm", default=3, at_least=1, at_most=6)
    end: float = vedette.fields.quantity("1", "nats against it that end it", default=3, at_least=1, at_most=6)

    def start(self, existence):
        return Odds(np.zeros(existence.shape), np.zeros(existence.shape, dtype=bool))

    def review(self, memory, scan):
        p = np.clip(scan.p_detect, 0.0, 0.99)
        step = scan.hit * np.log(1 / self.share) + (1 - scan.hit) * np.log((1 - p) / (1 - self.share * p))
        log = np.clip(memory.log + step - (1 - scan.hit) * scan.dt / self.patience, -20.0, 8.0)
        confirmed = memory.confirmed | (log >= self.confirm)
        return Odds(log, confirmed), confirmed, log > -self.end


COMPONENTS = (
    Foreign("hysteresis", "lifecycle", Hysteresis),
    Foreign("hit odds", "lifecycle", HitOdds),
)
